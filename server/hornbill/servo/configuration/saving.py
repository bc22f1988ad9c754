"""Owns save and restart: jobs that end on evidence, never on hope (sections 2.3, 4.10, 4.11, 4.14)."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import TypeAlias

from hornbill.errors import Busy, HornbillError, NoAnswer, Refused
from hornbill.schema import scale
from hornbill.servo import identification, permission
from hornbill.servo.asking import Asker
from hornbill.servo.fleet import Fleet
from hornbill.servo.hub import Hub, ReadingChanged, ServoChanged
from hornbill.servo.jobs import Job, Jobs, Step
from hornbill.servo.leases import Leases
from hornbill.servo.motion import Motion
from hornbill.servo.servo import Servo, State
from hornbill.servo.stop import Stop
from hornbill.servo.timebase import TimeBase
from hornbill.wire.services import MAGIC, Opcode

RESTART_WITHIN_S = 8.0
"""Silence after a save is about 0.05 s, a restart and a new node id take up to about 3 s; the rest is patience."""

IDENTIFIED_WITHIN_S = 40.0
"""Reading every row after a restart takes 0.1 s, or 20 s when a fifth of all frames is lost."""

NO_RESTART_AFTER_S = 3.0
"""A servo that answered the save and has been heard for this long without restarting does not restart by itself."""

OLD_ENOUGH_S = 2
"""Uptime a servo must have reached before it is sent into a restart: a younger one's uptime, told in whole seconds,
could not prove that it started anew."""

SOFT_START_WITHIN_S = 25.0
LOOK_AGAIN_S = 0.02


SAVE_STEPS = {
    "check": "RAM read",
    "write": "Written to ROM",
    "restart": "Restarted",
    "soft_start": "Soft start over",
    "read_back": "Every saved row read back",
}
RESTART_STEPS = {
    "ask": "Restart asked for",
    "restart": "Restarted",
    "soft_start": "Soft start over",
    "read_back": "Every row read",
}
Work: TypeAlias = Callable[[Job, Servo], Awaitable[dict[str, object]]]


class Saving:
    """Starts save and restart jobs; a second save of a servo joins the first."""

    def __init__(
        self,
        asker: Asker,
        hub: Hub,
        base: TimeBase,
        jobs: Jobs,
        leases: Leases,
        motion: Motion,
        stop: Stop,
        fleet: Fleet,
    ) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._jobs = jobs
        self._leases = leases
        self._motion = motion
        self._stop = stop
        self._fleet = fleet

    def save(self, servo: Servo, lease_id: str | None) -> Job:
        """Write RAM to ROM; the servo restarts and, with soft start and torque on in ROM, moves to 0 degrees.

        Raises Stopped, LeaseHeld, Busy, NoAnswer before anything is sent.
        """
        return self._begin("save", State.SAVING, servo, lease_id, SAVE_STEPS, self._save)

    def restart(self, servo: Servo, lease_id: str | None) -> Job:
        """Restart the servo; what is only in RAM is lost, and it may soft-start to 0 degrees. Raises as `save`."""
        return self._begin("restart", State.RESTARTING, servo, lease_id, RESTART_STEPS, self._restart)

    def check(self, servo: Servo, lease_id: str | None) -> None:
        """Whether a save or a restart could begin now. Raises Stopped, LeaseHeld, Busy, NoAnswer."""
        self._stop.check()
        self._leases.allow_write(lease_id, self._base.now())
        permission.check_writable(servo)
        if self._motion.driven(servo.uid):
            raise Busy(f"{servo.title} is under command. Turn motion off first: a restart drops its torque.")

    def _begin(
        self, kind: str, state: State, servo: Servo, lease_id: str | None, steps: Mapping[str, str], work: Work
    ) -> Job:
        running = self._jobs.running(servo.uid)
        if running is not None and running.kind == kind:
            return running
        if servo.changing.locked():
            raise Busy(f"{servo.title} is being changed right now. Try again when that has ended.")
        self.check(servo, lease_id)
        servo.busy = state
        self._hub.tell(ServoChanged(servo.uid))
        listed = [Step(name, text) for name, text in steps.items()]
        return self._jobs.start(kind, servo.uid, listed, lambda job: self._work(job, servo, work))

    async def _work(self, job: Job, servo: Servo, work: Work) -> dict[str, object]:
        try:
            return await work(job, servo)
        finally:
            servo.busy = None
            self._hub.tell(ServoChanged(servo.uid))

    async def _save(self, job: Job, servo: Servo) -> dict[str, object]:
        rows = [key for key, register in servo.registers.items() if register.parameter.rom]
        job.begin("check")
        await self._old_enough(servo)
        await identification.read_rows(self._asker, servo, rows)
        wanted = {key: servo.raw(key) for key in rows}
        job.done("check", f"{len(rows)} rows read")
        job.begin("write")
        boots = servo.boots
        self._stop.check()
        try:
            if not await self._asker.opcode(servo, Opcode.SAVE):
                raise Refused(f"{servo.title} refused to save (ok = 0). RAM is unchanged; ROM holds what it held.")
            job.done("write", "the servo answered ok")
        except NoAnswer:
            # the answer may be lost in the restart (errata C3): only what happens next tells
            job.done("write", "no answer yet; the restart will tell")
        try:
            await self._come_back(job, servo, boots, may_need_restart=True)
        except NoAnswer:
            identification.forget_rom(servo)
            self._tell_rows(servo)
            raise
        await self._soft_start_over(job, servo)
        job.begin("read_back")
        await identification.read_rows(self._asker, servo, [*rows, "fault_warning"])
        identification.learn_rom(servo, soft_start=False)
        self._fleet.remember(servo)
        self._tell_rows(servo)
        wrong = [key for key in rows if servo.registers[key].rom != wanted[key]]
        if wrong:
            listed = ", ".join(self._difference(servo, key, wanted[key]) for key in wrong)
            raise HornbillError(f"ROM of {servo.title} was not found to hold what RAM held before the save: {listed}.")
        job.done("read_back", f"{len(rows)} rows read back after the restart, all as saved")
        return {"saved": rows, "node_id": servo.node_id}

    async def _restart(self, job: Job, servo: Servo) -> dict[str, object]:
        job.begin("ask")
        await self._old_enough(servo)
        boots = servo.boots
        await self._ask_restart(servo)
        job.done("ask")
        await self._come_back(job, servo, boots, may_need_restart=False)
        await self._soft_start_over(job, servo)
        job.begin("read_back")
        await identification.read_rows(self._asker, servo)
        identification.learn_rom(servo, soft_start=False)
        self._fleet.remember(servo)
        self._tell_rows(servo)
        job.done("read_back", f"{len(servo.registers)} rows read")
        return {"node_id": servo.node_id}

    async def _old_enough(self, servo: Servo) -> None:
        until = self._base.now() + OLD_ENOUGH_S + 2
        while servo.status is not None and servo.status.uptime_sec < OLD_ENOUGH_S:
            if self._base.now() > until:
                return
            await asyncio.sleep(LOOK_AGAIN_S)

    async def _ask_restart(self, servo: Servo) -> None:
        self._stop.check()
        try:
            if not await self._asker.restart(servo, MAGIC):
                raise Refused(f"{servo.title} refused to restart (ok = 0).")
        except NoAnswer:
            pass  # it may have restarted before it could answer; the wait that follows decides

    async def _come_back(self, job: Job, servo: Servo, boots: int, *, may_need_restart: bool) -> None:
        """Wait for a start that came after `boots`, and for the servo to be identified again."""
        job.begin("restart")
        servo.busy = State.RESTARTING
        self._hub.tell(ServoChanged(servo.uid))
        began, asked = self._base.now(), False
        while servo.boots == boots or not servo.identified or not servo.online:
            waited = self._base.now() - began
            if servo.boots != boots and waited > IDENTIFIED_WITHIN_S:
                raise NoAnswer(
                    f"{servo.title} restarted, but could not be read within {IDENTIFIED_WITHIN_S:.0f} s since. "
                    "What ROM holds is not known. Check the wiring: its answers are lost.",
                )
            if servo.boots == boots and waited > RESTART_WITHIN_S:
                raise NoAnswer(
                    f"{servo.title} was not seen to restart within {RESTART_WITHIN_S:.0f} s. "
                    "What ROM holds is not known. Check its supply, then save again.",
                )
            heard = servo.status_at is not None and servo.status_at - began > NO_RESTART_AFTER_S - 1.0
            if may_need_restart and not asked and waited > NO_RESTART_AFTER_S and heard and servo.boots == boots:
                asked = True
                await self._ask_restart(servo)
            await asyncio.sleep(LOOK_AGAIN_S)
        took = self._base.now() - began
        job.done("restart", f"uptime went back to 0; node {servo.node_id} again identified after {took:.1f} s")

    async def _soft_start_over(self, job: Job, servo: Servo) -> None:
        if not servo.soft_starting:
            job.skip("soft_start", "no soft start: it is off, or the servo started with torque off")
            return
        job.begin("soft_start")
        began = self._base.now()
        while servo.soft_starting:
            if self._base.now() - began > SOFT_START_WITHIN_S:
                raise NoAnswer(f"{servo.title} does not end its soft start. Look whether the horn is blocked.")
            await asyncio.sleep(LOOK_AGAIN_S)
        angle = "" if servo.angle_deg is None else f", horn at {servo.angle_deg:+.1f}°"
        job.done("soft_start", f"over after {self._base.now() - began:.1f} s{angle}")

    def _tell_rows(self, servo: Servo) -> None:
        for key in servo.registers:
            self._hub.tell(ReadingChanged(servo.uid, key))

    def _difference(self, servo: Servo, key: str, wanted: int | None) -> str:
        row, held = servo.registers[key].parameter, servo.registers[key].rom
        before = "unknown" if wanted is None else scale.to_text(row, wanted)
        after = "unknown" if held is None else scale.to_text(row, held)
        return f"{row.label} {before} → {after}"
