"""The four messages of a servo: NodeStatus, Allocation, ArrayCommand and actuator Status."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar, Final, Self

from hornbill.wire.datatype import DataType, Kind
from hornbill.wire.layout import HALF_MAX, fit, half, room


class NodeHealth(IntEnum):
    """Table 2-18."""

    OK = 0
    WARNING = 1
    ERROR = 2
    CRITICAL = 3


class Mode(IntEnum):
    """Table 2-19. 4..6 are reserved and stay plain integers."""

    OPERATIONAL = 0
    INITIALIZATION = 1
    MAINTENANCE = 2
    SOFTWARE_UPDATE = 3
    OFFLINE = 7


class CommandType(IntEnum):
    """Table 2-21, and PWM of uavcan.equipment.actuator.Command, which these servos do not support."""

    UNITLESS = 0
    POSITION = 1
    FORCE = 2
    SPEED = 3
    PWM = 4


DEGREES_PER_UNITLESS: Final = 180.0
"""Angle of UNITLESS 1.0 (table 2-21)."""

MAX_COMMANDS: Final = 15
"""Maximum number of commands in one ArrayCommand."""

_NODE_STATUS: Final = struct.Struct("<IBH")
_ACTUATOR_STATUS: Final = struct.Struct("<BeeeB")
_COMMAND: Final = struct.Struct("<BBe")
_COMMANDS: Final = [struct.Struct("<" + count * "BBe") for count in range(MAX_COMMANDS + 1)]
_UNIQUE_ID_BYTES: Final = 16

POWER_RATING_UNKNOWN: Final = 127
"""`power_rating_pct` if not reported."""


def unitless_degrees(value: float) -> float:
    """Angle of a finite UNITLESS command, limited to ±180°, ° in steps of 0.1° as the servo rounds it."""
    return round(max(-1.0, min(1.0, value)) * DEGREES_PER_UNITLESS, 1)


def _status_bits(byte: int) -> tuple[NodeHealth, Mode | int, int]:
    mode = byte >> 3 & 7
    return NodeHealth(byte >> 6), (mode if 4 <= mode <= 6 else Mode(mode)), byte & 7


_STATUS_BITS: Final = {byte: _status_bits(byte) for byte in range(256)}
_COMMAND_TYPES: Final[dict[int, CommandType | int]] = {
    **{byte: byte for byte in range(256)},
    **{kind: kind for kind in CommandType},
}


@dataclass(slots=True)
class NodeStatus:
    """uavcan.protocol.NodeStatus (table 2-17): `uptime_sec` in seconds, `mode` 4..6 as plain integers."""

    uptime_sec: int
    health: NodeHealth
    mode: Mode | int
    sub_mode: int = 0
    vendor_specific_status_code: int = 0

    TYPE: ClassVar[DataType] = DataType("uavcan.protocol.NodeStatus", 341, 0x0F0868D0C1A7C6F1, service=False)
    KIND: ClassVar[Kind] = Kind.MESSAGE

    def encode(self) -> bytes:
        """Seven bytes. Raises ValueError for values out of range."""
        bits = fit("health", self.health, 3) << 6 | fit("mode", self.mode, 7) << 3 | fit("sub_mode", self.sub_mode, 7)
        return _NODE_STATUS.pack(
            fit("uptime_sec", self.uptime_sec, 0xFFFFFFFF),
            bits,
            fit("vendor_specific_status_code", self.vendor_specific_status_code, 0xFFFF),
        )

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """From exactly seven bytes; None for any other length."""
        if len(payload) != 7:
            return None
        uptime, bits, code = _NODE_STATUS.unpack(payload)
        health, mode, sub_mode = _STATUS_BITS[bits]
        return cls(uptime, health, mode, sub_mode, code)


@dataclass(slots=True)
class AllocationMessage:
    """uavcan.protocol.dynamic_node_id.Allocation (tables 2-7, 2-8): node ID 0..127, 0..16 bytes of unique ID.

    `node_id` is the preferred ID in a request, the assigned ID in the final response, otherwise 0.
    """

    node_id: int
    first_part_of_unique_id: bool
    unique_id: bytes

    TYPE: ClassVar[DataType] = DataType(
        "uavcan.protocol.dynamic_node_id.Allocation", 1, 0x0B2A812620A11D40, service=False
    )
    KIND: ClassVar[Kind] = Kind.MESSAGE

    def encode(self) -> bytes:
        """1 to 17 bytes. Raises ValueError for a node ID above 127 or a unique ID above 16 bytes."""
        first = fit("node_id", self.node_id, 127) << 1 | bool(self.first_part_of_unique_id)
        return bytes((first,)) + room("unique_id", self.unique_id, _UNIQUE_ID_BYTES)

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """From 1 to 17 bytes; None for any other length."""
        if not 1 <= len(payload) <= 1 + _UNIQUE_ID_BYTES:
            return None
        first = payload[0]
        return cls(first >> 1, bool(first & 1), payload[1:])


@dataclass(slots=True)
class ActuatorCommand:
    """One entry of ArrayCommand: actuator ID 0..255 (255 moves every servo), command type and value.

    `command_type` is a CommandType or, from a foreign node, any byte. `command_value` is float16 on the
    wire: 11 significant bits, clamped to ±65504.
    """

    actuator_id: int
    command_type: CommandType | int
    command_value: float


@dataclass(slots=True)
class ArrayCommand:
    """uavcan.equipment.actuator.ArrayCommand (table 2-20): up to 15 commands."""

    commands: Sequence[ActuatorCommand]

    TYPE: ClassVar[DataType] = DataType(
        "uavcan.equipment.actuator.ArrayCommand", 1010, 0xD8A7486238EC3AF3, service=False
    )
    KIND: ClassVar[Kind] = Kind.MESSAGE

    def encode(self) -> bytes:
        """Four bytes per command without a count, as on classic CAN. Raises ValueError for more than 15."""
        commands = self.commands
        if len(commands) > MAX_COMMANDS:
            raise ValueError(f"{len(commands)} commands exceed the {MAX_COMMANDS} of one message. Send two messages.")
        numbers: list[float] = []
        for command in commands:
            value = command.command_value
            if not -HALF_MAX <= value <= HALF_MAX:
                value = half(value)
            numbers += (command.actuator_id, command.command_type, value)
        try:
            return _COMMANDS[len(commands)].pack(*numbers)
        except struct.error:
            for command in commands:
                fit("actuator_id", command.actuator_id, 255)
                fit("command_type", command.command_type, 255)
            raise ValueError("actuator_id and command_type must be whole numbers, 0 to 255.") from None

    @staticmethod
    def actuator_ids(payload: bytes) -> bytes:
        """Actuator IDs of the commands in a payload, without decoding it."""
        return payload[::4]

    @classmethod
    def decode(cls, payload: bytes, *, explicit_length: bool = False) -> Self | None:
        """From 4n bytes (n = 0..15).

        With `explicit_length` also from 4n + 1 bytes, as on CAN FD: a leading four-bit count shifts everything after
        it. This is not standard on classic CAN, so only a monitor uses it.
        """
        if explicit_length and len(payload) % 4 == 1:
            whole = int.from_bytes(payload, "big")
            bits = 8 * len(payload) - 4
            if whole >> bits != len(payload) // 4:
                return None
            payload = (whole >> 4 & (1 << bits - 4) - 1).to_bytes(len(payload) - 1, "big")
        if len(payload) % 4 or len(payload) > 4 * MAX_COMMANDS:
            return None
        types = _COMMAND_TYPES
        return cls(
            tuple(
                [
                    ActuatorCommand(actuator, types[kind], value)
                    for actuator, kind, value in _COMMAND.iter_unpack(payload)
                ]
            )
        )


@dataclass(slots=True)
class ActuatorStatus:
    """uavcan.equipment.actuator.Status (table 2-22), broadcast by a servo every 100 ms.

    The unit of `position` depends on the servo: the table prints two. NaN in `force` and `speed` and 127 in
    `power_rating_pct` mean "not reported".
    """

    actuator_id: int
    position: float
    force: float
    speed: float
    power_rating_pct: int

    TYPE: ClassVar[DataType] = DataType("uavcan.equipment.actuator.Status", 1011, 0x5E9BBA44FAF1EA04, service=False)
    KIND: ClassVar[Kind] = Kind.MESSAGE

    def encode(self) -> bytes:
        """Eight bytes; numbers are clamped to ±65504. Raises ValueError for an ID or rating out of range."""
        return _ACTUATOR_STATUS.pack(
            fit("actuator_id", self.actuator_id, 255),
            half(self.position),
            half(self.force),
            half(self.speed),
            fit("power_rating_pct", self.power_rating_pct, 127),
        )

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """From exactly eight bytes; None for any other length."""
        if len(payload) != 8:
            return None
        actuator_id, position, force, speed, rating = _ACTUATOR_STATUS.unpack(payload)
        return cls(actuator_id, position, force, speed, rating & 0x7F)
