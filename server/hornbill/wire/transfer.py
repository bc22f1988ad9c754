"""Transfer, and its split into frames: tail byte, transfer CRC, identifier."""

from binascii import crc_hqx
from collections.abc import Callable
from functools import lru_cache
from typing import Final, NamedTuple, cast

from hornbill.units import Instant
from hornbill.wire.datatype import DataType, Kind
from hornbill.wire.frame import Frame
from hornbill.wire.identifier import make_anonymous_id, make_message_id, make_service_id
from hornbill.wire.layout import fit

START: Final = 0x80
END: Final = 0x40
TOGGLE: Final = 0x20
SINGLE_FRAME_BYTES: Final = 7
"""The longest payload of a single frame, which has no transfer CRC."""

_MESSAGE: Final = Kind.MESSAGE
_TAILS: Final = tuple(bytes((tail,)) for tail in range(256))
_new: Final = cast("Callable[[type[Frame], tuple[object, ...]], Frame]", tuple.__new__)


class Transfer(NamedTuple):
    """One complete transfer. `source` 0 is anonymous, `destination` 0 all nodes. Priority 0 (highest) to 31.

    `transfer_id` is 0..31. `at` is the time of its last frame on the bus, 0.0 if not yet sent.
    """

    kind: Kind
    type_id: int
    source: int
    destination: int
    priority: int
    transfer_id: int
    payload: bytes
    at: Instant = 0.0


def split(transfer: Transfer, data_type: DataType, *, discriminator: int | None = None) -> list[Frame]:
    """The frames of a transfer, in order of transmission.

    A transfer with source 0 is sent anonymously and must fit one frame. `discriminator` is then its 14-bit number;
    by default it is computed from the payload, so that nodes with different unique IDs differ.
    Raises ValueError if the transfer is not of `data_type`, a number is out of range, or an anonymous transfer is not
    a message of at most 7 bytes.
    """
    kind, type_id, source, destination, priority, transfer_id, payload, _ = transfer
    if type_id != data_type.id or (kind != _MESSAGE) != data_type.service:
        raise ValueError(f"A {kind.name} with type ID {type_id} is not a transfer of {data_type.name}.")
    if source or kind != _MESSAGE:
        can_id = _identifier(kind, type_id, source, destination, priority)
    else:
        can_id = _anonymous(transfer, discriminator)
    if not 0 <= transfer_id <= 31:
        fit("transfer_id", transfer_id, 31)
    if len(payload) <= SINGLE_FRAME_BYTES:
        return [_new(Frame, (can_id, payload + _TAILS[START | END | transfer_id], 0.0))]
    stream = crc_hqx(payload, data_type.crc_seed).to_bytes(2, "little") + payload
    # Frame(...) without its function call: an ArrayCommand has nine frames.
    return [_new(Frame, (can_id, stream[part] + tail, 0.0)) for part, tail in _cuts(len(stream), transfer_id)]


@lru_cache(maxsize=4096)
def _cuts(length: int, transfer_id: int) -> tuple[tuple[slice, bytes], ...]:
    """Slice and tail of each frame of a stream of `length` bytes. The toggle bit alternates, starting with 0."""
    starts = range(0, length, SINGLE_FRAME_BYTES)
    tails = [transfer_id | (TOGGLE if number & 1 else 0) for number in range(len(starts))]
    tails[0] |= START
    tails[-1] |= END
    return tuple(
        (slice(start, start + SINGLE_FRAME_BYTES), _TAILS[tail]) for start, tail in zip(starts, tails, strict=True)
    )


@lru_cache(maxsize=4096)
def _identifier(kind: Kind, type_id: int, source: int, destination: int, priority: int) -> int:
    """Identifier of a message or service. Cached: there are only a few hundred."""
    if kind != _MESSAGE:
        return make_service_id(priority, type_id, kind == Kind.REQUEST, destination, source)
    _check_addressed_to_all(destination)
    return make_message_id(priority, type_id, source)


def _anonymous(transfer: Transfer, discriminator: int | None) -> int:
    _check_addressed_to_all(transfer.destination)
    payload = transfer.payload
    if len(payload) > SINGLE_FRAME_BYTES:
        raise ValueError(f"{len(payload)} bytes exceed the {SINGLE_FRAME_BYTES} of an anonymous message. Set a source.")
    if discriminator is None:
        discriminator = crc_hqx(payload, 0xFFFF) & 0x3FFF
    return make_anonymous_id(transfer.priority, discriminator, transfer.type_id)


def _check_addressed_to_all(destination: int) -> None:
    if destination:
        raise ValueError(f"Messages are broadcast: destination {destination} must be 0.")
