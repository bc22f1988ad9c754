"""Position units: checks, forces and stores the unit of positions on the bus for each servo."""

import asyncio
import logging
from dataclasses import asdict, dataclass
from typing import Final

from pydantic import TypeAdapter, ValidationError

from hornbill.domain.note import Note
from hornbill.errors import HornbillError
from hornbill.servo.device.position_estimate import (
    DEGREES,
    LITERAL,
    MIN_ANGLE_DEG,
    MIN_DIFFERENCE_DEG,
    NAMES,
    Angle,
    Estimate,
    PositionUnit,
)
from hornbill.servo.device.requests import RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.hub import Hub, LogEvent, ServoChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.audit import NewAuditEntry
from hornbill.store.settings import SettingTable
from hornbill.store.tables import Json
from hornbill.units import Instant, Uid

_NOTE: Final = TypeAdapter(Note)
log = logging.getLogger(__name__)

COMPARE: Final = RetryPolicy(priority=27, timeout_s=0.12, tries=2, kind="poll")
"""Read of 0x08 to compare with Status: after every poll, with few retries, because only the current value helps."""

FAST_READS: Final = 20
"""Frequent reads after a servo is first seen: twice the number needed with a fifth of all frames lost."""
FAST_S: Final = 0.2
ANGLE_UNKNOWN_S: Final = 2.0
"""Interval of later reads while only 0x08 gives the angle: 0.03 % of the bus."""
SLOW_S: Final = 6.0
"""Interval of later reads otherwise: ten a minute."""

READABLE: Final = frozenset((State.READY, State.SOFT_START, State.PROTECTED))


def to_position(servo: Servo, degrees: float) -> float:
    """Convert degrees to the position of an ArrayCommand POSITION (table 2-21), before rounding to float16."""
    return degrees / DEGREES[servo.position_unit.unit]


def to_degrees(servo: Servo, position: float) -> float:
    """Convert a position of Status or ArrayCommand POSITION (tables 2-21 and 2-22) to degrees, in the assumed unit."""
    return position * DEGREES[servo.position_unit.unit]


@dataclass(slots=True)
class _Reads:
    """Schedule of the reads of 0x08 of one servo."""

    left: int = FAST_READS
    next_at: Instant = 0.0
    task: asyncio.Task[None] | None = None


