"""Steps of a save: read, snapshot, 0x20, SAVE, and the restart that verifies it (sections 2.3, 4.10, 4.11, 4.14)."""

import asyncio
import logging
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

from hornbill.domain.change import Change, Reason, SavePreview
from hornbill.domain.fields import known
from hornbill.errors import (
    Conflict,
    HornbillError,
    NoResponse,
    OutOfRange,
    Refused,
    Stopped,
    TorqueOff,
    UnexpectedResult,
)
from hornbill.servo.configuration import record
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.following import CHECK_PERIOD_S, Departure, RestartFollower
from hornbill.servo.configuration.forecast import Loaded, forecast, forecast_params, supply_problem
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.proving import AT_REST, check_held, check_rest
from hornbill.servo.configuration.restart_plan import RestartOptions, save_plan, saved_by
from hornbill.servo.configuration.rules import Claim
from hornbill.servo.device import identification
from hornbill.servo.device.output import KEY, ON, OutputRecord, off_mode
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.steps import Evidence
from hornbill.servo.torque_off.stored import StoredTorqueOff
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Raw
from hornbill.wire.services import Opcode

log = logging.getLogger(__name__)

SAVE_TRIES = 4
"""Maximum number of SAVE requests. Each follows only if the previous one was not acknowledged and the servo ran on, so
it was lost on the bus. Repeating SAVE with the same RAM is idempotent."""

LEAVES_WITHIN_S = 10.0
"""Timeout for another servo to leave the node ID that this servo will have after its restart."""

SAVE_STEPS = {
    "check": "At rest; supply and RAM read",
    "snapshot": "Snapshot taken",
    "write": "Written to ROM",
    "silence": "Silent while it writes and restarts",
    "restart": "Restarted",
    "back": "Back on the bus",
    "soft_start": "Soft start finished",
    "read_back": "Verified: every saved row read back from ROM",
}


BEFORE_SAVING = Reason("before saving", "saving")


@dataclass(slots=True)
class SaveRun:
    """One save or restart: the snapshot taken before, and the 0x20 to save (`torque`).

    `boot_count`: boot count at the request. `written`: values written in this boot and to be saved. `disable_count`:
    number of torque-offs at the request. `found`: output state before 0x20 was written for the save. `sent`: SAVE may
    have reached the servo, so the contents of ROM are unknown.
    """

    servo: Servo
    by: str
    boot_count: int
    disable_count: int
    written: Sequence[Change] = ()
    snapshot: int | None = None
    torque: Raw | None = None
    found: tuple[Raw | None, OutputRecord] | None = None
    sent: bool = False

    def audit_rows(self, _job: RunningJob, _outcome: str) -> list[NewAuditEntry]:
        """No entries: a save is one audit entry, not one per row."""
        return []


