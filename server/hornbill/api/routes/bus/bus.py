"""Routes of the bus and of the server's own health."""

from dataclasses import replace
from typing import Annotated, Literal

from fastapi import Query, Request
from pydantic import Field

from hornbill import __version__
from hornbill.api import present, remedies
from hornbill.api.dependencies import TheAdapters, TheHost
from hornbill.api.routing import Routes
from hornbill.api.security.roles import HERE, Role
from hornbill.domain.bus import Adapter, Bus, Finding
from hornbill.domain.fields import Model
from hornbill.wire.port import split_frame_gap

routes = Routes("bus")


class BusAddress(Model):
    """Which adapter to open, in python-can's words."""

    address: str = Field(
        examples=["socketcan:can0", "slcan:/dev/ttyACM0", "file:recording.log", "recording:NAME.zip"],
        description="INTERFACE:CHANNEL, such as `socketcan:can0`. `GET /bus/adapters` lists connected adapters.",
    )
    bitrate: int = Field(
        default=1_000_000, gt=0, le=1_000_000, description="Bit rate, bit/s. Servos are delivered with 1000000."
    )
    frame_gap_ms: float | None = Field(
        default=None, ge=0, le=20, allow_inf_nan=False,
        description="Pause between frames of one transfer, ms. Default 0, or the address's " "?frame_gap_ms=3.",
    )  # fmt: skip


class Health(Model):
    """The server serves."""

    status: Literal["ok"] = Field(description="State of the server.")
    version: str = Field(description="Version of hornbill.")
    uptime_s: float = Field(description="Time since its start, s.")
    bus: str = Field(description="State of the bus.")
    demo: bool = Field(description="Simulated servos on an embedded bus.")


@routes.get("/bus", Role.VIEW)
async def get_bus(host: TheHost) -> Bus:
    """The bus as the adapter and the counters show it."""
    return present.bus(host)


@routes.put("/bus", Role.CONFIGURE, "bus_open_failed", "invalid_value")
async def connect_bus(host: TheHost, body: BusAddress) -> Bus:
    """Open an adapter. The bus connected before stays until the new one is open; torque goes off on what moves."""
    address = body.address
    if body.frame_gap_ms is not None:
        address = f"{split_frame_gap(address)[0]}?frame_gap_ms={body.frame_gap_ms:g}"
    await host.connect(address, body.bitrate)
    return present.bus(host)


@routes.get("/bus/adapters", Role.VIEW)
async def list_adapters(host: TheHost, adapters: TheAdapters) -> list[Adapter]:
    """What a bus can be opened on, and why it cannot just now. Answers within 2 s, whatever a driver does."""
    connection = host.connection
    is_open = connection is not None and connection.port.retry_in_s is None
    in_use = connection.port.address if connection is not None and is_open else None
    return [Adapter.model_validate(one) for one in await adapters.plugged_in(in_use)]


@routes.get("/bus/doctor", Role.VIEW)
async def diagnose_bus(
    host: TheHost, all: Annotated[bool, Query(description="Include checks without findings.")] = False
) -> list[Finding]:
    """What is wrong with the bus, the worst first; empty when nothing is. `all`: also what was found well."""
    return [replace(one, remedy=remedies.remedy(one)) for one in host.doctor.findings(everything=all)]


@routes.delete("/bus", Role.CONFIGURE)
async def disconnect_bus(host: TheHost) -> Bus:
    """Leave the bus. Torque goes off first on what is under command."""
    await host.disconnect()
    return present.bus(host)


@routes.get("/health", HERE, tags=["server"])
async def get_health(host: TheHost, request: Request) -> Health:
    """200 while the server serves."""
    return Health(
        status="ok",
        version=__version__,
        uptime_s=round(host.base.now() - host.started_at, 1),
        bus=present.bus(host).state,
        demo=bool(request.app.state.demo),
    )
