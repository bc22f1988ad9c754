"""Drift: values in ROM that differ from the last known ones and were not saved by this server."""

from collections.abc import Mapping

from hornbill.domain.change import DriftRow
from hornbill.schema import scale
from hornbill.schema.firmware import to_text as firmware_text
from hornbill.servo.device import output
from hornbill.servo.device.servo import Register, Servo
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.hub import Hub, LogEvent, ServoChanged
from hornbill.store.audit import NewAuditEntry
from hornbill.store.servos import Servos, StoredServo
from hornbill.units import Raw, Uid

SOFT_START_MAY_LAST_S = 20
"""A servo first seen with a lower uptime may be in a soft start whose beginning was not seen (section 4.14)."""


def drifted(stored: StoredServo) -> dict[str, Raw]:
    """Rows of a stored servo that were found to differ, with the value ROM had before."""
    return {key: was for key, was in stored.drift.items() if stored.rom.get(key) != was}


def doubtful(stored: StoredServo) -> set[str]:
    """Rows for which `stored.rom` may be out of date."""
    return {key for key, was in stored.drift.items() if stored.rom.get(key) == was}


class DriftDetector:
    """Compares the values found in ROM with the stored ones.

    A stored servo's `drift` contains the last known ROM value of every row that is not known to have it still: because
    another value was found, or because the row has not been read since a start. In the latter case `rom` is the same.
    """

    def __init__(self, inventory: Servos, hub: Hub, audit: Audit) -> None:
        self._inventory = inventory
        self._hub = hub
        self._audit = audit
        self._reported: dict[Uid, dict[str, Raw | None]] = {}

    def check(self, servo: Servo, stored: StoredServo | None) -> dict[str, Raw]:
        """Flag rows that differ from `stored` and clear those that match again. Returns the ROM values to store."""
        if stored is None:
            return servo.rom()
        reported = self._reported.setdefault(servo.uid, {key: stored.rom.get(key) for key in drifted(stored)})
        last = _last(servo, stored, reported)
        found = {} if servo.rom_lost else {key: was for key, was in last.items() if _flagged(servo, key, was)}
        if last != stored.drift:
            self._inventory.put_drift(servo.uid, last)
        now = {key: _found(servo.registers[key], reported.get(key)) for key in found}
        news = [key for key in found if key not in reported or reported[key] not in (None, now[key])]
        changed = servo.drift.keys() != found.keys()
        self._reported[servo.uid], servo.drift = now, found
        if news or _other_firmware(servo, stored):
            params: dict[str, object] = {"servo": servo.title, "keys": news}
            if _other_firmware(servo, stored) and stored.facts.firmware is not None:
                params |= {"firmware_before": firmware_text(stored.facts.firmware), "firmware": servo.firmware_text}
            self._hub.publish(LogEvent("warning", "drift", self._sentence(servo, stored, news), servo.uid, params))
        if changed or news:
            self._hub.publish(ServoChanged(servo.uid))
        known = servo.rom()
        return {key: was for key, was in last.items() if key not in found and key not in known} | known

    def rows(self, servo: Servo) -> list[DriftRow]:
        """Drift of a servo, in row order."""
        rams = servo.raws()
        return [
            DriftRow(
                key, scale.to_value(one.parameter, servo.drift[key], {**rams, **servo.drift}),
                None if (now := _now(one)) is None else scale.to_value(one.parameter, now, rams), one.rom is not None,
            )
            for key, one in servo.registers.items()
            if key in servo.drift
        ]  # fmt: skip

    def accept(self, servo: Servo, by: str) -> None:
        """Accept the values found as intended and clear the flag."""
        stored = self._inventory.get(servo.uid)
        rows = self.rows(servo)
        if stored is not None:
            self._inventory.put_drift(
                servo.uid, {key: was for key, was in stored.drift.items() if key not in servo.drift}
            )
        servo.drift = {}
        self._reported.pop(servo.uid, None)
        self._audit.note(
            *(NewAuditEntry(by, "drift", "accepted", servo.uid, one.key, before=one.was, after=one.now) for one in rows)
        )
        self._hub.publish(ServoChanged(servo.uid))

    def forget(self, uid: Uid) -> None:
        """Drop what is known of a servo."""
        self._reported.pop(uid, None)

    @staticmethod
    def _sentence(servo: Servo, stored: StoredServo, keys: list[str]) -> str:
        values: Mapping[str, Raw | None] = servo.raws()
        before = {**values, **servo.drift}
        parts: list[str] = []
        for key in keys:
            row, now = servo.registers[key].parameter, _now(servo.registers[key])
            after = "unknown" if now is None else scale.to_text(row, now, values)
            parts.append(f"{row.label} {scale.to_text(row, servo.drift[key], before)} → {after}")
        if _other_firmware(servo, stored) and stored.facts.firmware is not None:
            parts.append(f"firmware {firmware_text(stored.facts.firmware)} → {servo.firmware_text}")
        text = f"{servo.title} changed since it was last seen: {', '.join(parts)}."
        return f"{text} Restore the previous values or accept the new ones." if keys else text


def _last(servo: Servo, stored: StoredServo, reported: Mapping[str, Raw | None]) -> dict[str, Raw]:
    """The last known ROM values of rows that are not known to have them now."""
    last = dict(stored.drift)
    for key, was in {**stored.rom, **stored.drift}.items():  # the oldest known value stays
        register = servo.registers.get(key)
        now = None if register is None else register.rom
        ours = now is not None and servo.expected_rom is not None and servo.expected_rom.get(key) == now
        saved_along = key in reported and reported[key] in (None, now)  # which does not resolve its drift
        if now == was or (ours and not saved_along):
            last.pop(key, None)
        else:
            last[key] = was
    return last


def _flagged(servo: Servo, key: str, was: Raw) -> bool:
    register = servo.registers.get(key)
    if register is None:
        return False
    if register.rom is not None:
        return register.rom != was
    if key in servo.drift:
        return True  # it was found to differ, and nothing since shows otherwise
    if key == output.KEY:
        return False  # the output may have been switched since the start, so RAM does not show ROM
    young = servo.status is None or servo.status.uptime_sec < SOFT_START_MAY_LAST_S
    temporary = register.parameter.soft_start is not None and (young or servo.soft_starting)
    if not register.reflects_rom or register.at is None or temporary:
        return False
    return register.raw is not None and register.raw != was


def _found(register: Register, before: Raw | None) -> Raw | None:
    """The value found in a drifted row. While ROM is unknown, the first value found."""
    return before if register.rom is None and before is not None else _now(register)


def _now(register: Register) -> Raw | None:
    return register.raw if register.rom is None else register.rom


def _other_firmware(servo: Servo, stored: StoredServo) -> bool:
    return None not in (servo.firmware, stored.facts.firmware) and servo.firmware != stored.facts.firmware
