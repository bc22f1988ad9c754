"""Offset between two clocks, measured so that a pause between the two readings cannot falsify it."""

import time
from collections.abc import Callable

from hornbill.units import Instant

_SIMULTANEOUS_S = 20e-6  # readings this close together count as simultaneous
_TRIES = 5  # if none is that close, the closest of this many counts


def ahead(now: Callable[[], Instant] = time.monotonic, wall: Callable[[], float] = time.time) -> float:
    """Seconds by which `wall` is ahead of `now`: the offset from an instant to seconds since 1970 UTC.

    A busy machine may suspend a thread between the two readings for 0.1 s. So `wall` is read between two readings of
    `now`, repeatedly until those are close together, and the closest pair counts.
    """
    closest, found = float("inf"), 0.0
    for _ in range(_TRIES):
        before, at, after = now(), wall(), now()
        if after - before < closest:
            closest, found = after - before, at - (before + after) / 2
        if closest < _SIMULTANEOUS_S:
            break
    return found
