"""Save, restart and factory reset as jobs with verified results (sections 2.3, 4.10, 4.11, 4.14)."""

from collections.abc import Awaitable, Callable, Mapping
from typing import Literal, overload

from hornbill.domain.change import ResetPreview, SavePreview
from hornbill.domain.note import Note
from hornbill.errors import BadRequest, Busy, HornbillError
from hornbill.schema import scale
from hornbill.servo.configuration import torque_in_rom
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.following import RestartFollower
from hornbill.servo.configuration.forecast import forecast, lost_by_restart
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.resetting import RESET_STEPS, ResetRun, ResetSteps, check_supply, reset_values
from hornbill.servo.configuration.restart_plan import RestartKind, RestartOptions
from hornbill.servo.configuration.saving import SAVE_STEPS, SaveRun, SaveSteps
from hornbill.servo.device import permission
from hornbill.servo.device.output import KEY, ON
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.hub import ServoChanged
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.steps import Evidence, Step
from hornbill.servo.torque_off.stored import StoredTorqueOff
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Raw

RESTART_STEPS = {
    "request": "Restart requested",
    "silence": "Silent while it restarts",
    "restart": "Restarted",
    "back": "Back on the bus",
    "soft_start": "Soft start finished",
    "read_back": "Every row read",
}

DEFAULTS = RestartOptions()


