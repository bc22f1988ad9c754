"""Headers and retries of requests, in the synchronous and the asynchronous client."""

import asyncio
from collections.abc import Callable
from typing import Any

import httpx
import pytest

from hornbill.client import AsyncHornbill, Hornbill, ServerUnreachable
from hornbill.client.aio import connection as aio
from hornbill.client.problems import WaitTimeout
from hornbill.client.sync import connection as sync
from hornbill.errors import Stopped

Handler = Callable[[httpx.Request], httpx.Response]
Run = Callable[[Handler, list[tuple[str, str]]], Any]


def run_sync(handler: Handler, requests: list[tuple[str, str]], **options: Any) -> Any:
    with Hornbill("http://rig:1/", transport=httpx.MockTransport(handler)) as hornbill:
        return [hornbill.request(verb, path, **options) for verb, path in requests][-1]


def run_async(handler: Handler, requests: list[tuple[str, str]], **options: Any) -> Any:
    async def scene() -> Any:
        async with AsyncHornbill("http://rig:1/", transport=httpx.MockTransport(handler)) as hornbill:
            return [await hornbill.request(verb, path, **options) for verb, path in requests][-1]

    return asyncio.run(scene())


@pytest.fixture(params=[run_sync, run_async], ids=["sync", "async"])
def run(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(aio, "PAUSE_S", 0.0)
    monkeypatch.setattr(sync, "PAUSE_S", 0.0)
    monkeypatch.delenv("HORNBILL_TOKEN", raising=False)
    return request.param


class Flaky:
    """A server whose first responses are lost."""

    def __init__(self, *lost: type[httpx.TransportError]) -> None:
        self._lost = list(lost)
        self.seen: list[httpx.Request] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.seen.append(request)
        if self._lost:
            raise self._lost.pop(0)("gone", request=request)
        return httpx.Response(200, json={"ok": True})


def test_a_get_is_retried_when_the_connection_breaks(run: Any) -> None:
    server = Flaky(httpx.ReadError, httpx.ConnectError)
    assert run(server, [("GET", "/servos")]) == {"ok": True}
    assert len(server.seen) == 3


def test_a_post_is_retried_with_its_key_and_each_post_has_another(run: Any) -> None:
    server = Flaky(httpx.RemoteProtocolError)
    run(server, [("POST", "/servos/x/save"), ("POST", "/servos/x/save")])
    first, retry, second = (one.headers["Idempotency-Key"] for one in server.seen)
    assert first == retry != second


@pytest.mark.parametrize("verb", ["POST", "PUT", "PATCH", "DELETE"])
def test_a_request_marked_once_is_not_retried(run: Any, verb: str) -> None:
    server = Flaky(httpx.ReadError)
    with pytest.raises(ServerUnreachable) as caught:
        run(server, [(verb, "/servos/x/command")], once=True)
    assert caught.value.facts == {"sent": True}
    assert len(server.seen) == 1
    assert "Idempotency-Key" not in server.seen[0].headers


def test_a_timeout_is_not_retried(run: Any) -> None:
    server = Flaky(httpx.ReadTimeout)
    with pytest.raises(ServerUnreachable):
        run(server, [("GET", "/servos")])
    assert len(server.seen) == 1


def test_without_a_server_the_error_says_how_to_start_one(run: Any) -> None:
    with pytest.raises(ServerUnreachable, match="hornbill demo") as caught:
        run(Flaky(*[httpx.ConnectError] * 3), [("GET", "/servos")])
    assert caught.value.facts == {"sent": False}


def test_a_problem_is_raised_without_retry(run: Any) -> None:
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
def test_a_local_server_is_reached_without_the_proxy_of_the_environment(
    kind: type[Hornbill | AsyncHornbill], url: str, local: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A proxy would receive the token, and might not forward Stop."""
    for name in ("http_proxy", "HTTP_PROXY", "https_proxy", "HTTPS_PROXY"):
        monkeypatch.setenv(name, "http://192.0.2.1:3128")
    for name in ("no_proxy", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)
    hornbill = kind(url)
    assert hornbill.local is local
    through = hornbill._http._transport_for_url(httpx.URL(url))  # pyright: ignore[reportPrivateUsage]
    assert (through is hornbill._http._transport) is local  # pyright: ignore[reportPrivateUsage]


def test_the_token_is_sent_and_not_in_errors(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HORNBILL_TOKEN", "sesame")
    server = Flaky(httpx.ConnectError, httpx.ConnectError, httpx.ConnectError)
    with pytest.raises(ServerUnreachable) as caught:
        run(server, [("GET", "/servos")])
    assert "sesame" not in str(caught.value)
    assert server.seen[0].headers["Authorization"] == "Bearer sesame"


def test_the_address_of_the_environment_may_have_a_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HORNBILL_URL", "https://site.example/bench7/")
    server = Flaky()
    with Hornbill(transport=httpx.MockTransport(server)) as hornbill:
        hornbill.request("GET", "/servos", seconds=5, refresh=True, channels=None)
        assert hornbill.socket_url == "wss://site.example/bench7/api/v1/ws"
    assert str(server.seen[0].url) == "https://site.example/bench7/api/v1/servos?seconds=5&refresh=true"


def test_a_job_is_waited_for_by_the_server_unless_its_progress_is_wanted() -> None:
    seen: list[str | None] = []

    def respond(request: httpx.Request) -> httpx.Response:
        seen.append(request.url.params.get("wait"))
        return httpx.Response(200, json={"kind": "save", "state": "succeeded" if len(seen) % 2 == 0 else "running"})

    with Hornbill("http://rig:1/", transport=httpx.MockTransport(respond)) as hornbill:
        hornbill.wait("x")
        assert seen == ["20.0", "20.0"]
        hornbill.wait("x", on_progress=lambda _: None)
        assert seen[2:] == [None, None]
        with pytest.raises(WaitTimeout):
            hornbill.wait("x", timeout_s=0.0)
