"""Connections that send a request too slowly are closed, and others are not affected."""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from time import monotonic

import httpx
import pytest
import uvicorn
from starlette.types import Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol
from websockets.asyncio.client import connect

from hornbill.app.request_timeouts import LARGEST_HEAD, RequestLimits
from hornbill.app.serving import LIMITS, configured, listen

QUICK = RequestLimits(head_s=0.3, body_s=0.3, bytes_per_s=100_000)
RELAXED = RequestLimits(head_s=5, body_s=0.8, bytes_per_s=100_000)
"""For requests that must arrive in time on a machine that may pause for half a second."""
Address = tuple[str, int]
Serve = Callable[[RequestLimits], AbstractAsyncContextManager[Address]]
pytestmark = pytest.mark.real_time


async def app(scope: Scope, receive: Receive, send: Send) -> None:
    """Reads the body and responds with its length; /stream takes two seconds, /early responds without reading."""
    if scope["type"] == "lifespan":
        for kind in ("startup", "shutdown"):
            await receive()
            await send({"type": f"lifespan.{kind}.complete"})
    elif scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.accept"})
        while (event := await receive())["type"] == "websocket.receive":
            await send({"type": "websocket.send", "text": event["text"]})
    else:
        await _respond(scope["path"], receive, send)


async def _respond(path: str, receive: Receive, send: Send) -> None:
    size, more = 0, path != "/early"
    while more:
        event = await receive()
        if event["type"] == "http.disconnect":
            return
        size, more = size + len(event["body"]), event.get("more_body", False)
    await send({"type": "http.response.start", "status": 200, "headers": []})
    for _ in range(40 if path == "/stream" else 0):
        await send({"type": "http.response.body", "body": b"x", "more_body": True})
        await asyncio.sleep(0.05)
    await send({"type": "http.response.body", "body": b"%d bytes" % size, "more_body": False})


@asynccontextmanager
async def served(limits: RequestLimits, http: type[asyncio.Protocol]) -> AsyncGenerator[Address]:
    """A running server."""
    made = uvicorn.Server(configured(app, limits=limits, http=http))
    listening = listen("127.0.0.1", 0)
    running = asyncio.create_task(made.serve(sockets=[listening]))
    while not made.started:
        await asyncio.sleep(0.01)
    try:
        async with asyncio.timeout(30):
            yield listening.getsockname()
    finally:
        made.should_exit = True
        await running


@pytest.fixture(params=[HttpToolsProtocol, H11Protocol], ids=["httptools", "h11"])
def serve(request: pytest.FixtureRequest) -> Serve:
    """Starts a server with these limits, with each implementation of HTTP."""
    return lambda limits: served(limits, request.param)


@pytest.fixture
def quick(serve: Serve) -> AbstractAsyncContextManager[Address]:
    return serve(QUICK)


@pytest.fixture
def relaxed(serve: Serve) -> AbstractAsyncContextManager[Address]:
    return serve(RELAXED)


async def whole(reader: asyncio.StreamReader) -> bytes:
    """All bytes until the end; a connection may also be reset while bytes are in transit."""
    found = b""
    with suppress(ConnectionResetError):
        while some := await reader.read(4096):
            found += some
    return found


async def closed(address: Address, *parts: bytes, every_s: float = 0.1) -> tuple[int, bytes]:
    """Parts that were not sent, as the server closed the connection first, and its response."""
    reader, writer = await asyncio.open_connection(*address)
    reading, unsent = asyncio.create_task(whole(reader)), len(parts)
    for one in parts:
        if reading.done():
            break
        writer.write(one)
        unsent -= 1
        await asyncio.sleep(every_s)
    response = await reading
    writer.close()
    return unsent, response


LINE, WHOLE = b"GET / HTTP/1.1\r\n", b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"
LENGTH, CHUNKED = b"Content-Length: 1000", b"Transfer-Encoding: chunked"


def post(kind: bytes, path: bytes = b"/") -> bytes:
    """The head of a request with a body."""
    return b"POST " + path + b" HTTP/1.1\r\nHost: a\r\n" + kind + b"\r\n\r\n"


