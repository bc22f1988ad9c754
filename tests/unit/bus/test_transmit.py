"""TransmitQueue: the order of arbitration, and the frame dropped from a full queue."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.bus.transmit import TransmitQueue, check
from hornbill.wire.frame import Frame


def emptied(queue: TransmitQueue) -> list[Frame]:
    return [queue.take().frame for _ in range(len(queue))]


@given(st.lists(st.integers(0, 5)))
def test_the_lowest_identifier_comes_first_and_equals_in_order(identifiers: list[int]) -> None:
    queue = TransmitQueue()
    frames = [Frame(identifier, bytes([turn % 256])) for turn, identifier in enumerate(identifiers)]
    for frame in frames:
        queue.put(frame, 0.0)
    assert emptied(queue) == sorted(frames, key=lambda frame: frame.id)


@given(st.lists(st.integers(0, 5)), st.integers(1, 6))
def test_a_full_queue_drops_the_frame_that_would_be_sent_last(identifiers: list[int], limit: int) -> None:
    queue = TransmitQueue(limit)
    frames = [Frame(identifier, bytes([turn % 256])) for turn, identifier in enumerate(identifiers)]
    dropped = sum(queue.put(frame, 0.0) for frame in frames)
    assert dropped == max(0, len(frames) - limit)
    assert emptied(queue) == sorted(frames, key=lambda frame: frame.id)[:limit]


def test_a_frame_put_back_keeps_its_position() -> None:
    queue = TransmitQueue()
    for data in (b"a", b"b"):
        queue.put(Frame(7, data), 0.0)
    first = queue.take()
    queue.put(Frame(7, b"c"), 0.0)
    queue.put_back(first)
    assert [frame.data for frame in emptied(queue)] == [b"a", b"b", b"c"]


def test_invalid_frames_are_refused() -> None:
    check([Frame(0x1FFF_FFFF, bytes(8)), Frame(0, b"")])
    for frame in (Frame(0x2000_0000, b""), Frame(-1, b""), Frame(0, bytes(9))):
        with pytest.raises(ValueError, match=r"outside|exceed"):
            check([frame])
