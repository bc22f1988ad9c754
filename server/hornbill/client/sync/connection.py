"""Requests to one server, with token, lease and problems as exceptions."""

# Made from hornbill.client.aio by `make generate`: change it there.

import os
import ssl
import time
import uuid
from typing import Any

import httpx

from hornbill.client.problems import NoServer, raised

HERE = "http://127.0.0.1:8000"
PAUSE_S = 0.2
"""Between two tries."""


class Connection:
    """Asks one server. `lease_id` goes with everything that changes something, while there is one.

    A connection that breaks is tried again (`tries` in all) where doing a thing twice does nothing twice: a GET, and
    a POST, which then carries the same Idempotency-Key. Motion is asked for once. Time-outs are never tried again.

    `trusted`: whose certificates are believed, for connections of another kind; None where there is no TLS.
    """

    def __init__(
        self,
        url: str | None = None,
        token: str | None = None,
        *,
        by: str = "client",
        timeout_s: float = 30.0,
        tries: int = 3,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        """`url` and `token` are those of HORNBILL_URL and HORNBILL_TOKEN unless given; see HERE for neither.

        The certificate of an https address is believed by the authorities of this machine and of SSL_CERT_FILE.

        `by`: who stops, for everybody to see. `timeout_s`: for an answer; `tries` in all, where trying again is safe.
        """
        self.url = (url or os.environ.get("HORNBILL_URL") or HERE).rstrip("/")
        self.by = by
        self.lease_id: str | None = None
        self._tries = tries
        self._secret = token or os.environ.get("HORNBILL_TOKEN")
        self.trusted = _authorities() if self.url.startswith("https:") else None
        self._http = httpx.Client(
            trust_env=not self.local,
            verify=self.trusted or True,
            base_url=f"{self.url}/api/v1",
            timeout=timeout_s,
            headers=self.credentials,
            transport=transport,
        )

    def close(self) -> None:
        """Close the connection; a lease that is held lapses."""
        self._http.close()

    def ask(
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
        """One request below /api/v1; its JSON, its text where it is none, or None for no content.

        `once`: never tried again. `keyed`: a POST carries an Idempotency-Key, the same at every try. `content` is
        sent as it is, in place of `body` as JSON; `query` leaves out what is None. Raises NoServer, and the error of
        hornbill.errors that the server's code names.
        """
        sent = dict(headers or {})
        if self.lease_id is not None and verb != "GET":
            sent.setdefault("Lease", self.lease_id)
        if verb == "POST" and keyed and not once:
            sent["Idempotency-Key"] = uuid.uuid4().hex
        request = self._http.build_request(
            verb, path, content=content, headers=sent, json=body,
            params={key: _text(value) for key, value in query.items() if value is not None},
            timeout=httpx.USE_CLIENT_DEFAULT if timeout_s is None else timeout_s,
        )  # fmt: skip
        response = self._send(request, 1 if once or verb not in ("GET", "POST") else self._tries)
        if response.status_code == 204:
            return None
        return response.json() if _is_json(response) else response.text

    def download(self, path: str, **query: str) -> bytes:
        """A file below /api/v1, byte by byte."""
        request = self._http.build_request("GET", path, params=query)
        return (self._send(request, self._tries)).content

    @property
    def local(self) -> bool:
        """Whether the server is on this machine: no proxy that HTTP_PROXY names can reach it, nor stop it."""
        return httpx.URL(self.url).host in ("127.0.0.1", "localhost", "::1")

    @property
    def socket_url(self) -> str:
        """Where the server's WebSocket is."""
        return f"ws{self.url.removeprefix('http')}/api/v1/ws"

    @property
    def credentials(self) -> dict[str, str]:
        """The headers that say who asks, for connections of another kind."""
        return {"Authorization": f"Bearer {self._secret}"} if self._secret else {}

    def _send(self, request: httpx.Request, tries: int) -> httpx.Response:
        while True:
            tries -= 1
            try:
                response = self._http.send(request)
                break
            except httpx.TransportError as error:
                if tries == 0 or isinstance(error, httpx.TimeoutException):
                    raise self._no_server(error) from None
            time.sleep(PAUSE_S)
        if response.is_error:
            found = response.json() if _is_json(response) else {"detail": response.text[:200]}
            raise raised(response.status_code, found)
        return response

    def _no_server(self, error: httpx.TransportError) -> NoServer:
        why = str(error) or type(error).__name__
        if "CERTIFICATE_VERIFY_FAILED" in why:
            remedy = "Name the file of its certificate, or of who signed it, in SSL_CERT_FILE."
            return NoServer(
                f"What answers at {self.url} has a certificate that is not trusted: {why}. {remedy}",
                cause=None,
                sent=False,
            )
        if isinstance(error, (httpx.ConnectError, httpx.ConnectTimeout)):
            start = "Start one with 'hornbill demo' or 'hornbill serve', or name its address in HORNBILL_URL."
            return NoServer(f"No hornbill server answers at {self.url}: {why}. {start}", cause=None, sent=False)
        lost = "The connection ended before the answer came, so that it is not known whether it was done."
        return NoServer(f"{lost} {self.url}: {why}. Look before you ask again.", cause=None, sent=True)


def _authorities() -> ssl.SSLContext:
    """Those that httpx brings, and those of this machine: a network's own authority is only there."""
    found = httpx.create_ssl_context()
    found.load_default_certs()
    return found


def _text(value: object) -> str:
    return ("true" if value else "false") if isinstance(value, bool) else str(value)


def _is_json(response: httpx.Response) -> bool:
    return "json" in response.headers.get("content-type", "")
