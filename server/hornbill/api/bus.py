"""Owns the routes of the bus, the allocation table and the server's own health."""

from fastapi import APIRouter, Request

from hornbill import __version__
from hornbill.api import bus_models, present
from hornbill.api.dependencies import TheHost
from hornbill.api.problems import declared

router = APIRouter(tags=["bus"])


@router.get("/bus", operation_id="get_bus")
async def get_bus(host: TheHost) -> bus_models.Bus:
    """The bus as the adapter and the counters show it."""
    return present.bus(host)


@router.put("/bus", operation_id="connect_bus", responses=declared("bus_open_failed", "invalid_value"))
async def connect_bus(host: TheHost, body: bus_models.BusAddress) -> bus_models.Bus:
    """Open an adapter. The bus connected before stays until the new one is open; torque goes off on what moves."""
    await host.connect(body.address, body.bitrate)
    return present.bus(host)


@router.delete("/bus", operation_id="disconnect_bus")
async def disconnect_bus(host: TheHost) -> bus_models.Bus:
    """Leave the bus. Torque goes off first on what is under command."""
    await host.disconnect()
    return present.bus(host)


@router.get("/allocations", operation_id="list_allocations")
async def list_allocations(host: TheHost) -> bus_models.Allocations:
    """The allocation table, and which nodes wait for an id."""
    online = {one.uid for one in host.fleet.all() if one.online}
    now = host.base.now()
    pending = host.connection.allocator.pending(now) if host.connection is not None else []
    return bus_models.Allocations(
        allocations=[
            bus_models.Allocation(
                uid=entry.uid,
                node_id=entry.node_id,
                pinned=entry.pinned,
                last_seen=entry.last_seen,
                online=entry.uid in online,
            )
            for entry in host.store.allocations.rows()
        ],
        pending=[
            bus_models.PendingAllocation(
                uid_part=one.partial,
                stage=one.stage,
                attempts=one.attempts,
                waiting_s=round(now - one.first_heard, 2),
                age_s=round(now - one.last_heard, 2),
                refusal=one.refusal,
            )
            for one in pending
        ],
    )


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
