"""Timestamps of frames: wall-clock times become instants of the loop."""

import pytest

from hornbill import clocks
from hornbill.bus.ports import link
from hornbill.bus.ports.link import Stamps

AHEAD_S = 1_700_000_000.0


class Clock:
    """A monotonic clock. `ahead_s`: its difference from the wall clock; `compared`: number of comparisons."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now, self.ahead_s, self.compared = 500.0, AHEAD_S, 0
        monkeypatch.setattr(link.time, "monotonic", lambda: self.now)
        monkeypatch.setattr(clocks, "ahead", self._ahead)

    def _ahead(self) -> float:
        self.compared += 1
        return self.ahead_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


@pytest.mark.parametrize(
    ("age_s", "expected_s"),
    [(0.0, 0.0), (0.25, 0.25), (-0.0005, 0.0), (-3600.0, 0.0), (1.5, 0.0), (AHEAD_S, 0.0)],
    ids=["at once", "waited", "clocks drifted", "of another clock", "too old to be true", "none"],
)
def test_a_timestamp_gives_the_age_of_a_frame(clock: Clock, age_s: float, expected_s: float) -> None:
    at = Stamps().instant(clock.now + AHEAD_S - age_s)
    assert at == pytest.approx(clock.now - expected_s, abs=1e-6)
    assert at <= clock.now


def test_the_clocks_are_compared_once_a_second(clock: Clock) -> None:
    stamps = Stamps()
    for _ in range(3500):
        stamps.instant(clock.now + AHEAD_S)
        clock.now += 0.001
    assert 3 <= clock.compared <= 4


def test_a_wall_clock_change_is_detected_and_time_never_runs_backwards(clock: Clock) -> None:
    stamps = Stamps()
    instants = [stamps.instant(clock.now + AHEAD_S)]
    clock.ahead_s += 0.5
    for _ in range(300):
        clock.now += 0.01
        instants.append(stamps.instant(clock.now + clock.ahead_s - 0.002))
    assert instants == sorted(instants)
    assert clock.now - instants[-1] == pytest.approx(0.002, abs=1e-6)
