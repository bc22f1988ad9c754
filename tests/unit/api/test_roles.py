"""Every route has its role, in the one table there is; what is not in it is an admin's."""

import re
from collections.abc import Iterable, Iterator

import pytest
from starlette.routing import BaseRoute, WebSocketRoute

from hornbill.api.http import create_api
from hornbill.api.roles import ANYBODY, HERE, Role, declared, needed
from hornbill.posing import Poses
from hornbill.schema.catalog import Catalog
from hornbill.view.proxy import routes as view_routes
from hornbill.view.viewer import Viewer


def walk(routes: Iterable[BaseRoute]) -> Iterator[tuple[str, str]]:
    """Every method and path there is, with {} for what stands for anything."""
    for route in routes:
        path = re.sub(r"{[^}]*}", "{}", str(getattr(route, "path", "")))
        methods: set[str] = {"GET"} if isinstance(route, WebSocketRoute) else getattr(route, "methods", None) or {"GET"}
        for method in methods:
            yield method, path


def everything() -> set[tuple[str, str]]:
    viewer = Viewer(Poses())
    return set(walk(create_api(Catalog.load(), mounted=view_routes(viewer, allowed=lambda _: True)).routes))


def test_every_route_there_is_has_a_role() -> None:
    found = everything()
    assert {("POST", "/api/v1/stop"), ("GET", "/viser"), ("GET", "/api/v1/ws"), ("GET", "/{}")} <= found
    assert len(found) > 130
    missing = sorted(f"{method} {path}" for method, path in found if declared(method, path) is None)
    assert missing == [], "give each a row in hornbill.api.roles"


def test_what_changes_something_takes_more_than_looking() -> None:
    without = {("POST", "/api/v1/stop"), ("POST", "/api/v1/tickets")}
    without |= {("POST", "/api/v1/session"), ("DELETE", "/api/v1/session")}
    for method, path in everything() - without:
        if method not in ("GET", "HEAD", "OPTIONS"):
            assert needed(method, path) >= Role.OPERATE, f"{method} {path}"


@pytest.mark.parametrize(
    ("method", "path", "role"),
    [
        ("GET", "/", ANYBODY),
        ("GET", "/servos/0123/motion", ANYBODY),
        ("GET", "/assets/index-1.js", ANYBODY),
        ("HEAD", "/api/v1/servos", Role.VIEW),
        ("GET", "/api/v1/servos/0123/parameters/torque_mode", Role.VIEW),
        ("PUT", "/api/v1/servos/0123/parameters/torque_mode", Role.CONFIGURE),
        ("POST", "/api/v1/servos/0123/command", Role.OPERATE),
        ("DELETE", "/api/v1/leases/requests/0123", Role.OPERATE),
        ("GET", "/viser/0123/", Role.VIEW),
        ("GET", "/metrics", Role.VIEW),
        ("GET", "/api/v1/tokens", Role.ADMIN),
        ("POST", "/api/v1/stop", HERE),
        ("GET", "/api/v1/nothing", Role.ADMIN),
        ("POST", "/api/v1/stop\n", Role.ADMIN),
        ("POST", "/api/v1/stop/", Role.ADMIN),
        ("POST", "//api/v1/stop", Role.ADMIN),
        ("POST", "/", Role.ADMIN),
        ("BREW", "/api/v1/servos", Role.ADMIN),
        ("GET", "/viseral", Role.ADMIN),
    ],
)
def test_the_table_is_read_as_written_and_what_it_lacks_is_for_an_admin(method: str, path: str, role: int) -> None:
    assert needed(method, path) == role
