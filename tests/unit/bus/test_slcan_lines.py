"""Lines of the slcan protocol: every form, and invalid data."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.bus.ports.errorframe import BUS_ERROR, NOW_ACTIVE, NOW_BUS_OFF, NOW_PASSIVE, OVERFLOW, UNACKNOWLEDGED
from hornbill.bus.ports.link import Received
from hornbill.bus.ports.slcan_lines import LONGEST, Lines, line_of
from hornbill.wire.frame import Frame

frames = st.builds(Frame, st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8), st.just(1.0))


def said(text: bytes) -> Received:
    return Lines().feed(text, 1.0)


def test_a_frame_is_written_as_in_the_manuals() -> None:
    assert line_of(Frame(0x1234567, b"\x00\xab\xff")) == b"T01234567300ABFF\r"
    assert line_of(Frame(0x1FFFFFFF, b"")) == b"T1FFFFFFF0\r"
    assert len(line_of(Frame(0, bytes(8)))) == LONGEST


@settings(max_examples=40)
@given(st.lists(frames, max_size=20), st.data())
def test_frames_are_read_back_complete_and_in_order_wherever_the_text_is_split(
    sent: list[Frame], data: st.DataObject
) -> None:
    text = b"".join(map(line_of, sent))
    lines, got, at = Lines(), list[Frame](), 0
    while at < len(text):
        size = data.draw(st.integers(1, 40))
        received = lines.feed(text[at : at + size], 1.0)
        assert (received.garbled, received.ignored, received.refused, received.errors) == (0, 0, 0, [])
        got += received.frames
        at += size
    assert got == sent


@pytest.mark.parametrize("stamp", [b"", b"EA5F", b"0123ABCD"], ids=["none", "milliseconds", "microseconds"])
def test_a_timestamp_after_the_data_is_ignored(stamp: bytes) -> None:
    assert said(b"T18AABB0121122" + stamp + b"\r").frames == [Frame(0x18AABB01, b"\x11\x22", 1.0)]


def test_small_letters_and_line_feeds_are_tolerated() -> None:
    assert said(b"T18aabb012aaff\r").frames == [Frame(0x18AABB01, b"\xaa\xff", 1.0)]
    assert said(b"\r\n\nz\r\n").garbled == 0


@pytest.mark.parametrize(
    "line",
    [
        b"T2000000001",  # 30 bits
        b"T1234567",  # no length
        b"T12345678",
        b"T12345678211",  # a byte short
        b"T1234567821",  # half a byte
        b"T12345678911223344556677889900",  # nine bytes
        b"T1234567821122335",  # data or stamp?
        b"T 234567821122",
        b"T+234567821122",
        b"T12_4567821122",
        b"T12345678211T123456780",  # two merged lines
        b"T123456782\xff\xfe",
        b"F0",
        b"F+1",
        b"s",
        b"sx000000",
        b"sa0000-1",
        b"e1",
        b"hello",
        b"\x00",
        b"\xff\xfe\xfd",
        b"t12",
        b"Q1231",
    ],
)
def test_an_invalid_line_is_counted_and_the_next_frame_is_read(line: bytes) -> None:
    got = said(line + b"\rT000000010\r")
    assert got == Received(frames=[Frame(1, b"", 1.0)], garbled=1)


@pytest.mark.parametrize(
    "line",
    [b"t1232AABB", b"t1230", b"r1238", b"R123456788", b"d1239" + b"00" * 12, b"D12345678F" + b"00" * 64, b"b1231AA",
     b"B123456781AA"],
)  # fmt: skip
def test_standard_remote_and_fd_frames_are_ignored_and_counted(line: bytes) -> None:
    assert said(line + b"\r") == Received(ignored=1)


def test_acknowledgements_of_every_kind_are_not_errors() -> None:
    lines = Lines()
    assert lines.feed(b"\rz\rZ\rzt1230\rZT123456780\r#\r", 1.0) == Received()
    assert (lines.accepted, lines.refused) == (2, 0)


def test_bell_is_a_refusal_with_or_without_a_line_end() -> None:
    lines = Lines()
    assert lines.feed(b"\a\a\rZ\r\aT000000010\r#4\r", 1.0) == Received(frames=[Frame(1, b"", 1.0)], refused=4)
    assert (lines.accepted, lines.refused) == (1, 4)  # the CR after a BELL cannot be distinguished from a response


def test_refusals_of_frames_before_a_channel_is_reopened_are_not_the_responses_to_reopening() -> None:
    lines = Lines()
    seen = [lines.feed(b"\a", 1.0).refused]
    lines.reopening()
    for response in (b"\a", b"\a\a\a", b"\r", b"\a", b"\r"):  # four frames; C, S8 (refused) and O
        seen.append(lines.feed(response, 2.0).refused)
        assert lines.refused_since == 1.0, "no response was to an accepted frame"
    assert seen == [1, 1, 3, 0, 0, 0]
    assert lines.feed(b"\a", 3.0).refused == 1
    lines.feed(b"\r", 3.0)
    assert lines.refused_since is None


def test_status_flags_report_passive_once_but_overruns_and_bus_errors_each_time() -> None:
    lines = Lines()
    seen = [lines.feed(flags + b"\r", 1.0).errors for flags in (b"F00", b"F24", b"F24", b"FA0", b"F08", b"F47")]
    assert seen == [[], [NOW_PASSIVE], [], [BUS_ERROR], [OVERFLOW, NOW_ACTIVE], []]
    assert lines.flags == 6


def test_unsolicited_reports_become_error_frames() -> None:
    assert said(b"sa057033\rsw097000\rsp128000\rsb255000\r").errors == [
        NOW_ACTIVE, NOW_ACTIVE, NOW_PASSIVE, NOW_BUS_OFF,
    ]  # fmt: skip
    assert said(b"e1a\re3bcO\re2so\r").errors == [UNACKNOWLEDGED, BUS_ERROR, BUS_ERROR, OVERFLOW]


@settings(max_examples=40)
@given(st.lists(st.binary(max_size=2000) | st.sampled_from([b"\r", b"\a", b"T", b"T123", b"F", b"s", b"e9", b"#"])))
def test_arbitrary_bytes_neither_raise_nor_accumulate(pieces: list[bytes]) -> None:
    lines = Lines()
    for piece in pieces:
        got = lines.feed(piece, 1.0)
        for frame in got.frames:
            assert frame.id <= 0x1FFF_FFFF
            assert len(frame.data) <= 8
        assert len(lines._rest) <= 2600  # pyright: ignore[reportPrivateUsage]


def test_an_endless_line_is_dropped() -> None:
    lines = Lines()
    assert sum(lines.feed(b"x" * 100, 1.0).garbled for _ in range(100)) > 10
    assert lines.feed(b"\rT000000010\r", 1.0).frames == [Frame(1, b"", 1.0)]


def test_a_frame_after_noise_is_read_and_the_noise_counted() -> None:
    got = said(b"\xf0\x81T0000000112A\rT000000010\r")
    assert got == Received(frames=[Frame(1, b"\x2a", 1.0), Frame(1, b"", 1.0)], garbled=1)
    assert said(b"\xf0\x81T0000000122A\r") == Received(garbled=1), "half a frame"
