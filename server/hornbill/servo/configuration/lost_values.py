"""RAM values that a servo lost in a restart without a save, stored until they are restored or dismissed."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from hornbill.schema import scale
from hornbill.schema.scale import Value
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.hub import Hub, JobChanged, LogEvent, ReadingChanged, ServoChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.audit import NewAuditEntry
from hornbill.store.settings import SettingTable
from hornbill.store.tables import Json
from hornbill.units import Raw, Uid

log = logging.getLogger(__name__)

NAMED: Final = 3
"""Maximum number of rows in the text of the event. Its `params` contain all of them."""


@dataclass(slots=True)
class Lost:
    """Raw values by key that RAM lost in a restart. `at`: seconds since 1970 UTC."""

    at: float = 0.0
    values: dict[str, Raw] = field(default_factory=dict[str, Raw])


class LostValues:
    """Compares RAM before and after a restart. At most one record per servo and one value per row.

    A value leaves the record when RAM contains it again. All values leave it when a save of the servo succeeds or a
    client dismisses them. A restart or factory reset by hornbill discards RAM on purpose, so it loses nothing.
    """

    def __init__(
        self, hub: Hub, base: TimeBase, find: Callable[[Uid], Servo | None], stored: SettingTable, audit: Audit
    ) -> None:
        """`find` returns the servo with a unique ID."""
        self._hub = hub
        self._base = base
        self._find = find
        self._stored = stored
        self._audit = audit
        self._lost: dict[Uid, Lost] = {}
        hub.subscribe(self._on_servo, ServoChanged)
        hub.subscribe(self._on_reading, ReadingChanged)
        hub.subscribe(self._on_job, JobChanged)

    def shown(self, servo: Servo) -> list[tuple[str, Value, float]]:
        """Key, engineering value and time of each lost value, in row order."""
        lost = self._of(servo.uid)
        if not lost.values:
            return []
        values = {**servo.raws(), **lost.values}
        return [
            (key, scale.to_value(one.parameter, lost.values[key], values), lost.at)
            for key, one in servo.registers.items()
            if key in lost.values
        ]

    def dismiss(self, servo: Servo, by: str) -> None:
        """Dismiss the lost values of a servo."""
        rows = self.shown(servo)
        if rows:
            self._audit.note(
                *(NewAuditEntry(by, "lost_values", "dismissed", servo.uid, key, before=was) for key, was, _ in rows)
            )
            self._set(servo.uid, Lost())

    def forget(self, uid: Uid) -> None:
        """Delete the record of a servo."""
        self._lost.pop(uid, None)
        self._store(uid, None)

    def _on_servo(self, change: ServoChanged) -> None:
        """Compare once all rows have been read since the restart. Cheap if there is nothing to do."""
        servo = self._find(change.uid)
        before = None if servo is None else servo.ram_before_restart
        if servo is None or before is None or not servo.online or not servo.identified or servo.soft_starting:
            return
        rows = {key: one for key, one in servo.registers.items() if key in before}
        if any(one.at is None for one in rows.values()):
            return
        servo.ram_before_restart = None
        gone = {key: before[key] for key, one in rows.items() if one.raw != before[key]}
        if gone:
            self._set(servo.uid, Lost(self._base.utc_now(), {**self._of(servo.uid).values, **gone}))
            self._publish(servo, gone)

    def _on_reading(self, change: ReadingChanged) -> None:
        lost, servo = self._lost.get(change.uid), self._find(change.uid)
        if lost is None or servo is None or change.key not in lost.values:
            return
        register = servo.registers.get(change.key)
        if register is not None and register.at is not None and register.raw == lost.values[change.key]:
            self._set(servo.uid, Lost(lost.at, {key: raw for key, raw in lost.values.items() if key != change.key}))

    def _on_job(self, change: JobChanged) -> None:
        job = change.job
        if job.uid is not None and (job.kind, job.state) == ("save", "succeeded") and self._of(Uid(job.uid)).values:
            self._set(Uid(job.uid), Lost())

    def _publish(self, servo: Servo, gone: dict[str, Raw]) -> None:
        values = {**servo.raws(), **gone}
        rows = [(servo.registers[key].parameter, raw) for key, raw in gone.items()]
        named = [f"{row.label} {scale.to_text(row, raw, values)}" for row, raw in rows[:NAMED]]
        more = f" and {len(rows) - NAMED} more" if len(rows) > NAMED else ""
        count = "1 unsaved value" if len(rows) == 1 else f"{len(rows)} unsaved values"
        text = f"{servo.title} restarted and lost {count}: {', '.join(named)}{more}. Apply them again."
        params: dict[str, object] = {"servo": servo.title, "count": len(rows), "keys": [row.key for row, _ in rows]}
        params["lost"] = [{"key": row.key, "value": scale.to_value(row, raw, values)} for row, raw in rows]
        self._hub.publish(LogEvent("warning", "ram_values_lost", text, servo.uid, params))

    def _of(self, uid: Uid) -> Lost:
        found = self._lost.get(uid)
        if found is None:
            found = self._lost[uid] = self._stored_of(uid)
        return found

    def _set(self, uid: Uid, lost: Lost) -> None:
        self._lost[uid] = lost
        self._store(uid, {"at": lost.at, "values": dict(lost.values)} if lost.values else None)
        self._hub.publish(ServoChanged(uid))

    def _stored_of(self, uid: Uid) -> Lost:
        """Read the stored record. Never raises: an unreadable record counts as empty."""
        try:
            stored = self._stored.get(_key(uid))
        except Exception:
            log.exception("Lost values of %s could not be read", uid)
            return Lost()
        if not isinstance(stored, dict):
            return Lost()
        at, values = stored.get("at"), stored.get("values")
        if not isinstance(at, int | float) or not isinstance(values, dict):
            return Lost()
        return Lost(float(at), {key: raw for key, raw in values.items() if isinstance(raw, int)})

    def _store(self, uid: Uid, value: Json) -> None:
        """Store the record. Never raises: a full disk must not affect the servo."""
        try:
            self._stored.put(_key(uid), value) if value is not None else self._stored.drop(_key(uid))
        except Exception:
            log.exception("Lost values of %s could not be stored", uid)
            text = "The RAM values lost by a servo could not be stored. Check the data folder and its disk."
            self._hub.publish(LogEvent("warning", "store_failed", text, uid, {"what": "lost_values"}))


def _key(uid: Uid) -> str:
    return f"lost_values.{uid}"
