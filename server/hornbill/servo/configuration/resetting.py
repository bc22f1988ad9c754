"""Steps of a factory reset: the model's defaults in RAM and ROM, whatever ERASE does (2.3, 4.9)."""

import copy
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from hornbill.domain.change import Change, Reason, ResetPreview
from hornbill.domain.fields import known
from hornbill.errors import HornbillError, NoResponse, OutOfRange, Refused, UnexpectedResult
from hornbill.schema import scale
from hornbill.schema.scale import Value
from hornbill.servo.configuration.following import RestartFollower
from hornbill.servo.configuration.forecast import forecast_of, forecast_params, supply_problem
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.proving import difference, differing, unverified
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

WRITE_ATTEMPTS = 3
"""Maximum number of attempts to write all rows. A restart during an attempt loses unsaved values."""

_RESTORE = replace(WRITE, tries=READ.tries)

RESET_STEPS = {
    "check": "Supply and RAM read",
    "snapshot": "Snapshot taken",
    "torque_off": "Torque off",
    "erase": "Reset by the servo",
    "read": "Current values read",
    "identity": "Identity written back",
    "rows": "Remaining differences written",
    "save": "Saved to ROM",
    "verify": "Every row verified",
}


BEFORE_RESET = Reason("before factory reset", "factory_reset")


