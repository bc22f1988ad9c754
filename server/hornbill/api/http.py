"""Owns create_api: routers, problems, the guard and the page, put into one FastAPI application."""

from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager
from pathlib import Path

from fastapi import FastAPI
from starlette.middleware import Middleware
from starlette.routing import BaseRoute

from hornbill import __version__
from hornbill.api import (
    PREFIX,
    access_routes,
    audit,
    batch,
    bus,
    commissioning,
    docs,
    drift,
    event_stream,
    faults,
    identify,
    inventory,
    jobs,
    lab,
    leases,
    live,
    logs,
    metrics,
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
from hornbill.api.access import Access
from hornbill.api.document import document
from hornbill.api.guard import Guard
from hornbill.api.meter import Measures, Meter
from hornbill.api.once import Once
from hornbill.api.origin import Policy
from hornbill.schema.catalog import Catalog

Lifespan = Callable[[FastAPI], AbstractAsyncContextManager[None]]


def create_api(
    catalog: Catalog,
    *,
    lifespan: Lifespan | None = None,
    policy: Policy | None = None,
    access: Access | None = None,
    behind_proxy: bool = False,
    root_path: str = "",
    page_folder: Callable[[], Path | None] = lambda: None,
    docs_folder: Callable[[], Path | None] = lambda: None,
    mounted: Sequence[BaseRoute] = (),
    demo: bool = False,
) -> FastAPI:
    """The application. `lifespan` sets `app.state.host`; `mounted`: routes of other layers (the 3D view).

    `policy`: which hosts and origins; `access`: who may do what, everybody unless given. `root_path` is where a
    reverse proxy puts it, for example /hornbill; it may pass that part of the path on or not.
    """
    access = access or Access()
    measures = Measures()
    app = FastAPI(
        title="hornbill",
        version=__version__,
        summary="Configure and drive BLA15 and BLA21 servos over DroneCAN",
        lifespan=lifespan,
        openapi_url=f"{PREFIX}/openapi.json",
        docs_url=None,
        redoc_url=None,
        middleware=[
            Middleware(Meter, measures=measures, root_path=root_path),
            Middleware(Guard, policy=policy, access=access, behind_proxy=behind_proxy, root_path=root_path),
            Middleware(Once),
        ],
        servers=[{"url": root_path}] if root_path else None,
        separate_input_output_schemas=False,
    )
    app.state.demo = demo
    app.state.access = access
    app.state.measures = measures
    problems.install(app)
    for part in (
        stop.router,  # routes are looked through in this order
        parameters.router(catalog),  # a rig writes a thousand values a second
        servos.router,
        inventory.router,
        drift.router,
        faults.router,
        jobs.router,
        reports.router,
        commissioning.router,
        batch.router,
        identify.router,
        motion.router,
        streams.router,
        leases.router,
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
        live.router,
        event_stream.router,
        access_routes.router,
        metrics.router,
    ):
        app.router.routes.extend(part.routes)
    app.router.routes.extend(mounted)
    docs.install(app, docs_folder)
    page.install(app, page_folder)
    app.openapi = lambda: document(app, catalog)
    return app
