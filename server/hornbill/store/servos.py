"""Inventory of all known servos: names and values, also of servos that are offline."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Final

from sqlalchemy import Connection, RowMapping, delete, select

from hornbill.store.database import Database
from hornbill.store.repository import put, row_at
from hornbill.store.tables import SERVOS, Json
from hornbill.units import Uid, serial_text


@dataclass(frozen=True, slots=True)
class ServoFacts:
    """Data reported by a servo. None: not read yet.

    `firmware`, `model_number`, `hardware_version` and `serial`: raw integers of 0x52, 0x50, 0x53 and 0x51.
    `production_date`: ISO 8601. `bus`: address of the bus on which it was seen. `node_id` and `servo_id` may change.
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


_FACTS: Final = tuple(one.name for one in fields(ServoFacts))


@dataclass(frozen=True, slots=True)
class StoredServo:
    """One servo. Instants: seconds since 1970 UTC. `rom`: last known ROM values, raw by key. `notes`: users' notes.
    `set_up`: as in `domain.set_up`, stated values only. `bench`: where it was last seen.

    `drift`: previous ROM values, by key, of rows that may have changed: another value was found that we did not save,
    or (if `rom` has the same value) the row has not been read yet after a start.
    """

    uid: Uid
    label: str = ""
    facts: ServoFacts = ServoFacts()
    first_seen: float | None = None
    last_seen: float | None = None
    rom: Mapping[str, int] = field(default_factory=dict[str, int])
    drift: Mapping[str, int] = field(default_factory=dict[str, int])
    notes: str = ""
    set_up: Mapping[str, Json] = field(default_factory=dict[str, Json])
    bench: str | None = None

    @property
    def serial_text(self) -> str | None:
        """Serial number as printed on the servo. None if unknown."""
        model, product = self.facts.model_number, self.facts.serial
        return None if model is None or product is None else serial_text(model, product)


class Servos:
    """The inventory. Each method commits before it returns.

    A commit costs a fraction of a millisecond, so call `seen` when a servo was identified or went offline, not for each
    of its messages.
    """

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` returns seconds since 1970 UTC."""
        self._database = database
        self._wall = wall

    def all(self, *, but: Collection[Uid] = ()) -> list[StoredServo]:
        """All servos, by unique ID. Exclude (`but`) those that are not needed: a row takes 0.1 ms."""
        query = select(SERVOS).where(SERVOS.c.uid.not_in(but)).order_by(SERVOS.c.uid)
        with self._database.reading() as connection:
            return [_stored(row) for row in connection.execute(query).mappings()]

    def get(self, uid: Uid) -> StoredServo | None:
        """One servo, or None if it has never been seen."""
        with self._database.reading() as connection:
            row = row_at(connection, SERVOS, uid)
            return None if row is None else _stored(row)

    def seen(self, uid: Uid, facts: ServoFacts | None = None) -> None:
        """Record that a servo is online now, with its data. Data that is None changes nothing."""
        now = self._wall()
        with self._database.transaction() as connection:
            row = row_at(connection, SERVOS, uid)
            read = {fact: value for fact, value in asdict(facts or ServoFacts()).items() if value is not None}
            first = (row and row["first_seen"]) or now
            _put(connection, uid, first_seen=first, last_seen=now, bench=self._database.bench, **read)

    def set_label(self, uid: Uid, label: str) -> None:
        """Set the nickname, at most 200 characters. Empty removes it. Raises ValueError."""
        if len(label) > 200:
            raise ValueError(f"The label has {len(label)} characters. Enter at most 200.")
        with self._database.transaction() as connection:
            _put(connection, uid, label=label)

    def set_notes(self, uid: Uid, notes: str) -> None:
        """Replace the users' notes. Empty removes them."""
        with self._database.transaction() as connection:
            _put(connection, uid, notes=notes or None)

    def put_set_up(self, uid: Uid, set_up: Mapping[str, Json]) -> None:
        """Replace the set-up. Empty removes it."""
        with self._database.transaction() as connection:
            _put(connection, uid, set_up=dict(set_up) or None)

    def put_rom(self, uid: Uid, values: Mapping[str, int]) -> None:
        """Replace the known ROM values, raw by key."""
        with self._database.transaction() as connection:
            _put(connection, uid, rom=dict(values))

    def put_drift(self, uid: Uid, was: Mapping[str, int]) -> None:
        """Replace the ROM values before an unexpected change, raw by key. Empty if there is none."""
        with self._database.transaction() as connection:
            _put(connection, uid, drift=dict(was) or None)

    def forget(self, uid: Uid) -> None:
        """Delete a servo. Idempotent."""
        with self._database.transaction() as connection:
            connection.execute(delete(SERVOS).where(SERVOS.c.uid == uid))


def _put(connection: Connection, uid: Uid, **values: Any) -> None:
    put(connection, SERVOS, (uid,), values, label="", rom={})


def _stored(row: RowMapping) -> StoredServo:
    return StoredServo(
        Uid(row["uid"]),
        row["label"],
        ServoFacts(**{name: row[name] for name in _FACTS}),
        row["first_seen"],
        row["last_seen"],
        dict(row["rom"]),
        dict(row["drift"] or {}),
        row["notes"] or "",
        dict(row["set_up"] or {}),
        row["bench"],
    )
