"""Connection to one server: requests with token and lease, and problems as exceptions."""

import asyncio
import os
import ssl
import uuid
from collections.abc import AsyncGenerator, AsyncIterator, Mapping
from contextlib import asynccontextmanager
from typing import Any

import httpx

from hornbill.client.problems import ServerUnreachable, raised
from hornbill.errors import HornbillError

LOCAL_URL = "http://127.0.0.1:8000"
PAUSE_S = 0.2
"""Pause before a retry."""


class AsyncConnection:
    """Connection to one server. Changing requests include `lease_id` while it is set.

    After a lost connection, requests that are safe to repeat are retried (`tries` in total): GET, and POST with the
    same Idempotency-Key. Motion commands are sent once. Timeouts are never retried.

    `trusted`: TLS context, also for other kinds of connections; None without TLS.
    """

    def __init__(
        self,
        url: str | None = None,
        token: str | None = None,
        *,
        by: str = "client",
        timeout_s: float = 30.0,
        tries: int = 3,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        """`url` and `token` default to HORNBILL_URL and HORNBILL_TOKEN, and then to LOCAL_URL without a token.

        Certificates of https servers are verified with the authorities of this machine and of SSL_CERT_FILE.

        `by`: name of the client, shown when it stops servos. `timeout_s`: response timeout.
        """
        self.url = (url or os.environ.get("HORNBILL_URL") or LOCAL_URL).rstrip("/")
        self.by = by
        self.lease_id: str | None = None
        self._tries = tries
        self._secret = token or os.environ.get("HORNBILL_TOKEN")
        self.trusted = _authorities() if self.url.startswith("https:") else None
        self._http = httpx.AsyncClient(
            trust_env=not self.local,
            # Without TLS an empty context: loading the authorities takes 50 ms.
            verify=self.trusted or ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT),
            base_url=f"{self.url}/api/v1",
            timeout=timeout_s,
            headers=self.credentials,
            transport=transport,
        )

    async def aclose(self) -> None:
        """Close the connection. A current lease expires."""
        await self._http.aclose()

    async def request(
        self,
        verb: str,
        path: str,
        body: object = None,
        *,
        once: bool = False,
        keyed: bool = True,
        timeout_s: float | None = None,
        headers: dict[str, str] | None = None,
        content: str | bytes | None = None,
        **query: object,
    ) -> Any:
        """Send a request below /api/v1. Returns JSON, else text, or None for an empty response.

        `once`: never retry. `keyed`: send an Idempotency-Key with a POST. `content` is sent unchanged, in place of
        `body` as JSON. None in `query` is omitted. Raises ServerUnreachable, and the class of hornbill.errors for the
        problem's code.
        """
        sent = dict(headers or {})
        if self.lease_id is not None and verb != "GET":
            sent.setdefault("Lease", self.lease_id)
        if verb == "POST" and keyed and not once:
            sent["Idempotency-Key"] = uuid.uuid4().hex
        request = self._http.build_request(
            verb, path, content=content, headers=sent, json=body,
            params=_given(query),
            timeout=httpx.USE_CLIENT_DEFAULT if timeout_s is None else timeout_s,
        )  # fmt: skip
        response = await self._send(request, 1 if once or verb not in ("GET", "POST") else self._tries)
        if response.status_code == 204:
            return None
        return response.json() if _is_json(response) else response.text

    async def download(self, path: str, **query: object) -> bytes:
        """Content of a file below /api/v1. None in `query` is omitted."""
        request = self._http.build_request("GET", path, params=_given(query))
        return (await self._send(request, self._tries)).content

    @asynccontextmanager
    async def lines(
        self, path: str, *, silence_s: float, headers: dict[str, str], **query: object
    ) -> AsyncGenerator[AsyncIterator[str]]:
        """Lines of an endless response below /api/v1. Raises ServerUnreachable if it ends or none comes for
        `silence_s`.
        """
        given, timeout = _given(query), httpx.Timeout(self._http.timeout.connect, read=silence_s)
        try:
            async with self._http.stream("GET", path, params=given, headers=headers, timeout=timeout) as response:
                if response.is_error:
                    await response.aread()
                    raise _problem(response)
                yield response.aiter_lines()
        except httpx.TransportError as error:
            raise self._unreachable(error) from None

    @property
    def closed(self) -> bool:
        """Whether the connection was closed."""
        return self._http.is_closed

    @property
    def local(self) -> bool:
        """Whether the server is on this machine, so that HTTP_PROXY is ignored."""
        return httpx.URL(self.url).host in ("127.0.0.1", "localhost", "::1")

    @property
    def socket_url(self) -> str:
        """URL of the server's WebSocket."""
        return f"ws{self.url.removeprefix('http')}/api/v1/ws"

    @property
    def credentials(self) -> dict[str, str]:
        """Authorization header, for other kinds of connections."""
        return {"Authorization": f"Bearer {self._secret}"} if self._secret else {}

    async def _send(self, request: httpx.Request, tries: int) -> httpx.Response:
        while True:
            tries -= 1
            try:
                response = await self._http.send(request)
                break
            except httpx.TransportError as error:
                if tries == 0 or isinstance(error, httpx.TimeoutException):
                    raise self._unreachable(error) from None
            await asyncio.sleep(PAUSE_S)
        if response.is_error:
            raise _problem(response)
        return response

    def _unreachable(self, error: httpx.TransportError) -> ServerUnreachable:
        why = str(error) or type(error).__name__
        if "CERTIFICATE_VERIFY_FAILED" in why:
            remedy = "Set SSL_CERT_FILE to the file of its certificate or of the certificate authority."
            return ServerUnreachable(
                f"The certificate of {self.url} is not trusted: {why}. {remedy}",
                cause=None,
                sent=False,
            )
        if isinstance(error, (httpx.ConnectError, httpx.ConnectTimeout)):
            start = "Start it with 'hornbill demo' or 'hornbill serve', or set HORNBILL_URL to its address."
            return ServerUnreachable(
                f"No hornbill server responds at {self.url}: {why}. {start}", cause=None, sent=False
            )
        lost = f"The connection to {self.url} was lost before the response: {why}."
        return ServerUnreachable(
            f"{lost} It is unknown whether the request was carried out. Check before you repeat it.",
            cause=None,
            sent=True,
        )


def _authorities() -> ssl.SSLContext:
    """TLS context with the authorities of httpx and of this machine, which may include a private one."""
    found = httpx.create_ssl_context()
    found.load_default_certs()
    return found


def _problem(response: httpx.Response) -> HornbillError:
    found = response.json() if _is_json(response) else {"detail": response.text[:200]}
    return raised(response.status_code, found)


def _given(query: Mapping[str, object]) -> dict[str, str]:
    """Texts of query parameters, without those that are None."""
    return {key: _text(value) for key, value in query.items() if value is not None}


def _text(value: object) -> str:
    return ("true" if value else "false") if isinstance(value, bool) else str(value)


def _is_json(response: httpx.Response) -> bool:
    return "json" in response.headers.get("content-type", "")
