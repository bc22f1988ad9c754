"""Connections that send a request too slowly are closed, and others are not affected."""

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from time import monotonic

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
SOON_S = 5.0
"""The slow requests of these tests would take ten."""
PURE = pytest.mark.parametrize("pure", [False, True], ids=["httptools", "h11"])
Address = tuple[str, int]
Scene = Callable[[Address], Awaitable[None]]


async def app(scope: Scope, receive: Receive, send: Send) -> None:
    """Reads the body and responds with its length; /stream is endless, /early responds without reading."""
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
    while path == "/stream":
        await send({"type": "http.response.body", "body": b"x", "more_body": True})
        await asyncio.sleep(0.05)
    await send({"type": "http.response.body", "body": b"%d bytes" % size, "more_body": False})


def served(scene: Scene, *, pure: bool, limits: RequestLimits = QUICK) -> None:
    async def run() -> None:
        async with server(pure, limits) as address, asyncio.timeout(30):
            await scene(address)

    asyncio.run(run())


@asynccontextmanager
async def server(pure: bool, limits: RequestLimits) -> AsyncGenerator[Address]:
    made = uvicorn.Server(configured(app, limits=limits, http=H11Protocol if pure else HttpToolsProtocol))
    listening = listen("127.0.0.1", 0)
    running = asyncio.create_task(made.serve(sockets=[listening]))
    while not made.started:
        await asyncio.sleep(0.01)
    try:
        yield listening.getsockname()
    finally:
        made.should_exit = True
        await running


async def whole(reader: asyncio.StreamReader) -> bytes:
    """All bytes until the end; a connection may also be reset while bytes are in transit."""
    found = b""
    with suppress(ConnectionResetError):
        while some := await reader.read(4096):
            found += some
    return found


async def closed(address: Address, *parts: bytes, every_s: float = 0.1) -> tuple[float, bytes]:
    """Seconds until the server closed a connection that sends `parts` one by one, and its response."""
    reader, writer = await asyncio.open_connection(*address)
    began, reading = monotonic(), asyncio.create_task(whole(reader))
    for one in parts:
        if reading.done():
            break
        writer.write(one)
        await asyncio.sleep(every_s)
    response = await reading
    writer.close()
    return monotonic() - began, response


@PURE
@pytest.mark.parametrize(
    "parts",
    [
        (),
        (b"GET / HTTP/1.1\r\n",),
        (b"GET / HTTP/1.1\r\n", *[b"A: b\r\n"] * 100),
        [b"GET / HTTP/1.1\r\nA: ", *[b"b"] * 100],
        [b"\r\n"] * 100,
    ],
    ids=["nothing", "a line", "a header now and then", "a letter now and then", "empty lines"],
)
def test_an_incomplete_head_times_out(pure: bool, parts: list[bytes]) -> None:
    async def scene(address: Address) -> None:
        took, _ = await closed(address, *parts)
        assert took < SOON_S

    served(scene, pure=pure)


@PURE
def test_a_slow_head_in_time_gets_a_response(pure: bool) -> None:
    async def scene(address: Address) -> None:
        _, response = await closed(address, b"GET / HTTP/1.1\r\n", b"Host: a\r\n", b"Connection: close\r\n\r\n")
        assert b"200 OK" in response

    served(scene, pure=pure, limits=RELAXED)


@PURE
@pytest.mark.parametrize("path", [b"/", b"/early"])
def test_an_incomplete_body_times_out(pure: bool, path: bytes) -> None:
    async def scene(address: Address) -> None:
        for kind in (b"Content-Length: 1000", b"Transfer-Encoding: chunked"):
            head = b"POST " + path + b" HTTP/1.1\r\nHost: a\r\n" + kind + b"\r\n\r\n"
            bits = [b"x" if b"1000" in kind else b"1\r\nx\r\n"] * 100
            took, _ = await closed(address, head, *bits)
            assert took < SOON_S

    served(scene, pure=pure)


@PURE
def test_a_second_request_times_out_too(pure: bool) -> None:
    async def scene(address: Address) -> None:
        whole = b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"
        took, response = await closed(address, whole, b"GET / HTTP/1.1\r\n", *[b"A: b\r\n"] * 100)
        assert took < SOON_S
        assert response.count(b"0 bytes") == 1
        took, response = await closed(address, whole + b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\nx")
        assert took < SOON_S
        assert response.count(b"0 bytes") == 1

    served(scene, pure=pure)


@PURE
def test_a_large_body_may_take_long_while_it_arrives(pure: bool) -> None:
    async def scene(address: Address) -> None:
        head = b"POST / HTTP/1.1\r\nHost: a\r\nConnection: close\r\nContent-Length: 200000\r\n\r\n"
        took, response = await closed(address, head, *[b"x" * 10_000] * 20)
        assert took > RELAXED.body_s * 2
        assert b"200000 bytes" in response

    served(scene, pure=pure, limits=RELAXED)


@PURE
def test_idle_connections_streams_and_sockets_stay_open(pure: bool) -> None:
    async def scene(address: Address) -> None:
        request = b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"
        reader, writer = await asyncio.open_connection(*address)
        streaming, stream = await asyncio.open_connection(*address)
        stream.write(b"GET /stream HTTP/1.1\r\nHost: a\r\n\r\n")
        async with connect(f"ws://{address[0]}:{address[1]}/") as socket:
            for _ in range(2):
                writer.write(request)
                assert b"200" in await reader.readuntil(b"0 bytes\r\n0\r\n\r\n")
                await asyncio.sleep(QUICK.head_s * 2.5)
                await socket.send("still here?")
                assert await socket.recv() == "still here?"
                assert len(await streaming.read(1 << 16)) > 5
        for one in (writer, stream):
            one.close()

    served(scene, pure=pure)


@PURE
def test_an_endless_head_is_rejected(pure: bool) -> None:
    async def scene(address: Address) -> None:
        _, response = await closed(
            address, b"GET / HTTP/1.1\r\n", *[b"A: " + b"b" * 2000 + b"\r\n"] * 40, every_s=0.002
        )
        assert response.startswith(b"HTTP/1.1 400")

    served(scene, pure=pure, limits=RequestLimits())
    assert LARGEST_HEAD < 40 * 2000


@PURE
def test_two_hundred_slow_connections_do_not_block_another(pure: bool) -> None:
    async def scene(address: Address) -> None:
        slow = [asyncio.create_task(closed(address, b"GET / HTTP/1.1\r\nA: ")) for _ in range(200)]
        await asyncio.sleep(0.05)
        _, response = await closed(address, b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
        assert b"200 OK" in response
        assert all(took < SOON_S for took, _ in await asyncio.gather(*slow))

    served(scene, pure=pure)


def test_the_server_has_these_limits() -> None:
    assert RequestLimits() == LIMITS
    assert 5 < LIMITS.head_s < 60
