"""Job that switches outputs on again, one by one, after a stop, a lease or a command switched them off."""

import asyncio
from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import dataclass

from hornbill.domain.fields import known
from hornbill.domain.note import Note
from hornbill.errors import (
    BusDisconnected,
    Busy,
    DidNotMove,
    HornbillError,
    LeaseHeld,
    LeaseRequired,
    NeedsConfirmation,
    NoResponse,
    OutOfRange,
    Refused,
    Stopped,
)
from hornbill.servo.configuration.following import RestartFollower
from hornbill.servo.configuration.record import ServoRecord
from hornbill.servo.device import permission
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.output import KEY, ON, SESSION, off_mode
from hornbill.servo.device.requests import READ
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.cautions import needs_feeding
from hornbill.servo.motion.motion import AT_REST_RPM, Motion
from hornbill.servo.runs.fleet_run import FleetJob, RunTarget
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.steps import Evidence, Step
from hornbill.servo.torque_off.stop import Latch, StopControl
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Uid

WORD = "load"
"""Confirms that a servo under load may be turned on."""

LOADED_PCT = 20
"""A torque reading above this is a load on the horn."""

CHECK_AFTER_S = 0.15
STAYED_DEG = 2.0
"""Maximum movement within CHECK_AFTER_S. A horn that moved more was moved by its output, which is turned off again."""

_ENDS = (Stopped, BusDisconnected, LeaseRequired, LeaseHeld)
"""Problems that concern every servo, and end the job."""

_DECIDING = (
    KEY, "current_angle", "current_torque", "current_speed", "timeout_action", "fault_warning", "angle_limit_cw",
    "angle_limit_ccw",
)  # fmt: skip
"""Rows read before an output is switched on."""


@dataclass(frozen=True, slots=True)
class Prospect:
    """Result of a dry run for one servo. `problem`: reason why it would stay off."""

    servo: Servo
    under_load: bool
    needs_lease: bool
    problem: HornbillError | None


@dataclass(slots=True, kw_only=True)
class OutputTarget(RunTarget):
    """One servo of the job. `outcome`: not_tried, on, failed. `held_by`: lease (off when it ends) or servo."""

    servo: Servo
    outcome: str = "not_tried"
    held_by: str | None = None
    angle_deg: float | None = None

    def fail(self, problem: HornbillError) -> None:
        """Record the reason why its output stays off."""
        self.outcome = "failed"
        RunTarget.fail(self, problem)

    def close(self) -> None:
        """Complete the record."""
        if self.outcome == "on":
            self.record.verdict = "done"
        RunTarget.close(self)

    def shown(self) -> dict[str, object]:
        """The target in the result of the job, as JSON."""
        return {
            **self.record.document(), "outcome": self.outcome, "held_by": self.held_by, "angle_deg": self.angle_deg
        }  # fmt: skip


@dataclass(slots=True, kw_only=True)
class OutputRun(FleetJob[OutputTarget]):
    """One job of restoring outputs."""

    ENDS = _ENDS

    lease_id: str | None
    by: str

    ALSO = "outputs_still_off"

    def summary(self, failed: Sequence[OutputTarget]) -> str:
        """The outputs that stayed off."""
        titles = ", ".join(target.title for target in failed)
        return f"{len(failed)} of {len(self.targets)} outputs stayed off: {titles}. "


