"""Host and origin check: a foreign page in the same browser must not move a servo."""

from collections.abc import Callable
from functools import lru_cache
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from starlette.requests import HTTPConnection

from hornbill.errors import ForbiddenOrigin

Policy = Callable[[HTTPConnection], ForbiddenOrigin | None]
"""Check of a request: the error to refuse it with, or None."""

LOCAL_NAMES: Final = frozenset(("127.0.0.1", "localhost", "::1"))
_OURS: Final = ("same-origin", "none")
"""Sec-Fetch-Site of our own page, and of an address typed into the browser."""
_PAGE: Final = ("navigate", "document")


def local_policy(hosts: frozenset[str], *, addresses: bool = False) -> Policy:
    """Require Host to be one of `hosts` (prevents DNS rebinding), and Origin, if sent, to be this server.

    With `addresses` any IP address is accepted as a host, because only names can be rebound. Programs send no Origin.
    Browsers send one with every changing request, socket and fetch; for other requests Sec-Fetch-Site tells whether
    another site made them. Links to the page from other sites are accepted.
    """

    @lru_cache(maxsize=64)
    def allowed(host: str) -> bool:
        name = _hostname(host)
        return name in hosts or (addresses and name is not None and _is_address(name))

    def check(connection: HTTPConnection) -> ForbiddenOrigin | None:
        host = connection.headers.get("host", "")
        if not allowed(host):
            known = ", ".join(sorted(hosts))
            return ForbiddenOrigin(
                f"Host {host[:80]!r} is not allowed. Use {known}, or start the server with --allow-host NAME.",
                cause="host_not_allowed",
                host=host[:80],
                known=sorted(hosts),
            )
        origin = connection.headers.get("origin")
        if origin is not None and origin not in (f"http://{host}", f"https://{host}"):
            return ForbiddenOrigin(
                f"Requests from the site {origin[:80]!r} are refused. Open hornbill's own page at http://{host}/.",
                cause="origin_not_allowed",
                origin=origin[:80],
                host=host[:80],
            )
        if connection.headers.get("sec-fetch-site", "none") not in _OURS and not _link(connection):
            return ForbiddenOrigin(
                f"Requests from another site are refused. Open hornbill's own page at http://{host}/.",
                cause="origin_not_allowed",
                host=host[:80],
            )
        return None

    return check


def _link(connection: HTTPConnection) -> bool:
    """Whether the request follows a link to the page: it changes nothing, and the other site cannot read it."""
    fetch = (connection.headers.get("sec-fetch-mode"), connection.headers.get("sec-fetch-dest"))
    path = connection.scope["path"].removeprefix(connection.scope.get("root_path", ""))
    safe = connection.scope.get("method") == "GET" and not path.startswith(("/api/", "/viser", "/metrics"))
    return safe and fetch == _PAGE


def _hostname(host: str) -> str | None:
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:  # invalid, for example "["
        return None


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
