"""Improve on 300 random plants without a bus: nothing ends worse, and most mistuned servos settle much sooner."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from bench.line import line
from improve_cases import Judged, judge

PLANTS = 300
WITHIN = 0.15
"""Difference between predicted and measured settling time, share of the measured one."""


def figures() -> Iterator[dict[str, Any]]:
    """Shares of 300 plants, goal fast."""
    with ProcessPoolExecutor() as processes:
        found = list(processes.map(judge, range(PLANTS)))
    yield from lines(found)


def lines(found: list[Judged]) -> Iterator[dict[str, Any]]:
    """The figures of these plants."""
    worse = [one.case.seed for one in found if one.worse]
    ran = [one for one in found if one.made is not None]
    kept = sum(one.made is not None and one.made.kept is not None for one in ran)
    yield line(
        f"improve: servos that end hunting or slower than they began, of {len(found)}",
        {"worse": len(worse), "kept": kept, "restored": len(ran) - kept,
         "refused_as_stalled": len(found) - len(ran)},
        of="worse", must=0, limit="none",
    )  # fmt: skip
    mistuned = [one for one in ran if one.mistuned]
    share = sum(one.sooner for one in mistuned) / len(mistuned)
    drawn = [one for one in ran if one.case.drawn]
    yield line(
        "improve: mistuned servos that settle at least 30 % sooner, share",
        {"share_missing": round(1 - share, 3), "share": round(share, 3), "mistuned": len(mistuned),
         "all_with_random_gains": len(drawn),
         "share_of_all_with_random_gains": round(sum(one.sooner for one in drawn) / len(drawn), 3)},
        of="share_missing", must=0.2, limit="all of them",
    )  # fmt: skip
    pairs = [one.predicted for one in ran if one.predicted is not None]
    right = sum(abs(expected - measured) <= WITHIN * measured for expected, measured in pairs)
    yield line(
        f"improve: predicted settling time within {WITHIN:.0%} of the measured one, share of kept gains",
        {"share_missing": round(1 - right / len(pairs), 3), "share": round(right / len(pairs), 3), "kept": len(pairs)},
        of="share_missing", must=0.2, limit="all of them",
    )  # fmt: skip
    cpu = sorted(one.cpu_s for one in found)
    yield line(
        "improve: CPU time of an improvement including the simulated servo, s",
        {"s_mean": round(sum(cpu) / len(cpu), 2), "s_max": round(cpu[-1], 2)}, of="s_mean", must=2.0,
        limit="an improvement takes a servo 20 s",
    )  # fmt: skip
