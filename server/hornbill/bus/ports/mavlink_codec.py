"""Codec of MAVLink 2, for the messages that forward a CAN bus: Writer, Reader and their payloads.

A message is, little endian: 0xFD, payload length, two flag bytes, sequence number, system, component, message ID
(24 bits), payload without trailing zeros, CRC, and 13 bytes of signature if it is signed.
"""

import hashlib
import hmac
import struct
import time
from collections.abc import Callable, Iterator
from enum import IntEnum
from typing import Final, NamedTuple

from hornbill.bus.ports.mavlink import checksum

HEAD: Final = 12
"""Bytes of a message besides its payload, unsigned."""
SIGNATURE: Final = 13
CAN_FRAME_BYTES: Final = HEAD + 16
"""Bytes of a forwarded CAN frame with eight bytes of data, unsigned."""

_V1, _V2 = 0xFE, 0xFD
_SIGNED: Final = 1
_LINK: Final = 0
"""Link ID in our signatures."""
_EPOCH: Final = 1_420_070_400
"""Signatures count units of 10 µs since 2015."""
_UNITS_PER_S: Final = 100_000
_HALF: Final = 128


class Kind(IntEnum):
    """Message IDs."""

    HEARTBEAT = 0
    COMMAND_LONG = 76
    COMMAND_ACK = 77
    CAN_FRAME = 386
    CANFD_FRAME = 387
    CAN_FILTER_MODIFY = 388


_LAYOUT: Final[dict[int, tuple[int, int]]] = {
    Kind.HEARTBEAT: (50, 9),
    Kind.COMMAND_LONG: (152, 33),
    Kind.COMMAND_ACK: (143, 10),
    Kind.CAN_FRAME: (132, 16),
    Kind.CANFD_FRAME: (4, 72),
    Kind.CAN_FILTER_MODIFY: (8, 37),
}
"""CRC_EXTRA byte of the checksum, and longest payload."""

_STEPS: Final = frozenset(checksum(bytes((byte ^ 0xFF,))) ^ 0xFF for byte in range(256))
"""What one byte may change in a checksum: of 65,536 values, these 256."""

_HEARTBEAT: Final = struct.Struct("<IBBBBB")
_COMMAND: Final = struct.Struct("<7fHBBB")
_CAN: Final = struct.Struct("<IBBBB8s")
_FILTER: Final = struct.Struct("<16HBBBBB")


class Message(NamedTuple):
    """A received message. `payload` is padded to its full length."""

    kind: int
    system: int
    component: int
    payload: bytes
    signed: bool
    """Whether it carries a signature, valid or not known to be invalid."""


class Heartbeat(NamedTuple):
    """What a HEARTBEAT says about its sender."""

    vehicle: int
    autopilot: int


class CanFrame(NamedTuple):
    """A forwarded CAN frame. `identifier`: bit 31 extended, 30 remote, 29 error. `bus` is counted from 0."""

    identifier: int
    bus: int
    data: bytes


def heartbeat_of(payload: bytes) -> Heartbeat:
    """Decode a HEARTBEAT."""
    _, vehicle, autopilot, *_ = _HEARTBEAT.unpack_from(payload)
    return Heartbeat(vehicle, autopilot)


def heartbeat() -> bytes:
    """A HEARTBEAT of a program that is neither vehicle nor ground station."""
    return _HEARTBEAT.pack(0, 18, 8, 0, 4, 3)  # onboard controller, no autopilot, active, version 3


def command(number: int, parameter: float, system: int, component: int = 0) -> bytes:
    """A COMMAND_LONG with one parameter."""
    return _COMMAND.pack(parameter, 0, 0, 0, 0, 0, 0, number, system, component, 0)


def acknowledged(payload: bytes) -> tuple[int, int]:
    """Number of the command that a COMMAND_ACK answers, and its result (0: accepted)."""
    return int.from_bytes(payload[:2], "little"), payload[2]


