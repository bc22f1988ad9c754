"""Owns save and restart: jobs that end on evidence, never on hope (sections 2.3, 4.10, 4.11, 4.14)."""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from hornbill.errors import (
    BadRequest,
    Busy,
    Conflict,
    HornbillError,
    NoAnswer,
    NotAsWanted,
    OutOfRange,
    Refused,
    Stopped,
)
from hornbill.schema import scale
from hornbill.servo import identification, permission
from hornbill.servo.asking import Asker
from hornbill.servo.configuration import sheet, torque_in_rom
from hornbill.servo.configuration.audit import Audit
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.forecast import forecast, supply_problem
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.proving import Proof, check_held, check_rest
from hornbill.servo.configuration.restarting import LOOK_AGAIN_S, Departure, Restarts
from hornbill.servo.configuration.writing import Change
from hornbill.servo.fleet import Fleet
from hornbill.servo.hub import Hub, ReadingChanged, ServoChanged
from hornbill.servo.jobs import Job, Jobs
from hornbill.servo.leases import Leases
from hornbill.servo.motion import Motion
from hornbill.servo.servo import Servo, State
from hornbill.servo.steps import Step
from hornbill.servo.stop import Stop
from hornbill.servo.timebase import TimeBase
from hornbill.store.audit import Entry
from hornbill.units import Raw
from hornbill.wire.services import Opcode

log = logging.getLogger(__name__)

SAVE_TRIES = 4
"""Times SAVE is sent, each only when the one before was not answered and the servo was then heard to run on: SAVE of
the same RAM is the same SAVE, and one that is lost on the bus was never carried out."""

LEAVES_WITHIN_S = 10.0
"""How long a save waits for a servo to leave the node id it will have after its restart."""

LIVE = ("current_voltage", "current_angle", "current_speed", "command_speed", "command_torque")

SAVE_STEPS = {
    "check": "At rest, supply and RAM read",
    "snapshot": "Snapshot taken",
    "write": "Written to ROM",
    "silence": "Silent while it writes and starts",
    "restart": "Restarted",
    "back": "Back on the bus",
    "soft_start": "Soft start over",
    "read_back": "In ROM: every saved row read back",
}
RESTART_STEPS = {
    "ask": "Restart asked for",
    "silence": "Silent while it starts",
    "restart": "Restarted",
    "back": "Back on the bus",
    "soft_start": "Soft start over",
    "read_back": "Every row read",
}


@dataclass(slots=True)
class Run:
    """One save or restart: who wants it, the snapshot of before, whether 0x20 becomes ON in the last moment.

    `boots` is its life when this was asked for, `written` what was written to it in this life, and is to be in ROM.
    `sent`: SAVE may have reached the servo, so that ROM is not known to hold what it held.
    """

    by: str
    boots: int
    written: Sequence[Change] = ()
    snapshot: int | None = None
    torque_on: bool = False
    sent: bool = False


Work: TypeAlias = Callable[[Job, Servo, Run], Awaitable[dict[str, object]]]


