"""Section 4.19: what happens when no command arrives in time, and with the next one."""

from collections.abc import Callable

import pytest

from behaviour.servo_story import Rom, Steps, follow, go, near, stories, turned, under
from hornbill.sim.behaviour import Behaviour
from hornbill.wire.messages import CommandType
from unit.sim.desk import Desk

BASE = {"speed_torque_control": 1, "soft_start": 0}
ON = 0
HOLD, OFF, BRAKE = 0, 1, 2


@pytest.mark.states("B72", "B74")
@pytest.mark.parametrize(
    ("rom", "seconds", "output"),
    [
        ({}, 1.0, OFF), *(({"timeout_action": action}, 1.0, action) for action in (HOLD, OFF, BRAKE)),
        *(({"timeout_time": ms}, ms / 1000, OFF) for ms in (1, 250, 60_000)),
    ],
)  # fmt: skip
def test_after_0x27_without_a_command_0x26_sets_the_output(rom: dict[str, int], seconds: float, output: int) -> None:
    follow(Desk(rom=BASE | rom), ("0x00", 100, seconds - 0.0005), {"output": ON}, 0.001, {"output": output})


@pytest.mark.states("B72")
def test_with_off_a_load_turns_the_horn_and_with_brake_more_slowly() -> None:
    def turned_by_it(action: int) -> float:
        desk = Desk(rom=BASE | {"timeout_action": action}).under(load_pct=20.0)
        desk.run("0x00", 0, 3.0)
        return desk.servo.angle_deg

    assert turned_by_it(HOLD) < 1 < turned_by_it(BRAKE) < turned_by_it(OFF)


NO_COMMANDS: dict[str, Callable[[Desk], object]] = {
    "reading": lambda desk: desk.read("0x00"),
    "configuring": lambda desk: desk.write("0x3E", 70),
    "node info": Desk.node_info,
    "an ArrayCommand for another servo": lambda desk: desk.array(8, CommandType.POSITION, 0.125),
}


@pytest.mark.states("B72", "B73", "B74")
@stories({
    **{f"B74: hold continues every command, {name}": ({"timeout_action": HOLD}, [
        under(load_pct=load_pct), (name, raw, 10.0), {reading: near(raw, 3 if name == "0x00" else 1)},
    ]) for name, reading, raw, load_pct in (
        ("0x00", "0x08", 300, 0), ("0x01", "0x09", 40, 0), ("0x02", "0x0A", 30, -30),
    )},
    **{f"B72: {name} counts as a command": ({}, [(name, raw, 0.9), {"output": ON}] * 5)
       for name, raw in (("0x00", 100), ("0x01", 20), ("0x02", 10), ("0x20", 0))},
    **{f"B72: {kind} does not count as a command": ({}, [("0x00", 100, 0), *([act, 0.1] * 12), {"output": OFF}])
       for kind, act in NO_COMMANDS.items()},
    "B73: the next command restores output and angle": ({}, [
        go(450), 1.5, {"output": OFF}, turned(0.0), {"0x00": 450}, ("0x20", 0, 0), {"output": ON}, 0.9,
        {"0x08": near(450)},
    ]),
    **{f"B73: a speed continues with the next command, after {action}": ({"timeout_action": action}, [
        ("0x01", 40, 4.0), {"0x01": 40, "0x09": 0}, ("0x20", 0, 0.5), {"0x09": near(40, 1)},
    ]) for action in (OFF, BRAKE)},
    "B73: a new command is executed immediately": ({}, [
        ("0x00", 450, 2.0), ("0x00", -450, 0), {"output": ON}, 0.9, {"0x08": near(-450)},
    ]),
})  # fmt: skip
def test_timeout(rom: Rom, steps: Steps) -> None:
    follow(Desk(rom=BASE | rom), *steps)


@pytest.mark.states("B72", "B61")
@pytest.mark.switch("timeout_changes")
@pytest.mark.parametrize(("mode", "action"), [(OFF, BRAKE), (BRAKE, OFF), (OFF, HOLD), (BRAKE, HOLD)])
@pytest.mark.parametrize("changes", ["output_on", "any_output"])
def test_the_timeout_leaves_off_and_brake_or_applies_its_action(changes: str, mode: int, action: int) -> None:
    behaviour = Behaviour(timeout_changes=changes)  # pyright: ignore[reportArgumentType]
    desk = Desk(rom=BASE | {"timeout_action": action}, behaviour=behaviour)
    expired = action if changes == "any_output" and action != HOLD else mode
    follow(desk, ("0x20", mode, 0.99), {"output": mode}, 1.0, {"output": expired})
    follow(desk, ("0x00", 450, 0), {"output": mode})  # the next command restores the state before
