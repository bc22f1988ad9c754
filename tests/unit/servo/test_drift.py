"""What is learned of ROM beside what was kept of it: any order of learning, saving and meddling ends in the truth."""

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
    """A servo whose ROM we see through `look` alone, and a model of what must be flagged."""

    def __init__(self, store: Store) -> None:
        self.inventory: Servos = store.servos
        self.hub = Hub()
        self.audit = Audit(store.audit, self.hub)
        self.drift = DriftDetector(self.inventory, self.hub, self.audit)
        self.servo = Servo(UID, CATALOG)
        self.servo.identify_as(CATALOG.models["BLA21-06U-A0"], 1300)
        self.rom = dict.fromkeys(KEYS, 1)
        self.wanted: dict[str, int] = {}

    def start(self, learned: set[str]) -> None:
        """The servo starts anew, and these rows of it are learned."""
        self.servo.restarted()
        for key in learned:
            self.servo.registers[key].rom = self.rom[key]
        rom = self.drift.check(self.servo, self.inventory.get(UID))
        self.inventory.seen(UID)
        self.inventory.put_rom(UID, rom)
        for key in learned:
            self.wanted.setdefault(key, self.rom[key])

    def save(self, key: str, raw: int) -> None:
        """We save a new value, which every row then is proved to hold."""
        if raw != self.rom[key]:
            self.wanted[key] = raw
        self.rom[key] = raw
        self.servo.expected_rom = dict(self.rom)
        self.start(set(KEYS))
        self.servo.expected_rom = None


Deed = Callable[[Bench], None]


def meddle(key: str, raw: int) -> Deed:
    def do(bench: Bench) -> None:
        bench.rom[key] = raw
        bench.start(set(KEYS))

    return do


def save(key: str, raw: int) -> Deed:
    return lambda bench: bench.save(key, raw)


def start(learned: set[str]) -> Deed:
    return lambda bench: bench.start(learned)


def new_server(bench: Bench) -> None:
    """It finds all that was kept; what drifted and is in doubt besides stays flagged until it is proved or accepted."""
    bench.start(set(KEYS))
    kept = bench.inventory.get(UID)
    assert kept is not None
    bench.drift = DriftDetector(bench.inventory, bench.hub, bench.audit)
    bench.servo.drift = drifted(kept)


row = st.sampled_from(KEYS)
deeds = st.lists(
    st.one_of(
        st.builds(meddle, row, st.integers(1, 3)),
        st.builds(save, row, st.integers(1, 3)),
        st.builds(start, st.sets(row)),
        st.just(new_server),
    ),
    max_size=12,
)


def test_what_is_flagged_is_what_rom_holds_otherwise_than_anybody_here_wanted() -> None:
    with Store("sqlite://") as store:  # one for all examples: making its tables takes longer than they do

        @settings(deadline=None)
        @given(deeds)
        def whatever_is(done: list[Deed]) -> None:
            store.servos.forget(UID)
            bench = Bench(store)
            bench.start(set(KEYS))
            for deed in done:
                deed(bench)
            bench.start(set(KEYS))
            expected = {key: was for key, was in bench.wanted.items() if bench.rom[key] != was}
            assert bench.servo.drift == expected
            kept = store.servos.get(UID)
            assert kept is not None
            assert (kept.rom, drifted(kept), doubtful(kept)) == (bench.rom, expected, set())

        whatever_is()


def test_a_row_that_is_not_learned_yet_keeps_its_last_value_and_is_in_doubt() -> None:
    with Store("sqlite://") as store:
        bench = Bench(store)
        bench.start(set(KEYS))
        bench.start({"servo_id"})
        kept = store.servos.get(UID)
        assert kept is not None
        assert kept.rom == dict.fromkeys(KEYS, 1)
        assert doubtful(kept) == {"angle_limit_cw", "speed_limit_cw"}
        assert drifted(kept) == {}
        assert bench.servo.drift == {}


def test_after_a_crash_between_the_two_writes_the_change_is_still_found() -> None:
    with Store("sqlite://") as store:
        bench = Bench(store)
        bench.start(set(KEYS))
        bench.rom["servo_id"] = 2
        for key in KEYS:
            bench.servo.registers[key].rom = bench.rom[key]
        bench.drift.check(bench.servo, store.servos.get(UID))  # and the process dies before ROM is kept
        again = Bench(store)
        again.rom = bench.rom
        again.start(set(KEYS))
        assert again.servo.drift == {"servo_id": 1}
