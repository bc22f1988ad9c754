"""The check of where a request comes from: a foreign page in the same browser must not move a servo."""

from collections.abc import Callable
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from starlette.requests import HTTPConnection

from hornbill.errors import ForbiddenOrigin

Policy = Callable[[HTTPConnection], ForbiddenOrigin | None]
"""The refusal of a request, or None."""

LOCAL_NAMES: Final = frozenset(("127.0.0.1", "localhost", "::1"))
_OURS: Final = ("same-origin", "none")
"""What a browser says of a request of our own page, and of one that was typed."""
_PAGE: Final = ("navigate", "document")


def local_policy(hosts: frozenset[str], *, addresses: bool = False) -> Policy:
    """Host must be one of `hosts` (stops DNS rebinding); a browser's Origin must be this very server.

    With `addresses` any number of the network is a host as well: only names can be rebound. Programs send no Origin
    and pass; browsers send one with every request that changes something, every socket and every fetch, and say with
    Sec-Fetch-Site of all others whether another site made them. A link to our page may be on another site.
    """

    def check(connection: HTTPConnection) -> ForbiddenOrigin | None:
        host = connection.headers.get("host", "")
        name = _hostname(host)
        if name not in hosts and not (addresses and name is not None and _is_address(name)):
            known = ", ".join(sorted(hosts))
            return ForbiddenOrigin(
                f"Host {host[:80]!r} is not this server. Use one of: {known}; or start it with --allow-host NAME.",
                cause="host_not_allowed",
                host=host[:80],
                known=sorted(hosts),
            )
        origin = connection.headers.get("origin")
        if origin is not None and origin not in (f"http://{host}", f"https://{host}"):
            return ForbiddenOrigin(
                f"Origin {origin[:80]!r} is another site. Open hornbill's own page at http://{host}/.",
                cause="origin_not_allowed",
                origin=origin[:80],
                host=host[:80],
            )
        if connection.headers.get("sec-fetch-site", "none") not in _OURS and not _link(connection):
            return ForbiddenOrigin(
                f"Another site asked for this. Open hornbill's own page at http://{host}/.",
                cause="origin_not_allowed",
                host=host[:80],
            )
        return None

    return check


def _link(connection: HTTPConnection) -> bool:
    """Somebody follows a link to a page as a whole: it changes nothing, and the other site sees none of it."""
    asked = (connection.headers.get("sec-fetch-mode"), connection.headers.get("sec-fetch-dest"))
    path = connection.scope["path"].removeprefix(connection.scope.get("root_path", ""))
    safe = connection.scope.get("method") == "GET" and not path.startswith(("/api/", "/viser", "/metrics"))
    return safe and asked == _PAGE


def _hostname(host: str) -> str | None:
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:  # no host at all, "[" for one
        return None


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
