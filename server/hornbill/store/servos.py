"""Every servo ever met, so that one that is switched off still has a name and its values."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass, field

from sqlalchemy import select
from sqlalchemy.orm import Session

from hornbill.store.database import Database
from hornbill.store.tables import ServoRow
from hornbill.units import Uid


@dataclass(frozen=True, slots=True)
class ServoFacts:
    """What a servo said of itself; None is "not asked yet".

    `firmware`, `model_number`, `hardware_version` and `serial` are raw integers of 0x52, 0x50, 0x53 and 0x51;
    `production_date` is ISO 8601; `bus` is the address it was met on; `node_id` and `servo_id` may change.
    """

    name: str | None = None
    model: str | None = None
    model_number: int | None = None
    hardware_version: int | None = None
    firmware: int | None = None
    serial: int | None = None
    production_date: str | None = None
    node_id: int | None = None
    servo_id: int | None = None
    bus: str | None = None


@dataclass(frozen=True, slots=True)
class StoredServo:
    """One servo; instants in seconds since 1970 (UTC). `rom` has raw values by parameter key, as last known. `notes`
    is what people wrote down about it.

    `drift`: what ROM held last, by key, of rows not known to hold it still: something else was found that we did not
    save, or (where `rom` has the same value) the row was not learned yet after a start.
    """

    uid: Uid
    label: str = ""
    facts: ServoFacts = ServoFacts()
    first_seen: float | None = None
    last_seen: float | None = None
    rom: Mapping[str, int] = field(default_factory=dict[str, int])
    drift: Mapping[str, int] = field(default_factory=dict[str, int])
    notes: str = ""


class Servos:
    """The inventory. Every method has been committed when it returns.

    A commit costs a fraction of a millisecond: call `met` when a servo was identified or went away, not for
    each of its messages.
    """

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` gives seconds since 1970 (UTC)."""
        self._database = database
        self._wall = wall

    def all(self, *, but: Collection[Uid] = ()) -> list[StoredServo]:
        """Every servo, by unique id; a row takes 0.1 ms, so leave out (`but`) those that are not needed."""
        asked = select(ServoRow).where(ServoRow.uid.not_in(but)).order_by(ServoRow.uid)
        with self._database.reading() as session:
            return [_stored(row) for row in session.scalars(asked)]

    def get(self, uid: Uid) -> StoredServo | None:
        """One servo, or None when it was never met."""
        with self._database.reading() as session:
            row = session.get(ServoRow, uid)
            return None if row is None else _stored(row)

    def met(self, uid: Uid, facts: ServoFacts | None = None) -> None:
        """Keep that a servo is there now, and what it said; facts that are None change nothing."""
        now = self._wall()
        with self._database.transaction() as session:
            row = _row(session, uid)
            row.first_seen = row.first_seen or now
            row.last_seen = now
            for fact, value in asdict(facts or ServoFacts()).items():
                if value is not None:
                    setattr(row, fact, value)

    def label(self, uid: Uid, label: str) -> None:
        """Give a servo a nickname of at most 200 characters; empty takes it away. Raises ValueError."""
        if len(label) > 200:
            raise ValueError(f"The label has {len(label)} characters. Give at most 200.")
        with self._database.transaction() as session:
            _row(session, uid).label = label

    def write_down(self, uid: Uid, notes: str) -> None:
        """Replace what people wrote down about a servo; empty takes it away."""
        with self._database.transaction() as session:
            _row(session, uid).notes = notes or None

    def keep_rom(self, uid: Uid, values: Mapping[str, int]) -> None:
        """Replace what is known to be in a servo's ROM: raw values by parameter key."""
        with self._database.transaction() as session:
            _row(session, uid).rom = dict(values)

    def keep_drift(self, uid: Uid, was: Mapping[str, int]) -> None:
        """Replace what a servo's ROM held before it changed under us: raw by key, empty when nothing did."""
        with self._database.transaction() as session:
            _row(session, uid).drift = dict(was) or None

    def forget(self, uid: Uid) -> None:
        """Drop everything about a servo. An unknown one is no error."""
        with self._database.transaction() as session:
            row = session.get(ServoRow, uid)
            if row is not None:
                session.delete(row)


def _row(session: Session, uid: Uid) -> ServoRow:
    row = session.get(ServoRow, uid)
    if row is None:
        row = ServoRow(uid=uid, label="", rom={})
        session.add(row)
    return row


def _stored(row: ServoRow) -> StoredServo:
    facts = ServoFacts(
        name=row.name,
        model=row.model,
        model_number=row.model_number,
        hardware_version=row.hardware_version,
        firmware=row.firmware,
        serial=row.serial,
        production_date=row.production_date,
        node_id=row.node_id,
        servo_id=row.servo_id,
        bus=row.bus,
    )
    return StoredServo(
        Uid(row.uid),
        row.label,
        facts,
        row.first_seen,
        row.last_seen,
        dict(row.rom),
        dict(row.drift or {}),
        row.notes or "",
    )
