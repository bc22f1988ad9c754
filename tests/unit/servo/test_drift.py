"""Drift: ROM as read beside ROM as stored, in any order of reads, saves and changes by another tool."""

from collections.abc import Callable

from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.schema.catalog import Catalog
from hornbill.servo.device.drift import DriftDetector, doubtful, drifted
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.hub import Hub
from hornbill.store.servos import Servos
from hornbill.store.store import Store
from hornbill.units import Uid

CATALOG = Catalog.load()
UID = Uid("ab" * 16)
KEYS: tuple[str, ...] = ("angle_limit_cw", "speed_limit_cw", "servo_id")


class Bench:
    """A servo whose ROM becomes known in `start` only, and a model of the drift to be found."""

    def __init__(self, store: Store) -> None:
        self.inventory: Servos = store.servos
        self.hub = Hub()
        self.audit = Audit(store.audit, self.hub)
        self.drift = DriftDetector(self.inventory, self.hub, self.audit)
        self.servo = Servo(UID, CATALOG)
        self.servo.identify_as(CATALOG.models["BLA21-06U-A0"], 1300)
        self.rom = dict.fromkeys(KEYS, 1)
        self.wanted: dict[str, int] = {}

    def start(self, known: set[str]) -> None:
        """The servo restarts, and these rows of its ROM become known."""
        self.servo.restarted()
        for key in known:
            self.servo.registers[key].rom = self.rom[key]
        rom = self.drift.check(self.servo, self.inventory.get(UID))
        self.inventory.seen(UID)
        self.inventory.put_rom(UID, rom)
        for key in known:
            self.wanted.setdefault(key, self.rom[key])

    def save(self, key: str, raw: int) -> None:
        """Save a new value, which then is proved."""
        if raw != self.rom[key]:
            self.wanted[key] = raw
        self.rom[key] = raw
        self.servo.expected_rom = dict(self.rom)
        self.start(set(KEYS))
        self.servo.expected_rom = None


Change = Callable[[Bench], None]


def changed_by_another_tool(key: str, raw: int) -> Change:
    def do(bench: Bench) -> None:
        bench.rom[key] = raw
        bench.start(set(KEYS))

    return do


def save(key: str, raw: int) -> Change:
    return lambda bench: bench.save(key, raw)


def start(known: set[str]) -> Change:
    return lambda bench: bench.start(known)


def new_server(bench: Bench) -> None:
    """Another server loads what was stored; drift remains until it is proved or accepted."""
    bench.start(set(KEYS))
    stored = bench.inventory.get(UID)
    assert stored is not None
    bench.drift = DriftDetector(bench.inventory, bench.hub, bench.audit)
    bench.servo.drift = drifted(stored)


row = st.sampled_from(KEYS)
changes = st.lists(
    st.one_of(
        st.builds(changed_by_another_tool, row, st.integers(1, 3)),
        st.builds(save, row, st.integers(1, 3)),
        st.builds(start, st.sets(row)),
        st.just(new_server),
    ),
    max_size=12,
)


def test_drift_is_where_rom_differs_from_what_was_last_stored_or_saved() -> None:
    with Store("sqlite://") as store:  # one for all examples, as creating its tables takes long

        @settings(deadline=None)
        @given(changes)
        def check(done: list[Change]) -> None:
            store.servos.forget(UID)
            bench = Bench(store)
            bench.start(set(KEYS))
            for change in done:
                change(bench)
            bench.start(set(KEYS))
            expected = {key: was for key, was in bench.wanted.items() if bench.rom[key] != was}
            assert bench.servo.drift == expected
            stored = store.servos.get(UID)
            assert stored is not None
            assert (stored.rom, drifted(stored), doubtful(stored)) == (bench.rom, expected, set())

        check()


def test_a_row_that_is_not_known_yet_keeps_its_last_value_and_is_doubtful() -> None:
    with Store("sqlite://") as store:
        bench = Bench(store)
        bench.start(set(KEYS))
        bench.start({"servo_id"})
        stored = store.servos.get(UID)
        assert stored is not None
        assert stored.rom == dict.fromkeys(KEYS, 1)
        assert doubtful(stored) == {"angle_limit_cw", "speed_limit_cw"}
        assert drifted(stored) == {}
        assert bench.servo.drift == {}


def test_drift_is_found_after_a_crash_between_the_two_writes() -> None:
    with Store("sqlite://") as store:
        bench = Bench(store)
        bench.start(set(KEYS))
        bench.rom["servo_id"] = 2
        for key in KEYS:
            bench.servo.registers[key].rom = bench.rom[key]
        bench.drift.check(bench.servo, store.servos.get(UID))  # and the process is killed before ROM is stored
        again = Bench(store)
        again.rom = bench.rom
        again.start(set(KEYS))
        assert again.servo.drift == {"servo_id": 1}
