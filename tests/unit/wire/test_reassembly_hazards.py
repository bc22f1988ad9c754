"""Reassembly under whatever a bus can do: mixed, lost, repeated, late and senseless frames."""

from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from hornbill.wire import types
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.transfer import Transfer, split
from unit.wire.structures import structures, transfer

MAX_SESSIONS = 4


def frames_of(sent: Transfer) -> list[Frame]:
    return split(sent, types.BY_KEY[bool(sent.kind), sent.type_id])


@st.composite
def senders(draw: st.DrawFn) -> list[list[Transfer]]:
    """Up to five nodes with a few transfers each, one after the other, transfer ids counting up."""
    talks: list[list[Transfer]] = []
    for source in range(1, 1 + draw(st.integers(1, 5))):
        talk = draw(st.lists(structures, min_size=1, max_size=4))
        talks.append([transfer(s, source=source, transfer_id=n) for n, s in enumerate(talk)])
    return talks


def mix(draw: st.DrawFn, talks: list[list[Transfer]]) -> list[tuple[Transfer, Frame]]:
    """All frames in one row; the frames of one node keep their order."""
    rows = [[(sent, frame) for sent in talk for frame in frames_of(sent)] for talk in talks]
    mixed: list[tuple[Transfer, Frame]] = []
    while rows:
        row = rows[draw(st.integers(0, len(rows) - 1))]
        mixed.append(row.pop(0))
        rows = [row for row in rows if row]
    return mixed


@given(st.data(), senders())
@settings(max_examples=60)
def test_mixed_transfers_all_come_out(data: st.DataObject, talks: list[list[Transfer]]) -> None:
    mixed = data.draw(st.composite(mix)(talks))
    received = Reassembler().feed([frame for _, frame in mixed])
    assert [[t for t in received if t.source == n] for n in range(1, len(talks) + 1)] == talks


@given(st.data(), senders())
@settings(max_examples=60)
def test_a_loss_costs_its_own_transfer_and_no_other(data: st.DataObject, talks: list[list[Transfer]]) -> None:
    mixed = data.draw(st.composite(mix)(talks))
    lost = data.draw(st.sets(st.integers(0, len(mixed) - 1), max_size=4))
    hit = [mixed[n][0] for n in lost]
    received = Reassembler().feed([frame for n, (_, frame) in enumerate(mixed) if n not in lost])
    assert sorted(received) == sorted(t for talk in talks for t in talk if t not in hit)


@given(st.data(), senders())
@settings(max_examples=60)
def test_repeated_frames_change_no_longer_transfer(data: st.DataObject, talks: list[list[Transfer]]) -> None:
    mixed = data.draw(st.composite(mix)(talks))
    times = data.draw(st.lists(st.integers(1, 3), min_size=len(mixed), max_size=len(mixed)))
    received = Reassembler().feed([frame for (_, frame), count in zip(mixed, times, strict=True) for _ in range(count)])
    sent = [t for talk in talks for t in talk]
    longer = [t for t in received if len(t.payload) > 7]
    assert sorted(longer) == sorted(t for t in sent if len(t.payload) > 7)
    assert all(t in sent for t in received)


frames_of_garbage = st.builds(
    Frame,
    st.sampled_from([0x1003F301, 0x100B8A94, 0x100B948A, 0x10015501, 0x18058100]) | st.integers(-1, 1 << 32),
    st.binary(max_size=8) | st.binary(max_size=70),
    st.floats(allow_nan=True, allow_infinity=True) | st.just(0.0),
)


@given(st.lists(frames_of_garbage, max_size=60), st.none() | st.floats(), st.none() | st.integers(1, 127))
@settings(max_examples=300)
def test_garbage_never_raises(garbage: list[Frame], now: float | None, node_id: int | None) -> None:
    reassembler = Reassembler(node_id, max_sessions=MAX_SESSIONS)
    received = reassembler.feed(garbage, now)
    for found in received:
        types.decode(found)
    assert reassembler.counters.frames == len(garbage)
    assert reassembler.counters.transfers == len(received)
    assert reassembler.sessions <= MAX_SESSIONS


class Bus(RuleBasedStateMachine):
    """Nodes that speak at their own pace on a bus that loses frames, beside a model of what must come out.

    A transfer must come out when all its frames arrived, within the time-out, and nothing else may. There
    are as many nodes as sessions, so none is evicted.
    """

    def __init__(self) -> None:
        super().__init__()
        self.reassembler = Reassembler(max_sessions=MAX_SESSIONS)
        self.now = 100.0
        self.next_id = [0] * MAX_SESSIONS
        self.under_way: dict[int, tuple[Transfer, list[Frame], float, bool]] = {}

    @rule(node=st.integers(0, MAX_SESSIONS - 1), structure=structures)
    def begin(self, node: int, structure: types.AnyStructure) -> None:
        """A node begins a transfer, maybe dropping the one it was at."""
        self.next_id[node] = (self.next_id[node] + 1) % 32
        sent = transfer(structure, source=node + 1, transfer_id=self.next_id[node])
        self.under_way[node] = (sent, frames_of(sent), self.now, True)

    @precondition(lambda self: self.under_way)
    @rule(data=st.data(), arrives=st.sampled_from([True, True, True, False]))
    def send(self, data: st.DataObject, arrives: bool) -> None:
        """One node's next frame goes out, and arrives or not."""
        node = data.draw(st.sampled_from(sorted(self.under_way)))
        sent, frames, begun, whole = self.under_way[node]
        first = len(frames) == len(frames_of(sent))
        begun = self.now if first else begun
        whole = whole and arrives and self.now - begun <= 2.0
        frame = frames.pop(0)._replace(at=self.now)
        self.under_way[node] = (sent, frames, begun, whole)
        received = self.reassembler.feed([frame]) if arrives else []
        if frames:
            assert received == []
            return
        del self.under_way[node]
        assert received == ([sent._replace(at=self.now)] if whole else [])

    @rule(seconds=st.sampled_from([0.001, 0.5, 1.9, 2.5]))
    def wait(self, seconds: float) -> None:
        """Time passes."""
        self.now += seconds

    @rule(garbage=st.lists(st.builds(Frame, st.just(0x1003F37F), st.binary(max_size=8)), max_size=3))
    def disturb(self, garbage: list[Frame]) -> None:
        """A node out of its mind sends continuations of nothing."""
        bare = [f._replace(data=f.data[:-1] + b"\x05", at=self.now) for f in garbage]
        assert self.reassembler.feed(bare) == []

    @invariant()
    def sessions_are_bounded(self) -> None:
        assert self.reassembler.sessions <= MAX_SESSIONS


Bus.TestCase.settings = settings(max_examples=60, stateful_step_count=40)
TestBus = Bus.TestCase
