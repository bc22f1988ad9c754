"""Every route has a declared role; undeclared routes require admin."""

from functools import lru_cache

import pytest
from starlette.routing import Mount, Route

from hornbill.api.http import create_api, table_of
from hornbill.api.security.roles import LOCAL, PUBLIC, Role, RouteTable, needed
from hornbill.app.view_feed import ViewFeed
from hornbill.schema.catalog import Catalog
from hornbill.view.proxy import routes as view_routes
from hornbill.view.viewer import Viewer


@lru_cache
def table() -> RouteTable:
    return table_of(Catalog.load(), mounted=view_routes(Viewer(ViewFeed()), allowed=lambda _: True))


def everything() -> set[tuple[str, str, int]]:
    """All methods, path templates and roles."""
    return {
        (method, row.route.path, row.least)
        for row in table().rows
        for method in ((row.route.methods or ()) if isinstance(row.route, Route) else ("GET",))
    }


def test_the_application_serves_exactly_the_routes_of_the_table() -> None:
    served = create_api(Catalog.load()).routes
    assert not any(isinstance(route, Mount) for route in served)
    assert [getattr(one, "path", "") for one in served] == [one.route.path for one in table_of(Catalog.load()).rows]
    found = {(method, path) for method, path, _ in everything()}
    assert {("POST", "/api/v1/stop"), ("GET", "/viser"), ("GET", "/api/v1/ws"), ("GET", "/{path:path}")} <= found
    assert len(found) > 130


def test_changes_require_at_least_operate() -> None:
    without = {("POST", "/api/v1/stop"), ("POST", "/api/v1/tickets")}
    without |= {("POST", "/api/v1/session"), ("DELETE", "/api/v1/session")}
    without |= {("POST", "/api/v1/autopilot/export"), ("POST", "/api/v1/autopilot/import")}  # they only convert
    without |= {("POST", "/api/v1/servos/{uid}/improve/plan")}  # it only reads
    for method, path, least in everything():
        if method not in ("GET", "HEAD", "OPTIONS") and (method, path) not in without:
            assert least >= Role.OPERATE, f"{method} {path}"


@pytest.mark.parametrize(
    ("method", "path", "role"),
    [
        ("GET", "/", PUBLIC),
        ("GET", "/servos/0123/motion", PUBLIC),
        ("GET", "/assets/index-1.js", PUBLIC),
        ("HEAD", "/api/v1/servos", Role.VIEW),
        ("GET", "/api/v1/servos/0123/parameters/torque_mode", Role.VIEW),
        ("PUT", "/api/v1/servos/0123/parameters/torque_mode", Role.CONFIGURE),
        ("POST", "/api/v1/servos/0123/command", Role.OPERATE),
        ("DELETE", "/api/v1/leases/requests/0123", Role.OPERATE),
        ("GET", "/viser/0123/", Role.VIEW),
        ("GET", "/viser/0123/nothing", Role.ADMIN),
        ("GET", "/metrics", Role.VIEW),
        ("GET", "/api/v1/tokens", Role.ADMIN),
        ("POST", "/api/v1/stop", LOCAL),
        ("GET", "/api/v1/nothing", Role.ADMIN),
        ("POST", "/api/v1/stop\n", Role.ADMIN),
        ("POST", "/api/v1/stop/", Role.ADMIN),
        ("POST", "//api/v1/stop", Role.ADMIN),
        ("POST", "/", Role.ADMIN),
        ("BREW", "/api/v1/servos", Role.ADMIN),
        ("GET", "/viseral", Role.ADMIN),
    ],
)
def test_a_request_requires_the_role_of_its_route(method: str, path: str, role: int) -> None:
    assert needed(table().find(method, path)) == role
