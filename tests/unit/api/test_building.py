"""Routes are built at their first request, that of a stop before."""

from collections.abc import Callable
from typing import Any, cast

import pydantic
import pytest

from hornbill.api.http import create_api
from hornbill.api.routes.motion.stop import StopRequest
from hornbill.api.routing import build_route
from hornbill.schema.catalog import Catalog
from unit.api.asgi import send


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The types for which pydantic builds an adapter."""
    types: list[object] = []
    init = cast("Callable[..., None]", vars(pydantic.TypeAdapter)["__init__"])

    def note(self: pydantic.TypeAdapter[Any], type: Any, **options: Any) -> None:
        types.append(type)
        init(self, type, **options)

    monkeypatch.setattr(pydantic.TypeAdapter, "__init__", note)
    return types


def test_a_stop_builds_nothing(built: list[object]) -> None:
    app = create_api(Catalog.load())
    assert StopRequest.__pydantic_complete__
    built.clear()
    send(app, "POST", "/api/v1/stop")
    assert built == []


@pytest.mark.parametrize(("method", "path"), [("GET", "/api/v1/no-such-thing"), ("POST", "/api/v1/stop")])
def test_once_a_server_has_built_its_routes_a_request_builds_nothing(
    built: list[object], method: str, path: str
) -> None:
    app = create_api(Catalog.load())
    for route in app.routes:
        build_route(route)
    built.clear()
    send(app, method, path)
    assert built == []


def test_an_application_reuses_what_modules_have_built(built: list[object]) -> None:
    create_api(Catalog.load())
    built.clear()
    create_api(Catalog.load())
    assert built == [], "a route that is included twice is built twice"
