"""Section 4.13: torque on, off and brake, and what remains of a command when torque is on again."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FREE, Desk

ON, OFF, BRAKE = 0, 1, 2
without_output = pytest.mark.parametrize("mode", [OFF, BRAKE])


@pytest.mark.states("B61")
def test_0_is_on_1_off_and_2_brake() -> None:
    desk = Desk(rom=FREE)
    for mode in (OFF, BRAKE, ON):
        assert desk.write("0x20", mode) == mode
        assert desk.servo.output == mode
    assert desk.write("0x20", 3) is None
    assert not desk.turn(90.0), "the motor holds the horn"
    assert desk.read("0x08") == 0


@pytest.mark.states("B61")
@without_output
@pytest.mark.parametrize(("name", "raw"), [("0x00", 900), ("0x01", 60), ("0x02", 30)])
def test_with_torque_off_or_brake_no_command_moves_the_horn(name: str, raw: int, mode: int) -> None:
    desk = Desk(rom=FREE)
    desk.write("0x20", mode)
    assert desk.write(name, raw) == raw
    desk.wait(1.0)
    assert desk.reads("0x08", "0x0A") == [0, 0]


@pytest.mark.states("B62")
def test_example_1_the_angle_at_torque_on_is_held() -> None:
    desk = Desk(rom=FREE)
    desk.run("0x00", 1_500, 0.1)
    desk.run("0x20", OFF, 1.0)
    there = desk.value("0x08")
    assert 50 < there < 1_400
    desk.run("0x20", ON, 1.0)
    assert desk.read("0x08") == pytest.approx(there, abs=3)
    assert desk.read("0x00") == there


@pytest.mark.states("B62")
@without_output
def test_example_2_the_horn_is_turned_manually_meanwhile(mode: int) -> None:
    desk = Desk(rom=FREE)
    desk.go(450)
    desk.write("0x20", mode)
    assert desk.turn(0.0)
    assert desk.read("0x08") == 0
    desk.run("0x20", ON, 1.0)
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B63")
@pytest.mark.parametrize(("name", "raw"), [("0x01", -50), ("0x02", -30)])
def test_example_3_the_last_kind_of_command_decides(name: str, raw: int) -> None:
    desk = Desk(rom=FREE)
    desk.go(450)
    desk.write("0x20", OFF)
    desk.run(name, raw, 0.5)
    assert desk.reads(name, "0x09") == [raw, 0]
    desk.run("0x20", ON, 0.5)
    assert desk.reads(name, "0x00", "0x09") == [0, DUMMY, 0]


@pytest.mark.states("B63")
def test_an_angle_commanded_after_a_speed_is_off_is_held_as_angle() -> None:
    desk = Desk(rom=FREE)
    desk.run("0x01", 50, 0.3)
    desk.run("0x20", OFF, 1.0)
    there = desk.value("0x08")
    desk.write("0x00", 900)
    desk.write("0x20", ON)
    assert desk.read("0x00") == there
    desk.wait(0.5)
    assert desk.read("0x08") == pytest.approx(there, abs=3)


@pytest.mark.states("B62")
@without_output
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_a_speed_or_torque_remains_while_off_or_braked_and_is_0_with_torque_on(name: str, mode: int) -> None:
    desk = Desk(rom=FREE)
    desk.run(name, 40, 0.5)
    for each in (mode, OFF, BRAKE, mode):
        desk.write("0x20", each)
        assert desk.read(name) == 40
    desk.wait(3.0)
    desk.run("0x20", ON, 0.5)
    assert (desk.reads(name, "0x09"), desk.servo.output) == ([0, 0], ON)


@pytest.mark.states("B61")
def test_brake_stops_faster_than_off_and_more_slowly_than_speed_0() -> None:
    def run_out(name: str, raw: int) -> float:
        desk = Desk(rom=FREE | {"smoothing": 0})
        desk.run("0x01", 120, 1.0)
        before = desk.servo.angle_deg
        desk.run(name, raw, 3.0)
        return desk.servo.angle_deg - before

    assert run_out("0x01", 0) < run_out("0x20", BRAKE) < run_out("0x20", OFF)


@pytest.mark.states("B62")
def test_on_written_while_on_has_no_effect() -> None:
    desk = Desk(rom=FREE)
    desk.run("0x00", 450, 0.05)
    desk.write("0x20", ON)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(450, abs=3)


@pytest.mark.states("B64")
@without_output
def test_a_saved_mode_applies_from_the_next_start_on_without_soft_start_and_an_unsaved_one_does_not(mode: int) -> None:
    desk = Desk(rom=FREE | {"soft_start": 1}, angle_deg=170.0)
    desk.write("0x20", mode)
    desk.power_cycle()
    assert (desk.read("0x20"), desk.servo.output) == (ON, ON)
    desk.write("0x20", mode)
    desk.save()
    there = desk.value("0x08")
    desk.power_cycle()
    desk.wait(2.0)
    assert (desk.reads("0x20", "0x08"), desk.servo.output, desk.servo.soft_starting) == ([mode, there], mode, False)
    desk.run("0x20", ON, 1.0)
    assert desk.read("0x08") == pytest.approx(there, abs=3)
    assert there > 300
