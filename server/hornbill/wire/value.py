"""Encoding of the tagged union uavcan.protocol.param.Value and its numeric variant."""

import struct
from enum import IntEnum
from typing import Final, NamedTuple

from hornbill.wire.layout import text_bytes

_INT64: Final = struct.Struct("<q")
_FLOAT32: Final = struct.Struct("<f")
_STRING_BYTES: Final = 128


class ValueKind(IntEnum):
    """Table 2-15. These servos use EMPTY and INTEGER; other nodes may send all five."""

    EMPTY = 0
    INTEGER = 1
    REAL = 2
    BOOLEAN = 3
    STRING = 4


class Value(NamedTuple):
    """A parameter value: None, int64, float32, uint8 (0 is false) or text of up to 128 characters."""

    kind: ValueKind
    value: int | float | str | None


EMPTY: Final = Value(ValueKind.EMPTY, None)
"""No value: in a read request, or in a response for "no such parameter"."""

_INTEGER: Final = ValueKind.INTEGER


def integer(number: int) -> Value:
    """A 64-bit signed integer, the only kind servos use. The range is checked on encoding."""
    return Value(_INTEGER, number)


def encode_value(value: Value, *, high: int = 0, numeric: bool = False) -> bytes:
    """Encode the tag byte (its unused upper bits set to `high`) and the content.

    `numeric` selects the two-bit union of the limits, which has no BOOLEAN and no STRING. Raises ValueError for a
    value of another kind or out of range.
    """
    if value == EMPTY:
        return bytes((high,))
    kind, content = value
    if numeric and kind > ValueKind.REAL:
        raise ValueError(f"A limit cannot be {kind.name}. Use EMPTY, INTEGER or REAL.")
    tag = bytes((high | kind,))
    try:
        match kind, content:
            case ValueKind.INTEGER, int():
                return tag + _INT64.pack(content)
            case ValueKind.REAL, float() | int():
                return tag + _FLOAT32.pack(content)
            case ValueKind.BOOLEAN, int():
                return tag + content.to_bytes(1, "little")
            case ValueKind.STRING, str():
                characters = text_bytes("value", content, _STRING_BYTES)
                return tag + bytes((len(characters),)) + characters
            case _:
                raise ValueError(f"{content!r} is not a value of kind {kind.name}.")
    except (struct.error, OverflowError):
        raise ValueError(f"{content!r} does not fit a value of kind {kind.name}.") from None


def decode_value(payload: bytes, offset: int, *, numeric: bool = False) -> tuple[Value, int] | None:
    """Decode the union at `offset`. Returns it and the offset after it, or None if the payload is truncated.

    The unused upper bits of the tag byte are ignored. An unknown tag returns None.
    """
    if offset >= len(payload):
        return None
    tag = payload[offset] & (3 if numeric else 7)
    body = offset + 1
    end = len(payload)
    if tag == ValueKind.EMPTY:
        return EMPTY, body
    if tag == ValueKind.INTEGER and body + 8 <= end:
        return Value(_INTEGER, _INT64.unpack_from(payload, body)[0]), body + 8
    if tag == ValueKind.REAL and body + 4 <= end:
        return Value(ValueKind.REAL, _FLOAT32.unpack_from(payload, body)[0]), body + 4
    if numeric or body >= end:
        return None
    if tag == ValueKind.BOOLEAN:
        return Value(ValueKind.BOOLEAN, payload[body]), body + 1
    length = payload[body]
    after = body + 1 + length
    if tag != ValueKind.STRING or length > _STRING_BYTES or after > end:
        return None
    return Value(ValueKind.STRING, payload[body + 1 : after].decode("latin-1")), after
