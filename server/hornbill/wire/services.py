"""The four services of a servo: GetNodeInfo, RestartNode, ExecuteOpcode and GetSet."""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from typing import ClassVar, Final, Self, cast

from hornbill.wire.datatype import DataType, Kind
from hornbill.wire.layout import fit, room, text_bytes
from hornbill.wire.messages import NodeStatus
from hornbill.wire.value import EMPTY, Value, ValueKind, decode_value, encode_value, integer

__all__ = [
    "EMPTY",
    "MAGIC",
    "ExecuteOpcodeRequest",
    "ExecuteOpcodeResponse",
    "GetNodeInfoRequest",
    "GetNodeInfoResponse",
    "GetSetRequest",
    "GetSetResponse",
    "HardwareVersion",
    "Opcode",
    "RestartNodeRequest",
    "RestartNodeResponse",
    "SoftwareVersion",
    "Value",
    "ValueKind",
    "integer",
]

GET_NODE_INFO: Final = DataType("uavcan.protocol.GetNodeInfo", 1, 0xEE468A8121C46A9E, service=True)
RESTART_NODE: Final = DataType("uavcan.protocol.RestartNode", 5, 0x569E05394A3017F0, service=True)
EXECUTE_OPCODE: Final = DataType("uavcan.protocol.param.ExecuteOpcode", 10, 0x3B131AC5EB69D2CD, service=True)
GET_SET: Final = DataType("uavcan.protocol.param.GetSet", 11, 0xA7B622F939D1A4D5, service=True)

MAGIC: Final = 0xACCE551B1E
"""The 40-bit number required to restart a node (table 2-9, which prints it as if it fit 32 bits)."""

_VERSIONS: Final = struct.Struct("<BBBIQBB16sB")
_STATUS_BYTES: Final = 7
_FIXED_BYTES: Final = _STATUS_BYTES + _VERSIONS.size
_NODE_NAME_BYTES: Final = 80
_PARAMETER_NAME_BYTES: Final = 92
_INTEGER_RESPONSE: Final = struct.Struct("<Bq3s4s")
_NO_LIMITS: Final = b"\0\0\0"
_INTEGER: Final = ValueKind.INTEGER
_new: Final = cast("Callable[[type[Value], tuple[object, ...]], Value]", tuple.__new__)
_OK_BIT: Final = 0x80


class Opcode(IntEnum):
    """Table 2-12."""

    SAVE = 0
    ERASE = 1


@dataclass(slots=True)
class SoftwareVersion:
    """uavcan.protocol.SoftwareVersion. Flag bit 0: `vcs_commit` is valid; bit 1: `image_crc` is valid."""

    major: int
    minor: int
    optional_field_flags: int = 0
    vcs_commit: int = 0
    image_crc: int = 0


@dataclass(slots=True)
class HardwareVersion:
    """uavcan.protocol.HardwareVersion: `unique_id` has 16 bytes, `certificate_of_authenticity` up to 255."""

    major: int
    minor: int
    unique_id: bytes
    certificate_of_authenticity: bytes = b""


@dataclass(slots=True)
class GetNodeInfoRequest:
    """Table 2-5. No payload: the byte printed in the table is the tail byte."""

    TYPE: ClassVar[DataType] = GET_NODE_INFO
    KIND: ClassVar[Kind] = Kind.REQUEST

    def encode(self) -> bytes:
        """No bytes."""
        return b""

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """From any payload, because some nodes send the printed byte."""
        return cls()


