"""Nodes on a bus that loses, repeats and damages frames, beside a model of both ends."""

from random import Random

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from hornbill.wire import types
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.transfer import Transfer, split
from unit.wire import damage
from unit.wire.reference import TIMEOUT_S, transfers_in
from unit.wire.structures import structures, transfer

SOURCES = st.integers(1, 3)
PRIORITIES = st.sampled_from([16, 24])
FATES = st.lists(st.sampled_from(["arrives"] * 9 + ["late", "lost", "twice", "damaged"]), min_size=1, max_size=12)
HARM = st.sampled_from([damage.cut, damage.lengthen, damage.flip_bit, damage.flip_tail])


class Bus(RuleBasedStateMachine):
    """Transfers that arrive complete are returned unchanged at their last frame, and no others.

    A node speaks several types and priorities at once, drops transfers, restarts with transfer id 0, and counts on
    past 31.
    """

    max_sessions = 4096

    def __init__(self) -> None:
        super().__init__()
        self.reassembler = Reassembler(max_sessions=self.max_sessions)
        self.now = 100.0
        self.next_id: dict[tuple[int, types.AnyStructure | int], int] = {}
        self.under_way: dict[int, tuple[Transfer, list[Frame], float, bool]] = {}
        self.fed: list[Frame] = []
        self.received: list[Transfer] = []
        self.sent: list[Transfer] = []

    def feed(self, frames: list[Frame]) -> list[Transfer]:
        """Frames arrive now."""
        frames = [frame._replace(at=self.now) for frame in frames]
        received = self.reassembler.feed(frames)
        self.fed += frames
        self.received += received
        return received

    @rule(source=SOURCES, priority=PRIORITIES, structure=structures, skipped=st.sampled_from([0, 0, 0, 30, 31]))
    def begin(self, source: int, priority: int, structure: types.AnyStructure, skipped: int) -> None:
        """A node begins a transfer, maybe dropping one of the same type and priority; others may have been lost."""
        key = source, structure.TYPE.id
        number = self.next_id[key] = (self.next_id.get(key, 0) + 1 + skipped) % 32
        sent = transfer(structure, source=source, priority=priority, transfer_id=number)
        frames = split(sent, structure.TYPE)
        self.under_way[frames[0].id] = (sent, frames, self.now, True)
        self.sent.append(sent)

    @precondition(lambda self: self.under_way)
    @rule(data=st.data(), fates=FATES)
    def send(self, data: st.DataObject, fates: list[str]) -> None:
        """Pending transfers send their next frames, interleaved."""
        for fate in fates:
            if self.under_way:
                self.send_one(data, data.draw(st.sampled_from(sorted(self.under_way))), fate)

    def send_one(self, data: st.DataObject, can_id: int, fate: str) -> None:
        """The next frame of the pending transfer with this identifier."""
        sent, frames, begun, whole = self.under_way.pop(can_id)
        alone = len(sent.payload) <= 7
        if fate == "late":
            self.now += 2.1
        first = len(frames) == len(split(sent, types.BY_KEY[bool(sent.kind), sent.type_id]))
        begun = self.now if first else begun
        frame, *rest = frames
        on_wire = [frame]
        if fate == "lost":
            on_wire, whole = [], False
        elif fate == "twice":
            on_wire = [frame, frame]
        elif fate == "damaged" and not alone:  # a single frame has no transfer CRC
            data.draw(HARM)(on_wire, 0, Random(data.draw(st.integers(0, 1 << 16))))
            whole = whole and on_wire == [frame]
        whole = whole and self.now - begun <= TIMEOUT_S
        received = self.feed(on_wire)
        if rest:
            self.under_way[can_id] = (sent, rest, begun, whole)
        if alone:
            assert received == [sent._replace(at=self.now)] * len(on_wire)
        elif rest or not whole:
            assert [found for found in received if len(found.payload) > 7] == []
        else:
            self.check_complete(received, sent)

    def check_complete(self, received: list[Transfer], sent: Transfer) -> None:
        """The last frame of a complete transfer arrived."""
        assert received == [sent._replace(at=self.now)]

    @rule(seconds=st.sampled_from([0.00014, 0.001, 0.5, 1.9, 2.0, 2.5]))
    def wait(self, seconds: float) -> None:
        """Time passes."""
        self.now += seconds

    @rule(source=SOURCES, does=st.booleans())
    def restart(self, source: int, does: bool) -> None:
        """A node restarts in the middle of a transfer, half as often as other events."""
        if does:
            self.next_id = {key: number for key, number in self.next_id.items() if key[0] != source}
            self.under_way = {can_id: at for can_id, at in self.under_way.items() if can_id & 0x7F != source}

    @rule(frames=st.lists(st.builds(Frame, st.integers(0, (1 << 29) - 1), st.binary(max_size=8)), max_size=3))
    def disturb(self, frames: list[Frame]) -> None:
        """A defective node sends anything."""
        self.feed([frame for frame in frames if frame.id not in self.under_way])

    @precondition(lambda self: self.under_way)
    @rule(data=st.data(), content=st.binary(max_size=8))
    def impersonate(self, data: st.DataObject, content: bytes) -> None:
        """A defective node uses the identifier of another."""
        can_id = data.draw(st.sampled_from(sorted(self.under_way)))
        sent, frames, begun, _ = self.under_way.pop(can_id)
        self.feed([Frame(can_id, content)])
        if len(sent.payload) <= 7:
            self.under_way[can_id] = (sent, frames, begun, True)

    @invariant()
    def room_is_bounded(self) -> None:
        counters = self.reassembler.counters
        assert self.reassembler.sessions <= self.max_sessions
        assert self.reassembler.routes <= len({frame.id for frame in self.fed})
        assert (counters.frames, counters.transfers) == (len(self.fed), len(self.received))

    def teardown(self) -> None:
        """The model agrees, and after silence no session remains."""
        self.check_all()
        self.now += 2 * TIMEOUT_S
        self.feed([Frame(0x1001557F, bytes(7) + b"\xc0")])
        assert self.reassembler.sessions == 0

    def check_all(self) -> None:
        """The transfers found by the reference receiver."""
        assert self.received == transfers_in(self.fed)


class Crowded(Bus):
    """The same with two sessions: transfers are evicted, but never confused."""

    max_sessions = 2

    def check_complete(self, received: list[Transfer], sent: Transfer) -> None:
        """It is returned unless it was evicted."""
        if not self.reassembler.counters.evicted:
            super().check_complete(received, sent)

    def check_all(self) -> None:
        """A subset of the transfers of a receiver with more sessions."""
        expected = transfers_in(self.fed)
        assert all(found in expected for found in self.received)


STEPS = settings(max_examples=40, stateful_step_count=50, deadline=None)
Bus.TestCase.settings = STEPS
Crowded.TestCase.settings = STEPS
TestBus = Bus.TestCase
TestCrowdedBus = Crowded.TestCase
