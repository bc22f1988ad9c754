"""Section 4.19: what happens when no command arrives in time, and with the next one."""

from collections.abc import Callable

import pytest

from hornbill.sim.behaviour import Behaviour
from hornbill.wire.messages import CommandType
from unit.sim.desk import Desk

BASE = {"speed_torque_control": 1, "soft_start": 0}
HOLD, OFF, BRAKE = 0, 1, 2


def desk_with(**rom: int) -> Desk:
    return Desk(rom=BASE | rom)


@pytest.mark.states("B72", "B74")
@pytest.mark.parametrize(
    ("rom", "seconds", "output"),
    [
        ({}, 1.0, OFF),
        ({"timeout_action": HOLD}, 1.0, HOLD),
        ({"timeout_action": OFF}, 1.0, OFF),
        ({"timeout_action": BRAKE}, 1.0, BRAKE),
        ({"timeout_time": 1}, 0.001, OFF),
        ({"timeout_time": 250}, 0.25, OFF),
        ({"timeout_time": 60_000}, 60.0, OFF),
    ],
)
def test_after_0x27_without_a_command_0x26_sets_the_output(rom: dict[str, int], seconds: float, output: int) -> None:
    desk = desk_with(**rom)
    desk.run("0x00", 100, seconds - 0.0005)
    assert desk.servo.output == 0
    desk.wait(0.001)
    assert desk.servo.output == output


@pytest.mark.states("B74")
@pytest.mark.parametrize(
    ("name", "reading", "raw", "load_pct"),
    [("0x00", "0x08", 300, 0), ("0x01", "0x09", 40, 0), ("0x02", "0x0A", 30, -30)],
)
def test_hold_continues_every_command(name: str, reading: str, raw: int, load_pct: float) -> None:
    desk = desk_with(timeout_action=HOLD).under(load_pct=load_pct)
    desk.run(name, raw, 10.0)
    assert desk.read(reading) == pytest.approx(raw, abs=3 if name == "0x00" else 1)


@pytest.mark.states("B72")
def test_with_off_a_load_turns_the_horn_and_with_brake_more_slowly() -> None:
    def turned(action: int) -> float:
        desk = desk_with(timeout_action=action).under(load_pct=20.0)
        desk.run("0x00", 0, 3.0)
        return desk.servo.angle_deg

    assert turned(HOLD) < 1 < turned(BRAKE) < turned(OFF)


@pytest.mark.states("B72")
@pytest.mark.parametrize(("name", "raw"), [("0x00", 100), ("0x01", 20), ("0x02", 10), ("0x20", 0)])
def test_these_four_count_as_commands(name: str, raw: int) -> None:
    desk = desk_with()
    for _ in range(5):
        desk.run(name, raw, 0.9)
        assert desk.servo.output == 0


NO_COMMANDS: dict[str, Callable[[Desk], object]] = {
    "reading": lambda desk: desk.read("0x00"),
    "configuring": lambda desk: desk.write("0x3E", 70),
    "node info": lambda desk: desk.node_info(),
    "an ArrayCommand for another servo": lambda desk: desk.array(8, CommandType.POSITION, 0.125),
}


@pytest.mark.states("B72")
@pytest.mark.parametrize("kind", NO_COMMANDS)
def test_these_do_not_count_as_commands(kind: str) -> None:
    desk = desk_with()
    desk.write("0x00", 100)
    for _ in range(12):
        NO_COMMANDS[kind](desk)
        desk.wait(0.1)
    assert desk.servo.output == 1


@pytest.mark.states("B73")
def test_the_next_command_restores_output_and_angle() -> None:
    desk = desk_with()
    desk.go(450)
    desk.wait(1.5)
    assert desk.servo.output == 1
    assert desk.turn(0.0)
    assert desk.read("0x00") == 450
    desk.write("0x20", 0)
    assert desk.servo.output == 0
    desk.wait(0.9)
    assert desk.read("0x08") == pytest.approx(450, abs=3)


@pytest.mark.states("B73")
@pytest.mark.parametrize("action", [OFF, BRAKE])
def test_a_speed_continues_with_the_next_command(action: int) -> None:
    desk = desk_with(timeout_action=action)
    desk.run("0x01", 40, 4.0)
    assert desk.reads("0x01", "0x09") == [40, 0]
    desk.run("0x20", 0, 0.5)
    assert desk.read("0x09") == pytest.approx(40, abs=1)


@pytest.mark.states("B73")
def test_a_new_command_is_executed_immediately() -> None:
    desk = desk_with()
    desk.run("0x00", 450, 2.0)
    desk.write("0x00", -450)
    assert desk.servo.output == 0
    desk.wait(0.9)
    assert desk.read("0x08") == pytest.approx(-450, abs=3)


@pytest.mark.states("B72", "B61")
@pytest.mark.switch("timeout_changes")
@pytest.mark.parametrize(("mode", "action"), [(OFF, BRAKE), (BRAKE, OFF), (OFF, HOLD), (BRAKE, HOLD)])
@pytest.mark.parametrize("changes", ["output_on", "any_output"])
def test_the_timeout_leaves_off_and_brake_or_applies_its_action(changes: str, mode: int, action: int) -> None:
    behaviour = Behaviour(timeout_changes=changes)  # pyright: ignore[reportArgumentType]
    desk = Desk(rom=BASE | {"timeout_action": action}, behaviour=behaviour)
    desk.run("0x20", mode, 0.99)
    assert desk.servo.output == mode
    desk.wait(1.0)
    assert desk.servo.output == (action if changes == "any_output" and action != HOLD else mode)
    desk.write("0x00", 450)
    assert desk.servo.output == mode, "the next command restores the state before"
