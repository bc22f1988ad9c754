"""Requests of hostile or broken clients: incomplete, malformed, and garbage on the socket."""

import asyncio
import contextlib
import random
import time
from collections.abc import Awaitable
from dataclasses import dataclass
from typing import Final

import httpx
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

HUGE: Final = "x" * (4 << 20)
"""A text frame four times as large as the server accepts."""

_AT_A_TIME: Final = 8


@dataclass(frozen=True)
class Latency:
    """Latency of a well-behaved client, in milliseconds."""

    median_ms: float
    p99_ms: float
    requests: int


def malformed(uid: str, seed: int, number: int) -> list[bytes]:
    """Malformed requests, some not HTTP; the same for the same seed."""
    chance = random.Random(seed)
    put, servo = "PUT /api/v1/servos/{uid}/parameters/{key} HTTP/1.1", f"/api/v1/servos/{uid}"

    def request(line: str, *headers: str, body: bytes = b"", host: str = "127.0.0.1") -> bytes:
        head = (line, f"Host: {host}", *headers, f"Content-Length: {len(body)}", "", "")
        return "\r\n".join(head).encode("latin-1") + body

    json = "Content-Type: application/json"
    kinds = (
        lambda: request(put.format(uid=uid, key="smoothing"), json, body=b"{" * chance.randrange(1, 200)),
        lambda: request(put.format(uid=uid, key="smoothing"), json, body=b'{"value": 1e999}'),
        lambda: request(put.format(uid=uid, key="smoothing"), json, body=b"[" * 5000 + b"]" * 5000),
        lambda: request(put.format(uid=uid, key="boot_loader"), json, body=b'{"value": 1}'),
        lambda: request(put.format(uid=uid, key="0x49"), json, body=b'{"value": 1}'),
        lambda: request(put.format(uid=chance.randbytes(16).hex(), key="smoothing"), json, body=b'{"value": true}'),
        lambda: request(f"PATCH {servo} HTTP/1.1", json, body=b'{"label": "\\ud800"}'),
        lambda: request(f"PATCH {servo}/parameters HTTP/1.1", json, body=chance.randbytes(chance.randrange(1, 300))),
        lambda: request(f"POST {servo}/command HTTP/1.1", json, "Lease: \xff", body=b'{"type": "angle", "value": NaN}'),
        lambda: request(f"POST {servo}/command HTTP/1.1", "Content-Type: text/plain", body=b"angle"),
        lambda: request(f"GET /{chance.randbytes(8).hex()}/{'a' * chance.randrange(1, 8000)} HTTP/1.1"),
        lambda: request(f"GET /api/v1/audit?limit={'9' * chance.randrange(1, 5000)} HTTP/1.1"),
        lambda: request(f"GET {servo} HTTP/1.1", host="evil.example"),
        lambda: request("BREW /api/v1/servos HTTP/1.1"),
        lambda: request("GET /assets/%00 HTTP/1.1"),
        lambda: request("GET /%2e%2e/%2e%2e/etc/passwd HTTP/1.1"),
        lambda: chance.randbytes(chance.randrange(1, 400)) + b"\r\n\r\n",
    )
    return [chance.choice(kinds)() for _ in range(number)]


async def send_malformed(port: int, requests: list[bytes]) -> int:
    """Send all of them; return the number of responses. A closed connection is opened again."""
    waiting, responses = iter(requests), 0

    async def one_after_the_other() -> None:
        nonlocal responses
        reader: asyncio.StreamReader | None = None
        writer: asyncio.StreamWriter | None = None
        for request in waiting:
            if reader is None or writer is None:
                reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(request)
            head = await _head(reader)
            responses += head.startswith(b"HTTP/1.1 ")
            assert not head.startswith(b"HTTP/1.1 5"), (request[:200], head)
            if b"content-length: " not in head or b"connection: close" in head.lower():
                writer.close()
                reader = writer = None
                continue
            length = int(head.partition(b"content-length: ")[2].partition(b"\r")[0])
            with contextlib.suppress(asyncio.IncompleteReadError):
                await reader.readexactly(length)
        if writer is not None:
            writer.close()

    await asyncio.gather(*(one_after_the_other() for _ in range(_AT_A_TIME)))
    return responses


