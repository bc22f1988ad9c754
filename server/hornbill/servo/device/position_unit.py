"""PositionUnits: checking, forcing and storing what a position on the bus means, servo by servo."""

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
"""0x08 to be compared with Status: after every poll, and not asked again for long, for it is about now."""

FAST_READS: Final = 20
"""Reads a servo is asked for soon after another when it is met: twice what it takes with a fifth of all frames lost."""
FAST_S: Final = 0.2
ANGLE_UNKNOWN_S: Final = 2.0
"""Between later reads while nothing but 0x08 tells where the horn is: 0.03 % of the bus."""
SLOW_S: Final = 6.0
"""Between later reads otherwise: ten a minute."""

READABLE: Final = frozenset((State.READY, State.SOFT_START, State.PROTECTED))


def to_position(servo: Servo, degrees: float) -> float:
    """Degrees as the position of ArrayCommand POSITION (table 2-21), before it is rounded to float16."""
    return degrees / DEGREES[servo.position_unit.unit]


def to_degrees(servo: Servo, position: float) -> float:
    """A position of Status or ArrayCommand POSITION in degrees (tables 2-21 and 2-22), by the unit taken to be its."""
    return position * DEGREES[servo.position_unit.unit]


@dataclass(slots=True)
class _Reads:
    """How often 0x08 of one servo has been asked for."""

    left: int = FAST_READS
    next_at: Instant = 0.0
    task: asyncio.Task[None] | None = None


class PositionUnits:
    """Reads 0x08 until it has agreed with Status often enough, where the horn stands off 0°, and stores what was found.

    The maker's unit is used from the first contact; a servo that turns out to speak another one raises an alarm, and
    gets no angle by ArrayCommand until its unit is forced. Nothing is ever written to a servo.
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
        """`for_all` is forced on every servo that has not been given a unit of its own."""
        self._requests = requests
        self._hub = hub
        self._base = base
        self._settings = settings
        self._audit = audit
        self._for_all: PositionUnit | None = for_all
        self._own: set[Uid] = set()
        """Who was given a unit of its own."""
        self._reads: dict[Uid, _Reads] = {}

    def on_arrival(self, servo: Servo) -> None:
        """A servo is there, and which firmware it has is known. What was measured on another one is void."""
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
                text = f"{servo.title} has other firmware than its position unit was measured on: it is measured anew."
                self._hub.publish(
                    LogEvent(
                        "notice", "position_unit", text, servo.uid, {"servo": servo.title, "what": "other_firmware"}
                    )
                )

    def on_status(self, servo: Servo, position: float, at: Instant) -> float | None:
        """A position of Status in degrees; None where its unit would be a guess, and 0x08 is shown instead."""
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
        """Take a servo's positions for this unit from now on; None measures it, also when it has been before."""
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
        """How the unit is known, for people."""
        estimate = servo.position_unit
        if estimate.forced is None:
            return estimate.evidence
        own = servo.uid in self._own
        which = "this servo" if own else "all servos by a setting"
        return Note(f"Forced for {which}. {estimate.evidence.text}", "unit_forced", {"this_servo": own})

    def forget(self, uid: Uid) -> None:
        """Drop what is known of a servo."""
        self._reads.pop(uid, None)
        self._own.discard(uid)
        self._store(uid, "forced", None)
        self._store(uid, "measured", None)

    async def close(self) -> None:
        """Ask nothing more."""
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
        """Read 0x08 between this Status and the next, unless it was read lately or the servo is at something else."""
        reads, now = self._reads.setdefault(servo.uid, _Reads()), self._base.now()
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
        remedy = "Force the unit."
        params: dict[str, object] = {"servo": servo.title}
        if estimate.clash:
            text = f"It is not clear what positions of {servo.title} mean. {estimate.evidence.text} "
            text += "Its angle is read from 0x08, and no angle is sent by ArrayCommand. " + remedy
            params["what"] = "unclear"
            self._hub.publish(LogEvent("warning", "position_unit", text, servo.uid, params))
        elif measured is not None and estimate.forced not in (None, measured):
            text = f"Positions of {servo.title} were forced to be in {NAMES[estimate.unit]}, and seem to be in "
            text += f"{NAMES[measured]}. {estimate.evidence.text} {remedy}"
            params |= {"what": "forced_otherwise", "unit": estimate.unit, "measured": measured}
            self._hub.publish(LogEvent("warning", "position_unit", text, servo.uid, params))
        elif measured is not None and estimate.forced is None and measured != LITERAL:
            text = f"Positions of {servo.title} are in {NAMES[measured]}, not in {NAMES[LITERAL]}. "
            text += (
                f"{estimate.evidence.text} Its angle is shown by that, and no angle is sent by ArrayCommand. " + remedy
            )
            params |= {"what": "another", "unit": LITERAL, "measured": measured}
            self._hub.publish(LogEvent("warning", "position_unit", text, servo.uid, params))
        self._hub.publish(ServoChanged(servo.uid))

    def _restore(self, uid: Uid) -> Estimate:
        own = _unit(self._stored(uid, "forced"))
        if own is not None:
            self._own.add(uid)
        forced, kept = own or self._for_all, self._stored(uid, "measured")
        if not isinstance(kept, dict):
            return Estimate(forced=forced)
        firmware = kept.get("firmware")
        estimate = Estimate(forced=forced, firmware=firmware if isinstance(firmware, int) else None)
        estimate.measured, estimate.clash = _unit(kept.get("measured")), kept.get("clash") is True
        estimate.evidence = _note(kept.get("evidence"))
        return estimate

    def _stored(self, uid: Uid, what: str) -> Json:
        """Never raises: a servo whose past cannot be read is measured, and can be stopped."""
        try:
            return self._settings.get(_key(uid, what))
        except Exception:
            log.exception("the position unit of %s could not be read", uid)
            return None

    def _store(self, uid: Uid, what: str, value: Json) -> None:
        """Never raises: a full disk must not keep anybody from measuring."""
        try:
            self._settings.put(_key(uid, what), value) if value is not None else self._settings.drop(_key(uid, what))
        except Exception:
            log.exception("the position unit of %s could not be kept", uid)
            text = "What positions of a servo mean could not be stored. Check the data folder and its disk."
            self._hub.publish(LogEvent("warning", "store_failed", text, uid, {"what": "position_unit"}))


def _key(uid: Uid, what: str) -> str:
    return f"position_unit.{what}.{uid}"


def _unit(word: Json) -> PositionUnit | None:
    return word if isinstance(word, str) and word in DEGREES else None


def _note(kept: Json) -> Note:
    """Evidence as it was kept; an older hornbill kept its text alone."""
    try:
        return _NOTE.validate_python(kept)
    except ValidationError:
        return Note(str(kept), "text")
