"""Sentences with the names and units of the tables, and what an answer answers."""

from dataclasses import dataclass, field
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.domain.servo import PositionUnit
from hornbill.schema.catalog import Catalog
from hornbill.servo.device.position_estimate import Estimate
from hornbill.servo.device.servo import Servo
from hornbill.servo.monitoring.transfer_text import TransferText
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorCommand, ActuatorStatus, ArrayCommand, CommandType
from hornbill.wire.services import EMPTY, GetNodeInfoRequest, GetSetRequest, GetSetResponse, Value, ValueKind, integer
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import AnyStructure, decode
from unit.wire.structures import structures, transfer

CATALOG = Catalog.load()


@dataclass
class Met:
    """As much of a servo as a sentence needs."""

    node_id: int
    servo_id: int
    pwm_mode: int | None = None
    position_unit: Estimate = field(default_factory=lambda: Estimate(forced="hundred_degrees"))

    def raw(self, key: str) -> int | None:
        return self.pwm_mode if key == "pwm_mode" else None


def narrator(*servos: Met) -> TransferText:
    return TransferText(CATALOG, lambda: cast("list[Servo]", servos))


def tell(one: TransferText, structure: AnyStructure, at: float = 0.0, **header: Any) -> str:
    sent = transfer(structure, **header)._replace(at=at)
    return one.describe(sent, structure, one.follow(sent))


def answer(value: Value, name: str) -> GetSetResponse:
    return GetSetResponse(value, EMPTY, EMPTY, EMPTY, name)


@pytest.mark.parametrize(
    ("structure", "told"),
    [
        (GetSetRequest(0, EMPTY, "0x08"), "GetSet request read 0x08 current_angle"),
        (GetSetRequest(0, integer(600), "0x38"), "GetSet request write 0x38 angle_limit_cw = 600, 60.0°"),
        (answer(integer(600), "0x38"), "GetSet response 0x38 = 600, 60.0°"),
        (answer(integer(120), "0x0C"), "GetSet response 0x0C = 120, 12.0 V"),
        (answer(integer(40), "0x2C"), "GetSet response 0x2C = 40"),
        (answer(integer(1), "0x20"), "GetSet response 0x20 = 1, Off"),
        (answer(integer(9), "0x20"), "GetSet response 0x20 = 9"),
        (answer(integer(555_555_555), "0x01"), "GetSet response 0x01 = 555555555, inactive"),
        (answer(integer(0), "0x18"), "GetSet response 0x18 = 0, no fault"),
        (
            answer(integer(0b1_0000_0010), "0x18"),
            "GetSet response 0x18 = 258, Hardware warning, Software notification",
        ),
        (answer(integer(1 << 30), "0x1B"), "GetSet response 0x1B = 1073741824, bit 30"),
        (answer(integer(5), "0x07"), "GetSet response 0x07 = 5"),
        (answer(integer(5), "0xzz"), "GetSet response 0xzz = 5"),
    ],
)
def test_registers_have_their_names_and_values_their_units(structure: AnyStructure, told: str) -> None:
    assert tell(narrator(), structure) == told


def test_the_position_of_a_servo_is_in_degrees_and_that_of_a_stranger_is_not() -> None:
    status = ActuatorStatus(1, 0.125, 0.0, 0.0, 0)
    assert tell(narrator(Met(10, 1)), status, source=10) == "Status servo 1, 12.5°"
    assert tell(narrator(Met(10, 1)), status, source=11) == "Status servo 1, position 0.125"


@pytest.mark.parametrize(("unit", "told"), [("radian", "7.2°"), ("degree", "0.1°"), ("tenth_degree", "0.0°")])
def test_the_position_is_told_by_the_unit_of_the_servo(unit: PositionUnit, told: str) -> None:
    servo = Met(10, 1, position_unit=Estimate(forced=unit))
    assert tell(narrator(servo), ActuatorStatus(1, 0.125, 0.0, 0.0, 0), source=10) == f"Status servo 1, {told}"
    command = ArrayCommand((ActuatorCommand(1, CommandType.POSITION, 0.125),))
    assert tell(narrator(servo), command) == f"ArrayCommand servo 1 to {told}"


def test_a_position_whose_unit_would_be_a_guess_is_told_without_one() -> None:
    servo = Met(10, 1, position_unit=Estimate())
    status = ActuatorStatus(1, 0.125, 0.0, 0.0, 0)
    assert tell(narrator(servo), status, source=10) == "Status servo 1, position 0.125"
    command = ArrayCommand((ActuatorCommand(1, CommandType.POSITION, 0.125),))
    assert tell(narrator(servo), command) == "ArrayCommand servo 1 position 0.125"


