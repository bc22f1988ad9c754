"""The FastAPI application: routes, problems, guard and page."""

from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager
from pathlib import Path

from fastapi import FastAPI
from starlette.middleware import Middleware
from starlette.routing import Route, WebSocketRoute

from hornbill import __version__
from hornbill.api import problems
from hornbill.api.compression import JsonGzip
from hornbill.api.idempotency import Idempotency
from hornbill.api.live import event_stream
from hornbill.api.live import socket as live
from hornbill.api.meter import Measures, Meter
from hornbill.api.openapi.document import document
from hornbill.api.pages import docs, page
from hornbill.api.routes.bus import autopilot, bus, logs, nodes
from hornbill.api.routes.configuration import commissioning, drift, parameters, profiles, snapshots
from hornbill.api.routes.configuration import matrix as batch
from hornbill.api.routes.configuration import restart as resetting
from hornbill.api.routes.motion import (
    frequency_response,
    identify,
    improve,
    lab,
    leases,
    mechanics,
    motion,
    plans,
    stop,
    streams,
    tuning,
)
from hornbill.api.routes.server import access as access_routes
from hornbill.api.routes.server import audit, benches, health, jobs, metrics, monitoring, recorder, reports, schema, sim
from hornbill.api.routes.servos import faults, inventory, position_unit, servos, telemetry
from hornbill.api.routing import Dispatch, Routes, build_route
from hornbill.api.security.access import Access
from hornbill.api.security.guard import Guard
from hornbill.api.security.origin import Policy
from hornbill.api.security.roles import Role, RouteRole, RouteTable
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
    mounted: Sequence[Route | WebSocketRoute] = (),
    demo: bool = False,
) -> FastAPI:
    """Build the application. `lifespan` sets `app.state.host`; `mounted`: routes of other layers (the 3D view).

    `policy`: allowed hosts and origins. `access`: access control; by default every client is an admin. `root_path`:
    sub-path of a reverse proxy, for example /hornbill; the proxy may or may not strip it.
    """
    access = access or Access()
    measures = Measures()
    for row in stop.routes.rows:
        build_route(row.route)
    table = table_of(catalog, page_folder, docs_folder, mounted)
    app = FastAPI(
        title="hornbill",
        version=__version__,
        summary="Configure and control BLA15, BLA21 and BLA34 servos over DroneCAN",
        lifespan=lifespan,
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        middleware=[
            Middleware(Meter, measures=measures),
            Middleware(
                Guard, table=table, policy=policy, access=access, behind_proxy=behind_proxy, root_path=root_path
            ),
            Middleware(JsonGzip),
            Middleware(Idempotency),
        ],
        servers=[{"url": root_path}] if root_path else None,
        separate_input_output_schemas=True,
    )
    app.state.demo = demo
    app.state.access = access
    app.state.measures = measures
    problems.install(app)
    app.router.routes.extend(row.route for row in table.rows)
    app.router.middleware_stack = Dispatch(app.router.middleware_stack)
    app.openapi = lambda: document(app, catalog)
    return app


def table_of(
    catalog: Catalog,
    page_folder: Callable[[], Path | None] = lambda: None,
    docs_folder: Callable[[], Path | None] = lambda: None,
    mounted: Sequence[Route | WebSocketRoute] = (),
) -> RouteTable:
    """Every route with its minimum role, in matching order. The page matches all remaining paths."""
    return RouteTable(
        [
            *(row for part in _parts(catalog) for row in part.rows),
            *(RouteRole(route, Role.VIEW) for route in mounted),
            *docs.routes(docs_folder, page_folder).rows,
            *page.routes(page_folder).rows,
        ]
    )


def _parts(catalog: Catalog) -> list[Routes]:
    return [
        stop.routes,
        parameters.routes(catalog),  # early: the most frequent requests
        servos.routes,
        inventory.routes,
        drift.routes,
        faults.routes,
        jobs.routes,
        reports.routes,
        commissioning.routes,
        batch.routes,
        identify.routes,
        motion.routes,
        plans.routes,
        streams.routes,
        leases.routes,
        position_unit.routes,
        bus.routes,
        logs.routes,
        nodes.routes,
        autopilot.routes,
        schema.routes(catalog),
        profiles.routes,
        resetting.routes,
        telemetry.routes,
        snapshots.routes,
        audit.routes,
        benches.routes,
        lab.routes,
        tuning.routes,
        frequency_response.routes,
        mechanics.routes,
        improve.routes,
        recorder.routes,
        sim.routes(catalog),
        live.routes,
        event_stream.routes,
        access_routes.routes,
        metrics.routes,
        monitoring.routes,
        health.routes,
        health.probes,
    ]
