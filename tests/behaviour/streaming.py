"""Transport from a client to a host in the same process, with endless responses that can be cut."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from typing import Any

import httpx
from fastapi import FastAPI


def http_scope(path: str, query: bytes, headers: Sequence[tuple[bytes, bytes]]) -> dict[str, Any]:
    """The ASGI scope of a GET from another computer."""
    return {
        "type": "http", "method": "GET", "path": path, "raw_path": path.encode(), "query_string": query,
        "headers": [*headers], "root_path": "", "scheme": "http", "client": ("192.0.2.9", 1), "server": ("test", 80),
        "http_version": "1.1", "asgi": {"version": "3.0", "spec_version": "2.3"},
    }  # fmt: skip


class _Lines(httpx.AsyncByteStream):
    def __init__(self, task: asyncio.Task[None], parts: asyncio.Queue[bytes | None]) -> None:
        self._task = task
        self._parts = parts

    async def __aiter__(self) -> AsyncIterator[bytes]:
        while (part := await self._parts.get()) is not None:
            yield part
        raise httpx.ReadError("cut")

    async def aclose(self) -> None:
        self._task.cancel()
        await asyncio.wait([self._task])


class StreamingTransport(httpx.AsyncBaseTransport):
    """Like httpx.ASGITransport, which waits for the end of every response; the event stream has none.

    `cut` breaks the streams, and `down` refuses further connections. `connections` counts the streams.
    """

    def __init__(self, app: FastAPI) -> None:
        self._app: Any = app
        self._plain = httpx.ASGITransport(app)
        self._open: list[asyncio.Queue[bytes | None]] = []
        self.down = False
        self.connections = 0

    def cut(self, *, down: bool) -> None:
        """Break all streams. `down`: until it is set to False, no connection succeeds."""
        self.down = down
        for parts in self._open:
            parts.put_nowait(None)
        self._open.clear()

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        if self.down:
            raise httpx.ConnectError("down", request=request)
        if not request.url.path.endswith("/events/stream"):
            return await self._plain.handle_async_request(request)
        self.connections += 1
        parts: asyncio.Queue[bytes | None] = asyncio.Queue()
        begun: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()

        async def send(message: Any) -> None:
            if message["type"] == "http.response.start":
                begun.set_result(message)
            else:
                parts.put_nowait(message.get("body", b""))

        async def receive() -> dict[str, Any]:
            await asyncio.Event().wait()
            raise AssertionError

        headers = [(name.lower(), value) for name, value in request.headers.raw]
        scope = http_scope(request.url.path, request.url.query, headers)
        task = asyncio.create_task(self._app(scope, receive, send))
        start = await begun
        self._open.append(parts)
        return httpx.Response(start["status"], headers=start["headers"], stream=_Lines(task, parts))
