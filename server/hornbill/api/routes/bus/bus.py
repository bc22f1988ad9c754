"""Routes of the bus and of the server's own health."""

from typing import Annotated

from fastapi import Query, Request

from hornbill import __version__
from hornbill.api import bus_models, present
from hornbill.api.dependencies import TheAdapters, TheHost
from hornbill.api.routing import Routes
from hornbill.api.security.roles import HERE, Role
from hornbill.domain.bus import Finding
from hornbill.wire.port import split_frame_gap

routes = Routes("bus")


@routes.get("/bus", Role.VIEW)
async def get_bus(host: TheHost) -> bus_models.Bus:
    """The bus as the adapter and the counters show it."""
    return present.bus(host)


@routes.put("/bus", Role.CONFIGURE, "bus_open_failed", "invalid_value")
async def connect_bus(host: TheHost, body: bus_models.BusAddress) -> bus_models.Bus:
    """Open an adapter. The bus connected before stays until the new one is open; torque goes off on what moves."""
    address = body.address
    if body.frame_gap_ms is not None:
        address = f"{split_frame_gap(address)[0]}?frame_gap_ms={body.frame_gap_ms:g}"
    await host.connect(address, body.bitrate)
    return present.bus(host)


@routes.get("/bus/adapters", Role.VIEW)
async def list_adapters(host: TheHost, adapters: TheAdapters) -> list[bus_models.Adapter]:
    """What a bus can be opened on, and why it cannot just now. Answers within 2 s, whatever a driver does."""
    connection = host.connection
    is_open = connection is not None and connection.port.retry_in_s is None
    in_use = connection.port.address if connection is not None and is_open else None
    return [bus_models.Adapter.model_validate(one) for one in await adapters.plugged_in(in_use)]


@routes.get("/bus/doctor", Role.VIEW)
async def examine_bus(
    host: TheHost, all: Annotated[bool, Query(description="Include checks without findings.")] = False
) -> list[Finding]:
    """What is wrong with the bus, the worst first; empty when nothing is. `all`: also what was found well."""
    return list(host.doctor.findings(everything=all))


@routes.delete("/bus", Role.CONFIGURE)
async def disconnect_bus(host: TheHost) -> bus_models.Bus:
    """Leave the bus. Torque goes off first on what is under command."""
    await host.disconnect()
    return present.bus(host)


@routes.get("/health", HERE, tags=["server"])
async def get_health(host: TheHost, request: Request) -> bus_models.Health:
    """200 while the server serves."""
    return bus_models.Health(
        status="ok",
        version=__version__,
        uptime_s=round(host.base.now() - host.started_at, 1),
        bus=present.bus(host).state,
        demo=bool(request.app.state.demo),
    )
