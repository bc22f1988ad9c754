"""Messages: bits as in the tables, clamped numbers, and None for every invalid length."""

import math
import re
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.wire.messages import (
    POWER_RATING_UNKNOWN,
    ActuatorCommand,
    ActuatorStatus,
    AllocationMessage,
    ArrayCommand,
    CommandType,
    Mode,
    NodeHealth,
    NodeStatus,
)
from unit.wire.structures import array_commands, node_statuses

AnyMessage = NodeStatus | AllocationMessage | ArrayCommand | ActuatorStatus


def test_health_mode_and_sub_mode_start_at_the_top_bit() -> None:
    status = NodeStatus(0x04030201, NodeHealth.ERROR, Mode.SOFTWARE_UPDATE, 5, 0xBEEF)
    assert status.encode() == bytes((1, 2, 3, 4, 0b10_011_101, 0xEF, 0xBE))


def test_reserved_modes_stay_numbers() -> None:
    decoded = NodeStatus.decode(bytes((0, 0, 0, 0, 0b11_101_000, 0, 0)))
    assert decoded == NodeStatus(0, NodeHealth.CRITICAL, 5)
    assert decoded is not None
    assert not isinstance(decoded.mode, Mode)


@given(node_statuses)
def test_known_health_and_mode_decode_to_enumerations(status: NodeStatus) -> None:
    decoded = NodeStatus.decode(status.encode())
    assert decoded is not None
    assert isinstance(decoded.health, NodeHealth)
    assert isinstance(decoded.mode, Mode) == (decoded.mode not in (4, 5, 6))


def test_allocation_bits() -> None:
    assert AllocationMessage(125, True, b"\x01\x02").encode() == bytes((0xFB, 1, 2))
    assert AllocationMessage.decode(b"\x28") == AllocationMessage(20, False, b"")


@pytest.mark.parametrize(
    ("message", "lengths"),
    [
        (NodeStatus, [0, 6, 8, 70]),
        (ActuatorStatus, [0, 7, 9]),
        (AllocationMessage, [0, 18]),
        (ArrayCommand, [2, 3, 5, 6, 61, 64, 65]),
    ],
)
def test_invalid_lengths_do_not_decode(message: type[AnyMessage], lengths: list[int]) -> None:
    assert [message.decode(bytes(length)) for length in lengths] == [None] * len(lengths)


def test_the_void_bit_before_the_power_rating_is_ignored() -> None:
    decoded = ActuatorStatus.decode(bytes(7) + b"\xff")
    assert decoded is not None
    assert decoded.power_rating_pct == POWER_RATING_UNKNOWN


@pytest.mark.parametrize("pattern", [0x7E00, 0x7FFF, 0xFE00, 0x7C01])
def test_every_nan_pattern_is_nan(pattern: int) -> None:
    decoded = ActuatorStatus.decode(bytes(3) + pattern.to_bytes(2, "little") + bytes(3))
    assert decoded is not None
    assert math.isnan(decoded.force)
    again = ActuatorStatus.decode(decoded.encode())
    assert again is not None
    assert math.isnan(again.force)


@pytest.mark.parametrize(
    ("requested", "sent"),
    [(65504.0, 65504.0), (65520.0, 65504.0), (1e300, 65504.0), (-1e9, -65504.0), (math.inf, 65504.0)],
)
def test_numbers_above_float16_are_clamped_never_infinite(requested: float, sent: float) -> None:
    decoded = ArrayCommand.decode(ArrayCommand([ActuatorCommand(1, CommandType.POSITION, requested)]).encode())
    assert decoded == ArrayCommand((ActuatorCommand(1, CommandType.POSITION, sent),))


@given(st.integers(-2048, 2048))
def test_whole_numbers_to_2048_are_exact(number: int) -> None:
    decoded = ArrayCommand.decode(ArrayCommand([ActuatorCommand(1, CommandType.POSITION, number)]).encode())
    assert decoded is not None
    assert decoded.commands[0].command_value == number


def test_command_types_decode_to_enumerations_and_others_to_numbers() -> None:
    decoded = ArrayCommand.decode(bytes((1, 3, 0, 0, 2, 9, 0, 0)))
    assert decoded is not None
    assert [command.command_type for command in decoded.commands] == [CommandType.SPEED, 9]
    assert isinstance(decoded.commands[0].command_type, CommandType)


@given(array_commands)
def test_an_explicit_length_is_decoded_only_on_request(message: ArrayCommand) -> None:
    plain = message.encode()
    count = len(message.commands)
    shifted = (count << 8 * len(plain) | int.from_bytes(plain, "big")) << 4
    with_length = shifted.to_bytes(len(plain) + 1, "big")
    assert ArrayCommand.decode(with_length) is None
    assert ArrayCommand.decode(with_length, explicit_length=True) == message
    assert ArrayCommand.decode(plain, explicit_length=True) == message


@pytest.mark.parametrize("payload", [b"\x20" + bytes(4), *map(bytes, (2, 3, 6, 61, 65))])
def test_an_explicit_length_must_be_correct(payload: bytes) -> None:
    assert ArrayCommand.decode(payload, explicit_length=True) is None


@pytest.mark.parametrize(
    ("message", "refusal"),
    [
        (NodeStatus(-1, NodeHealth.OK, Mode.OPERATIONAL), "uptime_sec is -1. Enter 0 to 4294967295."),
        (NodeStatus(1 << 32, NodeHealth.OK, Mode.OPERATIONAL), "uptime_sec is 4294967296. Enter 0 to 4294967295."),
        (NodeStatus(0, cast(NodeHealth, 4), 0), "health is 4. Enter 0 to 3."),
        (NodeStatus(0, NodeHealth.OK, 8), "mode is 8. Enter 0 to 7."),
        (NodeStatus(0, NodeHealth.OK, Mode.OFFLINE, 8), "sub_mode is 8. Enter 0 to 7."),
        (NodeStatus(0, NodeHealth.OK, 7, 0, 1 << 16), "vendor_specific_status_code is 65536. Enter 0 to 65535."),
        (AllocationMessage(128, False, b""), "node_id is 128. Enter 0 to 127."),
        (AllocationMessage(0, False, bytes(17)), "unique_id is 17 bytes long. The limit is 16."),
        (ArrayCommand([ActuatorCommand(256, CommandType.SPEED, 0.0)]), "actuator_id is 256. Enter 0 to 255."),
        (ArrayCommand([ActuatorCommand(0, 256, 0.0)]), "command_type is 256. Enter 0 to 255."),
        (ArrayCommand([ActuatorCommand(cast(int, 1.5), 3, 0.0)]),
         "actuator_id and command_type must be whole numbers, 0 to 255."),
        (ArrayCommand([ActuatorCommand(0, 3, 0.0)] * 16),
         "16 commands exceed the 15 of one message. Send two messages."),
        (ActuatorStatus(256, 0.0, 0.0, 0.0, 0), "actuator_id is 256. Enter 0 to 255."),
        (ActuatorStatus(0, 0.0, 0.0, 0.0, 128), "power_rating_pct is 128. Enter 0 to 127."),
    ],
)  # fmt: skip
def test_a_refusal_names_field_value_and_limit(message: AnyMessage, refusal: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(refusal)}$"):
        message.encode()
