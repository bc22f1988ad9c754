"""Owns the one table of who may do what: every route with the least role it takes. A test walks all routes."""

from enum import IntEnum
from functools import lru_cache
from typing import Final, Literal, get_args

RoleWord = Literal["view", "operate", "configure", "admin"]
_WORDS: Final[tuple[RoleWord, ...]] = get_args(RoleWord)


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
    def word(self) -> RoleWord:
        """How the API calls it."""
        return _WORDS[self - 1]


ANYBODY: Final = 0
"""No token at all: the page's files, and the way to log in."""
HERE: Final = -1
"""A token of any role; and none at all on the machine itself."""

WORDS: Final = {role.word: role for role in Role}

_READ: Final = {
    Role.VIEW: """
        /api/v1/openapi.json /metrics /api/v1/ws /api/v1/events/stream
        /api/v1/servos /api/v1/servos/{} /api/v1/inventory /api/v1/inventory.csv /api/v1/inventory/{}
        /api/v1/servos/{}/drift /api/v1/servos/{}/faults /api/v1/servos/{}/cautions /api/v1/servos/{}/position-unit
        /api/v1/servos/{}/restart-forecast /api/v1/servos/{}/factory-reset
        /api/v1/servos/{}/telemetry /api/v1/servos/{}/telemetry.csv /api/v1/servos/{}/telemetry.parquet
        /api/v1/servos/{}/snapshots /api/v1/servos/{}/snapshots/{} /api/v1/compare
        /api/v1/servos/{}/parameters /api/v1/servos/{}/parameters/{} /api/v1/parameters /api/v1/schema
        /api/v1/jobs /api/v1/jobs/{} /api/v1/jobs/{}/report /api/v1/commissioning/candidates
        /api/v1/streams /api/v1/streams/{} /api/v1/leases /api/v1/leases/requests/{} /api/v1/stop
        /api/v1/bus /api/v1/bus/adapters /api/v1/bus/doctor /api/v1/bus/log /api/v1/bus/logs /api/v1/bus/logs/{}
        /api/v1/nodes /api/v1/allocations /api/v1/profiles /api/v1/profiles/{} /api/v1/profiles/{}/file
        /api/v1/audit /api/v1/audit.csv /api/v1/runs /api/v1/runs/overlay /api/v1/runs/{} /api/v1/runs/{}/csv
        /api/v1/recorder /api/v1/recorder/bundles /api/v1/recorder/bundles/{} /api/v1/recorder/bundles/{}/content
        /api/v1/sim/servos /api/v1/sim/servos/{}
    """,
    Role.ADMIN: "/api/v1/tokens",
    HERE: "/api/v1/health",
    ANYBODY: "/api/v1/session",
}
"""GET (and the WebSockets); a {} is one segment of any content."""

_CHANGE: Final = {
    HERE: "POST /api/v1/stop",
    ANYBODY: "POST /api/v1/session, DELETE /api/v1/session",
    Role.VIEW: "POST /api/v1/tickets",
    Role.OPERATE: """
        DELETE /api/v1/stop, POST /api/v1/commands, POST /api/v1/servos/{}/command, POST /api/v1/servos/{}/torque,
        POST /api/v1/servos/{}/identify, POST /api/v1/servos/{}/step-test, PUT /api/v1/servos/{}/telemetry,
        POST /api/v1/leases, PUT /api/v1/leases/{}, DELETE /api/v1/leases/{},
        POST /api/v1/leases/requests, DELETE /api/v1/leases/requests/{}, POST /api/v1/leases/requests/{}/refuse,
        POST /api/v1/streams, PUT /api/v1/streams/{}, DELETE /api/v1/streams/{}, DELETE /api/v1/jobs/{},
        POST /api/v1/servos/{}/faults/acknowledge, POST /api/v1/servos/{}/faults/{}/acknowledge,
        POST /api/v1/recorder/bundles
    """,
    Role.CONFIGURE: """
        PATCH /api/v1/servos/{}, PATCH /api/v1/inventory/{},
        PUT /api/v1/servos/{}/parameters/{}, PATCH /api/v1/servos/{}/parameters, PATCH /api/v1/parameters,
        POST /api/v1/servos/{}/save, POST /api/v1/servos/{}/restart, POST /api/v1/servos/{}/factory-reset,
        PUT /api/v1/servos/{}/position-unit, POST /api/v1/servos/{}/copy,
        DELETE /api/v1/servos/{}/drift, POST /api/v1/servos/{}/drift/restore,
        POST /api/v1/servos/{}/snapshots, POST /api/v1/servos/{}/snapshots/{}/restore,
        POST /api/v1/commissioning, POST /api/v1/jobs/{}/resume,
        PUT /api/v1/profiles/{}, DELETE /api/v1/profiles/{}, PUT /api/v1/profiles/{}/file,
        POST /api/v1/profiles/{}/apply,
        PUT /api/v1/bus, DELETE /api/v1/bus, POST /api/v1/bus/log, DELETE /api/v1/bus/log, PUT /api/v1/bus/allocator,
        PUT /api/v1/allocations/{}, DELETE /api/v1/allocations/{}, POST /api/v1/allocations/recycle,
        PUT /api/v1/recorder/bundles/{}
    """,
    Role.ADMIN: """
        POST /api/v1/tokens, DELETE /api/v1/tokens/{},
        DELETE /api/v1/inventory/{}, DELETE /api/v1/servos/{}/snapshots/{}, DELETE /api/v1/runs/{},
        DELETE /api/v1/bus/logs/{}, DELETE /api/v1/recorder/bundles/{},
        POST /api/v1/sim/servos, PATCH /api/v1/sim/servos/{}, DELETE /api/v1/sim/servos/{}
    """,
}

