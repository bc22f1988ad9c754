"""When routes are built: once, and not while somebody waits for an answer, least of all while a stop does."""

import asyncio
from collections.abc import Callable
from typing import Any, cast

import httpx
import pydantic
import pytest
from fastapi import FastAPI

from hornbill.api.http import create_api
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


@pytest.mark.parametrize(("method", "path"), [("GET", "/api/v1/no-such-thing"), ("POST", "/api/v1/stop")])
def test_no_request_builds_anything_once_the_application_is_made(built: list[object], method: str, path: str) -> None:
    app = create_api(Catalog.load())
    built.clear()
    ask(app, method, path)
    assert built == []


def test_an_application_builds_little_that_the_modules_have_not_built_already(built: list[object]) -> None:
    create_api(Catalog.load())
    built.clear()
    create_api(Catalog.load())
    assert 0 < len(built) < 60, "a route that is included a second time is built a second time; a row needs no route"