class RestoreOutputJobs:
    """Starts jobs of kind "restore_output". Nothing moves: each horn is held at its present angle.

    Under a lease the servos are under motion control and kept alive, and are turned off when it ends. Without a lease
    nothing commands them afterwards, which suits servos whose own timeout holds the position (0x26).
    """

    def __init__(
        self,
        services: HostServices,
        motion: Motion,
        stop: StopControl,
        fleet: Fleet,
        follow: RestartFollower,
    ) -> None:
        self._requests = services.requests
        self._base = services.base
        self._jobs = services.jobs
        self._leases = services.leases
        self._motion = motion
        self._stop = stop
        self._fleet = fleet
        self._follow = follow
        self._audit = services.audit

    def candidates(self) -> list[Servo]:
        """Servos configured as on whose output was turned off by a stop, a lease or a command."""
        return [one for one in self._fleet.all() if one.online and _was_switched(one)]

    async def plan(self, uids: Sequence[Uid] | None, lease_id: str | None) -> list[Prospect]:
        """Dry run of `start`, servo by servo. Sends only reads.

        `uids`: None for `candidates`. Raises Unknown, LeaseHeld, LeaseRequired for a lease that has ended, Busy.
        """
        servos = self.candidates() if uids is None else [self._fleet.get(uid) for uid in dict.fromkeys(uids)]
        self._check_writable(lease_id, servos)
        found = await asyncio.gather(*(self._prospect(servo, lease_id) for servo in servos))
        self._check_writable(lease_id, servos)
        self._jobs.check_apart([one.uid for one in servos])
        for servo in servos:
            permission.check_free(servo, self._jobs)
        return found

    async def start(
        self, uids: Sequence[Uid] | None, lease_id: str | None, *, by: str, confirm: Collection[str] = ()
    ) -> RunningJob:
        """Clear a latched stop, then turn the outputs on one after the other.

        A servo that fails stays off and is reported; the others follow. The result has `servos`, one entry each. A stop
        ends the job immediately. Before anything but reads is sent, it raises the errors of `plan`, LeaseRequired (for
        servos whose own timeout would turn the output off again), NeedsConfirmation (load).
        """
        latch = self._stop.latch
        found = await self.plan(uids, lease_id)
        _require_lease([one.servo for one in found if one.needs_lease])
        if WORD not in confirm:
            _require_word([one.servo for one in found if one.under_load])
        targets = [
            OutputTarget(record=ServoRecord(one.servo.uid, by=by), place=place, servo=one.servo)
            for place, one in enumerate(found, 1)
        ]
        for target in targets:
            target.record.identify(target.servo)
        steps = [Step("clear", "Stop cleared"), *(target.step("restore", "output on") for target in targets)]

        async def work(job: RunningJob) -> dict[str, object]:
            run = OutputRun(job=job, targets=targets, lease_id=lease_id, by=by)
            return await run.work(self._execute(run, latch))

        return self._jobs.start("restore_output", None, steps, work)

    async def _execute(self, run: OutputRun, latch: Latch | None) -> None:
        try:
            self._clear(run, latch)
            await self._follow.unless_stopped(run.each(run.targets, self._restore_step))
        finally:
            self._audit.note(*(self._entry(run, one) for one in run.targets if one.outcome != "not_tried"))

    def _clear(self, run: OutputRun, latch: Latch | None) -> None:
        run.job.begin("clear")
        if self._stop.latch is not latch:  # latched since the request, so its clearing was not confirmed
            self._stop.check()
        if self._stop.latched:
            self._stop.clear(run.by)
            run.job.done("clear", Evidence("latch_cleared", "the stop was latched"))
        else:
            run.job.skip("clear", Evidence("not_latched", "no stop was latched"))

    async def _restore_step(self, run: OutputRun, target: OutputTarget) -> None:
        await run.step(target, "restore", self._restore)

    async def _restore(self, run: OutputRun, target: OutputTarget) -> Evidence:
        """Turn one output on. On any problem it is off or on brake as before."""
        servo, lease_id = target.servo, run.lease_id
        async with servo.changing:
            await self._read(servo)
            self._check_lease(lease_id, servo.uid)
            if servo.output_state.state == "on":
                target.angle_deg = _angle(servo)
                target.held_by = "lease" if self._motion.is_commanded(servo.uid) else "servo"
            else:
                self._check(servo)
                await self._switch_on(run, target)
                target.held_by = "servo" if lease_id is None else "lease"
        target.outcome = "on"
        how = "until motion control ends" if target.held_by == "lease" else "by the servo"
        text = f"held at {target.angle_deg:+.1f}° {how}"
        return Evidence("held", text, known(angle_deg=target.angle_deg, held_by=target.held_by))

    async def _switch_on(self, run: OutputRun, target: OutputTarget) -> None:
        """Turn the output on and check that the horn stays. On any problem turn the output off again."""
        servo, lease_id = target.servo, run.lease_id
        before, found, taken, stood = servo.raw(KEY), copy(servo.output), servo.output.disable_count, _angle(servo)
        try:
            if lease_id is not None:
                await self._motion.torque_on(servo, lease_id)
            else:
                await self._motion.energise(servo, run.by)
            await asyncio.sleep(CHECK_AFTER_S)
            await self._read(servo)
            target.angle_deg = _angle(servo)
            self._check_stays(servo, lease_id, stood, target.angle_deg)
        except BaseException:
            under_other = lease_id is None and self._motion.is_commanded(servo.uid)
            if not self._stop.latched and servo.output.disable_count == taken and not under_other:
                self._motion.stop_commanding(servo)
                self._motion.torque_off.require(servo, found.reason, found.by, off_mode(before))
            raise

    def _check_stays(self, servo: Servo, lease_id: str | None, stood: float, angle: float) -> None:
        """Raises if the output is no longer on, or the horn has moved."""
        if lease_id is not None:
            self._motion.may_move(servo, lease_id)
        if servo.output_state.state != "on" or (lease_id is not None and not self._motion.is_commanded(servo.uid)):
            raise Refused(
                f"The output of {servo.title} did not stay on.",
                key=KEY,
                cause="output_not_maintained",
                servo=servo.title,
            )
        if abs(angle - stood) > STAYED_DEG:
            raise DidNotMove(
                f"{servo.title} should hold its horn at {stood:.1f}°, but it moved to {angle:.1f}°. Its output was "
                "turned off again. Check what moves the horn.",
                angle_deg=angle, target_deg=stood, cause="horn_moved", servo=servo.title,
            )  # fmt: skip

    async def _prospect(self, servo: Servo, lease_id: str | None) -> Prospect:
        problem = None
        try:
            await self._read(servo)
            if servo.output_state.state != "on":
                self._check(servo)
        except _ENDS:
            raise
        except HornbillError as error:
            problem = error
        return Prospect(servo, _is_loaded(servo), lease_id is None and needs_feeding(servo), problem)

    def _check_writable(self, lease_id: str | None, servos: Sequence[Servo]) -> None:
        """Raises as `_check_lease`. The given lease may still be without these servos, which can be added to it."""
        if lease_id is not None:
            self._leases.require(lease_id, self._base.now())
        self._leases.allow_write(lease_id, self._base.now(), *(one.uid for one in servos))

    def _check_lease(self, lease_id: str | None, *uids: Uid) -> None:
        """Raises LeaseHeld while another client has motion control, LeaseRequired if the given lease has ended."""
        if lease_id is None:
            self._leases.allow_write(None, self._base.now(), *uids)
        else:
            self._leases.require(lease_id, self._base.now(), *uids)

    def _check(self, servo: Servo) -> None:
        """Check whether one output may be turned on, from the rows just read. Ignores the latch."""
        permission.check_movable(servo)
        if self._motion.torque_off.pending(servo.uid):
            raise NoResponse(
                f"Torque off of {servo.title} is not acknowledged yet and is being repeated. Try again later.",
                cause="torque_off_unconfirmed",
                servo=servo.title,
            )
        speed = servo.raw("current_speed") or 0
        if abs(speed) > AT_REST_RPM:
            raise Busy(
                f"The horn of {servo.title} turns at {speed} rpm. Stop the horn first.",
                cause="horn_turning_output_off",
                servo=servo.title,
                speed_rpm=speed,
            )
        row = permission.row_for(servo, "angle")
        low, high = (limit / row.per_unit for limit in permission.bounds(servo, row))
        angle = _angle(servo)
        if not low <= angle <= high:
            raise OutOfRange(
                f"The horn of {servo.title} is at {angle:.1f}°, outside its angle limits of {low:g}° to {high:g}°. "
                "Its output would move it. Turn the horn within the limits, or widen them.",
                minimum=low, maximum=high, unit=row.unit, requested=angle, cause="outside_limits", servo=servo.title,
            )  # fmt: skip

    async def _read(self, servo: Servo) -> None:
        for key in _DECIDING:
            if key in servo.registers:
                await self._requests.read(servo, servo.registers[key].parameter, READ)

    def _entry(self, run: OutputRun, target: OutputTarget) -> NewAuditEntry:
        outcome = "succeeded" if target.outcome == "on" else "failed"
        notes = () if target.problem is None else (Note.of(target.problem),)
        after = "on" if target.outcome == "on" else None
        return NewAuditEntry(
            run.by, "restore_output", outcome, target.uid, KEY, after=after, notes=notes, job=run.job.id
        )  # fmt: skip


