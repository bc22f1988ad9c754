"""The ring of frames: nothing is lost within its bounds, which it never exceeds."""

import random

from hypothesis import given
from hypothesis import strategies as st

from hornbill.servo.recorder.frame_ring import LIMIT_BYTES, RETAIN_S, FrameRing
from hornbill.wire.frame import Frame

FRAMES = st.lists(
    st.tuples(st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8), st.integers(0, 30_000_000), st.booleans()),
    max_size=60,
)


@given(FRAMES)
def test_frames_are_returned_in_order_of_time(given_frames: list[tuple[int, bytes, int, bool]]) -> None:
    ring = FrameRing()
    expected = sorted(
        ((us / 1e6, number, data, sent) for number, data, us, sent in given_frames), key=lambda one: one[0]
    )
    for at, number, data, sent in expected:
        ring.add([Frame(number, data, at)], sent)
    out = [one for part in ring.slices(0.0, 1e9) for one in part]
    assert [(one.frame.at, one.frame.id, one.frame.data, one.sent) for one in out] == expected
    assert ring.frames == len(expected)


def test_late_frames_are_sorted_in() -> None:
    ring = FrameRing()
    for second in range(30):
        ring.add([Frame(1, b"ours", second + 0.02)], True)
        ring.add([Frame(2, b"theirs", second + 0.01)], False)
    out = [one for part in ring.slices(5.0, 20.0) for one in part]
    assert [one.frame.data for one in out] == [b"theirs", b"ours"] * 15
    assert [one.sent for one in out] == [False, True] * 15


def test_the_ring_keeps_ten_minutes_and_stays_within_its_memory() -> None:
    ring = FrameRing()
    batch = [Frame(n * 7919 & 0x1FFF_FFFF, bytes(8), 0.0) for n in range(500)]
    most = 0
    for second in range(1200):
        ring.add([one._replace(at=float(second)) for one in batch], False)
        most = max(most, ring.size)
    assert most < 625 * len(batch) * 21
    assert ring.since is not None
    assert RETAIN_S <= 1200 - ring.since <= RETAIN_S + 21
    assert not ring.full
    assert 7_000 * 21 * (RETAIN_S + 20) < LIMIT_BYTES - (2 << 20), "ten minutes of a full bus have room"


def test_a_full_ring_drops_the_oldest_frames_and_reports_it() -> None:
    ring = FrameRing(limit_bytes=4 << 20)
    chance = random.Random(1)
    batch = [Frame(chance.getrandbits(29), chance.randbytes(8), 0.0) for _ in range(1000)]
    for tenth in range(400):
        ring.add([one._replace(at=tenth / 10) for one in batch], False)
        assert ring.size <= 4 << 20
    assert ring.full
    assert ring.since is not None
    newest = [one for part in ring.slices(30.0, 200.0) for one in part]
    assert len(newest) >= 9 * 10 * 1000
    assert not [*ring.slices(200.0, 300.0)], "no chunk is of that time"


def test_old_frames_of_a_silent_bus_are_dropped() -> None:
    ring = FrameRing()
    ring.add([Frame(1, b"", 0.0)], False)
    ring.add([Frame(1, b"", 11.0)], False)
    ring.forget_old(610.5)
    assert ring.since == 11.0


def test_frames_have_the_name_of_their_bus() -> None:
    ring = FrameRing()
    ring.switch_channel("can0")
    ring.add([Frame(1, b"", 1.0)], False)
    ring.switch_channel("can1")
    ring.add([Frame(1, b"", 2.0)], False)
    assert [one.channel for part in ring.slices(0, 9) for one in part] == ["can0", "can1"]
