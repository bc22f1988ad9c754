"""Owns Transfer, and how one is split into frames: tail byte, transfer CRC, identifier."""

from binascii import crc_hqx
from typing import Final, NamedTuple

from hornbill.units import Instant
from hornbill.wire.datatype import DataType, Kind
from hornbill.wire.frame import Frame
from hornbill.wire.identifier import make_anonymous_id, make_message_id, make_service_id
from hornbill.wire.layout import fit

START: Final = 0x80
END: Final = 0x40
TOGGLE: Final = 0x20
SINGLE_FRAME_BYTES: Final = 7
"""The longest payload that travels in one frame, and so without a transfer CRC."""


class Transfer(NamedTuple):
    """One whole transfer. `source` 0 is anonymous, `destination` 0 everybody; priority 0 goes first of 0..31.

    `transfer_id` is 0..31. `at` is the instant its last frame was on the bus, 0.0 for one not yet sent.
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

    A transfer with source 0 goes out anonymously and must fit one frame. `discriminator` is then its 14-bit
    number; without one it is taken from the payload, so that two nodes with different unique ids differ.
    Raises ValueError when the transfer is not of `data_type`, a number does not fit, or it is anonymous and
    not a message of at most 7 bytes.
    """
    can_id = _identifier(transfer, data_type, discriminator)
    payload = transfer.payload
    transfer_id = fit("transfer_id", transfer.transfer_id, 31)
    if len(payload) <= SINGLE_FRAME_BYTES:
        return [Frame(can_id, payload + bytes((START | END | transfer_id,)))]
    stream = crc_hqx(payload, data_type.crc_seed).to_bytes(2, "little") + payload
    last = (len(stream) - 1) // SINGLE_FRAME_BYTES
    frames: list[Frame] = []
    for number in range(last + 1):
        tail = transfer_id | (TOGGLE if number & 1 else 0)
        if number == 0:
            tail |= START
        if number == last:
            tail |= END
        start = number * SINGLE_FRAME_BYTES
        frames.append(Frame(can_id, stream[start : start + SINGLE_FRAME_BYTES] + bytes((tail,))))
    return frames


def _identifier(transfer: Transfer, data_type: DataType, discriminator: int | None) -> int:
    kind, type_id, source, destination, priority = transfer[:5]
    if type_id != data_type.id or (kind != Kind.MESSAGE) != data_type.service:
        raise ValueError(f"A {kind.name} with type id {type_id} is not a transfer of {data_type.name}.")
    if kind != Kind.MESSAGE:
        return make_service_id(priority, type_id, kind == Kind.REQUEST, destination, source)
    if destination:
        raise ValueError(f"A message goes to everybody: destination {destination} must be 0.")
    if source:
        return make_message_id(priority, type_id, source)
    if len(transfer.payload) > SINGLE_FRAME_BYTES:
        raise ValueError(
            f"{len(transfer.payload)} bytes are above the {SINGLE_FRAME_BYTES} of an anonymous message. "
            "Give it a source."
        )
    if discriminator is None:
        discriminator = crc_hqx(transfer.payload, 0xFFFF) & 0x3FFF
    return make_anonymous_id(priority, discriminator, type_id)