def _was_switched(servo: Servo) -> bool:
    state = servo.output_state
    configured = servo.configured(KEY)
    before = servo.output.last_configured if configured is None else configured
    return state.state in ("off", "brake") and state.reason in SESSION and before == ON


def _angle(servo: Servo) -> float:
    row = servo.registers["current_angle"]
    if row.raw is None or row.at is None:
        raise NoResponse(
            f"The angle of {servo.title} is unknown. Check its supply and wiring.",
            cause="angle_unknown",
            servo=servo.title,
        )
    return row.raw / row.parameter.per_unit


def _is_loaded(servo: Servo) -> bool:
    torque, speed = servo.raw("current_torque") or 0, servo.raw("current_speed") or 0
    return servo.output_state.state == "brake" or abs(torque) > LOADED_PCT or abs(speed) > AT_REST_RPM


def _require_lease(servos: Sequence[Servo]) -> None:
    if servos:
        titles = ", ".join(one.title for one in servos)
        raise LeaseRequired(
            f"{titles}: the servo's own timeout (0x26, 0x27) would turn the output off again. Take motion control "
            "first; the output then stays on until motion control ends.",
            uids=[one.uid for one in servos],
            cause="timeout_needs_lease",
            servos=[one.title for one in servos],
        )


def _require_word(servos: Sequence[Servo]) -> None:
    if servos:
        titles = ", ".join(one.title for one in servos)
        raise NeedsConfirmation(
            f"The horn of {titles} may be under load: on brake, turning, or above {LOADED_PCT} % torque. It will be "
            "held at its present angle.",
            confirm=WORD, uids=[one.uid for one in servos],
            cause="loaded_horns", servos=[one.title for one in servos], load_pct=LOADED_PCT,
        )  # fmt: skip
