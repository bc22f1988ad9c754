"""The format of a result line, and CPU time compared with a peer."""

import statistics
import time
from collections.abc import Callable, Mapping
from importlib.metadata import version
from typing import Any

PYDRONECAN = f"pydronecan {version('dronecan')}"


def line(
    bench: str,
    figures: Mapping[str, float],
    *,
    must: float,
    aim: float | None = None,
    of: str = "ratio",
    peer: str | None = None,
    limit: str | None = None,
) -> dict[str, Any]:
    """One line, with the `peer` in the same run or the physical `limit` that it is compared with.

    `must` and `aim` judge the figure named `of`: a `ratio` to a peer is at least that (peer divided by ours), all else
    at most (`times`: ours divided by the peer).
    """
    judged = figures[of]
    faster = of == "ratio" and peer is not None

    def holds(goal: float) -> bool:
        return judged >= goal if faster else judged <= goal

    return {
        "bench": bench, "figures": dict(figures), "peer": peer, "limit": limit, "ratio": figures.get("ratio"),
        "judged": of, "must": must, "aim": aim, "ok": holds(must), "aim_ok": None if aim is None else holds(aim),
    }  # fmt: skip


def cpu(work: Callable[[], object]) -> float:
    """CPU seconds of one call."""
    began = time.process_time()
    work()
    return time.process_time() - began


def compare_with_peer(
    ours: Callable[[], object], theirs: Callable[[], object], *, scale: float, rounds: int
) -> dict[str, float]:
    """Median CPU seconds of both, alternating, and of their ratios; `theirs` does 1/`scale` of the work."""
    for once in (ours, theirs):  # what is made at the first use is not what is compared
        once()
    pairs = [(cpu(ours), cpu(theirs) * scale) for _ in range(rounds)]
    return {
        "ours_s": round(statistics.median(mine for mine, _ in pairs), 5),
        "peer_s": round(statistics.median(theirs for _, theirs in pairs), 5),
        "ratio": round(statistics.median(theirs / mine for mine, theirs in pairs), 1),
    }