class Saving:
    """Starts save and restart jobs; a second save of a servo joins the first. `torque_in_rom` asks before."""

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
        history: History,
        audit: Audit,
        claims: Claims,
    ) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._jobs = jobs
        self._leases = leases
        self._motion = motion
        self._stop = stop
        self._fleet = fleet
        self._history = history
        self._audit = audit
        self._claims = claims
        self.restarts = Restarts(asker, hub, base, stop, fleet)
        self._proof = Proof(asker, base, stop, self.restarts)

    def save(
        self,
        servo: Servo,
        lease_id: str | None,
        *,
        by: str | None = None,
        written: Sequence[Change] = (),
        torque_on: bool = False,
    ) -> Job:
        """Write RAM to ROM; the servo restarts and, with soft start and torque on in ROM, moves to 0 degrees.

        `by`: who was permitted to when they asked, which was long ago; no lease is asked for then. `written` is what
        was just changed and is wanted in ROM: where RAM does not hold it any more nothing is saved, and a save that
        is under way already, which may be of something else, is not joined but Busy. `torque_on`: as `save_for`, for
        one that the end of motion control left without torque; then it raises ConfigurationLost and BusReadOnly, too.

        Raises Stopped, LeaseHeld, Busy, NoAnswer before anything is sent. The job may end with those and OutOfRange
        (the supply), Refused, Conflict (the node id is another's), NotAsWanted, ConfigurationLost; its facts name the
        `snapshot` of before and the `differences`.
        """
        return self._begin("save", servo, lease_id, by, written, torque_on)

    def restart(self, servo: Servo, lease_id: str | None, *, by: str | None = None) -> Job:
        """Restart the servo; what is only in RAM is lost, and it may soft-start to 0 degrees. Raises as `save`."""
        return self._begin("restart", servo, lease_id, by)

    def save_for(self, servo: Servo, *, by: str, snapshot: int, torque_on: bool) -> Job:
        """Save as a part of a job that has this servo, and has checked and kept it.

        `torque_on`: 0x20 becomes ON right before the SAVE, so that ROM holds it (section 4.13); the horn is held where
        it stands until the servo starts anew, and when it does not, torque goes off again.
        """
        return self._start("save", servo, Run(by, servo.boots, (), snapshot, torque_on))

    def joined(self, servo: Servo, values: Mapping[str, object]) -> Job | None:
        """The save under way that puts just these values (engineering, by key) into ROM, or None."""
        job, held = self.running("save", servo), servo.expected_rom
        if job is None or held is None or not values.keys() <= held.keys():  # None: it has not read yet what it saves
            return None
        try:
            same = all(
                held[key] == scale.to_raw(servo.registers[key].parameter, one, held) for key, one in values.items()
            )
        except BadRequest:  # whoever asked is told what is wrong with it when it is written
            return None
        return job if same else None

    def running(self, kind: str, servo: Servo) -> Job | None:
        """The save (or restart) of a servo that is under way."""
        return next(
            (job for job in self._jobs.all() if (job.kind, job.uid) == (kind, servo.uid) and not job.ended), None
        )

    def check(self, servo: Servo, lease_id: str | None, *, by: str | None = None) -> None:
        """Whether a save or a restart could begin now. Raises Stopped, LeaseHeld, Busy, NoAnswer."""
        self._stop.check()
        if by is None:
            self._leases.allow_write(lease_id, self._base.now())
        permission.check_writable(servo)
        if self._motion.driven(servo.uid):
            raise Busy(f"{servo.title} is under command. Turn motion off first: a restart drops its torque.")

    def _begin(
        self,
        kind: str,
        servo: Servo,
        lease_id: str | None,
        by: str | None,
        written: Sequence[Change] = (),
        torque_on: bool = False,
    ) -> Job:
        running = self.running(kind, servo)
        if running is not None and not written and not torque_on:
            return running
        self.check(servo, lease_id, by=by)
        if torque_on:
            permission.check_movable(servo)
        self._jobs.check_free(servo)
        by = by or self._leases.who(lease_id, self._base.now())
        return self._start(kind, servo, Run(by, servo.boots, written, torque_on=torque_on))

    def _start(self, kind: str, servo: Servo, run: Run) -> Job:
        steps, state = (SAVE_STEPS, State.SAVING) if kind == "save" else (RESTART_STEPS, State.RESTARTING)
        before, expected = servo.busy, servo.expected_rom
        servo.busy = state
        self._hub.tell(ServoChanged(servo.uid))
        work: Work = self._save if kind == "save" else self._restart

        async def whole(job: Job) -> dict[str, object]:
            outcome, detail = "cancelled", ""
            try:
                result = await work(job, servo, run)
                outcome = "succeeded"
                return result
            except HornbillError as error:
                outcome, detail = "failed", error.detail
                raise
            finally:
                servo.busy, servo.expected_rom = before, expected
                self._hub.tell(ServoChanged(servo.uid))
                self._audit.note(
                    Entry(run.by, kind, outcome, servo.uid, before=run.snapshot, detail=detail, job=job.id)
                )

        return self._jobs.start(kind, servo.uid, [Step(name, text) for name, text in steps.items()], whole)

    async def _save(self, job: Job, servo: Servo, run: Run) -> dict[str, object]:
        rows = [key for key, register in servo.registers.items() if register.parameter.rom]
        job.begin("check")
        job.done("check", await self._checked(servo, run, rows))
        wanted = {key: servo.raw(key) for key in rows} | ({"torque_mode": 0} if run.torque_on else {})
        servo.expected_rom = {key: raw for key, raw in wanted.items() if raw is not None}
        await self._keep(job, servo, run)
        if servo.boots != run.boots:
            raise NotAsWanted(
                f"{servo.title} restarted before it was saved, so what was only in RAM is lost. Nothing was saved. "
                "Look at what it holds now."
            )
        self._stop.check()
        departure = self.restarts.depart(servo)
        try:
            await self._write(job, servo, run, departure)
            await self._prove(job, servo, departure, [*rows, "fault_warning"], wanted)
        except BaseException as error:
            if run.sent and servo.boots == departure.boots:
                identification.forget_rom(servo)  # old, new or nothing: nobody knows
                self._tell_rows(servo)
            if isinstance(error, HornbillError) and run.snapshot is not None:
                error.facts.setdefault("snapshot", run.snapshot)
                error.detail += f" Snapshot {run.snapshot} holds what was in RAM before."
            raise
        return {
            "saved": rows, "node_id": servo.node_id, "node_id_before": departure.node_id, "snapshot": run.snapshot,
            "units": [sheet.saved(servo, by=run.by, began=job.created_at, ended=job.clock())],
        }  # fmt: skip

    async def _restart(self, job: Job, servo: Servo, run: Run) -> dict[str, object]:
        job.begin("ask")
        await self.restarts.old_enough(servo)
        departure = self.restarts.depart(servo)
        tries = await self.restarts.ask(servo, departure)
        job.done("ask", "once" if tries == 1 else f"{tries} times: it ran on before")
        self._seen(job, departure, "its uptime went back")
        await self._prove(job, servo, departure, list(servo.registers), {})
        return {"node_id": servo.node_id, "node_id_before": departure.node_id}

    async def _checked(self, servo: Servo, run: Run, rows: list[str]) -> str:
        """Read what a save is of and what it hangs on.

        Raises OutOfRange (supply), Busy (the horn turns), NotAsWanted (RAM does not hold what was written), NoAnswer.
        """
        await self.restarts.old_enough(servo)
        live = [key for key in LIVE if key in servo.registers]
        await identification.read_rows(self._asker, servo, [*rows, *live])
        check_held(servo, run.written)
        problem = supply_problem(servo)
        if problem is not None:
            low, high = servo.raw("voltage_limit_lower"), servo.raw("voltage_limit_upper")
            raise OutOfRange(
                f"{problem} Nothing was saved.", key="current_voltage", unit="V",
                requested=(servo.raw("current_voltage") or 0) / 10, minimum=(low or 0) / 10, maximum=(high or 0) / 10,
            )  # fmt: skip
        moves = check_rest(servo)
        await self._node_free(servo)
        said = forecast(servo, as_saved=True, torque_on=run.torque_on)
        supply = servo.raw("current_voltage")
        found = "supply not known" if supply is None else f"supply {supply / 10:.1f} V"
        return " ".join([f"{len(rows)} rows read, {found}.{moves}", said.text, *said.warnings])

    async def _node_free(self, servo: Servo) -> None:
        """Wait for who is on the node id of RAM and is being saved or restarted itself. Raises Conflict."""
        node, until = servo.raw("node_id"), self._base.now() + LEAVES_WITHIN_S
        while node and node != servo.node_id and (holder := self._claims.on_the_bus(servo, node)) is not None:
            other = None if holder.owner is None else self._fleet.find(holder.owner)
            if other is None or other.busy is None or self._base.now() > until:
                raise Conflict(
                    f"{servo.title} would come back on node ID {node}, where {holder.title} still is. Nothing was "
                    "saved. Save that one first, or let POST /api/v1/commissioning exchange them.",
                    key="node_id", requested=node, owner=holder.owner, owner_title=holder.title,
                )  # fmt: skip
            await asyncio.sleep(LOOK_AGAIN_S)

    async def _keep(self, job: Job, servo: Servo, run: Run) -> None:
        if run.snapshot is not None:
            job.skip("snapshot", f"snapshot {run.snapshot} was taken before")
            return
        job.begin("snapshot")
        try:
            run.snapshot = (await self._history.take(self._asker, servo, reason="before saving", by=run.by)).id
            job.done("snapshot", f"snapshot {run.snapshot}")
        except HornbillError:
            raise
        except Exception:  # a full disk must not keep anybody from saving; what cannot be undone is said
            log.exception("%s: no snapshot before saving", servo.title)
            job.fail("snapshot", "the store could not keep it; what is saved now cannot be undone")

    async def _write(self, job: Job, servo: Servo, run: Run, departure: Departure) -> None:
        """Send SAVE until it is known to have been carried out, and see the servo start anew."""
        job.begin("write")
        try:
            if run.torque_on:
                await self.restarts.unless_stopped(torque_in_rom.turn_on(self._asker, servo))
            for tries in range(1, SAVE_TRIES + 1):
                answered, stopped = await self._send_save(servo, run)
                sent = (
                    "sent once" if tries == 1 else f"sent {tries} times, for it was not answered and the servo ran on"
                )
                job.done(
                    "write", f"{sent}; " + ("the servo answered ok" if answered else "no answer: the restart tells")
                )
                job.begin("silence")
                if await self.restarts.left(servo, departure):
                    self._seen(job, departure, "its uptime went back, by itself")
                    return
                if stopped is not None:
                    raise stopped
                if answered:
                    break
            await self.restarts.ask(servo, departure)
            self._seen(job, departure, "its uptime went back, when it was asked to: by itself it ran on")
        except BaseException:
            if run.torque_on and servo.boots == departure.boots and not self._stop.latched:
                self._motion.debts.owe(servo)
            raise

    async def _send_save(self, servo: Servo, run: Run) -> tuple[bool, Stopped | None]:
        """Whether it was answered, and the stop that was pressed meanwhile. Raises Stopped before it is sent."""
        self._stop.check()
        if not run.sent:
            self._fleet.memory.doubt(servo)
        before, run.sent = run.sent, True
        servo.writes_are_over()
        try:
            if not await self.restarts.unless_stopped(self._asker.opcode(servo, Opcode.SAVE)):
                run.sent = before  # one of before that was not answered may have been carried out all the same
                if not before:
                    self._fleet.remember(servo)
                held = "What its ROM holds is not known" if before else "ROM holds what it held"
                raise Refused(f"{servo.title} refused to save (ok = 0). RAM is unchanged. {held}.")
        except NoAnswer:
            # the answer may be lost in the restart (errata C3): only what happens next tells
            return False, None
        except Stopped as stopped:
            stopped.detail += f" Whether {servo.title} had got the SAVE by then, and what its ROM holds, is not known."
            return False, stopped
        return True, None

    def _seen(self, job: Job, departure: Departure, evidence: str) -> None:
        if next(step.state for step in job.steps if step.name == "silence") != "running":
            job.begin("silence")
        job.done("silence", self.restarts.silence(departure))
        job.begin("restart")
        job.done("restart", evidence)

    async def _prove(
        self, job: Job, servo: Servo, departure: Departure, rows: list[str], wanted: Mapping[str, Raw | None]
    ) -> None:
        try:
            await self._proof.read_back(job, servo, departure, rows, wanted)
        finally:
            if servo.boots != departure.boots and servo.identified:
                self._fleet.remember(servo)  # also when it is not as wanted: that is what it holds now
                self._tell_rows(servo)

    def _tell_rows(self, servo: Servo) -> None:
        for key in servo.registers:
            self._hub.tell(ReadingChanged(servo.uid, key))