def can_frame(identifier: int, data: bytes, bus: int, system: int, component: int = 0) -> bytes:
    """A CAN_FRAME for `bus`, counted from 0."""
    return _CAN.pack(identifier, system, component, bus, len(data), data)


def can_frame_of(payload: bytes) -> CanFrame | None:
    """Decode a CAN_FRAME. None if its length is above 8."""
    identifier, _, _, bus, length, data = _CAN.unpack_from(payload)
    return CanFrame(identifier, bus, data[:length]) if length <= 8 else None


def can_filter(ids: tuple[int, ...], bus: int, system: int, component: int = 0) -> bytes:
    """A CAN_FILTER_MODIFY that forwards only these up to 16 IDs of `bus`, counted from 1. None: forward everything."""
    return _FILTER.pack(*ids, *(0,) * (16 - len(ids)), system, component, bus, 0, len(ids))


def key_of(passphrase: str) -> bytes:
    """The signing key that ground stations derive from a passphrase."""
    return hashlib.sha256(passphrase.encode()).digest()


def now_units(clock: Callable[[], float] = time.time) -> int:
    """The time in signatures."""
    return int((clock() - _EPOCH) * _UNITS_PER_S)


class Writer:
    """Encodes messages of one sender. Not thread-safe: messages must be sent in the order they are encoded."""

    def __init__(self, system: int, component: int, key: bytes | None = None) -> None:
        """`key` signs the messages."""
        self._sender = bytes((system, component))
        self._key = key
        self._sequence = 0
        self._signed_at = 0

    def encode(self, kind: Kind, payload: bytes) -> bytes:
        """One message."""
        payload = payload.rstrip(b"\0") or payload[:1]
        flags = 0 if self._key is None else _SIGNED
        head = bytes((len(payload), flags, 0, self._sequence)) + self._sender + kind.to_bytes(3, "little")
        self._sequence = (self._sequence + 1) & 0xFF
        body = head + payload
        data = b"\xfd" + body + checksum(body + bytes((_LAYOUT[kind][0],))).to_bytes(2, "little")
        if self._key is None:
            return data
        self._signed_at = max(self._signed_at + 1, now_units())
        data += bytes((_LINK,)) + self._signed_at.to_bytes(6, "little")
        return data + _signature(self._key, data)


