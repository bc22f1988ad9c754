"""Routes are built at their first request, that of a stop before."""

from collections.abc import Callable
from typing import Any, cast

import pydantic
import pytest

from hornbill.api.http import create_api
from hornbill.api.routes.motion.stop import StopRequest
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


def test_the_second_request_builds_nothing(built: list[object]) -> None:
    app = create_api(Catalog.load())
    send(app, "GET", "/api/v1/no-such-thing")
    built.clear()
    send(app, "GET", "/api/v1/no-such-thing")
    assert built == []


def test_an_application_reuses_what_modules_have_built(built: list[object]) -> None:
    create_api(Catalog.load())
    built.clear()
    create_api(Catalog.load())
    assert built == [], "a route that is included twice is built twice"