class SaveSteps:
    """Saves one servo: copies RAM to ROM, except 0x20, which keeps its ROM value unless another value was staged (see
    `torque_in_rom`).

    If the 0x20 in RAM differs because of a stop, a lease or a client, it is written immediately before SAVE, and
    restored if SAVE is not carried out.
    """

    def __init__(
        self,
        services: HostServices,
        motion: Motion,
        follow: RestartFollower,
        history: History,
        claims: Claims,
        stored_torque_off: StoredTorqueOff,
    ) -> None:
        self._requests = services.requests
        self._base = services.base
        self._motion = motion
        self._follow = follow
        self._history = history
        self._claims = claims
        self._stored_torque_off = stored_torque_off

    async def work(self, job: RunningJob, run: SaveRun) -> dict[str, object]:
        """Read, take a snapshot, SAVE, follow, verify. Returns the result."""
        servo = run.servo
        rows = [key for key, register in servo.registers.items() if register.parameter.rom]
        job.begin("check")
        job.done("check", await self._checked(servo, run, rows))
        wanted = saved_by(servo, run.torque)
        servo.expected_rom = {key: raw for key, raw in wanted.items() if raw is not None}
        await self._snapshot(job, servo, run)
        if servo.boot_count != run.boot_count:
            raise UnexpectedResult(
                f"{servo.title} restarted before the save, so unsaved values in RAM are lost. Nothing was saved. "
                "Check its current values.",
                cause="restarted_before_save",
                servo=servo.title,
            )
        self._follow.stop.check()
        departure = self._follow.depart(servo)
        try:
            await self._write(job, servo, run, departure)
            await self._follow.prove(job, servo, departure, [*rows, "fault_warning"], wanted)
        except BaseException as error:
            if run.sent and servo.boot_count == departure.boot_count:
                identification.forget_rom(servo)  # ROM may contain old, new or no values
                self._follow.publish_rows(servo)
            if isinstance(error, HornbillError) and run.snapshot is not None:
                error.facts.setdefault("snapshot", run.snapshot)
                error.extend(
                    after=f" Snapshot {run.snapshot} contains the previous RAM values.",
                    also="snapshot_has_previous_values",
                )
            raise
        return {
            "saved": rows, "node_id": servo.node_id, "node_id_before": departure.node_id, "snapshot": run.snapshot,
            "servos": [record.saved(servo, by=run.by, began=job.created_at, ended=job.clock())],
        }  # fmt: skip

    async def plan(self, servo: Servo, torque: Raw | None, options: RestartOptions) -> SavePreview:
        """The plan of a save of a servo that was just read, with `torque` as 0x20.

        Raises the errors that would end the job before it sends anything.
        """
        wanted = options.raws
        saved = saved_by(servo, torque, wanted)
        _check_supply(servo, saved)
        check_rest(servo)
        holder = self._on_node(servo, saved.get("node_id"))
        if holder is not None and holder.owner not in options.leaving:
            raise _node_taken(servo, saved.get("node_id"), holder)
        return save_plan(servo, saved, wanted)

    async def _checked(self, servo: Servo, run: SaveRun, rows: list[str]) -> Evidence:
        """Read and check everything that a save depends on. Returns the evidence.

        Raises OutOfRange (supply), Busy (horn turns), UnexpectedResult (RAM differs from the written values),
        NoResponse.
        """
        await self._follow.old_enough(servo)
        await self.read(servo)
        check_held(servo, run.written)
        _check_supply(servo)
        turning = check_rest(servo)
        await self._node_free(servo)
        restart = forecast(servo, saved_by(servo, run.torque))
        supply = servo.number("current_voltage")
        found = "supply unknown" if supply is None else f"supply {supply:.1f} V"
        moves = "" if turning is None else f" The horn moves at {turning} rpm without a command."
        ahead = " ".join([restart.text, *restart.warnings])
        values = known(rows=len(rows), supply_v=supply, speed_rpm=turning, **forecast_params(restart))
        return Evidence("rows_read", f"{len(rows)} rows read, {found}.{moves} {ahead}", values, ahead)

    async def read(self, servo: Servo) -> None:
        """Read the rows to save and those that a save depends on. Raises NoResponse, BusDisconnected."""
        at_rest = [key for key in AT_REST if key in servo.registers]
        await identification.read_rows(self._requests, servo, [*at_rest, *servo.before_restart])

    async def _node_free(self, servo: Servo) -> None:
        """Wait until the node ID in RAM is free, if its user is being saved or restarted. Raises Conflict."""
        node, until = servo.raw("node_id"), self._base.now() + LEAVES_WITHIN_S
        while (holder := self._on_node(servo, node)) is not None:
            other = None if holder.owner is None else self._follow.fleet.find(holder.owner)
            if other is None or other.busy is None or self._base.now() > until:
                raise _node_taken(servo, node, holder)
            await asyncio.sleep(CHECK_PERIOD_S)

    def _on_node(self, servo: Servo, node: Raw | None) -> Claim | None:
        """Another user of the node ID that the servo will have after its restart."""
        return self._claims.on_the_bus(servo, node) if node and node != servo.node_id else None

    async def _snapshot(self, job: RunningJob, servo: Servo, run: SaveRun) -> None:
        if run.snapshot is not None:
            job.skip(
                "snapshot",
                Evidence("snapshot_known", f"snapshot {run.snapshot} was taken before", {"snapshot": run.snapshot}),
            )
            return
        job.begin("snapshot")
        try:
            run.snapshot = (await self._history.take(self._requests, servo, reason=BEFORE_SAVING, by=run.by)).id
            job.done("snapshot", Evidence("snapshot_taken", f"snapshot {run.snapshot}", {"snapshot": run.snapshot}))
        except HornbillError:
            raise
        except Exception:  # a full disk must not prevent a save; the step reports that it cannot be undone
            log.exception("%s: no snapshot before saving", servo.title)
            job.fail(
                "snapshot",
                Evidence("snapshot_failed", "the snapshot could not be stored, so this save cannot be undone"),
            )

    async def _write(self, job: RunningJob, servo: Servo, run: SaveRun, departure: Departure) -> None:
        """Send SAVE until it is carried out, and follow the restart."""
        job.begin("write")
        try:
            await self._match(servo, run)
            await self._follow.unless_stopped(self._follow.fleet.memory.doubt(servo))
            for tries in range(1, SAVE_TRIES + 1):
                acknowledged, stopped = await self._send_save(servo, run)
                sent = "sent once" if tries == 1 else f"sent {tries} times, because the servo ran on without responding"
                text = f"{sent}; " + ("acknowledged" if acknowledged else "not acknowledged: waiting for a restart")
                job.done("write", Evidence("sent", text, {"tries": tries, "acknowledged": acknowledged}))
                job.begin("silence")
                if await self._follow.left(servo, departure):
                    self._follow.seen(job, departure, Evidence("restarted", "uptime restarted from 0"))
                    return
                if stopped is not None:
                    raise stopped
                if acknowledged:
                    break
            await self._follow.request_restart(servo, departure)
            text = "uptime restarted from 0 after a restart request; it did not restart automatically"
            self._follow.seen(job, departure, Evidence("restarted_on_request", text))
        except BaseException as error:
            if servo.boot_count == departure.boot_count:
                self._unmatch(servo, run, error)
            raise
        finally:
            if run.found is not None:
                self._stored_torque_off.over(servo)

    async def _match(self, servo: Servo, run: SaveRun) -> None:
        """Write the 0x20 to save to RAM. Raises the errors of Motion, and TorqueOff (see `SaveRun.disable_count`)."""
        if run.torque is None or servo.raw(KEY) == run.torque:
            return
        if servo.output.disable_count != run.disable_count and run.torque == ON:
            raise _switched(servo)
        run.found = servo.raw(KEY), copy(servo.output)
        if run.torque == ON:
            note = self._stored_torque_off.energising(servo, servo.raw(KEY), servo.output_state)
            await self._follow.unless_stopped(note)
            await self._follow.unless_stopped(self._motion.energise(servo, run.by))
        else:
            await self._follow.unless_stopped(self._motion.disable_torque(servo, off_mode(run.torque), by=run.by))

    def _unmatch(self, servo: Servo, run: SaveRun, error: BaseException) -> None:
        """Restore the output after a save that did not write ROM. An output switched off for it stays off."""
        if run.found is None:
            return
        raw, output = run.found
        if run.torque != ON:
            if raw == ON and isinstance(error, HornbillError):
                error.extend(
                    after=f" Its output was set to {off_mode(run.torque)} for the save and stays that way.",
                    also="output_not_switched_back",
                )
        elif not self._follow.stop.latched and servo.output.disable_count == run.disable_count:
            self._motion.torque_off.require(servo, output.reason, output.by, off_mode(raw))

    async def _send_save(self, servo: Servo, run: SaveRun) -> tuple[bool, Stopped | None]:
        """Send SAVE once. Returns whether it was acknowledged, and a stop latched meanwhile.

        Raises Stopped before it is sent, and TorqueOff if the 0x20 in RAM no longer is the one to save.
        """
        self._follow.stop.check()
        if run.torque is not None and servo.raw(KEY) != run.torque:
            raise _switched(servo)
        before, run.sent = run.sent, True
        servo.clear_write_times()
        try:
            if not await self._follow.unless_stopped(self._requests.opcode(servo, Opcode.SAVE)):
                run.sent = before  # a previous unacknowledged SAVE may have been carried out
                if not before:
                    self._follow.fleet.remember(servo)
                rom = "The contents of its ROM are unknown" if before else "ROM is unchanged"
                raise Refused(
                    f"{servo.title} refused the save (ok = 0). RAM is unchanged. {rom}.",
                    cause="save_refused",
                    servo=servo.title,
                )
        except NoResponse:
            # the response may be lost in the restart (errata C3)
            return False, None
        except Stopped as stopped:
            stopped.extend(
                after=f" {servo.title} may or may not have saved, so the contents of its ROM are unknown.",
                also="save_outcome_unknown",
                servo=servo.title,
            )
            return False, stopped
        return True, None


