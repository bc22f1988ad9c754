"""Fault words as they are read: new appearances, cleared bits, and bits that are the same as before."""

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest

from hornbill.domain.servo import Fault
from hornbill.errors import StoreFailed
from hornbill.schema.catalog import Catalog
from hornbill.servo.device.servo import Servo
from hornbill.servo.monitoring.faults import Faults
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.hub import Change, Hub, LogEvent, ReadingChanged, ServoChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.faults import FaultEntry, FaultReading
from hornbill.store.store import Store
from hornbill.units import Uid
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus

CATALOG = Catalog.load()
UID = Uid("a0" * 16)
EPOCH = 1_700_000_000.0
NOTIFICATION, WARNING, FAILURE = "fault_notification", "fault_warning", "fault_failure"
HOT, COLD, ROM, DRIVER, WATCHDOG = 1 << 8, 1 << 9, 1 << 15, 1 << 0, 1 << 9


@dataclass
class Desk:
    """One servo, a store, and a clock that is set; `commits` are what was stored."""

    store: Store
    now: float = 1000.0
    commits: list[FaultReading] = field(default_factory=list[FaultReading])
    happened: list[LogEvent] = field(default_factory=list[LogEvent])
    started: float = 0.0

    def __post_init__(self) -> None:
        self.start_server()

    def start_server(self) -> None:
        self.hub = Hub()
        base = TimeBase(lambda: self.now, lambda: EPOCH + self.now)
        self.servo = Servo(UID, CATALOG, label="Rudder")
        self.servo.identify_as(CATALOG.models["BLA21-06U-A0"], 1300)
        self.servo.online = True
        self.faults = Faults(
            CATALOG, self.store, self.hub, base, {UID: self.servo}.get, Audit(self.store.audit, self.hub)
        )
        self.hub.subscribe(self._note)
        self._receive_status()

    def read(self, word: str, raw: int, after: float = 1.0) -> None:
        """Read a word; it is published whether or not it changed."""
        self.now += after
        self._receive_status()
        self.servo.note(word, raw, self.now)
        self.hub.publish(ReadingChanged(UID, word))

    def silence(self, seconds: float) -> None:
        self.servo.online = False
        self.hub.publish(ServoChanged(UID))
        self.now += seconds
        self.servo.online = True

    def power_cycle(self) -> None:
        self.started = self.now = self.now + 2.0

    def notice_restart(self) -> None:
        self.servo.restarted(float("inf"))
        self._receive_status()
        self.hub.publish(ServoChanged(UID))

    def one(self, key: str) -> Fault:
        return next(fault for fault in self.faults.of(UID) if fault.key == key)

    def events(self) -> list[tuple[str, str]]:
        found = [(one.level, one.code) for one in self.happened]
        self.happened.clear()
        return found

    def _receive_status(self) -> None:
        self.servo.status = NodeStatus(int(self.now - self.started), NodeHealth.OK, Mode.OPERATIONAL)
        self.servo.status_at = self.now

    def _note(self, change: Change) -> None:
        if isinstance(change, LogEvent):
            self.happened.append(change)


@pytest.fixture
def store() -> Iterator[Store]:
    with Store("sqlite://") as opened:
        yield opened


@pytest.fixture
def desk(store: Store, monkeypatch: pytest.MonkeyPatch) -> Desk:
    desk, keep = Desk(store), store.faults.record

    def counted(sight: FaultReading) -> dict[str, FaultEntry]:
        desk.commits.append(sight)
        return keep(sight)

    monkeypatch.setattr(store.faults, "record", counted)
    return desk


def test_a_bit_is_reported_and_stored_when_it_is_set_and_when_it_is_cleared(desk: Desk) -> None:
    desk.read(WARNING, 0)
    assert (desk.commits, desk.events()) == ([], [])
    for _ in range(20):
        desk.read(WARNING, HOT)
    assert desk.events() == [("warning", "fault")]
    assert len(desk.commits) == 1
    for _ in range(20):
        desk.read(WARNING, 0)
    assert desk.events() == [("info", "fault_cleared")]
    assert len(desk.commits) == 2
    fault = desk.one("temperature_high")
    assert (fault.active, fault.stale, fault.count) == (False, False, 1)
    assert (fault.first_seen, fault.last_seen) == (EPOCH + 1002.0, EPOCH + 1022.0)


