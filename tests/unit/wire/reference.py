"""Reference receiver: finds the transfers in a row of frames by searching back from each last frame.

It keeps no sessions, knows all frames beforehand and takes the transfer CRC bit by bit, so that it shares no mistake
with Reassembler.
"""

from collections.abc import Sequence

from hornbill.wire import types
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.identifier import parse
from hornbill.wire.transfer import Transfer

TIMEOUT_S = 2.0
LONGEST = 512
"""Bytes before the frame that ends a transfer, CRC included."""


def transfers_in(frames: Sequence[Frame]) -> list[Transfer]:
    """The transfers in `frames`, with unlimited sessions, in the order of their last frames."""
    rows: dict[int, list[Frame]] = {}
    found: list[Transfer] = []
    for frame in frames:
        if not frame.data or not 0 <= frame.id < 1 << 29:
            continue
        row = rows.setdefault(frame.id, [])
        tail = frame.data[-1]
        if tail & 0xC0 == 0xC0:  # single-frame: independent of a pending longer transfer
            if not tail & 0x20:
                found += _transfer([frame], frame.data[:-1])
            continue
        row.append(frame)
        if tail & 0x40:
            found += _longer(row)
    return found


def _longer(row: list[Frame]) -> list[Transfer]:
    """The transfer completed by the last frame of a row, if complete."""
    first = next((place for place in range(len(row) - 1, -1, -1) if row[place].data[-1] & 0x80), None)
    if first is None or any(frame.data[-1] & 0x40 for frame in row[first:-1]):
        return []
    parts: list[Frame] = []
    for frame in row[first:]:
        late = bool(parts) and frame.at - parts[0].at > TIMEOUT_S
        if late or not parts or frame.data != parts[-1].data:  # an immediate repetition is ignored
            parts.append(frame)
    number = parts[0].data[-1] & 31
    tails = [number | (0x20 if place % 2 else 0) for place in range(len(parts))]
    tails[0] |= 0x80
    tails[-1] |= 0x40
    stream = b"".join(frame.data[:-1] for frame in parts)
    before_last = sum(len(frame.data) - 1 for frame in parts[:-1])
    identifier = parse(parts[0].id)
    data_type = types.BY_KEY.get((identifier.kind != Kind.MESSAGE, identifier.type_id))
    if (
        [frame.data[-1] for frame in parts] != tails
        or any(frame.at - parts[0].at > TIMEOUT_S for frame in parts)
        or len(parts[0].data) < 4
        or before_last > LONGEST
        or not identifier.source
        or data_type is None
    ):
        return []
    payload = stream[2:]
    if _crc(data_type.signature.to_bytes(8, "little") + payload) != int.from_bytes(stream[:2], "little"):
        return []
    return _transfer(parts, payload)


def _transfer(parts: list[Frame], payload: bytes) -> list[Transfer]:
    kind, type_id, source, destination, priority, _ = parse(parts[0].id)
    if kind != Kind.MESSAGE and not (source and destination):
        return []
    number = parts[0].data[-1] & 31
    return [Transfer(kind, type_id, source, destination, priority, number, payload, parts[-1].at)]


def _crc(data: bytes) -> int:
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc
