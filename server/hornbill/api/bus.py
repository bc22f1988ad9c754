"""Owns the routes of the bus and of the server's own health."""

from fastapi import APIRouter, Request

from hornbill import __version__
from hornbill.api import PREFIX, bus_models, present
from hornbill.api.dependencies import TheAdapters, TheHost
from hornbill.api.problems import declared

router = APIRouter(prefix=PREFIX, tags=["bus"])


@router.get("/bus", operation_id="get_bus")
async def get_bus(host: TheHost) -> bus_models.Bus:
    """The bus as the adapter and the counters show it."""
    return present.bus(host)


@router.put("/bus", operation_id="connect_bus", responses=declared("bus_open_failed", "invalid_value"))
async def connect_bus(host: TheHost, body: bus_models.BusAddress) -> bus_models.Bus:
    """Open an adapter. The bus connected before stays until the new one is open; torque goes off on what moves."""
    await host.connect(body.address, body.bitrate)
    return present.bus(host)


@router.get("/bus/adapters", operation_id="list_adapters")
async def list_adapters(host: TheHost, adapters: TheAdapters) -> list[bus_models.Adapter]:
    """What a bus can be opened on, and why it cannot just now. Answers within 2 s, whatever a driver does."""
    connection = host.connection
    is_open = connection is not None and connection.port.retry_in_s is None
    in_use = connection.port.address if connection is not None and is_open else None
    return [bus_models.Adapter.model_validate(one) for one in await adapters.plugged_in(in_use)]


@router.get("/bus/doctor", operation_id="examine_bus")
async def examine_bus(host: TheHost, all: bool = False) -> list[bus_models.Finding]:
    """What is wrong with the bus, the worst first; empty when nothing is. `all`: also what was found well."""
    return [bus_models.Finding.model_validate(one) for one in host.doctor.findings(everything=all)]


@router.delete("/bus", operation_id="disconnect_bus")
async def disconnect_bus(host: TheHost) -> bus_models.Bus:
    """Leave the bus. Torque goes off first on what is under command."""
    await host.disconnect()
    return present.bus(host)


@router.get("/health", operation_id="get_health", tags=["server"])
async def get_health(host: TheHost, request: Request) -> bus_models.Health:
    """200 while the server serves."""
    return bus_models.Health(
        status="ok",
        version=__version__,
        uptime_s=round(host.base.now() - host.started_at, 1),
        bus=present.bus(host).state,
        demo=bool(request.app.state.demo),
    )
