"""Section 2.3, ArrayCommand (tables 2-20 and 2-21): who is meant, and what the four types command."""

from math import inf, nan, radians

import pytest

from hornbill.schema.parameter import DUMMY
from hornbill.sim.behaviour import Behaviour, PositionUnit
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType
from unit.sim.desk import FREE, Desk

UNITLESS, POSITION, FORCE, SPEED, PWM = CommandType


def cascaded(**switches: object) -> Desk:
    return Desk(rom={"speed_torque_control": 1}, behaviour=Behaviour(**switches))  # pyright: ignore[reportArgumentType]


def registers(desk: Desk) -> tuple[int | None, ...]:
    return tuple(desk.read(name) for name in ("0x00", "0x01", "0x02"))


@pytest.mark.states("B24", "B25", "B26")
@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        (POSITION, 0.5, (500, DUMMY, DUMMY)),
        (POSITION, -0.9, (-900, DUMMY, DUMMY)),
        (UNITLESS, 0.25, (450, DUMMY, DUMMY)),
        (UNITLESS, -1.0, (-1800, DUMMY, DUMMY)),
        (SPEED, -120.0, (DUMMY, -120, DUMMY)),
        (FORCE, 25.0, (DUMMY, DUMMY, 25)),
    ],
)
def test_each_type_becomes_its_register(kind: CommandType, value: float, expected: tuple[int, ...]) -> None:
    desk = cascaded()
    desk.array(7, kind, value)
    # float16 holds 0.9 only to about 0.05 % of it.
    assert registers(desk) == pytest.approx(expected, abs=1)


@pytest.mark.states("B23")
@pytest.mark.parametrize(
    ("unit", "value"), [("hundred_degrees", 0.5), ("radian", radians(50)), ("degree", 50.0), ("tenth_degree", 500.0)]
)
def test_the_position_unit_is_a_switch(unit: PositionUnit, value: float) -> None:
    desk = cascaded(position_unit=unit)
    desk.array(7, POSITION, value)
    assert desk.read("0x00") == pytest.approx(500, abs=1)


@pytest.mark.states("B21")
def test_only_its_own_id_and_255_reach_it() -> None:
    desk = Desk(servo_id=7)
    for other in (0, 1, 6, 8, 254):
        desk.array(other, POSITION, 0.5)
        assert desk.read("0x00") == 0
    desk.array(255, POSITION, 0.5)
    assert desk.read("0x00") == 500


@pytest.mark.states("B22")
@pytest.mark.parametrize("servo_id", [0, 255])
def test_a_new_servo_is_reached_by_id_0_and_by_255(servo_id: int) -> None:
    desk = Desk(servo_id=0)
    desk.array(servo_id, POSITION, 0.5)
    assert desk.read("0x00") == 500


@pytest.mark.states("B22")
def test_a_servo_with_an_id_is_not_reached_by_id_0() -> None:
    desk = Desk(servo_id=7)
    desk.array(0, POSITION, 0.5)
    assert desk.read("0x00") == 0


@pytest.mark.states("B95")
def test_a_new_servo_id_is_obeyed_at_once() -> None:
    desk = Desk(servo_id=7)
    desk.write("0x45", 8)
    desk.array(7, POSITION, 0.5)
    assert desk.read("0x00") == 0
    desk.array(8, POSITION, 0.5)
    assert desk.read("0x00") == 500


@pytest.mark.states("B21")
def test_fifteen_commands_in_one_message_reach_the_one_they_are_for() -> None:
    desk = Desk(servo_id=15)
    desk.send(ArrayCommand([ActuatorCommand(n, POSITION, n / 16) for n in range(1, 16)]))
    assert desk.read("0x00") == round(15 / 16 * 1000)


@pytest.mark.states("B21")
def test_of_two_commands_for_one_servo_the_last_counts() -> None:
    desk = Desk()
    desk.send(ArrayCommand([ActuatorCommand(7, POSITION, 0.25), ActuatorCommand(255, POSITION, 0.5)]))
    assert desk.read("0x00") == 500


