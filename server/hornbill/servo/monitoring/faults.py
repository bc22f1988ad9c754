"""Faults: current and past fault bits of every servo, and their acknowledgement (section 4.12)."""

import logging
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import Final

from hornbill.domain.servo import Fault
from hornbill.errors import Unknown
from hornbill.schema.catalog import Catalog
from hornbill.schema.fault import GROUPS, LEVELS, REGISTERS, FaultBit, bits_of
from hornbill.servo.device.reading import LIVE_PERIOD_S
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.hub import Hub, LogEvent, ReadingChanged, ServoChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.audit import NewAuditEntry
from hornbill.store.faults import FaultEntry, FaultReading
from hornbill.store.store import Store
from hornbill.units import Instant, Uid

log = logging.getLogger(__name__)

EVENT_LEVEL: Final = {"notification": "notice", "warning": "warning", "failure": "failure"}
"""Event level by level of the fault bit."""

NEEDS_ACKNOWLEDGEMENT: Final = frozenset(("warning", "failure"))
"""Levels to acknowledge. Notifications come and go in normal use."""


@dataclass(slots=True)
class _Word:
    """Known state of one of the three fault words: set bits, and when each was first read as set."""

    boot_count: int
    since: dict[str, Instant] = field(default_factory=dict[str, Instant])
    ended: Instant | None = None
    """Last reading before the servo went offline or restarted. None while the word is being followed."""


