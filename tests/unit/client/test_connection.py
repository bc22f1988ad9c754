"""The tests of the connection: what goes with a request, and what is tried again. Both halves must agree."""

import asyncio
from collections.abc import Callable
from typing import Any

import httpx
import pytest

from hornbill.client import AsyncHornbill, Hornbill, ServerUnreachable
from hornbill.client.aio import connection as aio
from hornbill.client.sync import connection as sync
from hornbill.errors import Stopped

Handler = Callable[[httpx.Request], httpx.Response]
Run = Callable[[Handler, list[tuple[str, str]]], Any]


def run_sync(handler: Handler, asked: list[tuple[str, str]], **options: Any) -> Any:
    with Hornbill("http://rig:1/", transport=httpx.MockTransport(handler)) as hornbill:
        return [hornbill.request(verb, path, **options) for verb, path in asked][-1]


def run_async(handler: Handler, asked: list[tuple[str, str]], **options: Any) -> Any:
    async def scene() -> Any:
        async with AsyncHornbill("http://rig:1/", transport=httpx.MockTransport(handler)) as hornbill:
            return [await hornbill.request(verb, path, **options) for verb, path in asked][-1]

    return asyncio.run(scene())


@pytest.fixture(params=[run_sync, run_async], ids=["sync", "async"])
def run(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(aio, "PAUSE_S", 0.0)
    monkeypatch.setattr(sync, "PAUSE_S", 0.0)
    monkeypatch.delenv("HORNBILL_TOKEN", raising=False)
    return request.param


class Flaky:
    """A server whose first answers are lost."""

    def __init__(self, *lost: type[httpx.TransportError]) -> None:
        self._lost = list(lost)
        self.seen: list[httpx.Request] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.seen.append(request)
        if self._lost:
            raise self._lost.pop(0)("gone", request=request)
        return httpx.Response(200, json={"ok": True})


def test_a_get_is_tried_again_when_the_connection_breaks(run: Any) -> None:
    server = Flaky(httpx.ReadError, httpx.ConnectError)
    assert run(server, [("GET", "/servos")]) == {"ok": True}
    assert len(server.seen) == 3


def test_a_post_is_tried_again_with_the_same_key(run: Any) -> None:
    server = Flaky(httpx.RemoteProtocolError)
    run(server, [("POST", "/servos/x/save")])
    keys = [one.headers["Idempotency-Key"] for one in server.seen]
    assert len(keys) == 2
    assert keys[0] == keys[1]


def test_two_posts_have_two_keys(run: Any) -> None:
    server = Flaky()
    run(server, [("POST", "/servos/x/save"), ("POST", "/servos/x/save")])
    assert len({one.headers["Idempotency-Key"] for one in server.seen}) == 2


@pytest.mark.parametrize("verb", ["POST", "PUT", "PATCH", "DELETE"])
def test_what_may_not_happen_twice_is_asked_once(run: Any, verb: str) -> None:
    server = Flaky(httpx.ReadError)
    with pytest.raises(ServerUnreachable, match="unknown whether the request was carried out") as caught:
        run(server, [(verb, "/servos/x/command")], once=True)
    assert caught.value.facts == {"sent": True}
    assert len(server.seen) == 1
    assert "Idempotency-Key" not in server.seen[0].headers


def test_a_timeout_is_never_tried_again(run: Any) -> None:
    server = Flaky(httpx.ReadTimeout)
    with pytest.raises(ServerUnreachable):
        run(server, [("GET", "/servos")])
    assert len(server.seen) == 1


def test_nobody_there_says_how_to_start_one_and_that_nothing_was_sent(run: Any) -> None:
    with pytest.raises(ServerUnreachable, match="hornbill demo") as caught:
        run(Flaky(*[httpx.ConnectError] * 3), [("GET", "/servos")])
    assert caught.value.facts == {"sent": False}


def test_a_problem_is_raised_and_not_tried_again(run: Any) -> None:
    seen: list[str] = []

    def handler(request: httpx.Request) -> httpx.Response:
        seen.append(request.url.path)
        return httpx.Response(423, json={"code": "stopped", "detail": "Stopped by x."})

    with pytest.raises(Stopped) as caught:
        run(handler, [("GET", "/servos")])
    assert caught.value.status == 423
    assert seen == ["/api/v1/servos"]


@pytest.mark.parametrize("kind", [Hornbill, AsyncHornbill])
@pytest.mark.parametrize(
    ("url", "local"),
    [
        ("http://127.0.0.1:8000", True),
        ("http://[::1]:8000", True),
        ("http://localhost", True),
        ("https://bench.example", False),
    ],
)
def test_a_proxy_of_the_environment_is_not_asked_for_a_server_on_this_machine(
    kind: type[Hornbill | AsyncHornbill], url: str, local: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor is it told the token; and Stop would not arrive."""
    for name in ("http_proxy", "HTTP_PROXY", "https_proxy", "HTTPS_PROXY"):
        monkeypatch.setenv(name, "http://192.0.2.1:3128")
    for name in ("no_proxy", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)
    hornbill = kind(url)
    assert hornbill.local is local
    through = hornbill._http._transport_for_url(httpx.URL(url))  # pyright: ignore[reportPrivateUsage]
    assert (through is hornbill._http._transport) is local  # pyright: ignore[reportPrivateUsage]


def test_the_token_goes_with_every_request_and_into_no_text(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HORNBILL_TOKEN", "sesame")
    server = Flaky(httpx.ConnectError, httpx.ConnectError, httpx.ConnectError)
    with pytest.raises(ServerUnreachable) as caught:
        run(server, [("GET", "/servos")])
    assert "sesame" not in str(caught.value)
    assert server.seen[0].headers["Authorization"] == "Bearer sesame"


def test_the_address_is_that_of_the_environment_below_any_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HORNBILL_URL", "https://site.example/bench7/")
    server = Flaky()
    with Hornbill(transport=httpx.MockTransport(server)) as hornbill:
        hornbill.request("GET", "/servos", seconds=5, refresh=True, channels=None)
        assert hornbill.socket_url == "wss://site.example/bench7/api/v1/ws"
    assert str(server.seen[0].url) == "https://site.example/bench7/api/v1/servos?seconds=5&refresh=true"
