"""The ring of frames: nothing is lost within its bounds, and its bounds hold whatever the bus brings."""

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
def test_what_was_put_in_comes_out_in_order_of_time(given_frames: list[tuple[int, bytes, int, bool]]) -> None:
    ring = FrameRing()
    told = sorted(((us / 1e6, number, data, sent) for number, data, us, sent in given_frames), key=lambda one: one[0])
    for at, number, data, sent in told:
        ring.add([Frame(number, data, at)], sent)
    out = [one for part in ring.slices(0.0, 1e9) for one in part]
    assert [(one.frame.at, one.frame.id, one.frame.data, one.sent) for one in out] == told
    assert ring.frames == len(told)


def test_frames_that_were_under_way_take_their_place_again() -> None:
    ring = FrameRing()
    for second in range(30):
        ring.add([Frame(1, b"ours", second + 0.02)], True)
        ring.add([Frame(2, b"theirs", second + 0.01)], False)
    out = [one for part in ring.slices(5.0, 20.0) for one in part]
    assert [one.frame.data for one in out] == [b"theirs", b"ours"] * 15
    assert [one.sent for one in out] == [False, True] * 15


def test_an_hour_of_frames_stays_within_its_memory_and_keeps_ten_minutes() -> None:
    ring = FrameRing()
    batch = [Frame(n * 7919 & 0x1FFF_FFFF, bytes(8), 0.0) for n in range(500)]
    most = 0
    for second in range(3600):
        ring.add(batch_at(batch, float(second)), False)
        most = max(most, ring.size)
    assert most < 625 * len(batch) * 21
    assert ring.since is not None
    assert RETAIN_S <= 3600 - ring.since <= RETAIN_S + 21
    assert not ring.full
    assert 7_000 * 21 * (RETAIN_S + 20) < LIMIT_BYTES - (2 << 20), "ten minutes of a full bus have room"


def batch_at(batch: list[Frame], at: float) -> list[Frame]:
    """All at one instant: what counts here is how many they are."""
    return [Frame(number, data, at) for number, data, _ in batch]


def test_a_bus_that_brings_more_than_memory_has_loses_the_oldest_and_says_so() -> None:
    ring = FrameRing(limit_bytes=8 << 20)
    chance = random.Random(1)
    batch = [Frame(chance.getrandbits(29), chance.randbytes(8), 0.0) for _ in range(1000)]
    for tenth in range(1500):
        ring.add(batch_at(batch, tenth / 10), False)
        assert ring.size <= 8 << 20
    assert ring.full
    assert ring.since is not None
    newest = [one for part in ring.slices(140.0, 200.0) for one in part]
    assert len(newest) >= 9 * 10 * 1000


def test_a_silent_bus_forgets_what_is_old() -> None:
    ring = FrameRing()
    ring.add([Frame(1, b"", 0.0)], False)
    ring.add([Frame(1, b"", 11.0)], False)
    ring.forget_old(610.5)
    assert ring.since == 11.0


def test_frames_carry_the_name_of_the_bus_they_were_on() -> None:
    ring = FrameRing()
    ring.switch_channel("can0")
    ring.add([Frame(1, b"", 1.0)], False)
    ring.switch_channel("can1")
    ring.add([Frame(1, b"", 2.0)], False)
    assert [one.channel for part in ring.slices(0, 9) for one in part] == ["can0", "can1"]
