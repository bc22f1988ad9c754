"""What two clocks tell of each other on a machine that stops a thread whenever it likes."""

from collections.abc import Callable
from itertools import cycle

import pytest

from hornbill.clocks import ahead

AHEAD_S = 1_700_000_000.0
LOOK_S = 1e-6


class Machine:
    """One time under two clocks; after each look at either it stops for the next of `pauses` (seconds)."""

    def __init__(self, *pauses: float) -> None:
        self._time = 50.0
        self._pauses = cycle(pauses or (0.0,))

    def look(self, offset: float) -> Callable[[], float]:
        def now() -> float:
            seen = self._time + offset
            self._time += LOOK_S + next(self._pauses)
            return seen

        return now


@pytest.mark.parametrize(
    ("pauses", "off"),
    [((), 2e-6), ((0.1, 0, 0, 0, 0), 2e-6), ((0, 0.1, 0, 0, 0), 2e-6), ((0.2, 0.3, 0.001, 0.1, 0.1, 0.1, 0.1), 0.06)],
    ids=["none", "before the wall clock", "behind it", "always: the shortest counts"],
)
def test_a_pause_between_two_looks_does_not_count(pauses: tuple[float, ...], off: float) -> None:
    machine = Machine(*pauses)
    assert ahead(machine.look(0.0), machine.look(AHEAD_S)) == pytest.approx(AHEAD_S, abs=off, rel=0)


def test_clocks_that_stand_still_are_compared_once() -> None:
    looks: list[float] = []

    def wall() -> float:
        looks.append(7.5)
        return 7.5

    assert ahead(lambda: 3.0, wall) == 4.5
    assert len(looks) == 1