class PositionUnits:
    """Reads 0x08 until it has agreed with Status often enough, away from 0°, and stores the unit found.

    The maker's unit is used from the first contact. A servo found to use another unit raises a warning and receives no
    angles by ArrayCommand until its unit is forced. Nothing is written to servos.
    """

    def __init__(
        self,
        requests: ServoRequests,
        hub: Hub,
        base: TimeBase,
        settings: SettingTable,
        audit: Audit,
        for_all: PositionUnit | None,
    ) -> None:
        """`for_all` is forced for every servo without a unit of its own."""
        self._requests = requests
        self._hub = hub
        self._base = base
        self._settings = settings
        self._audit = audit
        self._for_all: PositionUnit | None = for_all
        self._own: set[Uid] = set()
        """Servos with a forced unit of their own."""
        self._reads: dict[Uid, _Reads] = {}

    def on_arrival(self, servo: Servo) -> None:
        """Start checking a servo whose firmware is known. A unit measured on other firmware is discarded."""
        estimate = servo.position_unit
        if servo.uid not in self._reads:
            estimate = servo.position_unit = self._restore(servo.uid)
            self._reads[servo.uid] = _Reads()
        self._reads[servo.uid].left = FAST_READS
        estimate.forget_motion()
        if estimate.firmware != servo.firmware:
            servo.position_unit = Estimate(forced=estimate.forced, firmware=servo.firmware)
            if estimate.measured is not None or estimate.clash:
                self._store(servo.uid, "measured", None)
                text = f"{servo.title} has different firmware. Its position unit is measured again."
                self._hub.publish(
                    LogEvent(
                        "notice", "position_unit", text, servo.uid, {"servo": servo.title, "what": "other_firmware"}
                    )
                )

    def on_status(self, servo: Servo, position: float, at: Instant) -> float | None:
        """Convert a position of Status to degrees. None if its unit is uncertain; 0x08 is shown instead."""
        estimate, register = servo.position_unit, servo.registers.get("current_angle")
        if register is None:
            return estimate.shown(position)
        reading = None
        if register.raw is not None and register.at is not None:
            reading = Angle(register.raw / register.parameter.per_unit, register.at)
        if estimate.add_status(position, at, reading):
            self._found(servo)
        shown = estimate.shown(position)
        if (estimate.unmeasured or shown is None) and self._worth_reading(estimate, position, reading, shown):
            self._read_soon(servo, angle_unknown=shown is None)
        return shown

    def force(self, servo: Servo, unit: PositionUnit | None, *, by: str) -> None:
        """Force the position unit of a servo; None measures it again."""
        before = servo.position_unit.unit
        self._store(servo.uid, "forced", unit)
        if unit is None:
            self._own.discard(servo.uid)
            self._store(servo.uid, "measured", None)
            reads = self._reads.setdefault(servo.uid, _Reads())
            reads.left, reads.next_at = FAST_READS, self._base.now()
            servo.position_unit = Estimate(forced=self._for_all, firmware=servo.firmware)
        else:
            self._own.add(servo.uid)
            servo.position_unit.forced = unit
        self._audit.note(
            NewAuditEntry(by, "position_unit", "applied", servo.uid, None, before, unit, servo.position_unit.unit)
        )
        self._hub.publish(ServoChanged(servo.uid))

    def evidence(self, servo: Servo) -> Note:
        """Evidence for the unit, for users."""
        estimate = servo.position_unit
        if estimate.forced is None:
            return estimate.evidence
        own = servo.uid in self._own
        which = "this servo" if own else "all servos by the server settings"
        return Note(f"Forced for {which}. {estimate.evidence.text}", "unit_forced", {"this_servo": own})

    def forget(self, uid: Uid) -> None:
        """Drop the unit of a servo."""
        self._reads.pop(uid, None)
        self._own.discard(uid)
        self._store(uid, "forced", None)
        self._store(uid, "measured", None)

    async def close(self) -> None:
        """Cancel all reads."""
        tasks = [one.task for one in self._reads.values() if one.task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    @staticmethod
    def _worth_reading(estimate: Estimate, position: float, reading: Angle | None, shown: float | None) -> bool:
        if shown is None:
            return True
        away = position != 0 or (reading is not None and abs(reading.degrees) >= MIN_ANGLE_DEG)
        if not away or not estimate.still:
            return False
        return abs(shown) >= MIN_ANGLE_DEG or (
            reading is not None and abs(reading.degrees) > MIN_DIFFERENCE_DEG + abs(shown)
        )

    def _read_soon(self, servo: Servo, *, angle_unknown: bool) -> None:
        """Read 0x08 between this Status and the next, unless it was read recently or the servo is busy."""
        if self._requests.silent:
            return
        reads, now = self._reads.get(servo.uid), self._base.now()
        if reads is None:
            reads = self._reads[servo.uid] = _Reads()
        if now < reads.next_at or reads.task is not None or servo.state not in READABLE or servo.changing.locked():
            return
        reads.next_at = now + (FAST_S if reads.left > 0 else ANGLE_UNKNOWN_S if angle_unknown else SLOW_S)
        reads.left -= 1
        reads.task = asyncio.get_running_loop().create_task(self._read(servo, reads))

    async def _read(self, servo: Servo, reads: _Reads) -> None:
        parameter = servo.registers["current_angle"].parameter
        try:
            raw = await self._requests.read(servo, parameter, COMPARE)
        except HornbillError as error:
            log.debug("%s: 0x08 beside Status: %s", servo.title, error.detail)
            return
        finally:
            reads.task = None
        servo.angle_deg, servo.angle_at = raw / parameter.per_unit, self._base.now()
        servo.angle_polled_at = servo.angle_at

    def _found(self, servo: Servo) -> None:
        estimate = servo.position_unit
        measured = estimate.measured
        record: Json = {
            "measured": measured, "clash": estimate.clash, "evidence": asdict(estimate.evidence),
            "firmware": estimate.firmware,
        }  # fmt: skip
        self._store(servo.uid, "measured", record)
        log.info("%s: position unit %s, %s: %s", servo.title, estimate.unit, estimate.state, estimate.evidence.text)
        remedy = "Force the position unit."
        params: dict[str, object] = {"servo": servo.title}
        if estimate.clash:
            text = f"The position unit of {servo.title} is unclear. {estimate.evidence.text} "
            text += "Its angle is read from 0x08. No angle is sent by ArrayCommand. " + remedy
            params["what"] = "unclear"
            self._hub.publish(LogEvent("warning", "position_unit", text, servo.uid, params))
        elif measured is not None and estimate.forced not in (None, measured):
            text = f"The position unit of {servo.title} is forced to {NAMES[estimate.unit]} but seems to be "
            text += f"{NAMES[measured]}. {estimate.evidence.text} {remedy}"
            params |= {"what": "forced_otherwise", "unit": estimate.unit, "measured": measured}
            self._hub.publish(LogEvent("warning", "position_unit", text, servo.uid, params))
        elif measured is not None and estimate.forced is None and measured != LITERAL:
            text = f"Positions of {servo.title} are in {NAMES[measured]}, not {NAMES[LITERAL]}. "
            text += (
                f"{estimate.evidence.text} Its angle is shown in that unit. No angle is sent by ArrayCommand. " + remedy
            )
            params |= {"what": "another", "unit": LITERAL, "measured": measured}
            self._hub.publish(LogEvent("warning", "position_unit", text, servo.uid, params))
        self._hub.publish(ServoChanged(servo.uid))

    def _restore(self, uid: Uid) -> Estimate:
        own = _unit(self._stored(uid, "forced"))
        if own is not None:
            self._own.add(uid)
        forced, stored = own or self._for_all, self._stored(uid, "measured")
        if not isinstance(stored, dict):
            return Estimate(forced=forced)
        firmware = stored.get("firmware")
        estimate = Estimate(forced=forced, firmware=firmware if isinstance(firmware, int) else None)
        estimate.measured, estimate.clash = _unit(stored.get("measured")), stored.get("clash") is True
        estimate.evidence = _note(stored.get("evidence"))
        return estimate

    def _stored(self, uid: Uid, what: str) -> Json:
        """Never raises: a servo whose stored unit cannot be read is measured again and can be stopped."""
        try:
            return self._settings.get(_key(uid, what))
        except Exception:
            log.exception("the position unit of %s could not be read", uid)
            return None

    def _store(self, uid: Uid, what: str, value: Json) -> None:
        """Never raises: a full disk must not block measuring."""
        try:
            self._settings.put(_key(uid, what), value) if value is not None else self._settings.drop(_key(uid, what))
        except Exception:
            log.exception("the position unit of %s could not be stored", uid)
            text = "The position unit of a servo could not be stored. Check the data folder and its disk."
            self._hub.publish(LogEvent("warning", "store_failed", text, uid, {"what": "position_unit"}))


def _key(uid: Uid, what: str) -> str:
    return f"position_unit.{what}.{uid}"


def _unit(word: Json) -> PositionUnit | None:
    return word if isinstance(word, str) and word in DEGREES else None


def _note(stored: Json) -> Note:
    """Stored evidence. Older versions stored only its text."""
    try:
        return _NOTE.validate_python(stored)
    except ValidationError:
        return Note(str(stored), "text")
