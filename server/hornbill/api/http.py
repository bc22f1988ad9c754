"""Owns create_api: routers, problems, the origin guard and the page, put into one FastAPI application."""

from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager
from pathlib import Path

from fastapi import APIRouter, FastAPI
from starlette.middleware import Middleware
from starlette.routing import BaseRoute

from hornbill import __version__
from hornbill.api import (
    audit,
    batch,
    bus,
    commissioning,
    drift,
    faults,
    identify,
    inventory,
    jobs,
    lab,
    leases,
    live,
    logs,
    motion,
    nodes,
    page,
    parameters,
    position_unit,
    problems,
    profiles,
    recorder,
    reports,
    resetting,
    schema,
    servos,
    sim,
    snapshots,
    stop,
    streams,
    telemetry,
)
from hornbill.api.document import document
from hornbill.api.origin import OriginGuard, Policy
from hornbill.schema.catalog import Catalog

PREFIX = "/api/v1"
Lifespan = Callable[[FastAPI], AbstractAsyncContextManager[None]]


def create_api(
    catalog: Catalog,
    *,
    lifespan: Lifespan | None = None,
    policy: Policy | None = None,
    page_folder: Callable[[], Path | None] = lambda: None,
    mounted: Sequence[BaseRoute] = (),
    demo: bool = False,
) -> FastAPI:
    """The application. `lifespan` sets `app.state.host`; `mounted`: routes of other layers (the 3D view)."""
    app = FastAPI(
        title="hornbill",
        version=__version__,
        summary="Configure and drive BLA15 and BLA21 servos over DroneCAN",
        lifespan=lifespan,
        openapi_url=f"{PREFIX}/openapi.json",
        docs_url=None,
        redoc_url=None,
        middleware=[Middleware(OriginGuard, policy=policy)] if policy is not None else [],
        separate_input_output_schemas=False,
    )
    app.state.demo = demo
    problems.install(app)
    routes = APIRouter(prefix=PREFIX)
    for part in (
        servos.router,
        inventory.router,
        drift.router,
        faults.router,
        jobs.router,
        reports.router,
        commissioning.router,
        parameters.router(catalog),
        batch.router,
        identify.router,
        motion.router,
        streams.router,
        leases.router,
        stop.router,
        position_unit.router,
        bus.router,
        logs.router,
        nodes.router,
        schema.router(catalog),
        profiles.router,
        resetting.router,
        telemetry.router,
        snapshots.router,
        audit.router,
        lab.router,
        recorder.router,
        sim.router(catalog),
    ):
        routes.include_router(part)
    routes.include_router(live.router)
    app.include_router(routes)
    app.router.routes.extend(mounted)
    page.install(app, page_folder)
    app.openapi = lambda: document(app)
    return app
