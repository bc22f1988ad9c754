"""ROM that was found to hold something else than we last knew, and did not save ourselves."""

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
"""A servo met when it has run for less may be in a soft start we did not see begin (section 4.14)."""


def drifted(kept: StoredServo) -> dict[str, Raw]:
    """Of what is kept of a servo: the rows that were found to differ from before, with what ROM held."""
    return {key: was for key, was in kept.drift.items() if kept.rom.get(key) != was}


def doubtful(kept: StoredServo) -> set[str]:
    """Rows of which `kept.rom` tells what ROM held once, and nobody knows whether it still does."""
    return {key for key, was in kept.drift.items() if kept.rom.get(key) == was}


class DriftDetector:
    """Compares what is learned of ROM with what was kept of it.

    The store keeps, as a servo's `drift`, what ROM held last of every row that is not known to hold it still: because
    something else was found, or because the row was not learned yet after a start. Of the latter `rom` holds the same.
    """

    def __init__(self, inventory: Servos, hub: Hub, audit: Audit) -> None:
        self._inventory = inventory
        self._hub = hub
        self._audit = audit
        self._told: dict[Uid, dict[str, Raw | None]] = {}

    def look(self, servo: Servo, kept: StoredServo | None) -> dict[str, Raw]:
        """Flag what differs from `kept`, settle what came back; the answer is what to keep of ROM from now on."""
        if kept is None:
            return servo.rom()
        told = self._told.setdefault(servo.uid, {key: kept.rom.get(key) for key in drifted(kept)})
        last = _last(servo, kept, told)
        found = {} if servo.rom_lost else {key: was for key, was in last.items() if _flagged(servo, key, was)}
        if last != kept.drift:
            self._inventory.keep_drift(servo.uid, last)
        now = {key: _found(servo.registers[key], told.get(key)) for key in found}
        news = [key for key in found if key not in told or told[key] not in (None, now[key])]
        changed = servo.drift.keys() != found.keys()
        self._told[servo.uid], servo.drift = now, found
        if news or _other_firmware(servo, kept):
            params: dict[str, object] = {"servo": servo.title, "keys": news}
            if _other_firmware(servo, kept) and kept.facts.firmware is not None:
                params |= {"firmware_before": firmware_text(kept.facts.firmware), "firmware": servo.firmware_text}
            self._hub.publish(LogEvent("warning", "drift", self._sentence(servo, kept, news), servo.uid, params))
        if changed or news:
            self._hub.publish(ServoChanged(servo.uid))
        known = servo.rom()
        return {key: was for key, was in last.items() if key not in found and key not in known} | known

    def rows(self, servo: Servo) -> list[DriftRow]:
        """The drift of a servo, in the order of its rows."""
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
        """Take what was found for what is wanted; the flag goes."""
        kept = self._inventory.get(servo.uid)
        rows = self.rows(servo)
        if kept is not None:
            self._inventory.keep_drift(
                servo.uid, {key: was for key, was in kept.drift.items() if key not in servo.drift}
            )
        servo.drift = {}
        self._told.pop(servo.uid, None)
        self._audit.note(
            *(NewAuditEntry(by, "drift", "accepted", servo.uid, one.key, before=one.was, after=one.now) for one in rows)
        )
        self._hub.publish(ServoChanged(servo.uid))

    def forget(self, uid: Uid) -> None:
        """Nothing is known of a servo any more."""
        self._told.pop(uid, None)

    @staticmethod
    def _sentence(servo: Servo, kept: StoredServo, keys: list[str]) -> str:
        values: Mapping[str, Raw | None] = servo.raws()
        before = {**values, **servo.drift}
        said: list[str] = []
        for key in keys:
            row, now = servo.registers[key].parameter, _now(servo.registers[key])
            after = "unknown" if now is None else scale.to_text(row, now, values)
            said.append(f"{row.label} {scale.to_text(row, servo.drift[key], before)} → {after}")
        if _other_firmware(servo, kept) and kept.facts.firmware is not None:
            said.append(f"firmware {firmware_text(kept.facts.firmware)} → {servo.firmware_text}")
        text = f"{servo.title} is not as it was last known: {', '.join(said)}."
        return f"{text} Restore what it held, or accept it." if keys else text


def _last(servo: Servo, kept: StoredServo, told: Mapping[str, Raw | None]) -> dict[str, Raw]:
    """What ROM held last, of the rows that are not known to hold it now."""
    last = dict(kept.drift)
    for key, was in {**kept.rom, **kept.drift}.items():  # the oldest known value stays
        register = servo.registers.get(key)
        now = None if register is None else register.rom
        ours = now is not None and servo.expected_rom is not None and servo.expected_rom.get(key) == now
        saved_along = key in told and told[key] in (None, now)  # that does not settle what had drifted
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
        return True  # it was found to differ, and nothing has proved since that it does not
    if key == output.KEY:
        return False  # whoever switched the output may have done it since the start: RAM tells nothing of ROM
    young = servo.status is None or servo.status.uptime_sec < SOFT_START_MAY_LAST_S
    temporary = register.parameter.soft_start is not None and (young or servo.soft_starting)
    if not register.reflects_rom or register.at is None or temporary:
        return False
    return register.raw is not None and register.raw != was


def _found(register: Register, before: Raw | None) -> Raw | None:
    """What a drifted row was found to hold: while ROM is not known, what it was found to hold first."""
    return before if register.rom is None and before is not None else _now(register)


def _now(register: Register) -> Raw | None:
    return register.raw if register.rom is None else register.rom


def _other_firmware(servo: Servo, kept: StoredServo) -> bool:
    return None not in (servo.firmware, kept.facts.firmware) and servo.firmware != kept.facts.firmware