def test_a_command_is_in_the_units_of_the_servo_it_is_for() -> None:
    message = ArrayCommand(
        (
            ActuatorCommand(1, CommandType.POSITION, -0.125),
            ActuatorCommand(1, CommandType.UNITLESS, 0.5),
            ActuatorCommand(1, CommandType.SPEED, 100),
            ActuatorCommand(1, CommandType.FORCE, -20),
            ActuatorCommand(9, CommandType.POSITION, -0.125),
        )
    )
    assert tell(narrator(Met(10, 1)), message) == (
        "ArrayCommand servo 1 to −12.5°, servo 1 to 90.0°, servo 1 speed 100 rpm, servo 1 torque −20 %, "
        "servo 9 position −0.125"
    )


def test_the_unit_follows_the_mode_the_servo_is_known_to_be_in() -> None:
    held = answer(integer(500), "0x36")
    row = CATALOG.by_key["pwm_output_range"]
    assert row.unit_when is not None
    in_mode = tell(narrator(Met(10, 1, pwm_mode=row.unit_when.raw)), held, source=10)
    not_known = tell(narrator(), held, source=10)
    assert in_mode.endswith(row.unit_when.unit)
    assert not_known.endswith(row.unit)
    assert row.unit != row.unit_when.unit


def test_an_answer_tells_how_long_it_took_and_whether_the_servo_did_as_asked() -> None:
    one = narrator()
    tell(one, GetSetRequest(0, integer(900), "0x38"), at=5.0, source=127, destination=10, transfer_id=3)
    told = tell(one, answer(integer(900), "0x38"), at=5.0008, source=10, destination=127, transfer_id=3)
    assert told == "GetSet response 0x38 = 900, 90.0°, as requested. 0.8 ms"
    tell(one, GetSetRequest(0, integer(-900), "0x39"), at=6.0, source=127, destination=10, transfer_id=4)
    told = tell(one, answer(integer(-750), "0x39"), at=6.002, source=10, destination=127, transfer_id=4)
    assert told == "GetSet response 0x39 = −750, −75.0°, requested −900. 2.0 ms"
    tell(one, GetSetRequest(0, EMPTY, "0x08"), at=7.0, source=127, destination=10, transfer_id=5)
    told = tell(one, answer(integer(1), "0x08"), at=7.001, source=10, destination=127, transfer_id=5)
    assert told == "GetSet response 0x08 = 1, 0.1°. 1.0 ms"


def test_a_text_that_was_asked_for_cannot_command_the_terminal_it_is_shown_on() -> None:
    one = narrator()
    asked = GetSetRequest(0, Value(ValueKind.STRING, "\x1b[2J"), "0x00")
    tell(one, asked, at=5.0, source=127, destination=10, transfer_id=3)
    told = tell(one, answer(integer(1), "0x00"), at=5.001, source=10, destination=127, transfer_id=3)
    assert told.isprintable()
    assert "requested" in told


def test_an_answer_to_somebody_else_and_a_second_answer_are_not_taken_for_it() -> None:
    one = narrator()
    tell(one, GetSetRequest(0, EMPTY, "0x08"), at=7.0, source=127, destination=10, transfer_id=5)
    stranger = tell(one, answer(integer(1), "0x08"), at=7.001, source=10, destination=126, transfer_id=5)
    first = tell(one, answer(integer(1), "0x08"), at=7.002, source=10, destination=127, transfer_id=5)
    second = tell(one, answer(integer(1), "0x08"), at=7.003, source=10, destination=127, transfer_id=5)
    assert (stranger, second) == ("GetSet response 0x08 = 1, 0.1°", "GetSet response 0x08 = 1, 0.1°")
    assert first.endswith("2.0 ms")


def test_requests_that_nobody_answers_are_forgotten_before_they_are_too_many() -> None:
    one = narrator()
    asked = [(source, number) for source in range(1, 80) for number in range(32)]
    for source, number in asked:
        one.follow(transfer(GetNodeInfoRequest(), source=source, destination=100, transfer_id=number))
    answered = [
        one.follow(Transfer(Kind.RESPONSE, GetNodeInfoRequest.TYPE.id, 100, source, 16, number, b""))
        for source, number in asked
    ]
    remembered = [found is not None for found in answered]
    assert sum(remembered) == 1024
    assert all(remembered[-1024:]), "the newest are kept"


@given(st.lists(st.tuples(structures, st.integers(1, 3), st.integers(1, 3), st.integers(0, 2)), max_size=12))
def test_whatever_is_said_on_a_bus_is_told(talk: list[tuple[AnyStructure, int, int, int]]) -> None:
    one = narrator(Met(1, 1), Met(2, 2))
    for structure, source, destination, transfer_id in talk:
        sent = transfer(structure, source=source, destination=destination, transfer_id=transfer_id)
        assert one.describe(sent, decode(sent), one.follow(sent)).isprintable()
