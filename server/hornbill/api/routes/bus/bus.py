"""Routes of the bus."""

from dataclasses import replace
from typing import Annotated

from fastapi import Query
from pydantic import Field

from hornbill.api import present, remedies
from hornbill.api.dependencies import TheAdapters, TheHost
from hornbill.api.paging import Every
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.bus import Adapter, Bus, ConnectionRoleChoice, ConnectionRoleName, Finding
from hornbill.domain.fields import Model
from hornbill.wire.port import split_frame_gap

routes = Routes("bus")


class BusAddress(Model):
    """Adapter to open."""

    address: str = Field(
        examples=["socketcan:can0", "slcan:/dev/ttyACM0", "file:recording.log", "recording:NAME.zip"],
        description="INTERFACE:CHANNEL as in python-can, such as `socketcan:can0`. `GET /bus/adapters` lists adapters.",
    )
    bitrate: int = Field(
        default=1_000_000, gt=0, le=1_000_000, description="Bit rate, bit/s. Factory setting of the servos: 1000000."
    )
    frame_gap_ms: float | None = Field(
        default=None, ge=0, le=20, allow_inf_nan=False,
        description="Pause between frames of one transfer, ms. Default: `?frame_gap_ms=` of the address, otherwise 0.",
    )  # fmt: skip
    role: ConnectionRoleChoice | None = Field(
        default=None,
        description="Connection role. auto: listen for 1.5 s, then guest beside an autopilot or another allocator, "
        "otherwise host. Default: the role last chosen for this adapter, otherwise auto.",
    )


class RoleChange(Model):
    """Connection role on the connected bus."""

    role: ConnectionRoleName = Field(description="New role.")


@routes.get("/bus", Role.VIEW)
async def get_bus(host: TheHost) -> Bus:
    """Get the state of the bus and its counters."""
    return present.bus(host)


@routes.put("/bus", Role.CONFIGURE, "bus_open_failed", "invalid_value")
async def connect_bus(host: TheHost, body: BusAddress) -> Bus:
    """Connect a bus. The previous bus stays connected until the new one is open. Torque goes off on moving servos."""
    address = body.address
    if body.frame_gap_ms is not None:
        address = f"{split_frame_gap(address)[0]}?frame_gap_ms={body.frame_gap_ms:g}"
    await host.connect(address, body.bitrate, host.roles.choose(address, body.role))
    return present.bus(host)


@routes.put("/bus/role", Role.CONFIGURE, "bus_disconnected", "bus_open_failed")
async def change_role(host: TheHost, body: RoleChange) -> Bus:
    """Change the connection role by opening the adapter again. Torque goes off first on servos under command.

    The role is remembered for this adapter.
    """
    port = host.connected().port
    gap_s = port.details.frame_gap_s
    address = f"{port.address}?frame_gap_ms={gap_s * 1000:g}" if gap_s else port.address
    await host.connect(address, port.bitrate, host.roles.choose(address, body.role))
    return present.bus(host)


@routes.get("/bus/adapters", Role.VIEW)
async def list_adapters(host: TheHost, adapters: TheAdapters, page: Every) -> list[Adapter]:
    """List adapters, and why an adapter is unavailable. Responds within 2 s even if a driver hangs."""
    connection = host.connection
    is_open = connection is not None and connection.port.retry_in_s is None
    in_use = connection.port.address if connection is not None and is_open else None
    found = [Adapter.model_validate(one) for one in await adapters.plugged_in(in_use)]
    return page.of(found, lambda one: one.address)


@routes.get("/bus/doctor", Role.VIEW)
async def diagnose_bus(
    host: TheHost, all: Annotated[bool, Query(description="Include checks without findings.")] = False
) -> list[Finding]:
    """Diagnose the bus. Returns findings, most severe first; empty if there are none."""
    return [replace(one, remedy=remedies.remedy(one)) for one in host.doctor.findings(everything=all)]


@routes.delete("/bus", Role.CONFIGURE)
async def disconnect_bus(host: TheHost) -> Bus:
    """Disconnect the bus. Torque goes off first on servos under command."""
    await host.disconnect()
    return present.bus(host)
