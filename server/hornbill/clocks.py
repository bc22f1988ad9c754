"""How far one clock is ahead of another, read so that a pause between the two looks cannot falsify it."""

import time
from collections.abc import Callable

from hornbill.units import Instant

_AT_ONCE_S = 20e-6  # two looks this close together are one
_LOOKS = 5  # the closest of so many is taken where none is that close


def ahead(now: Callable[[], Instant] = time.monotonic, wall: Callable[[], float] = time.time) -> float:
    """How many seconds `wall` is ahead of `now`: what turns an instant into seconds since 1970 UTC.

    A busy machine may stop a thread between two looks at two clocks for a tenth of a second. So `wall` is read
    between two looks at `now`, again while those are apart, and the closest pair counts.
    """
    closest, found = float("inf"), 0.0
    for _ in range(_LOOKS):
        before, at, after = now(), wall(), now()
        if after - before < closest:
            closest, found = after - before, at - (before + after) / 2
        if closest < _AT_ONCE_S:
            break
    return found
