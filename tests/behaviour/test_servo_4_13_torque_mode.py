"""Section 4.13: torque on, off and brake, and what is left of a command when torque comes back."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FREE, Desk

ON, OFF, BRAKE = 0, 1, 2


@pytest.mark.states("B61")
def test_0_is_on_1_off_and_2_brake() -> None:
    desk = Desk(rom=FREE)
    for mode in (OFF, BRAKE, ON):
        assert desk.write("0x20", mode) == mode
        assert desk.servo.output == mode
    assert desk.write("0x20", 3) is None


@pytest.mark.states("B61")
@pytest.mark.parametrize("mode", [OFF, BRAKE])
@pytest.mark.parametrize(("name", "raw"), [("0x00", 900), ("0x01", 60), ("0x02", 30)])
def test_off_and_brake_move_nothing_whatever_is_commanded(name: str, raw: int, mode: int) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x20", mode)
    assert desk.write(name, raw) == raw
    desk.wait(1.0)
    assert (desk.read("0x08"), desk.read("0x0A")) == (0, 0)


@pytest.mark.states("B62")
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


@pytest.mark.states("B62")
@pytest.mark.parametrize("mode", [OFF, BRAKE])
def test_example_2_a_hand_turns_it_meanwhile(mode: int) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 450)
    desk.settle()
    desk.write("0x20", mode)
    assert desk.servo.turn_manually(0.0, desk.now)
    assert desk.read("0x08") == 0
    desk.write("0x20", ON)
    desk.wait(1.0)
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B63")
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


@pytest.mark.states("B63")
def test_an_angle_entered_while_a_speed_is_off_is_held_as_angle_when_torque_comes_back() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 50)
    desk.wait(0.3)
    desk.write("0x20", OFF)
    desk.wait(1.0)
    there = desk.read("0x08") or 0
    desk.write("0x00", 900)
    desk.write("0x20", ON)
    assert desk.read("0x00") == there
    desk.wait(0.5)
    assert desk.read("0x08") == pytest.approx(there, abs=3)


@pytest.mark.states("B62")
@pytest.mark.parametrize("mode", [OFF, BRAKE])
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_a_speed_or_torque_is_0_when_torque_comes_back(name: str, mode: int) -> None:
    desk = Desk(rom=FREE)
    desk.write(name, 40)
    desk.wait(0.5)
    desk.write("0x20", mode)
    desk.wait(3.0)
    desk.write("0x20", ON)
    desk.wait(0.5)
    assert (desk.read(name), desk.read("0x09"), desk.servo.output) == (0, 0, ON)


@pytest.mark.states("B62")
def test_between_off_and_brake_nothing_is_dropped() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 40)
    for mode in (OFF, BRAKE, OFF):
        desk.write("0x20", mode)
        assert desk.read("0x01") == 40


@pytest.mark.states("B61")
def test_a_hand_does_not_turn_it_while_torque_is_on() -> None:
    desk = Desk(rom=FREE)
    assert not desk.servo.turn_manually(90.0, desk.now)
    assert desk.read("0x08") == 0


@pytest.mark.states("B61")
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


@pytest.mark.states("B62")
def test_on_written_while_it_is_on_changes_nothing() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 450)
    desk.wait(0.05)
    desk.write("0x20", ON)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(450, abs=3)


@pytest.mark.states("B64")
def test_a_saved_off_is_how_it_starts() -> None:
    desk = Desk(rom=FREE | {"torque_mode": OFF, "soft_start": 1}, angle_deg=60.0)
    desk.wait(2.0)
    assert desk.servo.output == OFF
    assert desk.read("0x08") == 600
    assert not desk.servo.soft_starting
    desk.write("0x20", ON)
    desk.wait(1.0)
    assert desk.read("0x08") == pytest.approx(600, abs=3)


@pytest.mark.states("B64")
@pytest.mark.parametrize("mode", [OFF, BRAKE])
def test_saved_by_0x12_it_holds_from_the_next_start_on(mode: int) -> None:
    desk = Desk()
    desk.write("0x20", mode)
    desk.write("0x12", 1)
    desk.wait(0.3)
    assert (desk.read("0x20"), desk.servo.output) == (mode, mode)
    desk.power_cycle()
    assert (desk.read("0x20"), desk.servo.output) == (mode, mode)


@pytest.mark.states("B64")
def test_unsaved_it_is_forgotten() -> None:
    desk = Desk()
    desk.write("0x20", OFF)
    desk.power_cycle()
    assert (desk.read("0x20"), desk.servo.output) == (ON, ON)


@pytest.mark.states("B65")
@pytest.mark.parametrize("condition", [{"voltage_v": 3.5}, {"voltage_v": 11.0}, {"temperature_c": 85.0}])
def test_protection_comes_first_and_its_cause_has_to_go(condition: dict[str, float]) -> None:
    desk = Desk(rom=FREE).under(**condition)
    for mode in (OFF, ON):
        assert desk.write("0x20", mode) == mode
        assert desk.servo.output == OFF
    desk.under(voltage_v=7.4, temperature_c=25.0)
    assert desk.servo.output == ON


@pytest.mark.states("B89")
def test_outside_the_angle_limits_torque_on_holds_there() -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300})
    desk.write("0x20", OFF)
    desk.servo.turn_manually(60.0, desk.now)
    desk.write("0x20", ON)
    desk.wait(1.0)
    assert desk.read("0x08") == pytest.approx(600, abs=3)
    desk.write("0x00", 900)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(300, abs=3)
