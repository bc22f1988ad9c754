"""Leases of sets of servos, as a state machine: no servo is ever under two leases, and only its holder may move it."""

from collections.abc import Callable

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from hornbill.errors import Busy, HornbillError, LeaseHeld, LeaseRequired, Unknown
from hornbill.servo.runtime.leases import HeldLease, Leases
from hornbill.units import Uid

SERVOS = [Uid(f"{n:032x}") for n in range(4)]
SETS = st.one_of(st.none(), st.frozensets(st.sampled_from(SERVOS), min_size=1))
SERVO = st.sampled_from(SERVOS)
INDEX = st.integers(0, 30)


def covered(uids: frozenset[Uid] | None) -> set[Uid | None]:
    """Servos of a set; None stands for those that appear later."""
    return set(SERVOS) | {None} if uids is None else set(uids)


def attempt(act: Callable[[], HeldLease]) -> HeldLease | HornbillError:
    """Result of a call, or its refusal."""
    try:
        return act()
    except HornbillError as error:
        return error


class LeaseMachine(RuleBasedStateMachine):
    """The model is a list of what was granted: ID, servos and expiry."""

    def __init__(self) -> None:
        super().__init__()
        self.leases = Leases()
        self.now = 100.0
        self.granted: list[HeldLease] = []
        self.ends: dict[str, float] = {}
        self.reported: list[str] = []
        self.promised: set[Uid | None] = set()

    def valid(self) -> list[HeldLease]:
        return [one for one in self.granted if self.ends.get(one.id, 0.0) > self.now]

    def owner(self, servo: Uid | None) -> HeldLease | None:
        return next((one for one in self.valid() if servo in covered(one.uids)), None)

    def pick(self, index: int) -> HeldLease | None:
        return self.granted[index % len(self.granted)] if self.granted else None

    def added(self, lease: HeldLease, ttl_s: float) -> None:
        self.granted.append(lease)
        self.ends[lease.id] = self.now + ttl_s

    @rule(uids=SETS, ttl_s=st.floats(0.2, 5.0))
    def take(self, uids: frozenset[Uid] | None, ttl_s: float) -> None:
        wanted = covered(uids)
        taken, promised = any(self.owner(servo) for servo in wanted), not wanted.isdisjoint(self.promised)
        found = attempt(lambda: self.leases.grant("client", ttl_s, self.now, uids))
        if isinstance(found, HeldLease):
            assert not taken
            assert not promised
            self.added(found, ttl_s)
        elif taken:
            assert isinstance(found, LeaseHeld)
            assert found.facts.get("uids") in [None if one.uids is None else sorted(one.uids) for one in self.valid()]
        else:
            assert promised
            assert isinstance(found, Busy)

    @rule(uids=SETS)
    def take_by_force(self, uids: frozenset[Uid] | None) -> None:
        overlapping = {one.id for one in self.valid() if not covered(one.uids).isdisjoint(covered(uids))}
        ended: set[str] = set()
        while (old := self.leases.revoke(self.now, uids)) is not None:
            ended.add(old.id)
            del self.ends[old.id]
        assert ended == overlapping
        self.added(self.leases.hand_over("forced", 2.0, self.now, grace_s=0.0, uids=uids), 2.0)
        self.promised = set()

    @rule(uids=SETS)
    def promise(self, uids: frozenset[Uid] | None) -> None:
        self.leases.promised_to, self.leases.promised_uids = "waiting", uids
        self.promised = covered(uids)

    @rule(index=INDEX)
    def renew(self, index: int) -> None:
        if (lease := self.pick(index)) is None:
            return
        valid = lease in self.valid()
        try:
            self.leases.renew(lease.id, self.now)
        except Unknown:
            assert not valid
        else:
            assert valid
            self.ends[lease.id] = self.now + lease.ttl_s

    @rule(index=INDEX, uids=st.frozensets(st.sampled_from(SERVOS), min_size=1))
    def extend(self, index: int, uids: frozenset[Uid]) -> None:
        if (lease := self.pick(index)) is None:
            return
        valid, before = lease in self.valid(), lease.uids
        others = any(self.owner(servo) not in (None, lease) for servo in uids)
        promised = not set(uids).isdisjoint(self.promised)
        found = attempt(lambda: self.leases.extend(lease.id, self.now, uids))
        if not valid:
            assert isinstance(found, Unknown)
        elif covered(before) >= set(uids) or not (others or promised):
            assert found is lease
            assert covered(lease.uids) == covered(before) | set(uids)
            self.ends[lease.id] = self.now + lease.ttl_s
        else:
            assert isinstance(found, LeaseHeld if others else Busy)
            assert lease.uids == before

    @rule(index=INDEX)
    def release(self, index: int) -> None:
        if (lease := self.pick(index)) is not None and lease in self.valid():
            self.leases.release(lease.id, self.now)
            del self.ends[lease.id]

    @rule(seconds=st.floats(0.0, 3.0))
    def wait(self, seconds: float) -> None:
        self.now += seconds

    @rule()
    def report_expired(self) -> None:
        due = {one for one, end in self.ends.items() if end <= self.now} - set(self.reported)
        found: list[str] = []
        while (lease := self.leases.expired(self.now)) is not None:
            found.append(lease.id)
        assert sorted(found) == sorted(due), "each expired lease is reported once"
        self.reported += found

    @rule(index=INDEX, servo=SERVO)
    def move(self, index: int, servo: Uid) -> None:
        lease, owner = self.pick(index), self.owner(servo)
        found = attempt(lambda: self.leases.require(None if lease is None else lease.id, self.now, servo))
        if owner is not None and owner is lease:
            assert found is lease
        else:
            assert isinstance(found, LeaseRequired if owner is None else LeaseHeld)

    @rule(index=INDEX, servo=SERVO)
    def write(self, index: int, servo: Uid) -> None:
        lease, owner = self.pick(index), self.owner(servo)
        try:
            self.leases.allow_write(None if lease is None else lease.id, self.now, servo)
        except LeaseHeld:
            assert owner is not None
            assert owner is not lease
        else:
            assert owner is None or owner is lease

    @invariant()
    def no_servo_is_under_two_leases(self) -> None:
        valid = self.leases.valid(self.now)
        assert valid == self.valid()
        assert all(sum(servo in covered(one.uids) for one in valid) <= 1 for servo in (*SERVOS, None))


TestLeaseSets = LeaseMachine.TestCase
TestLeaseSets.settings = settings(max_examples=60, stateful_step_count=40, deadline=None)
