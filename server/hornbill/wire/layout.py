"""Encoding of single values: text, half-precision numbers, and range checks."""

from typing import Final

HALF_MAX: Final = 65504.0
"""The largest finite float16."""


def half(value: float) -> float:
    """Clamp `value` to -65504..65504 for struct's `e`, which refuses anything larger. NaN is unchanged.

    Infinity is clamped as well, because it must not be sent to a servo.
    """
    # The argument order matters: min and max return their first argument when comparing NaN.
    return max(min(value, HALF_MAX), -HALF_MAX)


def fit(name: str, value: int, limit: int) -> int:
    """Return `value` if it is within 0..limit. Raises ValueError with field, value and limit otherwise."""
    if not 0 <= value <= limit:
        raise ValueError(f"{name} is {value}. Enter 0 to {limit}.")
    return value


def room(name: str, value: bytes, limit: int) -> bytes:
    """Return `value` if it has at most `limit` bytes. Raises ValueError with field and limit otherwise."""
    if len(value) > limit:
        raise ValueError(f"{name} is {len(value)} bytes long. The limit is {limit}.")
    return value


def text_bytes(name: str, text: str, limit: int) -> bytes:
    """Encode text as Latin-1, at most `limit` bytes. Raises ValueError if it is longer or cannot be encoded.

    With Latin-1 every byte sequence on the bus decodes to text that encodes to the same bytes.
    """
    try:
        return room(name, text.encode("latin-1"), limit)
    except UnicodeEncodeError:
        raise ValueError(f"{name} is {text!r}. Use single-byte characters (Latin-1) only.") from None
