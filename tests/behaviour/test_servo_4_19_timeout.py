"""Section 4.19: what happens when commands stop coming, and when they come again."""

import pytest

from hornbill.sim.behaviour import Behaviour
from hornbill.wire.messages import CommandType
from unit.sim.desk import Desk

BASE = {"speed_torque_control": 1, "soft_start": 0}
HOLD, OFF, BRAKE = 0, 1, 2


def desk_with(**rom: int) -> Desk:
    return Desk(rom=BASE | rom)


@pytest.mark.states("B72")
def test_as_delivered_the_output_goes_off_after_a_second() -> None:
    desk = Desk()
    desk.write("0x00", 100)
    desk.wait(0.999)
    assert desk.servo.output == 0
    desk.wait(0.002)
    assert desk.servo.output == OFF


@pytest.mark.states("B72", "B74")
@pytest.mark.parametrize(("action", "output"), [(HOLD, 0), (OFF, 1), (BRAKE, 2)])
def test_after_0x27_without_a_command_0x26_decides_the_output(action: int, output: int) -> None:
    desk = desk_with(timeout_action=action)
    desk.write("0x00", 100)
    desk.wait(0.999)
    assert desk.servo.output == 0
    desk.wait(0.002)
    assert desk.servo.output == output


@pytest.mark.states("B74")
def test_hold_keeps_a_speed_turning() -> None:
    desk = desk_with(timeout_action=HOLD)
    desk.write("0x01", 40)
    desk.wait(10.0)
    assert desk.read("0x09") == pytest.approx(40, abs=1)


@pytest.mark.states("B74")
def test_hold_keeps_a_torque_and_an_angle_too() -> None:
    desk = desk_with(timeout_action=HOLD).under(load_pct=-30.0)
    desk.write("0x02", 30)
    desk.wait(10.0)
    assert desk.read("0x0A") == 30
    desk.write("0x00", 300)
    desk.wait(10.0)
    assert desk.read("0x08") == pytest.approx(300, abs=5)


@pytest.mark.states("B72")
def test_off_lets_a_load_turn_the_horn_and_brake_does_so_more_slowly() -> None:
    def turned(action: int) -> float:
        desk = desk_with(timeout_action=action).under(load_pct=20.0)
        desk.write("0x00", 0)
        desk.wait(3.0)
        return desk.servo.angle_deg

    assert turned(HOLD) < 1 < turned(BRAKE) < turned(OFF)


@pytest.mark.states("B72")
@pytest.mark.parametrize("ms", [1, 250, 60_000])
def test_0x27_is_the_time(ms: int) -> None:
    desk = desk_with(timeout_time=ms)
    desk.write("0x00", 100)
    desk.wait(ms / 1000 - 0.0005)
    assert desk.servo.output == 0
    desk.wait(0.001)
    assert desk.servo.output == 1


@pytest.mark.states("B72")
@pytest.mark.parametrize(("name", "raw"), [("0x00", 100), ("0x01", 20), ("0x02", 10), ("0x20", 0)])
def test_these_four_count_as_commands(name: str, raw: int) -> None:
    desk = desk_with()
    for _ in range(5):
        desk.write(name, raw)
        desk.wait(0.9)
        assert desk.servo.output == 0


@pytest.mark.states("B72")
def test_reading_and_configuring_do_not() -> None:
    desk = desk_with()
    desk.write("0x00", 100)
    for _ in range(12):
        desk.read("0x00")
        desk.write("0x3E", 70)
        desk.node_info()
        desk.wait(0.1)
    assert desk.servo.output == 1


@pytest.mark.states("B72")
@pytest.mark.switch("array_command_feeds_timeout")
def test_array_command_does_unless_a_switch_says_otherwise() -> None:
    for counts, output in ((True, 0), (False, 1)):
        desk = Desk(rom=BASE, behaviour=Behaviour(array_command_feeds_timeout=counts))
        desk.write("0x00", 100)
        for _ in range(3):
            desk.wait(0.5)
            desk.array(7, CommandType.POSITION, 0.125)
        assert desk.servo.output == output


@pytest.mark.states("B72")
def test_an_array_command_for_others_does_not() -> None:
    desk = desk_with()
    desk.write("0x00", 100)
    for _ in range(3):
        desk.wait(0.5)
        desk.array(8, CommandType.POSITION, 0.125)
    assert desk.servo.output == 1


@pytest.mark.states("B73")
def test_the_next_command_restores_output_and_state() -> None:
    desk = desk_with()
    desk.write("0x00", 450)
    desk.settle()
    desk.wait(1.5)
    assert desk.servo.output == 1
    assert desk.servo.turn_manually(0.0, desk.now)
    assert desk.read("0x00") == 450
    desk.write("0x20", 0)
    assert desk.servo.output == 0
    desk.wait(0.9)
    assert desk.read("0x08") == pytest.approx(450, abs=3)


@pytest.mark.states("B73")
@pytest.mark.parametrize("action", [OFF, BRAKE])
def test_a_speed_goes_on_with_the_next_command(action: int) -> None:
    desk = desk_with(timeout_action=action)
    desk.write("0x01", 40)
    desk.wait(4.0)
    assert (desk.read("0x01"), desk.read("0x09")) == (40, 0)
    desk.write("0x20", 0)
    desk.wait(0.5)
    assert desk.read("0x09") == pytest.approx(40, abs=1)


@pytest.mark.states("B73")
def test_a_new_command_after_it_is_obeyed_at_once() -> None:
    desk = desk_with()
    desk.write("0x00", 450)
    desk.wait(2.0)
    desk.write("0x00", -450)
    assert desk.servo.output == 0
    desk.wait(0.9)
    assert desk.read("0x08") == pytest.approx(-450, abs=3)


@pytest.mark.states("B72")
@pytest.mark.switch("timeout_from")
@pytest.mark.parametrize(("begins", "output"), [("first_command", 0), ("power_on", OFF)])
def test_time_runs_from_the_first_command_or_from_power_on_by_a_switch(begins: str, output: int) -> None:
    desk = Desk(rom=BASE, behaviour=Behaviour(timeout_from=begins))  # pyright: ignore[reportArgumentType]
    desk.wait(30.0)
    assert desk.servo.output == output


@pytest.mark.states("B72", "B61")
@pytest.mark.switch("timeout_changes")
@pytest.mark.parametrize(("mode", "action"), [(OFF, BRAKE), (BRAKE, OFF), (OFF, HOLD), (BRAKE, HOLD)])
@pytest.mark.parametrize("changes", ["output_on", "any_output"])
def test_off_and_brake_outlast_the_time_out_or_yield_to_its_action(changes: str, mode: int, action: int) -> None:
    behaviour = Behaviour(timeout_changes=changes)  # pyright: ignore[reportArgumentType]
    desk = Desk(rom=BASE | {"timeout_action": action}, behaviour=behaviour)
    desk.write("0x20", mode)
    desk.wait(0.99)
    assert desk.servo.output == mode
    desk.wait(1.0)
    assert desk.servo.output == (action if changes == "any_output" and action != HOLD else mode)
    desk.write("0x00", 450)
    assert desk.servo.output == mode, "the next command restores the state before"
