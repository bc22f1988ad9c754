"""The offset between two clocks on a machine that may suspend a thread at any time."""

from collections.abc import Callable
from itertools import cycle

import pytest

from hornbill.clocks import ahead

AHEAD_S = 1_700_000_000.0
READ_S = 1e-6


class Machine:
    """One time for two clocks; after each reading it pauses for the next of `pauses` (seconds)."""

    def __init__(self, *pauses: float) -> None:
        self._time = 50.0
        self._pauses = cycle(pauses or (0.0,))

    def clock(self, offset: float) -> Callable[[], float]:
        def now() -> float:
            time = self._time + offset
            self._time += READ_S + next(self._pauses)
            return time

        return now


@pytest.mark.parametrize(
    ("pauses", "off"),
    [((), 2e-6), ((0.1, 0, 0, 0, 0), 2e-6), ((0, 0.1, 0, 0, 0), 2e-6), ((0.2, 0.3, 0.001, 0.1, 0.1, 0.1, 0.1), 0.06)],
    ids=["none", "before the wall clock", "behind it", "always: the shortest is used"],
)
def test_a_pause_between_two_readings_is_ignored(pauses: tuple[float, ...], off: float) -> None:
    machine = Machine(*pauses)
    assert ahead(machine.clock(0.0), machine.clock(AHEAD_S)) == pytest.approx(AHEAD_S, abs=off, rel=0)


def test_stopped_clocks_are_compared_once() -> None:
    readings: list[float] = []

    def wall() -> float:
        readings.append(7.5)
        return 7.5

    assert ahead(lambda: 3.0, wall) == 4.5
    assert len(readings) == 1