_BEHIND: Final = ("/api/", "/viser", "/metrics")
"""What begins so is no file of the page."""

_VIEW: Final = "/viser"
"""The 3D view: its page, and sockets that look and choose what is looked at."""

_ANY: Final = "{}"
_PAGE: Final = "page"
_OTHER: Final = "other"
_LONGEST: Final = 200
"""Characters of the longest path that is remembered: no path of ours is longer, and whoever asks for others must not
fill the memory with them."""

_Row = tuple[int, str]
"""A role, and the path as the table has it."""
_Tree = dict[str, "_Tree | _Row"]


def _grow() -> dict[str, _Tree]:
    """By method, a tree of segments; "" holds the row of the path that ends there."""
    trees: dict[str, _Tree] = {}
    rows = [("GET", path, role) for role, paths in _READ.items() for path in paths.split()]
    for role, changes in _CHANGE.items():
        for change in changes.split(","):
            method, path = change.split()
            rows.append((method, path, role))
    for method, path, role in rows:
        place = trees.setdefault(method, {})
        for segment in path.split("/"):
            deeper = place.setdefault(f"/{segment}", {})
            assert isinstance(deeper, dict)
            place = deeper
        assert "" not in place, f"{method} {path} stands twice"
        place[""] = int(role), path
    return trees


_TREES: Final = _grow()


def declared(method: str, path: str) -> int | None:
    """The least role a request takes, or None where the table has no row: then nobody but an admin may."""
    row = _row(method, path)
    return None if row is None else row[0]


def needed(method: str, path: str) -> int:
    """The least role a request takes. What is not in the table takes the highest."""
    found = declared(method, path)
    return int(Role.ADMIN) if found is None else found


def route_of(method: str, path: str) -> str:
    """What a request is counted as: the path of its row, "page" for the page's files, "other" for what has no row."""
    row = _row(method, path)
    return _OTHER if row is None else row[1]


def _row(method: str, path: str) -> _Row | None:
    return _remembered(method, path) if len(path) <= _LONGEST else _looked_up(method, path)


def _looked_up(method: str, path: str) -> _Row | None:
    method = "GET" if method in ("HEAD", "OPTIONS") else method
    if method == "GET" and not path.startswith(_BEHIND):
        return ANYBODY, _PAGE
    if method == "GET" and (path == _VIEW or path.startswith(f"{_VIEW}/")):
        return int(Role.VIEW), _VIEW
    return _find(_TREES.get(method, {}), path.split("/"), 0)


_remembered = lru_cache(maxsize=4096)(_looked_up)


def _find(place: _Tree, segments: list[str], at: int) -> _Row | None:
    if at == len(segments):
        found = place.get("")
        return found if isinstance(found, tuple) else None
    for name in (f"/{segments[at]}", f"/{_ANY}"):
        deeper = place.get(name)
        if isinstance(deeper, dict):
            found = _find(deeper, segments, at + 1)
            if found is not None:
                return found
    return None