@pytest.mark.states("B26")
@pytest.mark.parametrize("value", [nan, 200.0])
@pytest.mark.parametrize("kind", [PWM, 5, 255])
def test_types_the_document_does_not_list_do_nothing(kind: int, value: float) -> None:
    desk = cascaded()
    desk.array(7, kind, value)
    assert registers(desk) == (0, 0, 0)


@pytest.mark.states("B25")
@pytest.mark.parametrize(
    ("kind", "value"), [(FORCE, 101.0), (SPEED, -301.0), (UNITLESS, 1.5), (POSITION, nan), (SPEED, inf)]
)
def test_out_of_range_is_not_obeyed(kind: CommandType, value: float) -> None:
    desk = cascaded()
    desk.array(7, kind, value)
    assert registers(desk) == (0, 0, 0)


@pytest.mark.states("B25")
@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        (FORCE, 101.0, (DUMMY, DUMMY, 100)),
        (SPEED, -301.0, (DUMMY, -300, DUMMY)),
        (UNITLESS, 1.5, (1800, DUMMY, DUMMY)),
    ],
)
def test_or_clamped_by_a_switch(kind: CommandType, value: float, expected: tuple[int, ...]) -> None:
    desk = cascaded(out_of_range="clamp")
    desk.array(7, kind, value)
    assert registers(desk) == expected


@pytest.mark.states("B36", "B38")
def test_speed_and_torque_are_ignored_while_0x25_is_off() -> None:
    desk = Desk()
    for kind in (SPEED, FORCE):
        desk.array(7, kind, 50.0)
    assert registers(desk) == (0, 0, 0)


@pytest.mark.states("B21")
def test_the_horn_goes_where_it_is_told() -> None:
    desk = Desk()
    desk.array(7, POSITION, 0.45)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(450, abs=3)


@pytest.mark.states("B24")
def test_force_is_in_percent_and_speed_in_rpm() -> None:
    desk = Desk(rom=FREE)
    desk.array(7, SPEED, 90.0)
    desk.wait(1.0)
    assert desk.servo.speed_rpm == pytest.approx(90, abs=1)
    desk.under(load_pct=-35.0)
    desk.array(7, FORCE, 35.0)
    desk.wait(0.3)
    assert desk.read("0x0A") == 35


@pytest.mark.states("B25")
@pytest.mark.parametrize(
    ("kind", "value", "name", "raw"),
    [
        (POSITION, 0.1234, "0x00", 123), (POSITION, 0.1236, "0x00", 124), (POSITION, 10.0, "0x00", 10_000),
        (SPEED, 59.6, "0x01", 60), (FORCE, -12.4, "0x02", -12), (UNITLESS, 0.0005, "0x00", 1),
    ],
)  # fmt: skip
def test_values_are_rounded_to_counts(kind: CommandType, value: float, name: str, raw: int) -> None:
    desk = cascaded()
    desk.array(7, kind, value)
    assert desk.read(name) == raw


@pytest.mark.states("B25")
def test_a_16_bit_float_holds_large_angles_only_coarsely() -> None:
    read: list[int | None] = []
    for value in (25.001, 25.002, 25.01):
        desk = cascaded()
        desk.array(7, POSITION, value)
        read.append(desk.read("0x00"))
    assert read == [25_000, 25_000, 25_016]


@pytest.mark.states("B26")
@pytest.mark.parametrize(("value", "tenths"), [(1.0, 1_800), (-1.0, -1_800), (0.5, 900), (0.0, 0)])
def test_unitless_1_is_180_degrees_whatever_the_unit_of_positions(value: float, tenths: int) -> None:
    for unit in ("hundred_degrees", "radian", "degree", "tenth_degree"):
        desk = cascaded(position_unit=unit)
        desk.array(7, UNITLESS, value)
        assert desk.read("0x00") == tenths


def test_half_a_command_is_malformed_and_changes_nothing() -> None:
    desk = Desk()
    frames = desk.frames_of(ArrayCommand((ActuatorCommand(7, POSITION, 0.5),)))
    cut = [frame._replace(data=frame.data[1:]) for frame in frames]
    assert desk.raw_frames(cut) == []
    assert desk.read("0x00") == 0
