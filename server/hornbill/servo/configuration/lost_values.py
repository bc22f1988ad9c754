"""LostValues: RAM values that a servo lost when it restarted without a save, kept until somebody deals with them."""

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
"""Rows named in the text of the event; its `params` have all of them."""


@dataclass(slots=True)
class Lost:
    """Raw values by key that RAM held before a restart and does not hold since; `at`: seconds since 1970 UTC."""

    at: float = 0.0
    values: dict[str, Raw] = field(default_factory=dict[str, Raw])


class LostValues:
    """Compares RAM after a restart with RAM before it. At most one record a servo, one value a row.

    A value leaves the record when RAM holds it again; all of them leave when a save of the servo succeeds or a client
    dismisses them. A restart or factory reset that hornbill was asked for gives RAM up on purpose and loses nothing.
    """

    def __init__(
        self, hub: Hub, base: TimeBase, find: Callable[[Uid], Servo | None], stored: SettingTable, audit: Audit
    ) -> None:
        """`find` gives the servo of a uid."""
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
        """Key, engineering value and time of every lost value, in the order of the rows."""
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
        """Forget what a servo lost."""
        rows = self.shown(servo)
        if rows:
            self._audit.note(
                *(NewAuditEntry(by, "lost_values", "dismissed", servo.uid, key, before=was) for key, was, _ in rows)
            )
            self._keep(servo.uid, Lost())

    def forget(self, uid: Uid) -> None:
        """Drop what is stored of a servo."""
        self._lost.pop(uid, None)
        self._store(uid, None)

    def _on_servo(self, change: ServoChanged) -> None:
        """Compare, once every row that decides has been read since the restart. Cheap when there is nothing to do."""
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
            self._keep(servo.uid, Lost(self._base.utc_now(), {**self._of(servo.uid).values, **gone}))
            self._tell(servo, gone)

    def _on_reading(self, change: ReadingChanged) -> None:
        lost, servo = self._lost.get(change.uid), self._find(change.uid)
        if lost is None or servo is None or change.key not in lost.values:
            return
        register = servo.registers.get(change.key)
        if register is not None and register.at is not None and register.raw == lost.values[change.key]:
            self._keep(servo.uid, Lost(lost.at, {key: raw for key, raw in lost.values.items() if key != change.key}))

    def _on_job(self, change: JobChanged) -> None:
        job = change.job
        if job.uid is not None and (job.kind, job.state) == ("save", "succeeded") and self._of(Uid(job.uid)).values:
            self._keep(Uid(job.uid), Lost())

    def _tell(self, servo: Servo, gone: dict[str, Raw]) -> None:
        values = {**servo.raws(), **gone}
        rows = [(servo.registers[key].parameter, raw) for key, raw in gone.items()]
        named = [f"{row.label} {scale.to_text(row, raw, values)}" for row, raw in rows[:NAMED]]
        more = f" and {len(rows) - NAMED} more" if len(rows) > NAMED else ""
        count = "1 value that was" if len(rows) == 1 else f"{len(rows)} values that were"
        text = f"{servo.title} restarted and lost {count} only in RAM: {', '.join(named)}{more}. Apply them again."
        params: dict[str, object] = {"servo": servo.title, "count": len(rows), "keys": [row.key for row, _ in rows]}
        params["lost"] = [{"key": row.key, "value": scale.to_value(row, raw, values)} for row, raw in rows]
        self._hub.publish(LogEvent("warning", "ram_values_lost", text, servo.uid, params))

    def _of(self, uid: Uid) -> Lost:
        found = self._lost.get(uid)
        if found is None:
            found = self._lost[uid] = self._stored_of(uid)
        return found

    def _keep(self, uid: Uid, lost: Lost) -> None:
        self._lost[uid] = lost
        self._store(uid, {"at": lost.at, "values": dict(lost.values)} if lost.values else None)
        self._hub.publish(ServoChanged(uid))

    def _stored_of(self, uid: Uid) -> Lost:
        """Never raises: a servo whose past cannot be read has lost nothing that could be offered."""
        try:
            kept = self._stored.get(_key(uid))
        except Exception:
            log.exception("the lost values of %s could not be read", uid)
            return Lost()
        if not isinstance(kept, dict):
            return Lost()
        at, values = kept.get("at"), kept.get("values")
        if not isinstance(at, int | float) or not isinstance(values, dict):
            return Lost()
        return Lost(float(at), {key: raw for key, raw in values.items() if isinstance(raw, int)})

    def _store(self, uid: Uid, value: Json) -> None:
        """Never raises: a full disk loses the offer, not the servo."""
        try:
            self._stored.put(_key(uid), value) if value is not None else self._stored.drop(_key(uid))
        except Exception:
            log.exception("the lost values of %s could not be stored", uid)
            text = "The RAM values that a servo lost could not be stored. Check the data folder and its disk."
            self._hub.publish(LogEvent("warning", "store_failed", text, uid, {"what": "lost_values"}))


def _key(uid: Uid) -> str:
    return f"lost_values.{uid}"