def test_bits_that_change_together_are_one_commit_and_several_events(desk: Desk) -> None:
    desk.read(WARNING, HOT | ROM)
    desk.events()
    desk.read(WARNING, COLD | ROM)
    assert desk.events() == [("warning", "fault"), ("info", "fault_cleared")]
    assert len(desk.commits) == 2
    assert [(one.key, one.active) for one in desk.faults.of(UID)] == [
        ("temperature_low", True), ("rom_lost", True), ("temperature_high", False)
    ]  # fmt: skip


def test_a_bit_that_is_set_after_a_restart_is_a_new_appearance(desk: Desk) -> None:
    desk.read(WARNING, HOT)
    asyncio.run(desk.faults.acknowledge(UID, "Ada"))
    desk.power_cycle()
    desk.notice_restart()
    desk.events()
    desk.hub.publish(ReadingChanged(UID, WARNING))  # published again, but not read since
    assert (desk.one("temperature_high").count, desk.events()) == (1, [])
    desk.read(WARNING, HOT)
    assert desk.events() == [("warning", "fault")]
    fault = desk.one("temperature_high")
    assert (fault.count, fault.active, fault.acknowledged_by) == (2, True, None)


def test_a_bit_read_before_the_restart_is_detected_counts_once(desk: Desk) -> None:
    desk.read(WARNING, HOT)
    desk.read(FAILURE, 0)
    desk.power_cycle()
    desk.read(FAILURE, WATCHDOG, after=1.2)
    desk.notice_restart()
    desk.read(FAILURE, WATCHDOG)
    desk.read(WARNING, 0)
    assert desk.one("watchdog_restart").count == 1
    assert desk.events() == [("warning", "fault"), ("failure", "fault"), ("info", "fault_cleared")]


def test_a_bit_cleared_by_an_unobserved_restart_was_last_seen_before_it(desk: Desk) -> None:
    desk.read(FAILURE, WATCHDOG)
    desk.silence(3600.0)
    desk.power_cycle()
    desk.notice_restart()
    desk.read(FAILURE, 0)
    fault = desk.one("watchdog_restart")
    assert (fault.active, fault.last_seen) == (False, EPOCH + 1001.0)


def test_a_fault_that_is_no_longer_read_is_stale(desk: Desk) -> None:
    desk.read(WARNING, HOT)
    assert desk.one("temperature_high").active
    desk.now += 10
    fault = desk.one("temperature_high")
    assert (fault.active, fault.stale, fault.last_seen) == (False, True, EPOCH + 1001.0)


def test_warnings_and_failures_require_an_acknowledgement(desk: Desk) -> None:
    desk.read(NOTIFICATION, 1 << 8)
    assert desk.faults.unacknowledged(UID) == 0
    desk.read(WARNING, HOT)
    desk.read(FAILURE, DRIVER | 1 << 3)
    assert desk.faults.unacknowledged(UID) == 3
    asyncio.run(desk.faults.acknowledge(UID, "Ada", "motor_driver"))
    assert desk.faults.unacknowledged(UID) == 2
    asyncio.run(desk.faults.acknowledge(UID, "Ada"))
    assert desk.faults.unacknowledged(UID) == 0


def test_another_server_counts_a_bit_set_after_a_restart_as_new(desk: Desk) -> None:
    desk.read(WARNING, HOT)
    desk.read(FAILURE, WATCHDOG)
    desk.events()
    desk.now += 60.0
    desk.power_cycle()
    desk.start_server()
    desk.read(WARNING, HOT)
    desk.read(FAILURE, 0)
    assert desk.events() == [("warning", "fault"), ("info", "fault_cleared")]
    assert (desk.one("temperature_high").count, desk.one("watchdog_restart").active) == (2, False)


def test_stored_faults_are_shown_when_the_store_works(
    desk: Desk, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.faults.record(FaultReading(UID, 5.0, appeared=frozenset(["voltage_low"])))

    def fail(_uid: Uid) -> dict[str, FaultEntry]:
        raise StoreFailed("locked", cause=None)

    with monkeypatch.context() as broken:
        broken.setattr(store.faults, "of", fail)
        assert desk.faults.of(UID) == []
    desk.read(FAILURE, DRIVER)
    assert {one.key for one in desk.faults.of(UID)} == {"motor_driver", "voltage_low"}


def test_a_forgotten_servo_has_no_faults(desk: Desk) -> None:
    desk.read(WARNING, HOT)
    desk.silence(10.0)
    asyncio.run(desk.faults.forget(UID))
    assert desk.faults.of(UID) == []
    desk.read(WARNING, HOT)
    assert desk.one("temperature_high").count == 1