class Restarting:
    """Starts jobs of the kinds save, restart and factory_reset. A second save or restart of a servo joins the first."""

    def __init__(
        self,
        services: HostServices,
        motion: Motion,
        follow: RestartFollower,
        history: History,
        claims: Claims,
        stored_torque_off: StoredTorqueOff,
    ) -> None:
        self._services = services
        self._motion = motion
        self._follow = follow
        self._save = SaveSteps(services, motion, follow, history, claims, stored_torque_off)
        self._reset = ResetSteps(services, motion, follow, history, self._save_of_reset)

    def start(self, servo: Servo, kind: RestartKind, options: RestartOptions = DEFAULTS) -> RunningJob:
        """Save RAM to ROM, restart, or reset RAM and ROM to the model's defaults. The servo restarts; with soft start
        and torque on in ROM its horn moves to 0°.

        Joins a running job of the same kind. A save with `written` or `torque_on` and any reset raise Busy instead,
        because the running job may differ.

        Raises the errors of `check`. The job may also fail with OutOfRange (supply), Refused, TorqueOff, Conflict (node
        ID in use), UnexpectedResult, ConfigurationLost. The facts contain the `snapshot` taken before, the
        `differences`, and for a reset the steps `not_done`.
        """
        running = self.running(kind, servo)
        if running is not None and kind != "factory_reset" and not options.written and not options.torque_on:
            self._allow(servo, options)
            return running
        torque = self.check(servo, kind, options)
        by = options.by or self._services.leases.who(options.lease_id, self._services.base.now())
        self._motion.claim(servo, options.lease_id)
        if kind == "factory_reset":
            reset = ResetRun(servo, by, options.keep_identity)
            return self._begin(kind, RESET_STEPS, reset, lambda job: self._reset.work(job, reset))
        run = SaveRun(servo, by, servo.boot_count, servo.output.disable_count, options.written, torque=torque)
        if kind == "restart":
            return self._begin(kind, RESTART_STEPS, run, lambda job: self._restart(job, servo))
        return self._begin(kind, SAVE_STEPS, run, lambda job: self._save.work(job, run))

    def check(self, servo: Servo, kind: RestartKind, options: RestartOptions = DEFAULTS) -> Raw | None:
        """All checks of `start` that need no bus. Returns the 0x20 that a save will write to ROM. Sends nothing.

        Raises Stopped, LeaseHeld, Busy, NoResponse, NotInThisModel; for a save NeedsConfirmation; and ConfigurationLost
        and BusReadOnly if the output must be turned on first.
        """
        self._follow.stop.check()
        self._allow(servo, options)
        (permission.check_restartable if kind == "restart" else permission.check_writable)(servo)
        if self._motion.is_commanded(servo.uid):
            raise Busy(
                f"{servo.title} is under motion control, and a restart turns its torque off. "
                "Release motion control first.",
                cause="under_command",
                servo=servo.title,
            )
        torque = None
        if kind == "save":
            torque = torque_in_rom.decide(
                servo, options.confirm, options.values, torque_on=options.torque_on, rom_was=options.rom_was
            )
            if torque == ON and servo.raw(KEY) not in (ON, None):
                self._motion.check_energise(servo)
        permission.check_free(servo, self._services.jobs)
        if kind == "factory_reset":
            reset_values(servo, options.keep_identity)
        return torque

    @overload
    async def plan(self, servo: Servo, kind: Literal["save"], options: RestartOptions = DEFAULTS) -> SavePreview: ...

    @overload
    async def plan(
        self, servo: Servo, kind: Literal["restart", "factory_reset"], options: RestartOptions = DEFAULTS
    ) -> ResetPreview: ...

    async def plan(
        self, servo: Servo, kind: RestartKind, options: RestartOptions = DEFAULTS
    ) -> SavePreview | ResetPreview:
        """Dry run of `start`, after all checks that precede the first write. Sends only reads."""
        if kind == "factory_reset":
            self.check(servo, kind, options)
            found = await self.preview_reset(servo, keep_identity=options.keep_identity)
            check_supply(servo)
            return found
        self.check(servo, "restart", options)
        if kind == "restart":
            await self._reset.read(servo)
            return ResetPreview(lost_by_restart(servo), {}, forecast(servo))
        await self._save.read(servo)
        return await self._save.plan(servo, self.check(servo, kind, options), options)

    async def preview_reset(self, servo: Servo, *, keep_identity: bool) -> ResetPreview:
        """Read the servo and list what a reset would change. Raises NotInThisModel, NoResponse."""
        return await self._reset.preview(servo, keep_identity=keep_identity)

    def running(self, kind: RestartKind, servo: Servo) -> RunningJob | None:
        """The running job of this kind on this servo."""
        jobs = self._services.jobs.all()
        return next((job for job in jobs if (job.kind, job.uid) == (kind, servo.uid) and not job.ended), None)

    def save_in_progress(self, servo: Servo, values: Mapping[str, object], lease_id: str | None) -> RunningJob | None:
        """The running save that writes exactly these values (engineering, by key) to ROM, or None. Raises LeaseHeld."""
        self._services.leases.allow_write(lease_id, self._services.base.now(), servo.uid)
        job, held = self.running("save", servo), servo.expected_rom
        if job is None or held is None or not values.keys() <= held.keys():  # None: its values are not read yet
            return None
        try:
            same = all(
                held[key] == scale.to_raw(servo.registers[key].parameter, one, held) for key, one in values.items()
            )
        except BadRequest:  # reported by the write
            return None
        return job if same else None

    def _allow(self, servo: Servo, options: RestartOptions) -> None:
        """Raises LeaseHeld unless `by` is already authorized."""
        if options.by is None:
            self._services.leases.allow_write(options.lease_id, self._services.base.now(), servo.uid)

    def _begin(
        self,
        kind: RestartKind,
        steps: Mapping[str, str],
        run: SaveRun | ResetRun,
        work: Callable[[RunningJob], Awaitable[dict[str, object]]],
    ) -> RunningJob:
        servo, hub = run.servo, self._services.hub
        before, expected = servo.busy, servo.expected_rom
        servo.busy = State.RESTARTING if kind == "restart" else State.SAVING
        servo.discards_ram = servo.discards_ram or kind != "save"
        hub.publish(ServoChanged(servo.uid))

        async def whole(job: RunningJob) -> dict[str, object]:
            outcome, notes = "cancelled", ()
            try:
                result = await work(job)
                outcome = "succeeded"
                return result
            except HornbillError as error:
                outcome, notes = "failed", (Note.of(error),)
                raise
            finally:
                servo.busy, servo.expected_rom = before, expected
                servo.discards_ram = servo.discards_ram and before is not None
                hub.publish(ServoChanged(servo.uid))
                entry = NewAuditEntry(run.by, kind, outcome, servo.uid, before=run.snapshot, notes=notes, job=job.id)
                self._services.audit.note(*run.audit_rows(job, outcome), entry)

        return self._services.jobs.start(kind, servo.uid, [Step(*one) for one in steps.items()], whole)

    def _save_of_reset(self, reset: ResetRun) -> RunningJob:
        servo = reset.servo
        run = SaveRun(
            servo, reset.by, servo.boot_count, servo.output.disable_count, (), reset.snapshot, reset.wanted[KEY]
        )
        return self._begin("save", SAVE_STEPS, run, lambda job: self._save.work(job, run))

    async def _restart(self, job: RunningJob, servo: Servo) -> dict[str, object]:
        job.begin("request")
        await self._follow.old_enough(servo)
        departure = self._follow.depart(servo)
        tries = await self._follow.request_restart(servo, departure)
        job.done(
            "request",
            Evidence("requested", "once" if tries == 1 else f"{tries} times, because it ran on", {"tries": tries}),
        )
        self._follow.seen(job, departure, Evidence("restarted", "uptime restarted from 0"))
        await self._follow.prove(job, servo, departure, list(servo.registers), {})
        return {"node_id": servo.node_id, "node_id_before": departure.node_id}
