"""The allocator among requesters, losses, competitors, restarts and operators, in any order: invariants."""

from dataclasses import dataclass

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from hornbill.node.allocator import RECYCLE_AFTER_S, AllocationMode, Allocator, AllocatorStatus
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.transfer import Transfer
from unit.node.table import MemoryTable, Neighbours

OWN = 122
CROWD = frozenset(range(1, 119))
"""Node ids that belong to others from the start, so that six nodes fight for what is left."""

UIDS = [
    b"BLA21-" + b"2024\0\0" + b"0001",
    b"BLA21-" + b"2024\0\0" + b"0002",
    b"BLA21-" + b"2025\0\0" + b"0001",
    b"BLA15-" + b"2024\0\0" + b"0001",
    bytes(range(16)),
    bytes(16),
]
applicants = st.integers(0, len(UIDS) - 1)
ids = st.integers(119, 127)


@dataclass
class Node:
    """One node: the part of its unique ID echoed so far, and its node ID, 0 if none."""

    uid: bytes
    known: bytes = b""
    node_id: int = 0
    powered: bool = True
    spoke: bool = False
    """Since the server started."""


class Machine(RuleBasedStateMachine):
    """`nodes` follow rules A to E of the public type as far as losses allow; foreign nodes follow none."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 1000.0
        self.table = MemoryTable({f"{number:032x}": number for number in CROWD})
        self.nodes = [Node(uid) for uid in UIDS]
        self.known_nodes: dict[int, Node] = {}
        """Nodes with a static ID, by that ID; they never request one."""
        self.last: AllocationMessage | None = None
        self.mode = AllocationMode.ON
        self.start_server()

    # Server and operators.

    @rule()
    def start_server(self) -> None:
        self.neighbours = Neighbours()
        self.it = Allocator(
            self.table, own_ids=frozenset({OWN}), known_nodes=self.neighbours, mode=self.mode, listening_since=self.now
        )
        for node in self.living():
            node.spoke = False

    @rule(mode=st.sampled_from(AllocationMode))
    def choose(self, mode: AllocationMode) -> None:
        self.mode = self.it.mode = mode
        self.it.resume()

    @rule(broken=st.booleans())
    def break_table(self, broken: bool) -> None:
        self.table.broken = broken

    @rule(who=applicants, node_id=st.integers(119, 125))
    def pin(self, who: int, node_id: int) -> None:
        uid = UIDS[who].hex()
        taken = {node.node_id for node in self.living() if node.uid != UIDS[who]} | {OWN}
        owner = next((other for other, its in self.table.kept.items() if its == node_id), uid)
        if node_id not in taken and owner == uid:
            self.table.kept[uid] = node_id
            self.table.pins |= {uid}

    @rule(who=applicants)
    def forget(self, who: int) -> None:
        self.table.kept.pop(UIDS[who].hex(), None)
        self.table.pins -= {UIDS[who].hex()}

    @rule(number=st.sampled_from(sorted(CROWD)))
    def a_month_goes_by(self, number: int) -> None:
        self.table.away_s[f"{number:032x}"] = RECYCLE_AFTER_S + number

    # Time and nodes on the bus.

    def living(self) -> list[Node]:
        return [node for node in [*self.nodes, *self.known_nodes.values()] if node.node_id and node.powered]

    def speak(self, node: Node) -> None:
        node.spoke = True
        self.neighbours.seen[node.node_id] = self.now

    @rule(seconds=st.sampled_from([0.001, 0.1, 0.4, 0.45, 0.6, 1.0, 2.9, 10.0]), talk=st.booleans())
    def wait(self, seconds: float, talk: bool) -> None:
        self.pass_by(seconds, talk=talk)

    def pass_by(self, seconds: float, *, talk: bool = False) -> None:
        """Every powered node sends at least every three seconds."""
        self.now += seconds
        for node in self.living():
            if talk or self.now - self.neighbours.seen.get(node.node_id, 0.0) > 2.9:
                self.speak(node)

    @rule(who=applicants)
    def restart(self, who: int) -> None:
        """As after a power cut: silent for at least 0.6 s."""
        node = self.nodes[who]
        node.node_id, node.known, node.powered = 0, b"", True
        self.pass_by(0.6)

    @rule(who=applicants)
    def switch_off(self, who: int) -> None:
        self.nodes[who].powered = False

    @rule(node_id=ids, known=st.booleans())
    def resident_arrives(self, node_id: int, known: bool) -> None:
        if node_id != OWN and all(node.node_id != node_id for node in self.living()):
            node = self.known_nodes[node_id] = Node(bytes([node_id]) * 16, node_id=node_id)
            self.moved_in(node, known=known)

    @rule(who=applicants, quiet_s=st.sampled_from([0.0, 0.3, 0.9, 2.5]))
    def its_id_is_taken_while_it_is_off(self, who: int, quiet_s: float) -> None:
        node_id = self.table.kept.get(UIDS[who].hex(), OWN)
        self.restart(who)
        self.resident_arrives(node_id, known=False)
        self.pass_by(quiet_s)
        self.run_through(who)

    @rule(node_id=ids)
    def resident_leaves(self, node_id: int) -> None:
        self.known_nodes.pop(node_id, None)

    def moved_in(self, node: Node, *, known: bool) -> None:
        self.neighbours.uids.pop(node.node_id, None)
        if known:
            self.neighbours.uids[node.node_id] = node.uid
        self.speak(node)

    @rule()
    def every_node_identifies_itself(self) -> None:
        self.neighbours.uids.update({node.node_id: node.uid for node in self.living() if node.spoke})

    # Messages.

    @rule(who=applicants, preferred=ids | st.just(0), received=st.booleans(), responded=st.booleans())
    def request_first(self, who: int, preferred: int, received: bool, responded: bool) -> None:
        node = self.nodes[who]
        if node.powered and not node.node_id:
            self.request(
                node, AllocationMessage(preferred if preferred <= 125 else 0, True, node.uid[:6]), received, responded
            )

    @rule(who=applicants, preferred=ids | st.just(0), received=st.booleans(), responded=st.booleans())
    def follow_up(self, who: int, preferred: int, received: bool, responded: bool) -> None:
        node = self.nodes[who]
        if node.powered and not node.node_id and node.known:
            part = node.uid[len(node.known) : len(node.known) + 6]
            self.request(node, AllocationMessage(preferred, False, part), received, responded)

    @rule(who=applicants)
    def run_through(self, who: int) -> None:
        """All three parts without a loss, the usual case."""
        node = self.nodes[who]
        for _ in range(3):
            if node.powered and not node.node_id:
                part = node.uid[len(node.known) : len(node.known) + 6] if node.known else node.uid[:6]
                self.request(node, AllocationMessage(0, not node.known, part), received=True, responded=True)

    @precondition(lambda self: self.last is not None)
    @rule()
    def an_adapter_repeats_a_frame(self) -> None:
        assert self.last is not None
        self.deliver(self.handle(self.last), lost=False)

    @rule(node_id=st.integers(0, 127), first=st.booleans(), part=st.binary(max_size=16))
    def a_foreign_node_sends_anything(self, node_id: int, first: bool, part: bytes) -> None:
        self.deliver(self.handle(AllocationMessage(node_id, first, part)), lost=True)

    @rule(who=applicants, length=st.sampled_from([0, 6, 7, 12, 16]), node_id=st.integers(0, 127))
    def a_competitor_responds(self, who: int, length: int, node_id: int) -> None:
        message = AllocationMessage(node_id, False, UIDS[who][:length])
        assert self.handle(message, source=9) is None
        if length < 16 or all(node.node_id != node_id for node in self.living()):
            self.deliver(message, lost=False)

    def request(self, node: Node, message: AllocationMessage, received: bool, responded: bool) -> None:
        """Rule C: all nodes but the sender restart their exchange."""
        node.known = b""
        if received:
            for other in self.nodes:
                other.known = b""
            self.last = message
            self.deliver(self.handle(message), lost=not responded)

    def handle(self, message: AllocationMessage, source: int = 0) -> AllocationMessage | None:
        before, state = dict(self.table.kept), self.it.state
        transfer = Transfer(Kind.MESSAGE, 1, source, 0, 24, 0, message.encode(), self.now)
        reply = self.it.handle(message, transfer, self.now)
        if reply is None:
            return None
        assert source == 0
        assert state is AllocatorStatus.ON or self.it.state is AllocatorStatus.ON, "it does not respond otherwise"
        assert not reply.first_part_of_unique_id
        assert reply.unique_id.endswith(message.unique_id)
        assert len(reply.unique_id) in (6, 12, 16)
        assert bool(reply.node_id) == (len(reply.unique_id) == 16)
        if reply.node_id:
            self.check_grant(reply, before)
        return reply

    def check_grant(self, reply: AllocationMessage, before: dict[str, int]) -> None:
        uid, node_id = reply.unique_id.hex(), reply.node_id
        assert 1 <= node_id <= 125
        assert node_id != OWN
        assert self.table.kept[uid] == node_id, "stored before it is sent"
        assert not self.table.broken
        others = [one for one in self.living() if one.node_id == node_id and one.uid != reply.unique_id and one.spoke]
        assert others == [], "used by another node that was seen"
        if uid in self.table.pins:
            assert node_id == before[uid]
        lost = [other for other in before if other not in self.table.kept]
        assert all(self.table.away_s.get(other, 0) > RECYCLE_AFTER_S for other in lost), "no other node loses its ID"
        if uid in before and node_id != before[uid]:
            was = before[uid]
            seen_at = self.neighbours.seen.get(was)
            assert was == OWN or was > 125 or (seen_at is not None and self.now - seen_at < 3), "the same id again"

    def deliver(self, reply: AllocationMessage | None, *, lost: bool) -> None:
        """Rules C, D and E for every pending node."""
        if reply is None or lost:
            return
        for node in self.nodes:
            if not node.powered or node.node_id:
                continue
            matches = bool(reply.unique_id) and node.uid.startswith(reply.unique_id)
            node.known = reply.unique_id if matches and len(reply.unique_id) in (6, 12) else b""
            if matches and len(reply.unique_id) == 16 and reply.node_id:
                node.node_id = reply.node_id
                self.moved_in(node, known=False)

    # Invariants.

    @invariant()
    def no_id_is_kept_for_two(self) -> None:
        assert len(set(self.table.kept.values())) == len(self.table.kept)

    @invariant()
    def what_is_shown_makes_sense(self) -> None:
        for each in self.it.pending(self.now):
            assert len(each.partial) in (12, 24, 32)
            assert len(each.partial) == (0, 12, 24, 32)[each.stage]
            assert each.attempts >= (each.stage == 1)
        assert 0 <= self.it.free(self.now) <= 125 - 119 + 1 + len(CROWD)


TestAllocator = Machine.TestCase
TestAllocator.settings = settings(max_examples=150, stateful_step_count=50, deadline=None)
