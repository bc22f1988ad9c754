"""Section 4.15: smoothing slows steps of the command and leaves their ends."""

import pytest

from unit.sim.desk import FREE, QUIET, Desk
from unit.sim.response import step, watch


@pytest.mark.states("B69")
@pytest.mark.parametrize(
    ("rom", "name", "reading", "raw"),
    [(QUIET, "0x00", "0x09", 200), (FREE, "0x01", "0x09", 100), (FREE, "0x02", "0x0A", 40)],
)
def test_smoothing_slows_a_step(rom: dict[str, int], name: str, reading: str, raw: int) -> None:
    def soon_after(smoothing: int) -> int:
        desk = Desk(rom=rom | {"smoothing": smoothing})
        desk.write(name, raw)
        return watch(desk, reading, 0.01)[-1]

    assert soon_after(1) < soon_after(0)


@pytest.mark.states("B69")
@pytest.mark.parametrize("cascade", [0, 1])
def test_with_smoothing_the_same_angle_is_reached_later(cascade: int) -> None:
    smooth, direct = (step(Desk(rom=QUIET | {"smoothing": each, "speed_torque_control": cascade})) for each in (1, 0))
    assert smooth.first(0.9) > direct.first(0.9)
    assert max(smooth.left, direct.left) <= 3


@pytest.mark.states("B69")
def test_a_command_that_alternates_is_followed_less() -> None:
    def travel(smoothing: int) -> int:
        desk = Desk(rom=QUIET | {"smoothing": smoothing})
        readings: list[int] = []
        for turn in range(40):
            desk.write("0x00", 100 if turn % 2 else -100)
            readings += watch(desk, "0x08", 0.03)
        return max(readings) - min(readings)

    assert travel(1) < 0.7 * travel(0)