async def _head(reader: asyncio.StreamReader) -> bytes:
    try:
        async with asyncio.timeout(15.0):
            return await reader.readuntil(b"\r\n\r\n")
    except (asyncio.IncompleteReadError, ConnectionError):
        return b""


async def slow_loris(port: int, connections: int, until: "asyncio.Event") -> None:
    """Endless requests: a byte of a header from time to time, over many connections."""
    opened = [await asyncio.open_connection("127.0.0.1", port) for _ in range(connections)]
    for _, writer in opened:
        writer.write(b"POST /api/v1/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1000000\r\nX-Slow: ")
    while not until.is_set():
        for _, writer in opened:
            with contextlib.suppress(ConnectionError):
                writer.write(b"a")
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(until.wait(), 0.2)
    for _, writer in opened:
        writer.close()


async def garbage(port: int, rounds: int, seed: int) -> None:
    """Invalid, oversized, binary and non-WebSocket messages, each over its own socket."""
    chance = random.Random(seed)
    url = f"ws://127.0.0.1:{port}/api/v1/ws"

    async def texts(socket: ClientConnection) -> None:
        for text in ("", "{", "[]", "null", '{"type": "stop"', '{"type": "command", "lease": 1}', "[" * 20_000):
            await socket.send(text)
        for _ in range(50):
            await socket.send("".join(chr(chance.randrange(32, 0x2FFF)) for _ in range(200)))

    async def huge(socket: ClientConnection) -> None:
        await socket.send(HUGE)
        await socket.wait_closed()

    async def binary(socket: ClientConnection) -> None:
        await socket.send(chance.randbytes(1000))
        await socket.wait_closed()

    async def noise(socket: ClientConnection) -> None:
        socket.transport.write(chance.randbytes(2000))
        await socket.wait_closed()

    for number in range(rounds):
        way = (texts, huge, binary, noise)[number % 4]
        with contextlib.suppress(ConnectionClosed, ConnectionError):
            async with asyncio.timeout(10.0), connect(url, max_size=None, compression=None) as socket:
                await way(socket)


async def listeners_of(port: int, idle: int, active: int, until: asyncio.Event, there: asyncio.Event) -> int:
    """Sockets that receive everything, and sockets that do not read what they requested; the number of messages.

    `there` is set when all of them are open.
    """
    url, received = f"ws://127.0.0.1:{port}/api/v1/ws", 0
    everything = '{"type":"subscribe","topics":["servos","telemetry","events","jobs","bus"]}'

    async def listen(socket: ClientConnection) -> None:
        nonlocal received
        await socket.send(everything)
        with contextlib.suppress(ConnectionClosed):
            while True:
                await socket.recv(decode=False)
                received += 1

    async with contextlib.AsyncExitStack() as stack:
        sockets = [
            await stack.enter_async_context(connect(url, max_size=None, compression=None)) for _ in range(idle + active)
        ]
        listening = [asyncio.create_task(listen(socket)) for socket in sockets[:active]]
        there.set()
        await until.wait()
        assert not any(task.done() for task in listening), "a socket that listens was closed"
        for task in listening:
            task.cancel()
        await asyncio.gather(*listening, return_exceptions=True)
    return received


async def healthy(url: str, uid: str, meanwhile: Awaitable[object]) -> Latency:
    """The latency of a client that reads a servo twenty times a second meanwhile."""
    doing = asyncio.ensure_future(meanwhile)
    took: list[float] = []
    async with httpx.AsyncClient(base_url=url, timeout=30) as client:
        while not doing.done():
            began = time.perf_counter()
            (await client.get(f"/api/v1/servos/{uid}")).raise_for_status()
            took.append((time.perf_counter() - began) * 1000)
            await asyncio.sleep(0.05)
    await doing
    took.sort()
    return Latency(took[len(took) // 2], took[max(0, round(0.99 * len(took)) - 1)], len(took))