INCOMPLETE: dict[str, tuple[bytes, ...]] = {
    "nothing": (),
    "a line": (LINE,),
    "a header now and then": (LINE, *[b"A: b\r\n"] * 100),
    "a letter now and then": (LINE + b"A: ", *[b"b"] * 100),
    "empty lines": (*[b"\r\n"] * 100,),
    "a slow body": (post(LENGTH), *[b"x"] * 100),
    "slow chunks": (post(CHUNKED), *[b"1\r\nx\r\n"] * 100),
    "a slow body after an early response": (post(LENGTH, b"/early"), *[b"x"] * 100),
    "slow chunks after an early response": (post(CHUNKED, b"/early"), *[b"1\r\nx\r\n"] * 100),
    "a second head": (WHOLE, LINE, *[b"A: b\r\n"] * 100),
    "a second body": (WHOLE + post(LENGTH) + b"x",),
}
"""Parts of requests that never end, of which one is sent each 0.1 s."""


async def test_an_incomplete_request_times_out(quick: Address) -> None:
    ends = await asyncio.gather(*(closed(quick, *parts) for parts in INCOMPLETE.values()))
    for (name, parts), (unsent, response) in zip(INCOMPLETE.items(), ends, strict=True):
        assert unsent or len(parts) < 100, name
        assert response.count(b"0 bytes") == ("second" in name or "early" in name), name


async def test_a_slow_request_in_time_gets_a_response(relaxed: Address) -> None:
    """Also a large body that takes longer than a small one may take."""
    head = b"POST / HTTP/1.1\r\nHost: a\r\nConnection: close\r\nContent-Length: 200000\r\n\r\n"
    began = monotonic()
    (_, slow), (_, large) = await asyncio.gather(
        closed(relaxed, LINE, b"Host: a\r\n", b"Connection: close\r\n\r\n"),
        closed(relaxed, head, *[b"x" * 10_000] * 20),
    )
    assert monotonic() - began > RELAXED.body_s * 2
    assert b"200 OK" in slow
    assert b"200000 bytes" in large


async def test_idle_connections_streams_and_sockets_stay_open(quick: Address) -> None:
    reader, writer = await asyncio.open_connection(*quick)
    streaming, stream = await asyncio.open_connection(*quick)
    stream.write(b"GET /stream HTTP/1.1\r\nHost: a\r\n\r\n")
    async with connect(f"ws://{quick[0]}:{quick[1]}/") as socket:
        for _ in range(2):
            writer.write(WHOLE)
            assert b"200" in await reader.readuntil(b"0 bytes\r\n0\r\n\r\n")
            await asyncio.sleep(QUICK.head_s * 2.5)
            await socket.send("still here?")
            assert await socket.recv() == "still here?"
            assert len(await streaming.read(1 << 16)) > 5
    for one in (writer, stream):
        one.close()


async def test_an_endless_head_is_rejected(serve: Serve) -> None:
    async with serve(LIMITS) as address:
        _, response = await closed(address, LINE, *[b"A: " + b"b" * 2000 + b"\r\n"] * 40, every_s=0.002)
    assert response.startswith(b"HTTP/1.1 400")
    assert LARGEST_HEAD < 40 * 2000


async def test_two_hundred_slow_connections_do_not_block_another(quick: Address) -> None:
    slow = [asyncio.create_task(closed(quick, LINE + b"A: ")) for _ in range(200)]
    await asyncio.sleep(0.05)
    _, response = await closed(quick, b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
    assert b"200 OK" in response
    await asyncio.gather(*slow)


async def test_the_server_has_these_limits() -> None:
    assert RequestLimits() == LIMITS
    assert 5 < LIMITS.head_s < 60


async def test_idle_connections_are_kept_longer_than_by_clients_and_proxies() -> None:
    nginx_s = 60
    assert configured(app).timeout_keep_alive > max(httpx.Limits().keepalive_expiry or 0, nginx_s)