@dataclass(slots=True)
class GetNodeInfoResponse:
    """Table 2-6: identity of a node. `name` has at most 80 characters."""

    status: NodeStatus
    software_version: SoftwareVersion
    hardware_version: HardwareVersion
    name: str

    TYPE: ClassVar[DataType] = GET_NODE_INFO
    KIND: ClassVar[Kind] = Kind.RESPONSE

    def encode(self) -> bytes:
        """41 bytes, the certificate and the name. Raises ValueError when a value does not fit."""
        software, hardware = self.software_version, self.hardware_version
        certificate = room("certificate_of_authenticity", hardware.certificate_of_authenticity, 255)
        if len(hardware.unique_id) != 16:
            raise ValueError(f"unique_id is {len(hardware.unique_id)} bytes long. It must have 16.")
        versions = _VERSIONS.pack(
            fit("software_version.major", software.major, 0xFF),
            fit("software_version.minor", software.minor, 0xFF),
            fit("optional_field_flags", software.optional_field_flags, 0xFF),
            fit("vcs_commit", software.vcs_commit, 0xFFFFFFFF),
            fit("image_crc", software.image_crc, (1 << 64) - 1),
            fit("hardware_version.major", hardware.major, 0xFF),
            fit("hardware_version.minor", hardware.minor, 0xFF),
            hardware.unique_id,
            len(certificate),
        )
        return self.status.encode() + versions + certificate + text_bytes("name", self.name, _NODE_NAME_BYTES)

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """None if a fixed field or the certificate is truncated, or the name is longer than 80."""
        if len(payload) < _FIXED_BYTES:
            return None
        status = NodeStatus.decode(payload[:_STATUS_BYTES])
        major, minor, flags, commit, crc, hw_major, hw_minor, unique_id, length = _VERSIONS.unpack_from(
            payload, _STATUS_BYTES
        )
        name = payload[_FIXED_BYTES + length :]
        if status is None or len(payload) < _FIXED_BYTES + length or len(name) > _NODE_NAME_BYTES:
            return None
        certificate = payload[_FIXED_BYTES : _FIXED_BYTES + length]
        return cls(
            status,
            SoftwareVersion(major, minor, flags, commit, crc),
            HardwareVersion(hw_major, hw_minor, unique_id, certificate),
            name.decode("latin-1"),
        )


@dataclass(slots=True)
class RestartNodeRequest:
    """Table 2-9, with 40 bits for the number. A node restarts only for MAGIC."""

    magic_number: int = MAGIC

    TYPE: ClassVar[DataType] = RESTART_NODE
    KIND: ClassVar[Kind] = Kind.REQUEST

    def encode(self) -> bytes:
        """Five bytes, low first. Raises ValueError above 40 bits."""
        return fit("magic_number", self.magic_number, (1 << 40) - 1).to_bytes(5, "little")

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """From exactly five bytes; None for any other length."""
        return cls(int.from_bytes(payload, "little")) if len(payload) == 5 else None


@dataclass(slots=True)
class RestartNodeResponse:
    """Table 2-10: whether the node restarts."""

    ok: bool

    TYPE: ClassVar[DataType] = RESTART_NODE
    KIND: ClassVar[Kind] = Kind.RESPONSE

    def encode(self) -> bytes:
        """One byte; the flag is its top bit."""
        return bytes((_OK_BIT if self.ok else 0,))

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """From exactly one byte; None for any other length."""
        return cls(payload[0] >= _OK_BIT) if len(payload) == 1 else None


@dataclass(slots=True)
class ExecuteOpcodeRequest:
    """Table 2-11: an Opcode (from a foreign node any byte) and a signed 48-bit argument, 0 in hornbill's requests."""

    opcode: Opcode | int
    argument: int = 0

    TYPE: ClassVar[DataType] = EXECUTE_OPCODE
    KIND: ClassVar[Kind] = Kind.REQUEST

    def encode(self) -> bytes:
        """Seven bytes. Raises ValueError for a value that does not fit its field."""
        return bytes((fit("opcode", self.opcode, 0xFF),)) + _argument_bytes(self.argument)

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """From exactly seven bytes; None for any other length."""
        if len(payload) != 7:
            return None
        opcode = payload[0]
        return cls(Opcode(opcode) if opcode <= Opcode.ERASE else opcode, _argument(payload[1:]))


