"""The MAVLink codec, against vectors made with pymavlink and against pymavlink itself."""

import io
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as peer

from hornbill.bus.ports import mavlink
from hornbill.bus.ports import mavlink_codec as codec
from hornbill.bus.ports.mavlink_codec import Kind, Reader, Writer

KEY = codec.key_of("correct horse")
DATA = bytes.fromhex("000030783243c5")

# Made with pymavlink 2.4.50: system 1, component 1, sequence 7.
HEARTBEAT = "fd0900000701010000000400000002030003039059"
CAN_FRAME = "fd0f0000070101820100ff940b9efac00007000030783243c50de9"
FILTER = "fd25000007010184010000000100550100000000000000000000000000000000000000000000000000000100010003bd42"


def theirs(key: bytes | None = None) -> Any:
    """A pymavlink encoder and decoder, system 1, component 1."""
    made = peer.MAVLink(io.BytesIO(), srcSystem=1, srcComponent=1)
    if key is not None:
        made.signing.secret_key = key
        made.signing.sign_outgoing = True
        made.signing.timestamp = codec.now_units()
    return made


def packed(made: Any, message: Any) -> bytes:
    data = bytes(message.pack(made))
    made.seq = (made.seq + 1) % 256
    return data


def frames(made: Any, count: int) -> list[bytes]:
    return [packed(made, made.can_frame_encode(250, 192, 0, 1, 1 << 31 | 341, [n, 0, 0, 0, 0, 0, 0, 0]))
            for n in range(count)]  # fmt: skip


def numbers(reader: Reader, *parts: bytes) -> list[int]:
    """First data byte of each frame decoded."""
    return [frame.data[0] for part in parts for message in reader.feed(part)
            if message.kind == Kind.CAN_FRAME and (frame := codec.can_frame_of(message.payload))]  # fmt: skip


@pytest.mark.parametrize("key", [None, KEY], ids=["unsigned", "signed"])
def test_pymavlink_decodes_what_we_encode(key: bytes | None) -> None:
    writer, made = Writer(250, 192, key), theirs(key)
    decoded: list[Any] = []
    for kind, payload in (
        (Kind.HEARTBEAT, codec.heartbeat()),
        (Kind.COMMAND_LONG, codec.command(32000, 2, 1)),
        (Kind.CAN_FILTER_MODIFY, codec.can_filter((0, 1, 341), 2, 1)),
        (Kind.CAN_FILTER_MODIFY, codec.can_filter((), 1, 1)),
        (Kind.CAN_FRAME, codec.can_frame(1 << 31 | 0x1E0B94FF, DATA, 1, 1)),
        (Kind.CAN_FRAME, codec.can_frame(0, b"", 0, 0)),
    ):
        decoded += made.parse_buffer(writer.encode(kind, payload)) or []
    beat, order, these, none, frame, empty = decoded
    assert [one.get_seq() for one in decoded] == list(range(6))
    assert (beat.get_srcSystem(), beat.get_srcComponent(), beat.autopilot) == (250, 192, 8)
    assert (order.command, order.param1, order.target_system) == (32000, 2.0, 1)
    assert (these.bus, these.num_ids, these.operation, these.ids[:4]) == (2, 3, 0, [0, 1, 341, 0])
    assert none.num_ids == 0
    assert (frame.bus, frame.id, frame.len, bytes(frame.data[: frame.len])) == (1, 1 << 31 | 0x1E0B94FF, 7, DATA)
    assert (empty.id, empty.len) == (0, 0)


@pytest.mark.parametrize("key", [None, KEY], ids=["unsigned", "signed"])
def test_we_decode_what_pymavlink_encodes(key: bytes | None) -> None:
    reader, made = Reader(key), theirs(key)
    data = b"".join(packed(made, message) for message in (
        made.heartbeat_encode(2, 3, 0, 4, 3, 3),
        made.command_ack_encode(32000, 4),
        made.can_frame_encode(0, 0, 1, 7, 1 << 31 | 5, [*DATA, 0]),
        made.can_frame_encode(0, 0, 1, 9, 1 << 31 | 5, [0] * 8),
    ))  # fmt: skip
    beat, answer, frame, overlong = reader.feed(data)
    assert (codec.heartbeat_of(beat.payload), beat.system, beat.signed) == ((2, 3), 1, key is not None)
    assert codec.acknowledged(answer.payload) == (32000, 4)
    assert codec.can_frame_of(frame.payload) == (1 << 31 | 5, 1, DATA)
    assert codec.can_frame_of(overlong.payload) is None
    assert (reader.garbled, reader.lost, reader.unsigned, reader.wrongly_signed) == (0, 0, 0, 0)


