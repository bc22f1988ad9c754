"""Texts of transfers: names and units of the tables, and responses matched to their requests."""

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
class Known:
    """The part of a servo that a text needs."""

    node_id: int
    servo_id: int
    pwm_mode: int | None = None
    position_unit: Estimate = field(default_factory=lambda: Estimate(forced="hundred_degrees"))

    def raw(self, key: str) -> int | None:
        return self.pwm_mode if key == "pwm_mode" else None


def texts(*servos: Known) -> TransferText:
    return TransferText(CATALOG, lambda: cast("list[Servo]", servos))


def describe(one: TransferText, structure: AnyStructure, at: float = 0.0, **header: Any) -> str:
    sent = transfer(structure, **header)._replace(at=at)
    return one.describe(sent, structure, one.follow(sent))


def response(value: Value, name: str) -> GetSetResponse:
    return GetSetResponse(value, EMPTY, EMPTY, EMPTY, name)


@pytest.mark.parametrize(
    ("structure", "text"),
    [
        (GetSetRequest(0, EMPTY, "0x08"), "GetSet request read 0x08 current_angle"),
        (GetSetRequest(0, integer(600), "0x38"), "GetSet request write 0x38 angle_limit_cw = 600, 60.0°"),
        (response(integer(600), "0x38"), "GetSet response 0x38 = 600, 60.0°"),
        (response(integer(120), "0x0C"), "GetSet response 0x0C = 120, 12.0 V"),
        (response(integer(40), "0x2C"), "GetSet response 0x2C = 40"),
        (response(integer(1), "0x20"), "GetSet response 0x20 = 1, Off"),
        (response(integer(9), "0x20"), "GetSet response 0x20 = 9"),
        (response(integer(555_555_555), "0x01"), "GetSet response 0x01 = 555555555, inactive"),
        (response(integer(0), "0x18"), "GetSet response 0x18 = 0, no fault"),
        (response(integer(0x102), "0x18"), "GetSet response 0x18 = 258, Hardware warning, Software notification"),
        (response(integer(1 << 30), "0x1B"), "GetSet response 0x1B = 1073741824, bit 30"),
        (response(integer(5), "0x07"), "GetSet response 0x07 = 5"),
        (response(integer(5), "0xzz"), "GetSet response 0xzz = 5"),
    ],
)
def test_registers_have_names_and_values_have_units(structure: AnyStructure, text: str) -> None:
    assert describe(texts(), structure) == text


STATUS = ActuatorStatus(1, 0.125, 0.0, 0.0, 0)
COMMAND = ArrayCommand((ActuatorCommand(1, CommandType.POSITION, 0.125),))


@pytest.mark.parametrize(
    ("unit", "text"),
    [("hundred_degrees", "12.5°"), ("radian", "7.2°"), ("degree", "0.1°"), ("tenth_degree", "0.0°")],
)
def test_a_position_is_converted_by_the_unit_of_the_servo(unit: PositionUnit, text: str) -> None:
    servo = Known(10, 1, position_unit=Estimate(forced=unit))
    assert describe(texts(servo), STATUS, source=10) == f"Status servo 1, {text}"
    assert describe(texts(servo), COMMAND) == f"ArrayCommand servo 1 to {text}"


def test_a_position_of_unknown_unit_or_of_another_node_has_none() -> None:
    unknown = texts(Known(10, 1, position_unit=Estimate()))
    assert describe(unknown, STATUS, source=10) == "Status servo 1, position 0.125"
    assert describe(unknown, COMMAND) == "ArrayCommand servo 1 position 0.125"
    assert describe(texts(Known(10, 1)), STATUS, source=11) == "Status servo 1, position 0.125"


def test_a_command_has_the_units_of_its_servo() -> None:
    commands = (
        (1, CommandType.POSITION, -0.125), (1, CommandType.UNITLESS, 0.5), (1, CommandType.SPEED, 100),
        (1, CommandType.FORCE, -20), (9, CommandType.POSITION, -0.125),
    )  # fmt: skip
    message = ArrayCommand(tuple(ActuatorCommand(*one) for one in commands))
    assert describe(texts(Known(10, 1)), message) == (
        "ArrayCommand servo 1 to −12.5°, servo 1 to 90.0°, servo 1 speed 100 rpm, servo 1 torque −20 %, "
        "servo 9 position −0.125"
    )


def test_the_unit_depends_on_the_known_mode_of_the_servo() -> None:
    held = response(integer(500), "0x36")
    row = CATALOG.by_key["pwm_output_range"]
    assert row.unit_when is not None
    in_mode = describe(texts(Known(10, 1, pwm_mode=row.unit_when.raw)), held, source=10)
    not_known = describe(texts(), held, source=10)
    assert in_mode.endswith(row.unit_when.unit)
    assert not_known.endswith(row.unit)
    assert row.unit != row.unit_when.unit


HOST_TO_10, TO_HOST = {"source": 127, "destination": 10}, {"source": 10, "destination": 127}


@pytest.mark.parametrize(
    ("name", "requested", "found", "text"),
    [
        ("0x38", integer(900), 900, "0x38 = 900, 90.0°, as requested. 0.8 ms"),
        ("0x39", integer(-900), -750, "0x39 = −750, −75.0°, requested −900. 0.8 ms"),
        ("0x08", EMPTY, 1, "0x08 = 1, 0.1°. 0.8 ms"),
    ],
)
def test_a_response_has_its_delay_and_whether_the_value_is_the_requested_one(
    name: str, requested: Value, found: int, text: str
) -> None:
    one = texts()
    describe(one, GetSetRequest(0, requested, name), at=5.0, **HOST_TO_10, transfer_id=3)
    shown = describe(one, response(integer(found), name), at=5.0008, **TO_HOST, transfer_id=3)
    assert shown == f"GetSet response {text}"


def test_a_requested_text_contains_no_control_characters() -> None:
    one = texts()
    requested = GetSetRequest(0, Value(ValueKind.STRING, "\x1b[2J"), "0x00")
    describe(one, requested, at=5.0, **HOST_TO_10, transfer_id=3)
    text = describe(one, response(integer(1), "0x00"), at=5.001, **TO_HOST, transfer_id=3)
    assert text.isprintable()
    assert "requested" in text


def test_a_response_to_another_node_and_a_second_one_do_not_match() -> None:
    one = texts()
    describe(one, GetSetRequest(0, EMPTY, "0x08"), at=7.0, **HOST_TO_10, transfer_id=5)
    other, first, second = (
        describe(one, response(integer(1), "0x08"), at=7.002, source=10, destination=node, transfer_id=5)
        for node in (126, 127, 127)
    )
    assert other == second == "GetSet response 0x08 = 1, 0.1°"
    assert first == f"{other}. 2.0 ms"


def test_the_oldest_requests_without_a_response_are_dropped() -> None:
    one = texts()
    requested = [(source, number) for source in range(1, 80) for number in range(32)]
    for source, number in requested:
        one.follow(transfer(GetNodeInfoRequest(), source=source, destination=100, transfer_id=number))
    matched = [
        one.follow(Transfer(Kind.RESPONSE, GetNodeInfoRequest.TYPE.id, 100, source, 16, number, b""))
        for source, number in requested
    ]
    remembered = [found is not None for found in matched]
    assert sum(remembered) == 1024
    assert all(remembered[-1024:]), "the newest are kept"


@given(st.lists(st.tuples(structures, st.integers(1, 3), st.integers(1, 3), st.integers(0, 2)), max_size=12))
def test_any_transfer_has_a_text(talk: list[tuple[AnyStructure, int, int, int]]) -> None:
    one = texts(Known(1, 1), Known(2, 2))
    for structure, source, destination, transfer_id in talk:
        sent = transfer(structure, source=source, destination=destination, transfer_id=transfer_id)
        assert one.describe(sent, decode(sent), one.follow(sent)).isprintable()
