"""Steps of a factory reset: the model's defaults in RAM and ROM, whatever ERASE turns out to do (2.3, 4.9)."""

import copy
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from hornbill.domain.change import Change, Reason, ResetPreview
from hornbill.domain.fields import known
from hornbill.errors import HornbillError, NoResponse, NotAsWanted, OutOfRange, Refused
from hornbill.schema import scale
from hornbill.schema.scale import Value
from hornbill.servo.configuration.following import RestartFollower
from hornbill.servo.configuration.forecast import forecast_of, forecast_params, supply_problem
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.proving import difference, differing
from hornbill.servo.device import identification, permission
from hornbill.servo.device.requests import READ, WRITE
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.hub import ReadingChanged, ServoChanged
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.steps import Evidence
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Raw
from hornbill.wire.services import Opcode

LIVES = 3
"""Restarts in the middle of the writing that are gone along with: each one loses what was not saved."""

_PATIENT = replace(WRITE, tries=READ.tries)

RESET_STEPS = {
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


BEFORE_RESET = Reason("before factory reset", "factory_reset")


@dataclass(slots=True)
class ResetRun:
    """One factory reset: what is wanted and was there, raw by key, and how far it came."""

    servo: Servo
    by: str
    keeps: bool
    wanted: dict[str, Raw] = field(default_factory=dict[str, Raw])
    before: dict[str, Raw | None] = field(default_factory=dict[str, Raw | None])
    snapshot: int | None = None
    written: dict[str, Raw] = field(default_factory=dict[str, Raw])
    erased: bool = False
    torque_gone: bool = False

    def audit_rows(self, job: RunningJob, outcome: str) -> list[NewAuditEntry]:
        """An entry for each row that the reset changed."""
        servo, values = self.servo, self.servo.raws()
        rows: list[NewAuditEntry] = []
        for key, raw in (self.wanted if outcome == "succeeded" else self.written).items():
            row, was = servo.registers[key].parameter, self.before[key]
            if was != raw:
                before, wanted, now = (
                    None if one is None else scale.to_value(row, one, values) for one in (was, self.wanted[key], raw)
                )
                rows.append(
                    NewAuditEntry(self.by, "factory_reset", "applied", servo.uid, key, before, wanted, now, job=job.id)
                )  # fmt: skip
        return rows


class ResetSteps:
    """Resets one servo.

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
        services: HostServices,
        motion: Motion,
        follow: RestartFollower,
        history: History,
        start_save: Callable[[ResetRun], RunningJob],
    ) -> None:
        """`start_save`: starts the save of a servo that the reset has, checked and took a snapshot of."""
        self._requests = services.requests
        self._hub = services.hub
        self._jobs = services.jobs
        self._motion = motion
        self._follow = follow
        self._history = history
        self._start_save = start_save

    async def preview(self, servo: Servo, *, keep_identity: bool) -> ResetPreview:
        """What a reset would change, of a servo that is read for it. Raises NotInThisModel, NoResponse."""
        reset_values(servo, keep_identity)
        await self.read(servo)
        wanted = reset_values(servo, keep_identity)
        values = servo.raws()
        changes: list[Change] = []
        kept: dict[str, Value] = {}
        for key, raw in wanted.items():
            register = servo.registers[key]
            row = register.parameter
            if keep_identity and row.identity:
                kept[key] = scale.to_value(row, raw, values)
                continue
            differs = [one for one in (servo.configured(key), register.rom) if one is not None and one != raw]
            if differs:
                before, default = (scale.to_value(row, one, values) for one in (differs[0], raw))
                changes.append(Change(key, before, default, before, "planned"))
        return ResetPreview(changes, kept, forecast_of(servo, wanted))

    async def work(self, job: RunningJob, run: ResetRun) -> dict[str, object]:
        """All steps. Stop ends it at once. The result as it is stored; an error says what was not done."""
        succeeded = False
        try:
            result = await self._follow.unless_stopped(self._work(job, run))
            succeeded = True
            return result
        except HornbillError as error:
            raise _told(job, run, error) from error
        finally:
            if run.erased and not run.torque_gone and not succeeded and not self._follow.stop.latched:
                self._motion.torque_off.require(run.servo, "command", run.by)  # ERASE may have given torque back

    async def _work(self, job: RunningJob, run: ResetRun) -> dict[str, object]:
        servo = run.servo
        job.begin("check")
        await self._follow.old_enough(servo)
        await self.read(servo)
        check_supply(servo)
        run.wanted = reset_values(servo, run.keeps)
        run.before = {key: servo.configured(key) for key in run.wanted}
        restart = forecast_of(servo, run.wanted)
        ahead = " ".join([restart.text, *restart.warnings])
        values = {"rows": len(run.wanted), **forecast_params(restart)}
        job.done("check", Evidence("rows_read", f"{len(run.wanted)} rows read. {ahead}", values, ahead))
        job.begin("snapshot")
        taken = await self._history.take(self._requests, servo, reason=BEFORE_RESET, by=run.by)
        run.snapshot = taken.id
        job.done("snapshot", Evidence("snapshot_taken", f"snapshot {taken.id}", {"snapshot": taken.id}))
        job.begin("torque_off")
        await self._torque_off(run)
        job.done("torque_off", Evidence("torque_off", "0x20 reads off"))
        node_before = servo.node_id
        await self._erase(job, run)
        await self._bring(job, run)
        saved = await self._save(job, run)
        job.begin("verify")
        wrong = {key: raw for key, raw in run.wanted.items() if servo.registers[key].rom != raw}
        if wrong:
            differences, said = differing(servo, wrong)
            raise NotAsWanted(
                f"{servo.title} was saved, and ROM is not as it should be: {said}.",
                differences=differences,
                cause="rom_differs",
                servo=servo.title,
                keys=[one["key"] for one in differences],
            )
        text = f"{len(run.wanted)} rows of ROM read back after the restart, all as they should be"
        job.done("verify", Evidence("rows_verified", text, {"rows": len(run.wanted)}))
        changed = [key for key, raw in run.wanted.items() if run.before[key] != raw]
        return {
            "changed": changed, "node_id": servo.node_id, "node_id_before": node_before, "snapshot": run.snapshot,
            "save": saved.id,
        }  # fmt: skip

    async def _erase(self, job: RunningJob, run: ResetRun) -> None:
        """Run ERASE once. Whatever comes of it, the servo is there and settled afterwards. Raises Refused, NoResponse."""
        servo = run.servo
        job.begin("erase")
        await self._follow.fleet.memory.doubt(servo)
        departure = self._follow.depart(servo)
        defaults = {key: one.parameter.default for key, one in servo.registers.items() if one.parameter.rom}
        servo.expected_rom = {key: raw for key, raw in defaults.items() if raw is not None}
        run.erased, run.torque_gone, refused = True, False, False
        servo.writes_are_over()
        try:
            refused = not await self._requests.opcode(servo, Opcode.ERASE)
            answered = True
        except NoResponse:
            answered = False
        finally:  # also when stop, or who cancels, ends the wait for the answer: it may have been carried out
            if not refused:
                identification.forget_rom(servo)
                for key in defaults:
                    servo.forget(key)
                    self._hub.tell(ReadingChanged(servo.uid, key))
        if refused:
            run.erased, run.torque_gone = False, True
            self._follow.fleet.memory.remember(servo)
            raise Refused(
                f"{servo.title} refused the reset (ok = 0). Nothing was changed but torque, which is off.",
                cause="reset_refused",
                servo=servo.title,
            )
        restarted = await self._follow.left(servo, departure)
        await self._there(servo)
        answer = "answered ok" if answered else "no answer: what the servo holds will tell"
        text = f"{answer}; " + (f"it restarted, node {servo.node_id}" if restarted else "no restart")
        node = servo.node_id if restarted else None
        job.done("erase", Evidence("erased", text, known(answered=answered, restarted=restarted, node_id=node)))

    async def _bring(self, job: RunningJob, run: ResetRun) -> None:
        """Write what ERASE left undone, in one life of the servo. Raises NoResponse, Refused, NotAsWanted."""
        servo = run.servo
        for life in range(1, LIVES + 1):
            boots = servo.boots
            try:
                await self._there(servo)
                job.begin("read")
                await self._requests.read(servo, servo.registers["torque_mode"].parameter)
                back = servo.raw("torque_mode") != 1
                if back:
                    await self._torque_off(run)
                run.torque_gone = True
                await identification.read_rows(self._requests, servo, list(run.wanted))
                open_rows = [key for key in run.wanted if servo.raw(key) != run.wanted[key] and key != "torque_mode"]
                given = ", and torque was on again: taken off" if back else ""
                text = f"{len(open_rows)} rows are not yet as they should be{given}"
                job.done("read", Evidence("rows_differ", text, {"rows": len(open_rows), "torque_was_on": back}))
                identity = [key for key in open_rows if servo.registers[key].parameter.identity]
                await self._write(job, run, "identity", identity)
                await self._write(job, run, "rows", [key for key in open_rows if key not in identity])
            except NoResponse:
                if life == LIVES:
                    raise
                run.torque_gone = False
                continue
            if servo.boots == boots:
                return
            run.torque_gone = False
        raise NoResponse(
            f"{servo.title} restarts again and again, so that nothing it is told stays. Check its supply.",
            cause="restarts_repeatedly_reset",
            servo=servo.title,
        )

    async def _write(self, job: RunningJob, run: ResetRun, step: str, keys: list[str]) -> None:
        servo = run.servo
        if not keys:
            job.skip(step, Evidence("nothing_differs", "all of them are as they should be"))
            return
        job.begin(step)
        for key in keys:
            row, raw = servo.registers[key].parameter, run.wanted[key]
            found = run.written[key] = await self._requests.write(servo, row, raw, _PATIENT)
            if found != raw:
                values = servo.raws()
                raise NotAsWanted(
                    f"{servo.title} made {scale.to_text(row, found, values)} of {row.label.lower()} "
                    f"{scale.to_text(row, raw, values)}.",
                    differences=[difference(servo, key, raw, found)[0]],
                    cause="took_another",
                    servo=servo.title,
                    key=key,
                )
        job.done(step, Evidence("rows_written", ", ".join(keys), {"keys": [*keys]}))

    async def _save(self, job: RunningJob, run: ResetRun) -> RunningJob:
        """Save through a job of its own, which writes 0x20 last."""
        job.begin("save")
        child = self._start_save(run)
        told = f"Saving {run.servo.title} was cancelled. What its ROM holds is not known."
        try:
            await self._jobs.succeeded(child, NotAsWanted(told, cause="save_cancelled", servo=run.servo.title))
        finally:
            await self._jobs.cancel(child.id)  # ends nothing that has ended; a stop must not leave it alone
        last = child.steps[-1]
        text = f"job {child.id}: {last.evidence}"
        job.done("save", Evidence("saved_by_job", text, {**last.evidence_params, "job": child.id}))
        return child

    async def _torque_off(self, run: ResetRun) -> None:
        if await self._motion.torque_away(run.servo, "off", by=run.by) != 1:
            raise NotAsWanted(
                f"{run.servo.title} did not take torque off. Nothing further was reset.",
                cause="torque_off_not_taken",
                servo=run.servo.title,
            )

    async def _there(self, servo: Servo) -> None:
        """Wait for a servo that may be starting, on whatever node id, and for the end of its soft start."""
        await self._follow.back(servo, self._follow.depart(servo))
        await self._follow.soft_start_over(servo)
        servo.busy = State.SAVING
        self._hub.tell(ServoChanged(servo.uid))

    async def read(self, servo: Servo) -> None:
        """Read every row of ROM, and what a restart is judged by. Raises NoResponse, BusDisconnected."""
        await identification.read_rows(self._requests, servo, servo.before_restart)


def reset_values(servo: Servo, keep_identity: bool) -> dict[str, Raw]:
    """What a reset brings a servo to, raw by key. Raises NotInThisModel."""
    if servo.model is None:
        raise permission.unknown_series(servo)
    found: dict[str, Raw] = {}
    for key, one in servo.registers.items():
        kept = one.raw if keep_identity and one.parameter.identity else None
        raw = one.parameter.default if kept is None else kept
        if one.parameter.rom and raw is not None:
            found[key] = raw
    return found


def _told(job: RunningJob, run: ResetRun, error: HornbillError) -> HornbillError:
    """The error with what was not done, and the way back."""
    told = copy.copy(error)  # the save job shows the same one
    told.facts = dict(error.facts)
    not_done = [step.text for step in job.steps if step.state in ("waiting", "running")]
    told.facts["not_done"] = not_done
    told.extend(after=f" Not done: {', '.join(not_done).lower()}.", also="not_done")
    if run.snapshot is not None:
        told.facts["snapshot"] = run.snapshot
        if run.erased and f"Snapshot {run.snapshot}" not in told.detail:
            told.extend(after=f" Snapshot {run.snapshot} holds what it held before.", also="snapshot_holds_before")
    return told


def check_supply(servo: Servo) -> None:
    """Raises OutOfRange at a supply at which ROM must not be written."""
    problem = supply_problem(servo)
    if problem is not None:
        raise OutOfRange(
            f"{problem} Nothing was reset.", key="current_voltage", cause="supply_bad_reset", servo=servo.title
        )
