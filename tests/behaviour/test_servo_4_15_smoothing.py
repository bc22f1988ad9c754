"""Section 4.15: smoothing levels out steps of the command, and leaves where they lead."""

import pytest

from unit.sim.desk import FREE, QUIET, Desk
from unit.sim.response import step, watch


@pytest.mark.states("B69")
def test_smoothing_levels_a_step() -> None:
    def speed_soon_after(smoothing: int) -> int:
        desk = Desk(rom=QUIET | {"smoothing": smoothing})
        desk.write("0x00", 200)
        desk.wait(0.01)
        return desk.read("0x09") or 0

    assert speed_soon_after(1) < speed_soon_after(0)


@pytest.mark.states("B69")
@pytest.mark.parametrize("cascade", [0, 1])
def test_both_settings_end_where_the_command_says_the_smoothed_one_later(cascade: int) -> None:
    def answer(smoothing: int) -> tuple[float, int]:
        response = step(Desk(rom=QUIET | {"smoothing": smoothing, "speed_torque_control": cascade}))
        return response.first(0.9), response.left

    smooth, direct = answer(1), answer(0)
    assert smooth[0] > direct[0]
    assert smooth[1] <= 3
    assert direct[1] <= 3


@pytest.mark.states("B69")
@pytest.mark.parametrize(("name", "reading", "raw"), [("0x01", "0x09", 100), ("0x02", "0x0A", 40)])
def test_steps_of_speed_and_torque_are_levelled_too(name: str, reading: str, raw: int) -> None:
    def soon_after(smoothing: int) -> int:
        desk = Desk(rom=FREE | {"smoothing": smoothing})
        desk.write(name, raw)
        return watch(desk, reading, 0.01)[-1]

    assert soon_after(1) < soon_after(0)


@pytest.mark.states("B69")
def test_a_command_that_jumps_to_and_fro_is_followed_less() -> None:
    def stirred(smoothing: int) -> int:
        desk = Desk(rom=QUIET | {"smoothing": smoothing})
        readings: list[int] = []
        for turn in range(40):
            desk.write("0x00", 100 if turn % 2 else -100)
            readings += watch(desk, "0x08", 0.03)
        return max(readings) - min(readings)

    assert stirred(1) < 0.7 * stirred(0)
