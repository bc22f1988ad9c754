"""Section 4.18: 0x25 puts angle, speed and torque into a row, or leaves the angle alone on the motor."""

from itertools import pairwise

import pytest

from hornbill.schema.parameter import DUMMY
from hornbill.sim.behaviour import Behaviour
from unit.sim.desk import FREE, Desk
from unit.sim.response import step, watch


def commands(desk: Desk) -> tuple[int | None, ...]:
    return tuple(desk.read(name) for name in ("0x00", "0x01", "0x02"))


@pytest.mark.states("B36", "B38", "B76")
def test_speed_and_torque_are_ignored_while_0x25_is_off() -> None:
    desk = Desk(rom={"timeout_action": 0})
    desk.write("0x00", 100)
    for name in ("0x01", "0x02"):
        assert desk.write(name, 50) == DUMMY
    assert commands(desk) == (100, DUMMY, DUMMY)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(100, abs=3)


@pytest.mark.states("B36", "B38")
@pytest.mark.parametrize(("name", "reading", "raw"), [("0x01", "0x09", 60), ("0x02", "0x0A", 30)])
def test_they_are_obeyed_once_it_is_on(name: str, reading: str, raw: int) -> None:
    desk = Desk(rom={"timeout_action": 0, "soft_start": 0}).under(load_pct=-raw if name == "0x02" else 0.0)
    desk.write("0x25", 1)
    assert desk.write(name, raw) == raw
    desk.wait(1.0)
    assert desk.read(reading) == pytest.approx(raw, abs=1)


@pytest.mark.states("B76")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_switched_off_under_a_running_speed_or_torque_it_brakes(name: str) -> None:
    desk = Desk(rom=FREE)
    desk.write(name, 40)
    desk.wait(0.5)
    desk.write("0x25", 0)
    desk.wait(0.5)
    assert desk.read("0x09") == 0


@pytest.mark.states("B75")
@pytest.mark.switch("cascade_without_switch")
@pytest.mark.parametrize("always_on", [False, True])
def test_a_firmware_without_0x25_has_it_always_off_or_always_on_by_a_switch(always_on: bool) -> None:
    rom = {"timeout_action": 0, "soft_start": 0}
    desk = Desk(firmware="1.010", rom=rom, behaviour=Behaviour(cascade_without_switch=always_on))
    assert desk.read("0x25") == 0
    desk.write("0x01", 50)
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(50 if always_on else 0, abs=1)


@pytest.mark.states("B76")
def test_the_speed_of_an_angle_is_controlled_with_it_and_free_without() -> None:
    def fastest(cascade: int) -> int:
        desk = Desk(rom=FREE | {"speed_torque_control": cascade, "speed_limit_cw": 30})
        desk.write("0x00", 1_700)
        return max(watch(desk, "0x09", 0.5))

    assert fastest(1) == pytest.approx(30, abs=2)
    assert fastest(0) > 120


@pytest.mark.states("B76")
def test_the_torque_of_an_angle_is_controlled_with_it_and_free_without() -> None:
    def strongest(cascade: int) -> int:
        desk = Desk(rom=FREE | {"speed_torque_control": cascade, "torque_limit_cw": 20})
        desk.write("0x00", 1_700)
        return max(watch(desk, "0x0A", 0.5))

    assert strongest(1) <= 21
    assert strongest(0) > 50


@pytest.mark.states("B76")
def test_without_it_the_motion_is_smoother() -> None:
    # A target that goes on in small steps, as a stick or a gimbal gives it.
    def roughness(cascade: int) -> float:
        desk = Desk(rom=FREE | {"speed_torque_control": cascade})
        torques: list[int] = []
        for turn in range(60):
            desk.write("0x00", 5 * turn)
            torques += watch(desk, "0x0A", 0.04)
        return sum(abs(later - earlier) for earlier, later in pairwise(torques))

    assert roughness(0) < roughness(1)


@pytest.mark.states("B76", "B79")
def test_the_speed_loop_acts_on_angles_with_it_and_not_without() -> None:
    def answer(cascade: int, speed_p_gain: int) -> list[int]:
        rom = FREE | {"speed_torque_control": cascade, "speed_p_gain": speed_p_gain}
        return step(Desk(rom=rom), seconds=0.5).readings

    assert answer(0, 5) == answer(0, 100)
    assert answer(1, 5) != answer(1, 100)