@dataclass(slots=True)
class ResetRun:
    """One factory reset: target values, previous values (raw by key) and progress."""

    servo: Servo
    by: str
    keep_identity: bool
    wanted: dict[str, Raw] = field(default_factory=dict[str, Raw])
    before: dict[str, Raw | None] = field(default_factory=dict[str, Raw | None])
    snapshot: int | None = None
    written: dict[str, Raw] = field(default_factory=dict[str, Raw])
    erased: bool = False
    torque_off: bool = False

    def audit_rows(self, job: RunningJob, outcome: str) -> list[NewAuditEntry]:
        """Audit entries, one per changed row."""
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

    The specification does not say whether ERASE changes ROM or the IDs, or whether it restarts the servo. So the result
    of ERASE is not trusted: all rows are read afterwards, differing rows are written one by one, and only the save
    verifies them. The order avoids motion. Torque is turned off first, and again if ERASE turned it on (0x20 defaults
    to ON), because writing the zero back would turn a held horn. 0x20 must be ON in RAM when SAVE copies RAM to ROM, so
    it is the last row, written immediately before SAVE. The horn is then held at its angle (section 4.13) for the
    milliseconds until the ROM write stops the motor; it does not move before the restart, which was announced. If SAVE
    is not carried out, torque is turned off again.
    """

    def __init__(
        self,
        services: HostServices,
        motion: Motion,
        follow: RestartFollower,
        history: History,
        start_save: Callable[[ResetRun], RunningJob],
    ) -> None:
        """`start_save`: starts the save of a servo that this reset has already claimed, checked and stored."""
        self._requests = services.requests
        self._hub = services.hub
        self._jobs = services.jobs
        self._motion = motion
        self._follow = follow
        self._history = history
        self._start_save = start_save

    async def preview(self, servo: Servo, *, keep_identity: bool) -> ResetPreview:
        """Read the servo and list what a reset would change. Raises NotInThisModel, NoResponse."""
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
        """Run all steps and return the result. A stop ends it immediately. An error lists what was not done."""
        succeeded = False
        try:
            result = await self._follow.unless_stopped(self._work(job, run))
            succeeded = True
            return result
        except HornbillError as error:
            raise _with_not_done(job, run, error) from error
        finally:
            if run.erased and not run.torque_off and not succeeded and not self._follow.stop.latched:
                self._motion.torque_off.require(run.servo, "command", run.by)  # ERASE may have turned torque on

    async def _work(self, job: RunningJob, run: ResetRun) -> dict[str, object]:
        servo = run.servo
        job.begin("check")
        await self._follow.old_enough(servo)
        await self.read(servo)
        check_supply(servo)
        run.wanted = reset_values(servo, run.keep_identity)
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
        await self._write_differences(job, run)
        saved = await self._save(job, run)
        job.begin("verify")
        wrong = {key: raw for key, raw in run.wanted.items() if servo.registers[key].rom != raw}
        if wrong:
            if (unread := unverified(servo, run.wanted, wrong)) is not None:
                raise unread
            differences, text = differing(servo, wrong)
            raise UnexpectedResult(
                f"{servo.title} was saved, but its ROM differs: {text}.",
                differences=differences,
                cause="rom_differs",
                servo=servo.title,
                keys=[one["key"] for one in differences],
            )
        text = f"{len(run.wanted)} rows read back from ROM after the restart, all correct"
        job.done("verify", Evidence("rows_verified", text, {"rows": len(run.wanted)}))
        changed = [key for key, raw in run.wanted.items() if run.before[key] != raw]
        return {
            "changed": changed, "node_id": servo.node_id, "node_id_before": node_before, "snapshot": run.snapshot,
            "save": saved.id,
        }  # fmt: skip

    async def _erase(self, job: RunningJob, run: ResetRun) -> None:
        """Run ERASE once, then wait until the servo is back and settled. Raises Refused, NoResponse."""
        servo = run.servo
        job.begin("erase")
        await self._follow.fleet.memory.doubt(servo)
        departure = self._follow.depart(servo)
        defaults = {key: one.parameter.default for key, one in servo.registers.items() if one.parameter.rom}
        servo.expected_rom = {key: raw for key, raw in defaults.items() if raw is not None}
        run.erased, run.torque_off, refused = True, False, False
        servo.clear_write_times()
        try:
            refused = not await self._requests.opcode(servo, Opcode.ERASE)
            acknowledged = True
        except NoResponse:
            acknowledged = False
        finally:  # also if a stop or a cancellation ends the wait: it may have been carried out
            if not refused:
                identification.forget_rom(servo)
                for key in defaults:
                    servo.forget(key)
                    self._hub.publish(ReadingChanged(servo.uid, key))
        if refused:
            run.erased, run.torque_off = False, True
            self._follow.fleet.memory.remember(servo)
            raise Refused(
                f"{servo.title} refused the reset (ok = 0). Nothing changed except torque, which is off.",
                cause="reset_refused",
                servo=servo.title,
            )
        restarted = await self._follow.left(servo, departure)
        await self._wait_until_back(servo)
        response = "acknowledged" if acknowledged else "no response: the values will be read"
        text = f"{response}; " + (f"it restarted, node {servo.node_id}" if restarted else "no restart")
        node = servo.node_id if restarted else None
        job.done("erase", Evidence("erased", text, known(acknowledged=acknowledged, restarted=restarted, node_id=node)))

    async def _write_differences(self, job: RunningJob, run: ResetRun) -> None:
        """Write the remaining differences within one boot. Raises NoResponse, Refused, UnexpectedResult."""
        servo = run.servo
        for attempt in range(1, WRITE_ATTEMPTS + 1):
            boot_count = servo.boot_count
            try:
                await self._wait_until_back(servo)
                job.begin("read")
                await self._requests.read(servo, servo.registers["torque_mode"].parameter)
                torque_was_on = servo.raw("torque_mode") != 1
                if torque_was_on:
                    await self._torque_off(run)
                run.torque_off = True
                await identification.read_rows(self._requests, servo, list(run.wanted))
                open_rows = [key for key in run.wanted if servo.raw(key) != run.wanted[key] and key != "torque_mode"]
                torque = "; torque was on and was turned off again" if torque_was_on else ""
                text = f"{len(open_rows)} rows still differ{torque}"
                values = {"rows": len(open_rows), "torque_was_on": torque_was_on}
                job.done("read", Evidence("rows_differ", text, values))
                identity = [key for key in open_rows if servo.registers[key].parameter.identity]
                await self._write(job, run, "identity", identity)
                await self._write(job, run, "rows", [key for key in open_rows if key not in identity])
            except NoResponse:
                if attempt == WRITE_ATTEMPTS:
                    raise
                run.torque_off = False
                continue
            if servo.boot_count == boot_count:
                return
            run.torque_off = False
        raise NoResponse(
            f"{servo.title} restarts repeatedly, so written values are lost. Check its supply.",
            cause="restarts_repeatedly_in_reset",
            servo=servo.title,
        )

    async def _write(self, job: RunningJob, run: ResetRun, step: str, keys: list[str]) -> None:
        servo = run.servo
        if not keys:
            job.skip(step, Evidence("nothing_differs", "nothing differs"))
            return
        job.begin(step)
        for key in keys:
            row, raw = servo.registers[key].parameter, run.wanted[key]
            found = run.written[key] = await self._requests.write(servo, row, raw, _RESTORE)
            if found != raw:
                values = servo.raws()
                raise UnexpectedResult(
                    f"{servo.title} changed {row.label.lower()} from the written {scale.to_text(row, raw, values)} to "
                    f"{scale.to_text(row, found, values)}.",
                    differences=[difference(servo, key, raw, found)[0]],
                    cause="value_changed_by_servo",
                    servo=servo.title,
                    key=key,
                )
        job.done(step, Evidence("rows_written", ", ".join(keys), {"keys": [*keys]}))

    async def _save(self, job: RunningJob, run: ResetRun) -> RunningJob:
        """Save by a child job, which writes 0x20 last."""
        job.begin("save")
        child = self._start_save(run)
        detail = f"The save of {run.servo.title} was cancelled. The contents of its ROM are unknown."
        try:
            await self._jobs.succeeded(child, UnexpectedResult(detail, cause="save_cancelled", servo=run.servo.title))
        finally:
            await self._jobs.cancel(child.id)  # no effect on an ended job; after a stop the child must not continue
        last = child.steps[-1]
        text = f"job {child.id}: {last.evidence}"
        job.done("save", Evidence("saved_by_job", text, {**last.evidence_params, "job": child.id}))
        return child

    async def _torque_off(self, run: ResetRun) -> None:
        if await self._motion.disable_torque(run.servo, "off", by=run.by) != 1:
            raise UnexpectedResult(
                f"{run.servo.title} did not turn torque off. The reset ended here.",
                cause="torque_off_not_accepted",
                servo=run.servo.title,
            )

    async def _wait_until_back(self, servo: Servo) -> None:
        """Wait until a servo is identified, on any node ID, and its soft start has ended."""
        await self._follow.back(servo, self._follow.depart(servo))
        await self._follow.soft_start_over(servo)
        servo.busy = State.SAVING
        self._hub.publish(ServoChanged(servo.uid))

    async def read(self, servo: Servo) -> None:
        """Read all rows stored in ROM and those a forecast needs. Raises NoResponse, BusDisconnected."""
        await identification.read_rows(self._requests, servo, servo.before_restart)


def reset_values(servo: Servo, keep_identity: bool) -> dict[str, Raw]:
    """Values after a reset, raw by key. Raises NotInThisModel."""
    if servo.model is None:
        raise permission.unknown_series(servo)
    found: dict[str, Raw] = {}
    for key, one in servo.registers.items():
        kept = one.raw if keep_identity and one.parameter.identity else None
        raw = one.parameter.default if kept is None else kept
        if one.parameter.rom and raw is not None:
            found[key] = raw
    return found


def _with_not_done(job: RunningJob, run: ResetRun, error: HornbillError) -> HornbillError:
    """The error, extended by the steps not done and the snapshot to restore."""
    extended = copy.copy(error)  # the save job contains the same object
    extended.facts = dict(error.facts)
    not_done = [step.text for step in job.steps if step.state in ("waiting", "running")]
    extended.facts["not_done"] = not_done
    extended.extend(after=f" Not done: {', '.join(not_done).lower()}.", also="steps_incomplete")
    if run.snapshot is not None:
        extended.facts["snapshot"] = run.snapshot
        if run.erased and f"Snapshot {run.snapshot}" not in extended.detail:
            extended.extend(
                after=f" Snapshot {run.snapshot} contains the previous values.", also="snapshot_has_previous_values"
            )
    return extended


def check_supply(servo: Servo) -> None:
    """Raises OutOfRange if ROM must not be written at the present supply voltage."""
    problem = supply_problem(servo)
    if problem is not None:
        raise OutOfRange(
            f"{problem} Nothing was reset.", key="current_voltage", cause="supply_out_of_range_reset", servo=servo.title
        )
