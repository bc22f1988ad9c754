"""Roles, and the table that finds the route of a request with the least role it takes."""

from collections.abc import Iterable
from enum import IntEnum
from functools import lru_cache
from typing import Final, Literal, NamedTuple, get_args

from starlette.routing import Route, WebSocketRoute
from typing_extensions import TypeAliasType

RoleName = TypeAliasType("RoleName", Literal["view", "operate", "configure", "admin"])
_WORDS: Final[tuple[RoleName, ...]] = get_args(RoleName.__value__)


class Role(IntEnum):
    """What a token is for; each may do all that those before it may."""

    VIEW = 1
    """Look, and stop every servo."""
    OPERATE = 2
    """Move servos under a lease, and choose what is recorded of it."""
    CONFIGURE = 3
    """Write and save parameters, profiles, node ids, and connect the bus."""
    ADMIN = 4
    """Tokens, simulated servos, and deleting what was recorded."""

    @property
    def word(self) -> RoleName:
        """How the API calls it."""
        return _WORDS[self - 1]


ANYBODY: Final = 0
"""No token at all: the page's files, and the way to log in."""
HERE: Final = -1
"""A token of any role; and none at all on the machine itself."""

WORDS: Final = {role.word: role for role in Role}

ROW: Final = "hornbill.row"
"""Where in the scope of a request its Row is; None there: no route is declared for it."""

_BEHIND: Final = ("/api/", "/viser", "/metrics")
"""What begins so is no file of the page."""

_LONGEST: Final = 200
"""Characters of the longest path that is remembered: requests for longer ones must not fill the memory."""


class RouteRole(NamedTuple):
    """A route and the least role it takes."""

    route: Route | WebSocketRoute
    least: int


class RouteTable:
    """Every declared route, in the order in which they are matched."""

    def __init__(self, rows: Iterable[RouteRole]) -> None:
        self.rows = tuple(rows)
        self._remembered = lru_cache(maxsize=4096)(self._look_up)

    def find(self, method: str, path: str) -> RouteRole | None:
        """The row of a request, or None where no route is declared."""
        return self._remembered(method, path) if len(path) <= _LONGEST else self._look_up(method, path)

    def _look_up(self, method: str, path: str) -> RouteRole | None:
        method = "GET" if method in ("HEAD", "OPTIONS") else method
        behind = path.startswith(_BEHIND)
        for row in self.rows:
            methods = (row.route.methods or ()) if isinstance(row.route, Route) else ("GET",)
            if method in methods and row.route.path_regex.fullmatch(path):
                return row if not behind or row.route.path.startswith(_BEHIND) else None
        return None


def needed(row: RouteRole | None) -> int:
    """The least role of a row. What is not declared takes the highest."""
    return int(Role.ADMIN) if row is None else row.least
