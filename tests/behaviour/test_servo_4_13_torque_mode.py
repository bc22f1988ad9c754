"""Section 4.13: torque on, off and brake, and what is left of a command when torque comes back."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import Desk

FREE = {"speed_torque_control": 1, "timeout_action": 0, "soft_start": 0}
ON, OFF, BRAKE = 0, 1, 2


def test_0_is_on_1_off_and_2_brake() -> None:
    desk = Desk(rom=FREE)
    for mode in (OFF, BRAKE, ON):
        assert desk.write("0x20", mode) == mode
        assert desk.servo.output == mode
    assert desk.write("0x20", 3) is None


def test_example_1_holds_the_angle_it_had_when_torque_came_back() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 1_500)
    desk.wait(0.1)
    desk.write("0x20", OFF)
    desk.wait(1.0)
    there = desk.read("0x08") or 0
    assert 50 < there < 1_400
    desk.write("0x20", ON)
    desk.wait(1.0)
    assert desk.read("0x08") == pytest.approx(there, abs=3)
    assert desk.read("0x00") == there


@pytest.mark.parametrize("mode", [OFF, BRAKE])
def test_example_2_a_hand_turns_it_meanwhile(mode: int) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 450)
    desk.settle()
    desk.write("0x20", mode)
    assert desk.servo.turn_by_hand(0.0, desk.now)
    assert desk.read("0x08") == 0
    desk.write("0x20", ON)
    desk.wait(1.0)
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.parametrize(("name", "raw"), [("0x01", -50), ("0x02", -30)])
def test_example_3_the_last_kind_of_command_decides(name: str, raw: int) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 450)
    desk.settle()
    desk.write("0x20", OFF)
    desk.write(name, raw)
    desk.wait(0.5)
    assert desk.read(name) == raw
    assert desk.read("0x09") == 0
    desk.write("0x20", ON)
    desk.wait(0.5)
    assert desk.read(name) == 0
    assert desk.read("0x00") == DUMMY
    assert desk.read("0x09") == 0


def test_a_hand_does_not_turn_it_while_torque_is_on() -> None:
    desk = Desk(rom=FREE)
    assert not desk.servo.turn_by_hand(90.0, desk.now)
    assert desk.read("0x08") == 0


def test_the_brake_slows_more_than_nothing_and_less_than_speed_0() -> None:
    def run_out(name: str, raw: int) -> float:
        desk = Desk(rom=FREE | {"smoothing": 0})
        desk.write("0x01", 120)
        desk.wait(1.0)
        before = desk.servo.angle_deg
        desk.write(name, raw)
        desk.wait(3.0)
        return desk.servo.angle_deg - before

    assert run_out("0x01", 0) < run_out("0x20", BRAKE) < run_out("0x20", OFF)


def test_on_written_while_it_is_on_changes_nothing() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 450)
    desk.wait(0.05)
    desk.write("0x20", ON)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(450, abs=3)


def test_a_saved_off_is_how_it_starts() -> None:
    desk = Desk(rom=FREE | {"torque_mode": OFF, "soft_start": 1}, angle_deg=60.0)
    desk.wait(2.0)
    assert desk.servo.output == OFF
    assert desk.read("0x08") == 600
    assert not desk.servo.soft_starting
    desk.write("0x20", ON)
    desk.wait(1.0)
    assert desk.read("0x08") == pytest.approx(600, abs=3)


def test_outside_the_angle_limits_torque_on_holds_there() -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300})
    desk.write("0x20", OFF)
    desk.servo.turn_by_hand(60.0, desk.now)
    desk.write("0x20", ON)
    desk.wait(1.0)
    assert desk.read("0x08") == pytest.approx(600, abs=3)
    desk.write("0x00", 900)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(300, abs=3)