def _check_supply(servo: Servo, saved: Loaded | None = None) -> None:
    """Raises OutOfRange if ROM must not be written at the present supply voltage."""
    problem = supply_problem(servo) or (None if saved is None else supply_problem(servo, saved))
    if problem is not None:
        supply, low, high = map(servo.number, ("current_voltage", "voltage_limit_lower", "voltage_limit_upper"))
        raise OutOfRange(
            f"{problem} Nothing was saved.", key="current_voltage", unit="V",
            requested=supply or 0.0, minimum=low or 0.0, maximum=high or 0.0,
            cause="supply_out_of_range_save", servo=servo.title,
        )  # fmt: skip


def _switched(servo: Servo) -> TorqueOff:
    return TorqueOff(
        f"The output of {servo.title} was switched off during the save. Save it again.",
        cause="switched_off_during_save",
        servo=servo.title,
    )


def _node_taken(servo: Servo, node: Raw | None, holder: Claim) -> Conflict:
    return Conflict(
        f"After the restart {servo.title} would use node ID {node}, which {holder.title} still has. Nothing was "
        "saved. Save that servo first, or exchange the IDs by commissioning.",
        key="node_id", requested=node, owner=holder.owner, owner_title=holder.title,
        cause="node_id_still_in_use", servo=servo.title,
    )  # fmt: skip
