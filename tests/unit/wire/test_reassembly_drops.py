"""Whoever asks hears of every frame nothing is made of, with the reason, and the counters agree."""

from collections import Counter
from dataclasses import fields

from hypothesis import given
from hypothesis import strategies as st

from hornbill.wire.frame import Frame
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from hornbill.wire.reassembly import Reassembler, ReassemblyCounters
from hornbill.wire.services import GetSetRequest, integer
from unit.wire.structures import frames

identifiers = st.sampled_from([0x100BB4FF, 0x1001550B, 0x104E2314, 0x18000100, 0x1000_0080, 0x0000_01FF]) | st.integers(
    0, (1 << 29) - 1
)
any_frames = st.lists(st.builds(Frame, identifiers, st.binary(max_size=8), st.floats(1.0, 9.0)), max_size=40)


def test_a_wrong_toggle_bit_is_told_with_its_frame() -> None:
    one, two, three = frames(GetSetRequest(0, integer(5), "0x2C"), at=1.0)
    wrong = two._replace(data=two.data[:-1] + bytes((two.data[-1] ^ 0x20,)))
    told: list[tuple[str, int, bytes]] = []
    reassembler = Reassembler(on_drop=lambda reason, can_id, data: told.append((reason, can_id, data)))
    assert reassembler.feed([one, wrong, three]) == []
    assert told == [("bad_toggle", wrong.id, wrong.data), ("unexpected", three.id, three.data)]


def test_nothing_is_told_of_a_good_bus() -> None:
    told: list[str] = []
    reassembler = Reassembler(on_drop=lambda reason, _id, _data: told.append(reason))
    heard = [
        *frames(NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL), at=1.0),
        *frames(GetSetRequest(0, integer(5), "0x2C")),
    ]
    assert len(reassembler.feed(heard)) == 2
    assert told == []


@given(any_frames)
def test_every_count_was_told(heard: list[Frame]) -> None:
    told: Counter[str] = Counter()
    reassembler = Reassembler(timeout=0.5, max_sessions=2, on_drop=lambda reason, _id, _data: told.update((reason,)))
    for frame in heard:
        reassembler.feed([frame])
    counters = reassembler.counters
    counted = {field.name: getattr(counters, field.name) for field in fields(ReassemblyCounters)}
    del counted["frames"], counted["transfers"]
    assert told == Counter(counted)