class Faults:
    """Follows the fault words 0x19 to 0x1B of every servo. A changed bit causes one commit and one event; reading an
    unchanged word causes none. A store failure is tolerated."""

    def __init__(
        self,
        catalog: Catalog,
        store: Store,
        hub: Hub,
        base: TimeBase,
        find: Callable[[Uid], Servo | None],
        audit: Audit,
    ) -> None:
        self._store = store
        self._hub = hub
        self._base = base
        self._find = find
        self._audit = audit
        self._bits = _table(catalog)
        self._by_key = {bit.key: bit for bit in self._bits.values()}
        self._words: dict[tuple[Uid, str], _Word] = {}
        self._entries: dict[Uid, dict[str, FaultEntry]] = {}
        self._failed = False
        hub.subscribe(self._on_reading, ReadingChanged)
        hub.subscribe(self._on_servo, ServoChanged)

    def of(self, uid: Uid) -> list[Fault]:
        """All bits that are or were set: failures, warnings, then notifications; active before past."""
        servo = self._find(uid)
        found = [
            self._fault(servo, self._by_key[key], entry)
            for key, entry in self._history(uid).items()
            if key in self._by_key  # a newer version may have stored bits unknown to these tables
        ]
        return sorted(found, key=lambda one: (-LEVELS.index(one.level), not one.active, not one.stale, one.bit))

    def unacknowledged(self, uid: Uid) -> int:
        """Number of warnings and failures of a servo not acknowledged since they last occurred."""
        return sum(
            1
            for key, entry in self._history(uid).items()
            if entry.acknowledged_at is None
            and key in self._by_key
            and self._by_key[key].level in NEEDS_ACKNOWLEDGEMENT
        )

    async def acknowledge(self, uid: Uid, by: str, key: str | None = None) -> None:
        """Acknowledge a bit (None: all bits). Raises Unknown(unknown_fault), StoreFailed."""
        known = self._history(uid)
        if key is not None and (key not in known or key not in self._by_key):
            raise Unknown(
                "unknown_fault", f"This servo has never reported a fault {key[:60]!r}.",
                uid=uid, key=key[:60], cause="fault_never_seen",
            )  # fmt: skip
        wanted = [one for one in known if key is None or one == key]
        now = self._base.utc_now()
        new = {one for one in wanted if known[one].acknowledged_at is None}
        stored = await self._store.run(self._store.faults.acknowledge, uid, new, by, now)
        known.update({one: known[one].acknowledged(by, now) for one in new} | stored)
        self._audit.note(
            *(
                NewAuditEntry(by, "acknowledge", "succeeded" if one in new else "unchanged", uid, one)
                for one in (wanted if key is not None else new)
            )
        )
        self._hub.publish(ServoChanged(uid))

    def refresh_stored(self) -> None:
        """Read the history again: another bench changed it."""
        self._entries.clear()

    async def forget(self, uid: Uid) -> None:
        """Drop the faults of a servo that is offline. Raises StoreFailed."""
        await self._store.run(self._store.faults.forget, uid)
        self._entries.pop(uid, None)
        for word in REGISTERS:
            self._words.pop((uid, word), None)

    def _on_reading(self, change: ReadingChanged) -> None:
        if change.key in REGISTERS and (servo := self._find(change.uid)) is not None and not servo.recorded:
            self._on_word(servo, change.key)

    def _on_servo(self, change: ServoChanged) -> None:
        """When a servo goes offline or restarts, store its last readings as last seen then."""
        servo = self._find(change.uid)
        if servo is None or servo.recorded:
            return
        for name in REGISTERS:
            word = self._words.get((servo.uid, name))
            if word is None or word.ended is not None or (servo.online and word.boot_count == servo.boot_count):
                continue
            register = servo.registers.get(name)
            now = self._base.now()
            word.ended = now if register is None or register.at is None else register.at
            if word.since:
                self._store_reading(FaultReading(servo.uid, self._base.utc(word.ended), seen=frozenset(word.since)))

    def _on_word(self, servo: Servo, name: str) -> None:
        """Process a reading of a word: publish bits that were set or cleared."""
        register, word = servo.registers.get(name), self._words.get((servo.uid, name))
        if register is None or register.raw is None or register.at is None:
            return
        if word is not None and word.ended is not None and register.at <= word.ended:
            return  # published again, but not read again
        shown = self._visible(servo, name, register.raw)
        if word is None:
            before = {
                key: entry.last_seen - self._base.utc_offset
                for key, entry in self._history(servo.uid).items()
                if entry.active and key in self._by_key and self._by_key[key].parameter == name
            }
        else:
            before = word.since
        went_on = word is not None and word.boot_count == servo.boot_count
        same = before if went_on else {key: at for key, at in before.items() if _has_run_since(servo, at)}
        appeared, gone = shown - same.keys(), frozenset(before.keys() - shown)
        followed = word is not None and word.ended is None
        self._words[servo.uid, name] = _Word(servo.boot_count, {key: same.get(key, register.at) for key in shown})
        if not appeared and not gone:
            return
        self._store_reading(
            FaultReading(servo.uid, self._base.utc(register.at), appeared, gone if followed else frozenset(), gone)
        )
        self._publish(servo, appeared, gone)

    def _visible(self, servo: Servo, name: str, raw: int) -> frozenset[str]:
        """Keys of set bits, without those that have no meaning on a model without PWM input (note 1)."""
        pwm = servo.model is None or servo.model.pwm
        bits = (self._bits[name, number] for number in bits_of(raw))
        return frozenset(bit.key for bit in bits if pwm or not bit.pwm_only)

    def _history(self, uid: Uid) -> dict[str, FaultEntry]:
        """Fault history of a servo, initially from the store."""
        found = self._entries.get(uid)
        if found is None:
            try:
                found = self._store.faults.of(uid)
            except Exception:
                self._report_store_failed("the faults of servo %s could not be read", uid)
                found = dict[str, FaultEntry]()  # the store is read again with the next changed bit
            self._entries[uid] = found
        return found

    def _store_reading(self, reading: FaultReading) -> None:
        known = self._history(reading.uid)
        try:
            known.update(self._store.faults.record(reading))
            self._failed = False
        except Exception:  # a full disk must not hide a fault
            self._report_store_failed("a change of faults could not be stored: %r", reading)
            known.update(reading.changes(known))

    def _report_store_failed(self, text: str, about: object) -> None:
        log.exception(text, about)
        if not self._failed:
            self._failed = True
            text = "The fault history cannot be stored. Faults are still shown. Check the data folder and its disk."
            self._hub.publish(LogEvent("warning", "store_failed", text, params={"what": "faults"}))

    def _publish(self, servo: Servo, appeared: Collection[str], gone: Collection[str]) -> None:
        for bit in self._in_order(appeared):
            text = f"{servo.title}: {bit.label}. {bit.advice}"
            self._hub.publish(LogEvent(EVENT_LEVEL[bit.level], "fault", text, servo.uid, _named(servo, bit)))
        for bit in self._in_order(gone):
            text = f"{servo.title}: {bit.label} cleared."
            self._hub.publish(LogEvent("info", "fault_cleared", text, servo.uid, _named(servo, bit)))
        self._hub.publish(ServoChanged(servo.uid))

    def _in_order(self, keys: Collection[str]) -> list[FaultBit]:
        return sorted((self._by_key[key] for key in keys), key=lambda bit: bit.bit)

    def _fault(self, servo: Servo | None, bit: FaultBit, entry: FaultEntry) -> Fault:
        word = self._words.get((entry.uid, bit.parameter))
        register = None if servo is None else servo.registers.get(bit.parameter)
        was_set = entry.active if word is None else bit.key in word.since
        active, last = False, entry.last_seen
        if was_set and word is not None and word.ended is None and register is not None and register.at is not None:
            active = self._base.now() - register.at <= LIVE_PERIOD_S["faults"]
            last = max(last, self._base.utc(register.at))
        return Fault(
            bit.level, bit.group, bit.bit, bit.key, bit.label, bit.advice, active=active, stale=was_set and not active,
            latched=active and bit.latching, past_event=bit.past_event, first_seen=entry.first_seen, last_seen=last,
            count=entry.count, acknowledged_at=entry.acknowledged_at, acknowledged_by=entry.acknowledged_by,
        )  # fmt: skip


def _has_run_since(servo: Servo, at: Instant) -> bool:
    """Whether it started before an instant, by its uptime in whole seconds (table 2-17)."""
    return servo.status is None or servo.status_at is None or servo.status_at - servo.status.uptime_sec - 1 <= at


def _table(catalog: Catalog) -> dict[tuple[str, int], FaultBit]:
    """All 96 bits by word and number. Undocumented bits are included as such."""
    found = {
        (name, number): FaultBit(
            parameter=name, level=level, group=GROUPS[number // 8], bit=number, key=f"{level}_bit_{number}",
            label=f"Bit {number} (undocumented)",
            advice="This bit is not documented. Note what the servo was doing and contact its manufacturer.",
            section="4.12",
        )
        for name, level in REGISTERS.items()
        for number in range(32)
    }  # fmt: skip
    return found | {(bit.parameter, bit.bit): bit for bit in catalog.faults}


def _named(servo: Servo, bit: FaultBit) -> dict[str, object]:
    return {"servo": servo.title, "fault": bit.key}
