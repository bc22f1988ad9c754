"""Owns Resetting: back to the defaults of the model, in RAM and in ROM, whatever ERASE turns out to do (2.3, 4.9)."""

import copy
from dataclasses import dataclass, field, replace

from hornbill.errors import HornbillError, NoAnswer, NotAsWanted, NotInThisModel, OutOfRange, Refused
from hornbill.schema import scale
from hornbill.schema.scale import Value
from hornbill.servo import identification
from hornbill.servo.asking import READ, WRITE, Asker
from hornbill.servo.configuration.audit import Audit
from hornbill.servo.configuration.forecast import Forecast, forecast_of, supply_problem
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.proving import differing
from hornbill.servo.configuration.saving import Saving
from hornbill.servo.configuration.writing import Change
from hornbill.servo.hub import Hub, ReadingChanged, ServoChanged
from hornbill.servo.jobs import Job, Jobs
from hornbill.servo.leases import Leases
from hornbill.servo.motion import Motion
from hornbill.servo.remembering import Memory
from hornbill.servo.servo import Servo, State
from hornbill.servo.steps import Step
from hornbill.servo.stop import Stop
from hornbill.servo.timebase import TimeBase
from hornbill.store.audit import Entry
from hornbill.units import Raw
from hornbill.wire.services import Opcode

LIVES = 3
"""Restarts in the middle of the writing that are gone along with: each one loses what was not saved."""

_PATIENT = replace(WRITE, tries=READ.tries)

STEPS = {
    "check": "Supply and RAM read",
    "snapshot": "Snapshot taken",
    "torque_off": "Torque off",
    "erase": "Reset by the servo itself",
    "read": "What it holds now read",
    "identity": "Identity written back",
    "rows": "Rows that still differ written",
    "save": "Saved to ROM",
    "verify": "Every row verified",
}


@dataclass(frozen=True, slots=True)
class Preview:
    """What a reset would change, what it keeps (by key, engineering values), and what its restart does to the horn."""

    changes: list[Change]
    kept: dict[str, Value]
    restart: Forecast


@dataclass(slots=True)
class _Run:
    servo: Servo
    by: str
    keeps: bool
    wanted: dict[str, Raw] = field(default_factory=dict[str, Raw])
    before: dict[str, Raw | None] = field(default_factory=dict[str, Raw | None])
    snapshot: int | None = None
    written: dict[str, Raw] = field(default_factory=dict[str, Raw])
    erased: bool = False
    torque_gone: bool = False


