"""Roles, and the lookup of a request's route with its minimum role."""

from collections.abc import Iterable
from enum import IntEnum
from functools import lru_cache
from typing import Final, Literal, NamedTuple, get_args

from starlette.routing import Route, WebSocketRoute
from typing_extensions import TypeAliasType

RoleName = TypeAliasType("RoleName", Literal["view", "operate", "configure", "admin"])
_WORDS: Final[tuple[RoleName, ...]] = get_args(RoleName.__value__)


class Role(IntEnum):
    """Role of a token. Each includes the lower ones."""

    VIEW = 1
    """Read everything, and stop all servos."""
    OPERATE = 2
    """Move servos under a lease, subscribe to telemetry and record."""
    CONFIGURE = 3
    """Write and save parameters, profiles and node IDs, and connect the bus."""
    ADMIN = 4
    """Manage tokens and simulated servos, and delete records."""

    @property
    def word(self) -> RoleName:
        """Name of the role in the API."""
        return _WORDS[self - 1]


PUBLIC: Final = 0
"""No token required: files of the page, and login."""
LOCAL: Final = -1
"""A token of any role; none for clients on the same machine."""

WORDS: Final = {role.word: role for role in Role}

ROW: Final = "hornbill.row"
"""Key of a request's RouteRole in its ASGI scope; the value is None if no route matches."""

_BEHIND: Final = ("/api/", "/viser", "/metrics", "/health", "/ready")
"""Path prefixes that are not files of the page."""

_LONGEST: Final = 200
"""Maximum length of cached paths, so that requests cannot fill the memory."""


class RouteRole(NamedTuple):
    """A route and its minimum role."""

    route: Route | WebSocketRoute
    least: int

    @property
    def query(self) -> frozenset[str] | None:
        """Names of its query parameters. None if any are accepted: files of the page, sockets."""
        return getattr(self.route, "query", None)


class RouteTable:
    """Every declared route, in matching order."""

    def __init__(self, rows: Iterable[RouteRole]) -> None:
        self.rows = tuple(rows)
        self._cached = lru_cache(maxsize=4096)(self._look_up)

    def find(self, method: str, path: str) -> RouteRole | None:
        """Route and role of a request, or None if no route matches."""
        return self._cached(method, path) if len(path) <= _LONGEST else self._look_up(method, path)

    def _look_up(self, method: str, path: str) -> RouteRole | None:
        method = "GET" if method in ("HEAD", "OPTIONS") else method
        behind = path.startswith(_BEHIND)
        for row in self.rows:
            methods = (row.route.methods or ()) if isinstance(row.route, Route) else ("GET",)
            if method in methods and row.route.path_regex.fullmatch(path):
                return row if not behind or row.route.path.startswith(_BEHIND) else None
        return None


def needed(row: RouteRole | None) -> int:
    """Minimum role of a route; the highest role if no route matches."""
    return int(Role.ADMIN) if row is None else row.least
