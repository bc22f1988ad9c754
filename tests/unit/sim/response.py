"""The response of a simulated horn to a command, sampled by reading 0x08."""

from itertools import pairwise
from typing import NamedTuple

from unit.sim.desk import Desk

SAMPLE_S = 0.01


class Response(NamedTuple):
    """Readings of 0x08 in 0.1°, one per SAMPLE_S, on a step to `target`."""

    target: int
    readings: list[int]

    @property
    def overshoot(self) -> int:
        """Overshoot, 0.1°; negative if the target was not reached."""
        way = 1 if self.target >= self.readings[0] else -1
        return max(way * (reading - self.target) for reading in self.readings)

    @property
    def left(self) -> int:
        """Final distance from the target, 0.1°."""
        return abs(self.readings[-1] - self.target)

    @property
    def hunting(self) -> int:
        """Peak-to-peak oscillation in the last second, 0.1°."""
        late = self.readings[-round(1.0 / SAMPLE_S) :]
        return max(late) - min(late)

    @property
    def swings(self) -> int:
        """Number of reversals in the last second."""
        late = self.readings[-round(1.0 / SAMPLE_S) :]
        ways = [later - earlier for earlier, later in pairwise(late) if later != earlier]
        return sum((earlier > 0) is not (later > 0) for earlier, later in pairwise(ways))

    def first(self, share: float) -> float:
        """Time until this share of the step, s."""
        return SAMPLE_S * next(n for n, reading in enumerate(self.readings) if reading >= share * self.target)


def step(desk: Desk, target: int = 450, seconds: float = 3.0) -> Response:
    """Command an angle (0.1°) and sample the response."""
    assert desk.write("0x00", target) == target
    return Response(target, watch(desk, "0x08", seconds))


def watch(desk: Desk, name: str, seconds: float) -> list[int]:
    """Readings of a register, one per SAMPLE_S."""
    found: list[int] = []
    for _ in range(round(seconds / SAMPLE_S)):
        desk.wait(SAMPLE_S)
        reading = desk.read(name)
        assert reading is not None
        found.append(reading)
    return found