@dataclass(slots=True)
class ExecuteOpcodeResponse:
    """Table 2-13: a signed 48-bit argument and whether the operation succeeded."""

    argument: int
    ok: bool

    TYPE: ClassVar[DataType] = EXECUTE_OPCODE
    KIND: ClassVar[Kind] = Kind.RESPONSE

    def encode(self) -> bytes:
        """Seven bytes; the flag is the top bit of the last. Raises ValueError above 48 bits."""
        return _argument_bytes(self.argument) + bytes((_OK_BIT if self.ok else 0,))

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """From exactly seven bytes; None for any other length."""
        return cls(_argument(payload[:6]), payload[6] >= _OK_BIT) if len(payload) == 7 else None


@dataclass(slots=True)
class GetSetRequest:
    """Table 2-14: read (EMPTY value) or write one parameter.

    By `name` of up to 92 characters or, if that is empty, by `index` 0..8191.
    """

    index: int
    value: Value
    name: str

    TYPE: ClassVar[DataType] = GET_SET
    KIND: ClassVar[Kind] = Kind.REQUEST

    def encode(self) -> bytes:
        """Two bytes, the value and the name. Raises ValueError for values out of range."""
        return _get_set(self.index, self.value, self.name)

    def matches(self, response: "GetSetResponse") -> bool:
        """Whether a response has the requested name, or none, as in a refusal (table 2-16)."""
        name, other = self.name, response.name
        return name == other or not (name and other) or name.upper() == other.upper()

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """None if the value is truncated or of an unknown kind, or the name is longer than 92."""
        found = decode_value(payload, 1)
        if found is None:
            return None
        value, end = found
        name = payload[end:]
        if len(name) > _PARAMETER_NAME_BYTES:
            return None
        return cls(payload[0] | payload[1] >> 3 << 8, value, name.decode("latin-1"))


@dataclass(slots=True)
class GetSetResponse:
    """Table 2-16: the value after the request. All empty, including the name: no such parameter, or refused."""

    value: Value
    default_value: Value
    max_value: Value
    min_value: Value
    name: str

    TYPE: ClassVar[DataType] = GET_SET
    KIND: ClassVar[Kind] = Kind.RESPONSE

    def encode(self) -> bytes:
        """Four unions and the name of up to 92 characters. Raises ValueError for values out of range."""
        return b"".join(
            (
                encode_value(self.value),
                encode_value(self.default_value),
                encode_value(self.max_value, numeric=True),
                encode_value(self.min_value, numeric=True),
                text_bytes("name", self.name, _PARAMETER_NAME_BYTES),
            )
        )

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """None if a union is truncated or of an unknown kind, or the name is longer than 92."""
        if len(payload) == 16:
            # The form servos send: an integer, three empty unions, four characters.
            tag, number, limits, name = _INTEGER_RESPONSE.unpack(payload)
            if tag == 1 and limits == _NO_LIMITS:
                return cls(_new(Value, (_INTEGER, number)), EMPTY, EMPTY, EMPTY, name.decode("latin-1"))
        unions: list[Value] = []
        offset = 0
        for numeric in (False, False, True, True):
            found = decode_value(payload, offset, numeric=numeric)
            if found is None:
                return None
            union, offset = found
            unions.append(union)
        if len(payload) - offset > _PARAMETER_NAME_BYTES:
            return None
        return cls(unions[0], unions[1], unions[2], unions[3], payload[offset:].decode("latin-1"))


@lru_cache(maxsize=4096, typed=True)
def _get_set(index: int, value: Value, name: str) -> bytes:
    """Payload of a GetSetRequest. Cached: the same rows are read again and again."""
    fit("index", index, 0x1FFF)
    # The five high bits of the index share a byte with the tag of the value.
    coded = encode_value(value, high=index >> 8 << 3)
    return bytes((index & 0xFF,)) + coded + text_bytes("name", name, _PARAMETER_NAME_BYTES)


def _argument_bytes(argument: int) -> bytes:
    try:
        return argument.to_bytes(6, "little", signed=True)
    except OverflowError:
        raise ValueError(f"argument is {argument}. It must fit a signed 48-bit integer.") from None


def _argument(six: bytes) -> int:
    return int.from_bytes(six, "little", signed=True)
