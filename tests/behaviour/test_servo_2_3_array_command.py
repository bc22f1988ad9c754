"""Section 2.3, ArrayCommand (tables 2-20 and 2-21) and servo ID (4.37): who is addressed, and what is commanded."""

from math import inf, nan

import pytest

from behaviour.servo_story import follow, near, under
from hornbill.schema.parameter import DUMMY
from hornbill.sim.behaviour import Behaviour
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType
from unit.sim.desk import FREE, Desk

UNITLESS, POSITION, FORCE, SPEED, PWM = CommandType
COMMANDS = ("0x00", "0x01", "0x02")


def cascaded(**switches: object) -> Desk:
    return Desk(rom={"speed_torque_control": 1}, behaviour=Behaviour(**switches))  # pyright: ignore[reportArgumentType]


@pytest.mark.states("B24", "B25", "B26")
@pytest.mark.parametrize(
    ("kind", "value", "place", "raw"),
    [
        (POSITION, 0.5, 0, 500), (POSITION, -0.9, 0, -900), (UNITLESS, 0.25, 0, 450), (UNITLESS, -1.0, 0, -1800),
        (SPEED, -120.0, 1, -120), (FORCE, 25.0, 2, 25),
    ],
)  # fmt: skip
def test_each_type_is_stored_in_its_register(kind: CommandType, value: float, place: int, raw: int) -> None:
    desk = cascaded()
    desk.array(7, kind, value)
    # float16 holds 0.9 only to about 0.05 % of it.
    assert desk.reads(*COMMANDS) == pytest.approx([raw if at == place else DUMMY for at in range(3)], abs=1)


@pytest.mark.states("B21", "B22", "B95", "B28")
@pytest.mark.parametrize("servo_id", [0, 1, 127, 254])
def test_a_new_servo_id_has_effect_immediately_and_only_it_and_255_reach_the_servo(servo_id: int) -> None:
    desk = Desk(servo_id=7)
    assert desk.write("0x45", servo_id) == servo_id
    assert desk.statuses(desk.wait(0.2))[-1].actuator_id == servo_id
    for other in set(range(255)) - {servo_id}:
        desk.array(other, POSITION, 0.5)
    assert desk.read("0x00") == 0
    for addressed, position in ((servo_id, 0.5), (255, 0.25)):
        desk.array(addressed, POSITION, position)
        assert desk.read("0x00") == 1000 * position


@pytest.mark.states("B95")
def test_a_servo_id_is_lost_at_power_off_unless_saved() -> None:
    desk = Desk(servo_id=7)
    follow(desk, ("0x45", 8, 0), Desk.power_cycle, {"0x45": 7})
    follow(desk, ("0x45", 8, 0), Desk.save, Desk.power_cycle, {"0x45": 8})


@pytest.mark.states("B21", "B95")
@pytest.mark.parametrize(
    ("servo_id", "commands", "expected"),
    [
        (15, [(n, n / 16) for n in range(1, 16)], round(15 / 16 * 1000)),
        (7, [(7, 0.25), (255, 0.5)], 500),
        (9, [(3, 0.1), (9, 0.5)], 500),
    ],
)
def test_of_several_commands_the_last_for_its_id_counts_for_every_servo_of_that_id(
    servo_id: int, commands: list[tuple[int, float]], expected: int
) -> None:
    for node_id in (20, 21):
        desk = Desk(node_id=node_id, servo_id=servo_id)
        desk.send(ArrayCommand([ActuatorCommand(to, POSITION, position) for to, position in commands]))
        assert desk.read("0x00") == expected


@pytest.mark.states("B25", "B26")
@pytest.mark.parametrize(
    ("kind", "value"),
    [
        *((kind, value) for kind in (PWM, 5, 255) for value in (nan, 200.0)),
        (FORCE, 101.0), (SPEED, -301.0), (UNITLESS, 1.5), (POSITION, nan), (SPEED, inf),
    ],
)  # fmt: skip
def test_unlisted_types_and_values_out_of_range_have_no_effect(kind: int, value: float) -> None:
    desk = cascaded()
    desk.array(7, kind, value)
    assert desk.reads(*COMMANDS) == [0, 0, 0]


@pytest.mark.states("B25")
@pytest.mark.parametrize(
    ("kind", "value", "place", "raw"), [(FORCE, 101.0, 2, 100), (SPEED, -301.0, 1, -300), (UNITLESS, 1.5, 0, 1800)]
)
def test_a_switch_clamps_values_out_of_range(kind: CommandType, value: float, place: int, raw: int) -> None:
    desk = cascaded(out_of_range="clamp")
    desk.array(7, kind, value)
    assert desk.reads(*COMMANDS) == [raw if at == place else DUMMY for at in range(3)]


@pytest.mark.states("B36", "B38")
def test_speed_and_torque_are_ignored_while_0x25_is_off() -> None:
    desk = Desk()
    for kind in (SPEED, FORCE):
        desk.array(7, kind, 50.0)
    assert desk.reads(*COMMANDS) == [0, 0, 0]


@pytest.mark.states("B21", "B24")
def test_the_horn_follows_and_force_is_in_percent_and_speed_in_rpm() -> None:
    desk = Desk(rom=FREE)
    desk.array(7, POSITION, 0.45)
    follow(desk, Desk.settle, {"0x08": near(450)})
    desk.array(7, SPEED, 90.0)
    follow(desk, 1.0, {"speed_rpm": near(90, 1)}, under(load_pct=-35.0))
    desk.array(7, FORCE, 35.0)
    follow(desk, 0.3, {"0x0A": 35})


@pytest.mark.states("B25")
@pytest.mark.parametrize(
    ("kind", "value", "name", "raw"),
    [
        (POSITION, 0.1234, "0x00", 123), (POSITION, 0.1236, "0x00", 124), (POSITION, 10.0, "0x00", 10_000),
        (SPEED, 59.6, "0x01", 60), (FORCE, -12.4, "0x02", -12), (UNITLESS, 0.0005, "0x00", 1),
        # float16 holds large angles only coarsely
        (POSITION, 25.001, "0x00", 25_000), (POSITION, 25.002, "0x00", 25_000), (POSITION, 25.01, "0x00", 25_016),
    ],
)  # fmt: skip
def test_values_are_rounded_to_counts(kind: CommandType, value: float, name: str, raw: int) -> None:
    desk = cascaded()
    desk.array(7, kind, value)
    assert desk.read(name) == raw


@pytest.mark.states("B26")
@pytest.mark.parametrize("unit", ["hundred_degrees", "radian", "degree", "tenth_degree"])
def test_unitless_1_is_180_degrees_in_every_position_unit(unit: str) -> None:
    desk = cascaded(position_unit=unit)
    for value, tenths in ((1.0, 1_800), (-1.0, -1_800), (0.5, 900), (0.0, 0)):
        desk.array(7, UNITLESS, value)
        assert desk.read("0x00") == tenths


def test_a_truncated_command_is_ignored() -> None:
    desk = Desk()
    frames = desk.frames_of(ArrayCommand((ActuatorCommand(7, POSITION, 0.5),)))
    assert desk.raw_frames(frame._replace(data=frame.data[1:]) for frame in frames) == []
    assert desk.read("0x00") == 0
