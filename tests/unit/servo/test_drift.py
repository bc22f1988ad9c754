"""Drift after an interrupted start. tests/behaviour/test_drift.py has every other order of reads, saves and changes."""

from collections.abc import Iterator

import pytest

from hornbill.schema.catalog import Catalog
from hornbill.servo.device.drift import DriftDetector, doubtful, drifted
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.hub import Hub
from hornbill.store.servos import StoredServo
from hornbill.store.store import Store
from hornbill.units import Uid

CATALOG = Catalog.load()
UID = Uid("ab" * 16)
KEYS: tuple[str, ...] = ("angle_limit_cw", "speed_limit_cw", "servo_id")


class Process:
    """A server process and its servo, which has started with 1 in each of these rows."""

    def __init__(self, store: Store) -> None:
        self.store, hub = store, Hub()
        self.drift = DriftDetector(store.servos, hub, Audit(store.audit, hub))
        self.servo = Servo(UID, CATALOG)
        self.servo.identify_as(CATALOG.models["BLA21-06U-A0"], 1300)
        self.rom = dict.fromkeys(KEYS, 1)

    def check(self, *known: str) -> dict[str, int]:
        """The servo restarts, and these rows of its ROM become known. Returns what is to be stored."""
        self.servo.restarted(float("inf"))
        for key in known:
            self.servo.registers[key].rom = self.rom[key]
        return self.drift.check(self.servo, self.store.servos.get(UID))

    def start(self, *known: str) -> StoredServo:
        """The same, and it is stored."""
        rom = self.check(*known)
        self.store.servos.seen(UID)
        self.store.servos.put_rom(UID, rom)
        stored = self.store.servos.get(UID)
        assert stored is not None
        return stored


@pytest.fixture
def store() -> Iterator[Store]:
    with Store("sqlite://") as opened:
        yield opened


def test_a_row_that_is_not_known_yet_keeps_its_last_value_and_is_doubtful(store: Store) -> None:
    process = Process(store)
    assert doubtful(process.start(*KEYS)) == set()
    stored = process.start("servo_id")
    assert stored.rom == dict.fromkeys(KEYS, 1)
    assert doubtful(stored) == {"angle_limit_cw", "speed_limit_cw"}
    assert drifted(stored) == process.servo.drift == {}
    assert doubtful(process.start(*KEYS)) == set()


def test_drift_is_found_after_a_crash_between_the_two_writes(store: Store) -> None:
    killed = Process(store)
    killed.start(*KEYS)
    killed.rom["servo_id"] = 2
    killed.check(*KEYS)  # and it is killed before ROM is stored
    again = Process(store)
    again.rom = killed.rom
    again.start(*KEYS)
    assert again.servo.drift == {"servo_id": 1}