def test_vectors_of_pymavlink() -> None:
    (message,) = Reader().feed(bytes.fromhex(HEARTBEAT))
    assert (message.kind, message.system, message.component) == (Kind.HEARTBEAT, 1, 1)
    assert mavlink.system_of(bytes.fromhex(HEARTBEAT)) == 1
    writer = Writer(1, 1)
    for _ in range(7):
        writer.encode(Kind.HEARTBEAT, codec.heartbeat())
    assert writer.encode(Kind.CAN_FRAME, codec.can_frame(1 << 31 | 0x1E0B94FF, DATA, 0, 250, 192)).hex() == CAN_FRAME
    writer = Writer(1, 1)
    for _ in range(7):
        writer.encode(Kind.HEARTBEAT, codec.heartbeat())
    assert writer.encode(Kind.CAN_FILTER_MODIFY, codec.can_filter((0, 1, 341), 1, 1)).hex() == FILTER


def test_a_missing_message_is_counted_and_telemetry_is_not() -> None:
    made, reader = theirs(), Reader()
    one, _, three = frames(made, 3)
    attitude = [packed(made, made.attitude_encode(n, 0, 0, 0, 0, 0, 0)) for n in range(5)]
    (after,) = frames(made, 1)
    assert numbers(reader, one, three, *attitude, after) == [0, 2, 0]
    assert (reader.lost, reader.garbled) == (1, 0)


def test_most_damaged_telemetry_is_detected() -> None:
    made = theirs()
    detected = 0
    for bit in range(8 * 24):
        reader = Reader()
        first, damaged = frames(made, 1)[0], bytearray(packed(made, made.attitude_encode(1, 2, 3, 4, 5, 6, 7)))
        damaged[10 + bit // 8] ^= 1 << bit % 8
        list(reader.feed(first + bytes(damaged) + frames(made, 1)[0]))
        detected += reader.lost == 1 and reader.garbled == 1
    assert detected > 180


def test_the_sequence_wraps_and_a_late_message_counts_nothing() -> None:
    made, reader = theirs(), Reader()
    sent = frames(made, 256)
    sent += frames(made, 4)
    sent[100], sent[101] = sent[101], sent[100]
    assert len(numbers(reader, *sent)) == 260
    assert reader.lost <= 2


@given(st.integers(0, 27), st.integers(1, 255))
def test_a_changed_byte_is_detected_and_the_next_message_decoded(at: int, change: int) -> None:
    made, reader = theirs(), Reader()
    first, damaged, last = frames(made, 3)
    damaged = bytearray(damaged)
    damaged[at % len(damaged)] ^= change
    got = numbers(reader, first, bytes(damaged), last, *frames(made, 12))
    assert got[0] == 0
    assert 1 not in got[1:2]
    assert got[-2:] == [10, 11]
    if at not in range(7, 10):  # another message ID fits some checksum one time in 256
        assert reader.garbled + reader.lost >= 1


@given(st.lists(st.binary(max_size=300), max_size=8), st.booleans())
def test_arbitrary_bytes_never_raise(parts: list[bytes], signed: bool) -> None:
    reader = Reader(KEY if signed else None)
    for part in parts:
        list(reader.feed(b"\xfd" + part))
        list(reader.feed(b"\xfe" + part[:40]))
    made = theirs(KEY if signed else None)
    assert numbers(reader, *frames(made, 40))[-1] == 39, "it is in step again"


@given(st.lists(st.integers(1, 30), min_size=1, max_size=40))
def test_messages_are_found_however_the_stream_is_cut(cuts: list[int]) -> None:
    made, reader = theirs(), Reader()
    data = b"".join(frames(made, 12))
    parts: list[bytes] = []
    for size in cuts:
        parts.append(data[:size])
        data = data[size:]
    assert numbers(reader, *parts, data) == list(range(12))
    assert (reader.garbled, reader.lost) == (0, 0)


def test_only_messages_with_the_key_are_accepted_and_each_once() -> None:
    reader = Reader(KEY)
    made = theirs(KEY)
    (one,) = frames(made, 1)
    assert numbers(reader, one) == [0]
    assert numbers(reader, one) == [], "a repetition"
    assert numbers(reader, *frames(theirs(codec.key_of("wrong")), 1), *frames(theirs(), 2)) == []
    assert (reader.wrongly_signed, reader.unsigned) == (2, 2)
    assert numbers(Reader(), one) == [0], "without a key, signatures are not checked"


def test_pymavlink_rejects_a_wrong_key() -> None:
    made = theirs(KEY)
    data = Writer(250, 192, codec.key_of("wrong")).encode(Kind.HEARTBEAT, codec.heartbeat())
    with pytest.raises(peer.MAVError, match="Invalid signature"):
        made.parse_buffer(data)
