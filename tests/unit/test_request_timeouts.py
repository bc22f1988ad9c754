"""Connections that never finish what they say, over real sockets: closed in time, and nobody else is touched."""

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
PATIENT = RequestLimits(head_s=5, body_s=0.8, bytes_per_s=100_000)
"""For what has to come in time on a machine that may stop for half a second."""
SOON_S = 5.0
"""What dawdles here would take ten."""
PURE = pytest.mark.parametrize("pure", [False, True], ids=["httptools", "h11"])
Address = tuple[str, int]
Scene = Callable[[Address], Awaitable[None]]


async def app(scope: Scope, receive: Receive, send: Send) -> None:
    """Reads the body and tells its length; /stream goes on for ever, /early answers without reading."""
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
        await _answer(scope["path"], receive, send)


async def _answer(path: str, receive: Receive, send: Send) -> None:
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
    """All that comes until the end; a connection is also closed by a reset, when bits were still on their way."""
    found = b""
    with suppress(ConnectionResetError):
        while some := await reader.read(4096):
            found += some
    return found


async def closed(address: Address, *said: bytes, every_s: float = 0.1) -> tuple[float, bytes]:
    """Seconds until the server closed a connection over which `said` comes bit by bit, and what it answered."""
    reader, writer = await asyncio.open_connection(*address)
    began, reading = monotonic(), asyncio.create_task(whole(reader))
    for one in said:
        if reading.done():
            break
        writer.write(one)
        await asyncio.sleep(every_s)
    answer = await reading
    writer.close()
    return monotonic() - began, answer


@PURE
@pytest.mark.parametrize(
    "said",
    [
        (),
        (b"GET / HTTP/1.1\r\n",),
        (b"GET / HTTP/1.1\r\n", *[b"A: b\r\n"] * 100),
        [b"GET / HTTP/1.1\r\nA: ", *[b"b"] * 100],
        [b"\r\n"] * 100,
    ],
    ids=["nothing", "a line", "a header now and then", "a letter now and then", "empty lines"],
)
def test_a_head_that_is_never_whole_is_not_waited_for(pure: bool, said: list[bytes]) -> None:
    async def scene(address: Address) -> None:
        took, _ = await closed(address, *said)
        assert took < SOON_S

    served(scene, pure=pure)


@PURE
def test_a_head_that_comes_slowly_and_in_time_is_answered(pure: bool) -> None:
    async def scene(address: Address) -> None:
        _, answer = await closed(address, b"GET / HTTP/1.1\r\n", b"Host: a\r\n", b"Connection: close\r\n\r\n")
        assert b"200 OK" in answer

    served(scene, pure=pure, limits=PATIENT)


@PURE
@pytest.mark.parametrize("path", [b"/", b"/early"])
def test_a_body_that_is_never_whole_is_not_waited_for(pure: bool, path: bytes) -> None:
    async def scene(address: Address) -> None:
        for kind in (b"Content-Length: 1000", b"Transfer-Encoding: chunked"):
            head = b"POST " + path + b" HTTP/1.1\r\nHost: a\r\n" + kind + b"\r\n\r\n"
            bits = [b"x" if b"1000" in kind else b"1\r\nx\r\n"] * 100
            took, _ = await closed(address, head, *bits)
            assert took < SOON_S

    served(scene, pure=pure)


@PURE
def test_a_second_request_is_timed_as_the_first(pure: bool) -> None:
    async def scene(address: Address) -> None:
        whole = b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"
        took, answer = await closed(address, whole, b"GET / HTTP/1.1\r\n", *[b"A: b\r\n"] * 100)
        assert took < SOON_S
        assert answer.count(b"0 bytes") == 1
        took, answer = await closed(address, whole + b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\nx")
        assert took < SOON_S
        assert answer.count(b"0 bytes") == 1

    served(scene, pure=pure)


@PURE
def test_a_large_body_may_take_its_time_as_long_as_it_comes(pure: bool) -> None:
    async def scene(address: Address) -> None:
        head = b"POST / HTTP/1.1\r\nHost: a\r\nConnection: close\r\nContent-Length: 200000\r\n\r\n"
        took, answer = await closed(address, head, *[b"x" * 10_000] * 20)
        assert took > PATIENT.body_s * 2
        assert b"200000 bytes" in answer

    served(scene, pure=pure, limits=PATIENT)


@PURE
def test_idle_connections_streams_and_sockets_are_left_alone(pure: bool) -> None:
    async def scene(address: Address) -> None:
        ask = b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"
        reader, writer = await asyncio.open_connection(*address)
        streaming, stream = await asyncio.open_connection(*address)
        stream.write(b"GET /stream HTTP/1.1\r\nHost: a\r\n\r\n")
        async with connect(f"ws://{address[0]}:{address[1]}/") as socket:
            for _ in range(2):
                writer.write(ask)
                assert b"200" in await reader.readuntil(b"0 bytes\r\n0\r\n\r\n")
                await asyncio.sleep(QUICK.head_s * 2.5)
                await socket.send("still here?")
                assert await socket.recv() == "still here?"
                assert len(await streaming.read(1 << 16)) > 5
        for one in (writer, stream):
            one.close()

    served(scene, pure=pure)


@PURE
def test_a_head_without_end_is_refused_before_it_fills_the_memory(pure: bool) -> None:
    async def scene(address: Address) -> None:
        _, answer = await closed(address, b"GET / HTTP/1.1\r\n", *[b"A: " + b"b" * 2000 + b"\r\n"] * 40, every_s=0.002)
        assert answer.startswith(b"HTTP/1.1 400")

    served(scene, pure=pure, limits=RequestLimits())
    assert LARGEST_HEAD < 40 * 2000


@PURE
def test_two_hundred_that_dawdle_are_gone_and_keep_nobody_from_being_answered(pure: bool) -> None:
    async def scene(address: Address) -> None:
        slow = [asyncio.create_task(closed(address, b"GET / HTTP/1.1\r\nA: ")) for _ in range(200)]
        await asyncio.sleep(0.05)
        _, answer = await closed(address, b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
        assert b"200 OK" in answer
        assert all(took < 5 for took, _ in await asyncio.gather(*slow))

    served(scene, pure=pure)


def test_what_hornbill_serves_with_has_these_limits() -> None:
    assert RequestLimits() == LIMITS
    assert 5 < LIMITS.head_s < 60
