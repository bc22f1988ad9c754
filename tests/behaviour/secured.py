"""The whole application with tokens and origins, in front of a rig's host, and clients from several addresses."""

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Any, TypeVar

import httpx
from fastapi import FastAPI

from behaviour.rig import CATALOG, Rig, play
from hornbill.api.http import create_api
from hornbill.api.security.access import Access
from hornbill.api.security.origin import LOCAL_NAMES, local_policy

T = TypeVar("T")
REMOTE = ("192.0.2.9", 5000)
LOCAL = ("127.0.0.1", 5000)
GIVEN = "a-token-of-the-command-line"


class SecuredServer:
    """The whole application in front of a rig's host. `now` is the clock of logins and tries."""

    def __init__(self, rig: Rig, given: str | None = None, root_path: str = "", behind_proxy: bool = False) -> None:
        self.now = 0.0
        self.access = Access(given=given, now=lambda: self.now, wall=lambda: 1000.0 + self.now)
        self.access.open(rig.host.store)
        self.rig = rig
        self.app: FastAPI = create_api(
            CATALOG, policy=local_policy(LOCAL_NAMES), access=self.access, root_path=root_path,
            behind_proxy=behind_proxy,
        )  # fmt: skip
        self.app.state.host, self.app.state.adapters, self.app.state.bench = rig.host, rig.app.state.adapters, rig.bench

    async def token(self, name: str, role: str) -> str:
        """A new token, valid immediately."""
        secret = self.rig.host.store.tokens.add(name, role)[1]
        await self.access.refresh()
        return secret

    async def revoke(self, name: str) -> None:
        """Revoke a token, effective immediately."""
        self.rig.host.store.tokens.drop(name)
        await self.access.refresh()

    @asynccontextmanager
    async def client(
        self, token: str | None = None, address: tuple[str, int] = REMOTE
    ) -> AsyncGenerator[httpx.AsyncClient]:
        """An HTTP client at `address`, with its own cookie jar."""
        headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        transport = httpx.ASGITransport(self.app, client=address)
        async with httpx.AsyncClient(
            transport=transport, base_url="http://localhost/api/v1", headers=headers, timeout=None
        ) as made:
            yield made


class RawSocket:
    """One WebSocket through the whole application."""

    def __init__(self, app: FastAPI, *headers: tuple[str, str], query: str = "", path: str = "/api/v1/ws") -> None:
        self._to: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._from: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        pairs = [(name.lower().encode(), value.encode()) for name, value in (("host", "localhost"), *headers)]
        self.scope: dict[str, Any] = {
            "type": "websocket", "path": path, "raw_path": path.encode(), "query_string": query.encode(),
            "headers": pairs, "subprotocols": [], "root_path": "", "scheme": "ws", "client": REMOTE,
            "server": ("test", 80), "extensions": {"websocket.http.response": {}},
        }  # fmt: skip
        self.task = asyncio.create_task(app(self.scope, self._to.get, self._from.put))  # pyright: ignore[reportArgumentType]
        self._to.put_nowait({"type": "websocket.connect"})

    async def first(self) -> str | int:
        """The type of the first event, or the status of a rejection."""
        event = await asyncio.wait_for(self._from.get(), 10)
        return int(event["status"]) if event["type"] == "websocket.http.response.start" else str(event["type"])

    def send(self, text: str) -> None:
        """Send one message."""
        self._to.put_nowait({"type": "websocket.receive", "text": text})

    async def until(self, wanted: str) -> dict[str, Any]:
        """The next event that contains this text."""
        async with asyncio.timeout(20):
            while wanted not in str(event := await self._from.get()):
                pass
        return event

    async def close(self) -> None:
        """Disconnect as a closed page does."""
        self._to.put_nowait({"type": "websocket.disconnect", "code": 1001})
        await self.task


def through(scene: Callable[[SecuredServer], Awaitable[T]], **options: Any) -> T:
    """Play a scene with a secured server and one plain servo. `options` are those of SecuredServer."""

    async def run(rig: Rig) -> T:
        await rig.ready()
        return await scene(SecuredServer(rig, **options))

    return play(run)


def secured(**options: Any) -> Callable[[Callable[..., Awaitable[None]]], Callable[..., None]]:
    """Decorate a coroutine function `(server, …)`: a test that plays it with a SecuredServer.

    An argument `client` is a remote client without a token. `options` are those of SecuredServer.
    """

    def make(act: Callable[..., Awaitable[None]]) -> Callable[..., None]:
        parameters = signature(act).parameters

        @wraps(act)
        def test(**arguments: object) -> None:
            async def scene(server: SecuredServer) -> None:
                async with server.client() as client:
                    await act(server, **({"client": client} if "client" in parameters else {}), **arguments)

            through(scene, **options)

        test.__signature__ = Signature(  # pyright: ignore[reportAttributeAccessIssue]
            [
                each.replace(kind=Parameter.KEYWORD_ONLY)
                for name, each in parameters.items()
                if name not in ("server", "client")
            ]
        )
        return test

    return make
