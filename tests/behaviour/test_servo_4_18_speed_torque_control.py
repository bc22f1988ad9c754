"""Section 4.18: 0x25 puts angle, speed and torque control in series, or controls the angle alone."""

from itertools import pairwise

import pytest

from behaviour.servo_story import follow, near, under
from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FREE, QUIET, Desk
from unit.sim.response import step, watch


@pytest.mark.states("B36", "B38", "B76")
def test_speed_and_torque_are_ignored_while_0x25_is_off() -> None:
    desk = Desk(rom={"timeout_action": 0})
    desk.write("0x00", 100)
    assert [desk.write(name, 50) for name in ("0x01", "0x02")] == [DUMMY, DUMMY]
    follow(desk, {"0x00": 100, "0x01": DUMMY, "0x02": DUMMY}, Desk.settle, {"0x08": near(100)})


@pytest.mark.states("B36", "B38", "B76")
@pytest.mark.parametrize(("name", "reading", "raw"), [("0x01", "0x09", 60), ("0x02", "0x0A", 30)])
def test_switched_on_it_obeys_them_and_switched_off_it_brakes(name: str, reading: str, raw: int) -> None:
    desk = Desk(rom=QUIET).under(load_pct=-raw if name == "0x02" else 0.0)
    follow(desk, ("0x25", 1, 0), (name, raw, 1.0), {reading: near(raw, 1)})
    follow(desk, under(load_pct=0.0), ("0x25", 0, 0.5), {"0x09": 0})


@pytest.mark.states("B76")
@pytest.mark.parametrize(
    ("limit", "reading", "with_it", "without"),
    [({"speed_limit_cw": 30}, "0x09", (28, 32), 120), ({"torque_limit_cw": 20}, "0x0A", (0, 21), 50)],
)
def test_speed_and_torque_of_an_angle_are_limited_with_it_only(
    limit: dict[str, int], reading: str, with_it: tuple[int, int], without: int
) -> None:
    def greatest(cascade: int) -> int:
        desk = Desk(rom=FREE | limit | {"speed_torque_control": cascade})
        desk.write("0x00", 1_700)
        return max(watch(desk, reading, 0.5))

    assert with_it[0] <= greatest(1) <= with_it[1]
    assert greatest(0) > without


@pytest.mark.states("B76")
def test_without_it_the_motion_is_smoother() -> None:
    # The target advances in small steps, as from a stick or a gimbal.
    def roughness(cascade: int) -> float:
        desk = Desk(rom=FREE | {"speed_torque_control": cascade})
        torques: list[int] = []
        for turn in range(60):
            desk.write("0x00", 5 * turn)
            torques += watch(desk, "0x0A", 0.04)
        return sum(abs(later - earlier) for earlier, later in pairwise(torques))

    assert roughness(0) < roughness(1)


@pytest.mark.states("B76", "B79")
def test_the_speed_loop_acts_on_angles_with_it_only() -> None:
    def response(cascade: int, speed_p_gain: int) -> list[int]:
        rom = FREE | {"speed_torque_control": cascade, "speed_p_gain": speed_p_gain}
        return step(Desk(rom=rom), seconds=0.5).readings

    assert response(0, 5) == response(0, 100)
    assert response(1, 5) != response(1, 100)