class Reader:
    """Decodes messages from a stream of bytes. Never raises: whatever is invalid is dropped and counted."""

    def __init__(self, key: bytes | None = None) -> None:
        """With `key`, only messages signed with it are accepted, each once."""
        self.garbled = 0
        """Messages with a wrong checksum, or bytes between messages."""
        self.lost = 0
        """Messages missing in the sequence of a sender."""
        self.unsigned = 0
        """Messages dropped because they are not signed."""
        self.wrongly_signed = 0
        """Messages dropped because their signature is not by our key, or is a repetition."""
        self._key = key
        self._data = b""
        self._in_step = False  # the data begins where a message ended
        self._sequences: dict[tuple[int, int], int] = {}
        self._unverified: dict[tuple[int, int], int] = {}
        self._latest: dict[tuple[int, int, int], int] = {}

    def feed(self, data: bytes) -> Iterator[Message]:
        """Messages completed by `data`."""
        self._data += data
        at = 0
        while at < len(self._data):
            size = self._message_size(at)
            if size is None:
                break
            if not size:
                at = self._skip(at)
                continue
            if (message := self._take(at, size)) is not None:
                yield message
            self._in_step = True
            at += size
        self._data = self._data[at:]

    def begin(self) -> None:
        """The next data begins with a message, as a datagram does."""
        self.garbled += bool(self._data)
        self._data, self._in_step = b"", True

    def _skip(self, at: int) -> int:
        """Position of the next possible message after `at`, where there is none."""
        self.garbled += self._in_step
        self._in_step = False
        after = [found for magic in (b"\xfd", b"\xfe") if (found := self._data.find(magic, at + 1)) >= 0]
        return min(after, default=len(self._data))

    def _message_size(self, at: int) -> int | None:
        """Size of the message at `at`, 0 if there is none, None if it is incomplete."""
        data = self._data
        magic, left = data[at], len(data) - at
        if magic == _V1:
            return None if left < 2 else self._checked(at, 6, data[at + 1] + 8)
        if magic != _V2:
            return 0
        if left < 3:
            return None
        flags = data[at + 2]
        if flags & ~_SIGNED:
            return 0
        return self._checked(at, 10, data[at + 1] + HEAD + flags * SIGNATURE)

    def _checked(self, at: int, head: int, size: int) -> int | None:
        data = self._data
        if len(data) < at + head:
            return None
        kind = self._kind(at)
        layout = _LAYOUT.get(kind)
        if layout is None:
            return self._unknown(at, head, size)
        extra, longest = layout
        if data[at + 1] > longest:
            return 0
        if len(data) < at + size:
            return None
        end = at + head + data[at + 1]
        expected = checksum(data[at + 1 : end] + bytes((extra,)))
        return size if data[end : end + 2] == expected.to_bytes(2, "little") else 0

    def _unknown(self, at: int, head: int, size: int) -> int | None:
        """`size` of a message of an unknown type if it lies between two others and some CRC_EXTRA fits its checksum."""
        data = self._data
        if not self._in_step:
            return 0
        if len(data) < at + size:
            return None
        end = at + head + data[at + 1]
        before = checksum(data[at + 1 : end])
        expected = int.from_bytes(data[end : end + 2], "little")
        fits = expected ^ before >> 8 in _STEPS and data[at + size : at + size + 1] in (b"", b"\xfd", b"\xfe")
        return size if fits else 0

    def _kind(self, at: int) -> int:
        data = self._data
        return data[at + 5] if data[at] == _V1 else int.from_bytes(data[at + 7 : at + 10], "little")

    def _take(self, at: int, size: int) -> Message | None:
        data = self._data
        first = data[at] == _V1
        sequence, system, component = data[at + 2 : at + 5] if first else data[at + 4 : at + 7]
        kind = self._kind(at)
        sender = (system, component)
        layout = _LAYOUT.get(kind)
        if layout is None:
            self._unverified[sender] = self._unverified.get(sender, 0) + 1
            return None
        self._count(sender, sequence)
        signed = not first and bool(data[at + 2] & _SIGNED)
        if self._key is not None and not self._is_authentic(data[at : at + size] if signed else b"", sender):
            return None
        begin = at + (6 if first else 10)
        payload = data[begin : begin + data[at + 1]].ljust(layout[1], b"\0")
        return Message(kind, system, component, payload, signed)

    def _count(self, sender: tuple[int, int], sequence: int) -> None:
        """Count the messages missing before this one. Messages of unknown types in between were not verified."""
        before = self._sequences.get(sender)
        between = self._unverified.pop(sender, 0)
        if before is not None:
            gap = (sequence - before - 1 - between) & 0xFF
            if gap >= _HALF:  # repeated or late; or a message taken for one of an unknown type
                gap = 0
            self.lost += gap
        self._sequences[sender] = sequence

    def _is_authentic(self, message: bytes, sender: tuple[int, int]) -> bool:
        if not message:
            self.unsigned += 1
            return False
        assert self._key is not None
        at = int.from_bytes(message[-12:-6], "little")
        stream = (*sender, message[-13])
        if not hmac.compare_digest(message[-6:], _signature(self._key, message[:-6])) or at <= self._latest.get(
            stream, -1
        ):
            self.wrongly_signed += 1
            return False
        self._latest[stream] = at
        return True


def _signature(key: bytes, message: bytes) -> bytes:
    return hashlib.sha256(key + message).digest()[:6]
