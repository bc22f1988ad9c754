"""Conversion between 29-bit CAN identifiers and their fields: message, anonymous message and service."""

from typing import Final, NamedTuple

from hornbill.wire.datatype import Kind
from hornbill.wire.layout import fit

_SERVICE: Final = 1 << 7
_REQUEST: Final = 1 << 15


class Identifier(NamedTuple):
    """The fields of one identifier.

    `destination` is 0 for messages, `source` is 0 for anonymous ones. For an anonymous message `type_id`
    contains only the low two bits of its type, and `discriminator` 14 bits; for all others it is None.
    """

    kind: Kind
    type_id: int
    source: int
    destination: int
    priority: int
    discriminator: int | None


def make_message_id(priority: int, type_id: int, source: int) -> int:
    """The identifier of a message: priority 0 (first) to 31, type 0..65535, source 1..127.

    Raises ValueError for values out of range.
    """
    return fit("priority", priority, 31) << 24 | fit("type_id", type_id, 0xFFFF) << 8 | _node("source", source)


def make_anonymous_id(priority: int, discriminator: int, type_id: int) -> int:
    """The identifier of a message without a source: discriminator 0..16383, type 0..3.

    Raises ValueError for values out of range.
    """
    return (
        fit("priority", priority, 31) << 24
        | fit("discriminator", discriminator, 0x3FFF) << 10
        | fit("type_id of an anonymous message", type_id, 3) << 8
    )


def make_service_id(priority: int, type_id: int, request: bool, destination: int, source: int) -> int:
    """The identifier of a request or response: type 0..255, destination and source 1..127.

    Raises ValueError for values out of range.
    """
    return (
        fit("priority", priority, 31) << 24
        | fit("type_id", type_id, 0xFF) << 16
        | (_REQUEST if request else 0)
        | _node("destination", destination) << 8
        | _SERVICE
        | _node("source", source)
    )


def parse(identifier: int) -> Identifier:
    """The fields of any identifier; bits above the 29th are ignored. Never raises.

    A service frame with node 0 at either end is invalid, but still parsed for display in a monitor.
    """
    priority = identifier >> 24 & 31
    source = identifier & 0x7F
    if identifier & _SERVICE:
        kind = Kind.REQUEST if identifier & _REQUEST else Kind.RESPONSE
        return Identifier(kind, identifier >> 16 & 0xFF, source, identifier >> 8 & 0x7F, priority, None)
    if source:
        return Identifier(Kind.MESSAGE, identifier >> 8 & 0xFFFF, source, 0, priority, None)
    return Identifier(Kind.MESSAGE, identifier >> 8 & 3, 0, 0, priority, identifier >> 10 & 0x3FFF)


def _node(name: str, number: int) -> int:
    if not 1 <= number <= 127:
        raise ValueError(f"{name} is {number}. Enter a node ID, 1 to 127.")
    return number