class Resetting:
    """Starts factory resets.

    The documents do not say whether ERASE reaches ROM, whether it takes the ids along, and whether it restarts; so
    nothing is concluded from it: what the servo holds afterwards is read, the rest is written row by row, and only
    the save proves it. The order is the one that moves least. Torque is taken first, and again when ERASE has given
    it back (0x20 is ON by default), because a zero that is written back turns under a held horn. 0x20 itself has to be
    ON in RAM when SAVE copies RAM to ROM: it is the very last row, written right before the SAVE. The horn is then
    held where it stands (section 4.13) for the milliseconds until the ROM write stops the motor anyway; nothing moves
    before the restart, and that was told beforehand. Where the SAVE is not carried out, torque goes off again.
    """

    def __init__(
        self,
        asker: Asker,
        hub: Hub,
        base: TimeBase,
        jobs: Jobs,
        leases: Leases,
        motion: Motion,
        stop: Stop,
        saving: Saving,
        history: History,
        audit: Audit,
        memory: Memory,
    ) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._jobs = jobs
        self._leases = leases
        self._motion = motion
        self._stop = stop
        self._saving = saving
        self._restarts = saving.restarts
        self._history = history
        self._audit = audit
        self._memory = memory

    async def preview(self, servo: Servo, *, keep_identity: bool) -> Preview:
        """What a reset would change, of a servo that is read for it. Raises NotInThisModel, NoAnswer."""
        wanted = self._wanted(servo, keep_identity)
        await self._read(servo)
        wanted = self._wanted(servo, keep_identity)
        values = servo.raws()
        changes: list[Change] = []
        kept: dict[str, Value] = {}
        for key, raw in wanted.items():
            register = servo.registers[key]
            row = register.parameter
            if keep_identity and row.identity:
                kept[key] = scale.to_value(row, raw, values)
                continue
            differs = [one for one in (register.raw, register.rom) if one is not None and one != raw]
            if differs:
                before, default = (scale.to_value(row, one, values) for one in (differs[0], raw))
                changes.append(Change(key, before, default, before, "planned"))
        return Preview(changes, kept, forecast_of(servo, wanted))

    def start(self, servo: Servo, lease_id: str | None, *, keep_identity: bool = True) -> Job:
        """Reset it, save and verify: a job. `keep_identity`: origin, servo id and node id (0x44 to 0x46) stay.

        Raises Stopped, LeaseHeld, Busy, NoAnswer, NotInThisModel before anything is sent. The job may end with those
        and OutOfRange (the supply), Refused, NotAsWanted, ConfigurationLost; facts: `not_done`, `snapshot`.
        """
        self._saving.check(servo, lease_id)
        self._jobs.check_free(servo)
        self._wanted(servo, keep_identity)
        run = _Run(servo, self._leases.who(lease_id, self._base.now()), keep_identity)
        servo.busy = State.SAVING
        self._hub.tell(ServoChanged(servo.uid))
        steps = [Step(name, text) for name, text in STEPS.items()]
        return self._jobs.start("factory_reset", servo.uid, steps, lambda job: self._whole(job, run))

    async def _whole(self, job: Job, run: _Run) -> dict[str, object]:
        servo, outcome, detail = run.servo, "cancelled", ""
        try:
            result = await self._restarts.unless_stopped(self._work(job, run))
            outcome = "succeeded"
            return result
        except HornbillError as error:
            told = self._told(job, run, error)
            outcome, detail = "failed", told.detail
            raise told from error
        finally:
            if run.erased and not run.torque_gone and outcome != "succeeded" and not self._stop.latched:
                self._motion.debts.owe(servo)  # ERASE may have given torque back
            servo.busy, servo.expected_rom = None, None
            self._hub.tell(ServoChanged(servo.uid))
            self._audit.note(*self._entries(job, run, outcome, detail))

    async def _work(self, job: Job, run: _Run) -> dict[str, object]:
        servo = run.servo
        job.begin("check")
        await self._restarts.old_enough(servo)
        await self._read(servo)
        problem = supply_problem(servo)
        if problem is not None:
            raise OutOfRange(f"{problem} Nothing was reset.", key="current_voltage")
        run.wanted = self._wanted(servo, run.keeps)
        run.before = {key: servo.raw(key) for key in run.wanted}
        restart = forecast_of(servo, run.wanted)
        job.done("check", " ".join([f"{len(run.wanted)} rows read.", restart.text, *restart.warnings]))
        job.begin("snapshot")
        taken = await self._history.take(self._asker, servo, reason="before factory reset", by=run.by)
        run.snapshot = taken.id
        job.done("snapshot", f"snapshot {taken.id}")
        job.begin("torque_off")
        await self._torque_off(run)
        job.done("torque_off", "0x20 reads off")
        node_before = servo.node_id
        await self._erase(job, run)
        await self._bring(job, run)
        saved = await self._save(job, run)
        job.begin("verify")
        wrong = {key: raw for key, raw in run.wanted.items() if servo.registers[key].rom != raw}
        if wrong:
            differences, said = differing(servo, wrong)
            raise NotAsWanted(
                f"{servo.title} was saved, and ROM is not as it should be: {said}.", differences=differences
            )
        job.done("verify", f"{len(run.wanted)} rows of ROM read back after the restart, all as they should be")
        changed = [key for key, raw in run.wanted.items() if run.before[key] != raw]
        return {
            "changed": changed, "node_id": servo.node_id, "node_id_before": node_before, "snapshot": run.snapshot,
            "save": saved.id,
        }  # fmt: skip

    async def _erase(self, job: Job, run: _Run) -> None:
        """Run ERASE once. Whatever comes of it, the servo is there and settled afterwards. Raises Refused, NoAnswer."""
        servo = run.servo
        job.begin("erase")
        departure = self._restarts.depart(servo)
        defaults = {key: one.parameter.default for key, one in servo.registers.items() if one.parameter.rom}
        servo.expected_rom = {key: raw for key, raw in defaults.items() if raw is not None}
        run.erased, run.torque_gone, refused = True, False, False
        self._memory.doubt(servo)
        servo.writes_are_over()
        try:
            refused = not await self._asker.opcode(servo, Opcode.ERASE)
            answer = "answered ok"
        except NoAnswer:
            answer = "no answer: what the servo holds will tell"
        finally:  # also when stop, or who cancels, ends the wait for the answer: it may have been carried out
            if not refused:
                identification.forget_rom(servo)
                for key in defaults:
                    servo.forget(key)
                    self._hub.tell(ReadingChanged(servo.uid, key))
        if refused:
            run.erased, run.torque_gone = False, True
            self._memory.remember(servo)
            raise Refused(f"{servo.title} refused the reset (ok = 0). Nothing was changed but torque, which is off.")
        restarted = await self._restarts.left(servo, departure)
        await self._there(servo)
        job.done("erase", f"{answer}; " + (f"it restarted, node {servo.node_id}" if restarted else "no restart"))

    async def _bring(self, job: Job, run: _Run) -> None:
        """Write what ERASE left undone, in one life of the servo. Raises NoAnswer, Refused, NotAsWanted."""
        servo = run.servo
        for life in range(1, LIVES + 1):
            boots = servo.boots
            try:
                await self._there(servo)
                job.begin("read")
                await self._asker.read(servo, servo.registers["torque_mode"].parameter)
                back = servo.raw("torque_mode") != 1
                if back:
                    await self._torque_off(run)
                run.torque_gone = True
                await identification.read_rows(self._asker, servo, list(run.wanted))
                open_rows = [key for key in run.wanted if servo.raw(key) != run.wanted[key] and key != "torque_mode"]
                given = ", and torque was on again: taken off" if back else ""
                job.done("read", f"{len(open_rows)} rows are not yet as they should be{given}")
                identity = [key for key in open_rows if servo.registers[key].parameter.identity]
                await self._write(job, run, "identity", identity)
                await self._write(job, run, "rows", [key for key in open_rows if key not in identity])
            except NoAnswer:
                if life == LIVES:
                    raise
                run.torque_gone = False
                continue
            if servo.boots == boots:
                return
            run.torque_gone = False
        raise NoAnswer(f"{servo.title} restarts again and again, so that nothing it is told stays. Check its supply.")

    async def _write(self, job: Job, run: _Run, step: str, keys: list[str]) -> None:
        servo = run.servo
        if not keys:
            job.skip(step, "all of them are as they should be")
            return
        job.begin(step)
        for key in keys:
            row, raw = servo.registers[key].parameter, run.wanted[key]
            found = run.written[key] = await self._asker.write(servo, row, raw, _PATIENT)
            if found != raw:
                values = servo.raws()
                shown = [scale.to_value(row, one, values) for one in (raw, found)]
                raise NotAsWanted(
                    f"{servo.title} made {scale.to_text(row, found, values)} of {row.label.lower()} "
                    f"{scale.to_text(row, raw, values)}.",
                    differences=[{"key": key, "wanted": shown[0], "found": shown[1]}],
                )
        job.done(step, ", ".join(keys))

    async def _save(self, job: Job, run: _Run) -> Job:
        """Save through a job of its own, which writes 0x20 last."""
        assert run.snapshot is not None
        job.begin("save")
        child = self._saving.save_for(
            run.servo, by=run.by, snapshot=run.snapshot, torque_on=run.wanted["torque_mode"] == 0
        )
        try:
            await self._jobs.wait(child)
        finally:
            await self._jobs.cancel(child.id)  # ends nothing that has ended; a stop must not leave it alone
        if child.error is not None:
            raise child.error
        if child.state != "succeeded":
            raise NotAsWanted(f"Saving {run.servo.title} was cancelled. What its ROM holds is not known.")
        job.done("save", f"job {child.id}: {child.steps[-1].evidence}")
        return child

    async def _torque_off(self, run: _Run) -> None:
        if await self._motion.torque_away(run.servo, "off") != 1:
            raise NotAsWanted(f"{run.servo.title} did not take torque off. Nothing further was reset.")

    async def _there(self, servo: Servo) -> None:
        """Wait for a servo that may be starting, on whatever node id, and for the end of its soft start."""
        await self._restarts.back(servo, self._restarts.depart(servo))
        await self._restarts.soft_start_over(servo)
        servo.busy = State.SAVING
        self._hub.tell(ServoChanged(servo.uid))

    async def _read(self, servo: Servo) -> None:
        live = [key for key in ("current_voltage", "current_angle", "fault_warning") if key in servo.registers]
        rows = [key for key, one in servo.registers.items() if one.parameter.rom]
        await identification.read_rows(self._asker, servo, [*live, *rows])

    @staticmethod
    def _wanted(servo: Servo, keep_identity: bool) -> dict[str, Raw]:
        if servo.model is None:
            raise NotInThisModel(f"{servo.title} is of no known model, so its defaults are not known.")
        found: dict[str, Raw] = {}
        for key, one in servo.registers.items():
            kept = one.raw if keep_identity and one.parameter.identity else None
            raw = one.parameter.default if kept is None else kept
            if one.parameter.rom and raw is not None:
                found[key] = raw
        return found

    @staticmethod
    def _told(job: Job, run: _Run, error: HornbillError) -> HornbillError:
        """The error with what was not done, and the way back."""
        told = copy.copy(error)  # the save job shows the same one
        told.facts = dict(error.facts)
        not_done = [step.text for step in job.steps if step.state in ("waiting", "running")]
        told.facts["not_done"] = not_done
        told.detail = f"{error.detail} Not done: {', '.join(not_done).lower()}."
        if run.snapshot is not None:
            told.facts["snapshot"] = run.snapshot
            if run.erased and f"Snapshot {run.snapshot}" not in told.detail:
                told.detail += f" Snapshot {run.snapshot} holds what it held before."
        return told

    @staticmethod
    def _entries(job: Job, run: _Run, outcome: str, detail: str) -> list[Entry]:
        servo, values = run.servo, run.servo.raws()
        whole = Entry(
            run.by, "factory_reset", outcome, servo.uid, before=run.snapshot, detail=detail, job=job.id
        )  # fmt: skip
        rows: list[Entry] = []
        for key, raw in (run.wanted if outcome == "succeeded" else run.written).items():
            row, was = servo.registers[key].parameter, run.before[key]
            if was != raw:
                before, wanted, now = (
                    None if one is None else scale.to_value(row, one, values) for one in (was, run.wanted[key], raw)
                )
                rows.append(
                    Entry(run.by, "factory_reset", "applied", servo.uid, key, before, wanted, now, job=job.id)
                )  # fmt: skip
        return [*rows, whole]
