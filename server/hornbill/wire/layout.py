"""How single values become bytes: text, half-precision numbers, and the refusal of what does not fit."""

from typing import Final

HALF_MAX: Final = 65504.0
"""The largest finite float16."""


def half(value: float) -> float:
    """`value` brought into -65504..65504, NaN kept: ready for struct's `e`, which refuses anything larger.

    Infinity becomes the nearest finite number too, because no servo should be sent one.
    """
    # The order of the arguments matters: min and max return their first one when NaN is compared.
    return max(min(value, HALF_MAX), -HALF_MAX)


def fit(name: str, value: int, limit: int) -> int:
    """`value`, when it is within 0..limit. Raises ValueError naming the field, the value and the limit."""
    if not 0 <= value <= limit:
        raise ValueError(f"{name} is {value}. Give 0 to {limit}.")
    return value


def room(name: str, value: bytes, limit: int) -> bytes:
    """`value`, when it has at most `limit` bytes. Raises ValueError naming field and limit."""
    if len(value) > limit:
        raise ValueError(f"{name} is {len(value)} bytes long. Give at most {limit}.")
    return value


def text_bytes(name: str, text: str, limit: int) -> bytes:
    """Text of one byte a character, at most `limit` of them. Raises ValueError for others.

    Latin-1 both ways: every byte sequence on the bus has a text, and that text gives the same bytes back.
    """
    try:
        return room(name, text.encode("latin-1"), limit)
    except UnicodeEncodeError:
        raise ValueError(f"{name} is {text!r}. Use characters of one byte only.") from None
