"""When routes are built: not while somebody waits for an answer, and least of all while a stop does."""

import asyncio
from collections.abc import Callable
from typing import Any, cast

import httpx
import pydantic
import pytest
from fastapi import FastAPI

from hornbill.api.http import build_routes, create_api
from hornbill.schema.catalog import Catalog


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """What pydantic is asked to build, as it is asked."""
    asked: list[object] = []
    init = cast("Callable[..., None]", vars(pydantic.TypeAdapter)["__init__"])

    def note(self: pydantic.TypeAdapter[Any], type: Any, **options: Any) -> None:
        asked.append(type)
        init(self, type, **options)

    monkeypatch.setattr(pydantic.TypeAdapter, "__init__", note)
    return asked


def ask(app: FastAPI, method: str, path: str) -> None:
    async def one() -> None:
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as http:
            await http.request(method, path)

    asyncio.run(one())


def test_the_first_request_builds_nothing_once_routes_are_built(built: list[object]) -> None:
    app = create_api(Catalog.load())
    asyncio.run(build_routes(app))
    assert len(built) > 500, "this is what somebody would have waited for"
    built.clear()
    ask(app, "GET", "/api/v1/no-such-thing")
    assert built == []


def test_a_stop_that_comes_before_that_builds_its_own_routes_alone(built: list[object]) -> None:
    app = create_api(Catalog.load())
    built.clear()
    ask(app, "POST", "/api/v1/stop")
    assert len(built) < 40
