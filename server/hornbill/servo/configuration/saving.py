"""Steps of a save: read, snapshot, 0x20, SAVE, and the restart that proves it (sections 2.3, 4.10, 4.11, 4.14)."""

import asyncio
import logging
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

from hornbill.domain.change import Change, Reason, SavePreview
from hornbill.domain.fields import known
from hornbill.errors import Conflict, HornbillError, NoResponse, NotAsWanted, OutOfRange, Refused, Stopped, TorqueOff
from hornbill.servo.configuration import record
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.following import LOOK_AGAIN_S, Departure, RestartFollower
from hornbill.servo.configuration.forecast import Loaded, forecast, forecast_params, supply_problem
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.proving import AT_REST, check_held, check_rest
from hornbill.servo.configuration.restart_plan import RestartOptions, save_plan, saved_by
from hornbill.servo.configuration.rules import Claim
from hornbill.servo.device import identification
from hornbill.servo.device.output import KEY, ON, OutputRecord, taken_by
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
"""Times SAVE is sent, each only when the one before was not answered and the servo was then heard to run on: SAVE of
the same RAM is the same SAVE, and one that is lost on the bus was never carried out."""

LEAVES_WITHIN_S = 10.0
"""How long a save waits for a servo to leave the node id it will have after its restart."""

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


BEFORE_SAVING = Reason("before saving", "saving")


@dataclass(slots=True)
class SaveRun:
    """One save or restart: the snapshot of before, and the 0x20 that ROM is to hold (`torque`).

    `boots` is its life when this was asked for, `written` what was written to it in this life, and is to be in ROM.
    `taken` is how often its output had been taken by then, `found` the output before 0x20 was written for the save.
    `sent`: SAVE may have reached the servo, so that ROM is not known to hold what it held.
    """

    servo: Servo
    by: str
    boots: int
    taken: int
    written: Sequence[Change] = ()
    snapshot: int | None = None
    torque: Raw | None = None
    found: tuple[Raw | None, OutputRecord] | None = None
    sent: bool = False

    def audit_rows(self, _job: RunningJob, _outcome: str) -> list[NewAuditEntry]:
        """A save has no audit entries of single rows."""
        return []


class SaveSteps:
    """Saves one servo: copies RAM to ROM, but for 0x20: ROM keeps what it holds there unless another value was staged
    (see `torque_in_rom`).

    Where RAM holds something else because of a stop, a lease or a client, 0x20 is written right before the SAVE, and
    put back when the SAVE is not carried out.
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
        """Read, snapshot, SAVE, follow, prove. The result as it is stored."""
        servo = run.servo
        rows = [key for key, register in servo.registers.items() if register.parameter.rom]
        job.begin("check")
        job.done("check", await self._checked(servo, run, rows))
        wanted = saved_by(servo, run.torque)
        servo.expected_rom = {key: raw for key, raw in wanted.items() if raw is not None}
        await self._keep(job, servo, run)
        if servo.boots != run.boots:
            raise NotAsWanted(
                f"{servo.title} restarted before it was saved, so what was only in RAM is lost. Nothing was saved. "
                "Look at what it holds now.",
                cause="restarted_before_save",
                servo=servo.title,
            )
        self._follow.stop.check()
        departure = self._follow.depart(servo)
        try:
            await self._write(job, servo, run, departure)
            await self._follow.prove(job, servo, departure, [*rows, "fault_warning"], wanted)
        except BaseException as error:
            if run.sent and servo.boots == departure.boots:
                identification.forget_rom(servo)  # old, new or nothing: nobody knows
                self._follow.publish_rows(servo)
            if isinstance(error, HornbillError) and run.snapshot is not None:
                error.facts.setdefault("snapshot", run.snapshot)
                error.extend(
                    after=f" Snapshot {run.snapshot} holds what was in RAM before.", also="snapshot_holds_before"
                )
            raise
        return {
            "saved": rows, "node_id": servo.node_id, "node_id_before": departure.node_id, "snapshot": run.snapshot,
            "servos": [record.saved(servo, by=run.by, began=job.created_at, ended=job.clock())],
        }  # fmt: skip

    async def plan(self, servo: Servo, torque: Raw | None, options: RestartOptions) -> SavePreview:
        """The plan of a save of a servo that was just read, `torque` as 0x20.

        Raises what the job would end with before it sends anything.
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
        """Read what a save is of and what it hangs on; the evidence.

        Raises OutOfRange (supply), Busy (the horn turns), NotAsWanted (RAM does not hold what was written), NoResponse.
        """
        await self._follow.old_enough(servo)
        await self.read(servo)
        check_held(servo, run.written)
        _check_supply(servo)
        turning = check_rest(servo)
        await self._node_free(servo)
        said = forecast(servo, saved_by(servo, run.torque))
        supply = servo.number("current_voltage")
        found = "supply not known" if supply is None else f"supply {supply:.1f} V"
        moves = "" if turning is None else f" The horn moves at {turning} rpm by itself."
        ahead = " ".join([said.text, *said.warnings])
        values = known(rows=len(rows), supply_v=supply, speed_rpm=turning, **forecast_params(said))
        return Evidence("rows_read", f"{len(rows)} rows read, {found}.{moves} {ahead}", values, ahead)

    async def read(self, servo: Servo) -> None:
        """Read what a save is of, and what it hangs on. Raises NoResponse, BusDisconnected."""
        at_rest = [key for key in AT_REST if key in servo.registers]
        await identification.read_rows(self._requests, servo, [*at_rest, *servo.before_restart])

    async def _node_free(self, servo: Servo) -> None:
        """Wait for who is on the node id of RAM and is being saved or restarted itself. Raises Conflict."""
        node, until = servo.raw("node_id"), self._base.now() + LEAVES_WITHIN_S
        while (holder := self._on_node(servo, node)) is not None:
            other = None if holder.owner is None else self._follow.fleet.find(holder.owner)
            if other is None or other.busy is None or self._base.now() > until:
                raise _node_taken(servo, node, holder)
            await asyncio.sleep(LOOK_AGAIN_S)

    def _on_node(self, servo: Servo, node: Raw | None) -> Claim | None:
        """Who else is on the node id it is to come back on."""
        return self._claims.on_the_bus(servo, node) if node and node != servo.node_id else None

    async def _keep(self, job: RunningJob, servo: Servo, run: SaveRun) -> None:
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
        except Exception:  # a full disk must not keep anybody from saving; what cannot be undone is said
            log.exception("%s: no snapshot before saving", servo.title)
            job.fail(
                "snapshot",
                Evidence("snapshot_failed", "the store could not keep it; what is saved now cannot be undone"),
            )

    async def _write(self, job: RunningJob, servo: Servo, run: SaveRun, departure: Departure) -> None:
        """Send SAVE until it is known to have been carried out, and see the servo start anew."""
        job.begin("write")
        try:
            await self._match(servo, run)
            await self._follow.unless_stopped(self._follow.fleet.memory.doubt(servo))
            for tries in range(1, SAVE_TRIES + 1):
                answered, stopped = await self._send_save(servo, run)
                sent = (
                    "sent once" if tries == 1 else f"sent {tries} times, for it was not answered and the servo ran on"
                )
                text = f"{sent}; " + ("the servo answered ok" if answered else "no answer: the restart tells")
                job.done("write", Evidence("sent", text, {"tries": tries, "answered": answered}))
                job.begin("silence")
                if await self._follow.left(servo, departure):
                    self._follow.seen(job, departure, Evidence("restarted", "its uptime went back, by itself"))
                    return
                if stopped is not None:
                    raise stopped
                if answered:
                    break
            await self._follow.ask(servo, departure)
            text = "its uptime went back, when it was asked to: by itself it ran on"
            self._follow.seen(job, departure, Evidence("restarted_when_asked", text))
        except BaseException as error:
            if servo.boots == departure.boots:
                self._unmatch(servo, run, error)
            raise
        finally:
            if run.found is not None:
                self._stored_torque_off.over(servo)

    async def _match(self, servo: Servo, run: SaveRun) -> None:
        """Bring RAM's 0x20 to what ROM is to hold. Raises what Motion raises, and TorqueOff (see `Run.taken`)."""
        if run.torque is None or servo.raw(KEY) == run.torque:
            return
        if servo.output.taken != run.taken and run.torque == ON:
            raise _switched(servo)
        run.found = servo.raw(KEY), copy(servo.output)
        if run.torque == ON:
            note = self._stored_torque_off.energising(servo, servo.raw(KEY), servo.output_state)
            await self._follow.unless_stopped(note)
            await self._follow.unless_stopped(self._motion.energise(servo, run.by))
        else:
            await self._follow.unless_stopped(self._motion.torque_away(servo, taken_by(run.torque), by=run.by))

    def _unmatch(self, servo: Servo, run: SaveRun, error: BaseException) -> None:
        """ROM was not written: take the output again that was given for it. What was taken stays off."""
        if run.found is None:
            return
        raw, output = run.found
        if run.torque != ON:
            if raw == ON and isinstance(error, HornbillError):
                error.extend(
                    after=f" Its output was switched {taken_by(run.torque)} for the save, and stays so.",
                    also="output_stays",
                )
        elif not self._follow.stop.latched and servo.output.taken == run.taken:
            self._motion.torque_off.require(servo, output.reason, output.by, taken_by(raw))

    async def _send_save(self, servo: Servo, run: SaveRun) -> tuple[bool, Stopped | None]:
        """Whether it was answered, and the stop that was pressed meanwhile.

        Raises Stopped before it is sent, and TorqueOff where RAM does not hold any more what ROM is to hold in 0x20.
        """
        self._follow.stop.check()
        if run.torque is not None and servo.raw(KEY) != run.torque:
            raise _switched(servo)
        before, run.sent = run.sent, True
        servo.writes_are_over()
        try:
            if not await self._follow.unless_stopped(self._requests.opcode(servo, Opcode.SAVE)):
                run.sent = before  # one of before that was not answered may have been carried out all the same
                if not before:
                    self._follow.fleet.remember(servo)
                held = "What its ROM holds is not known" if before else "ROM holds what it held"
                raise Refused(
                    f"{servo.title} refused to save (ok = 0). RAM is unchanged. {held}.",
                    cause="save_refused",
                    servo=servo.title,
                )
        except NoResponse:
            # the answer may be lost in the restart (errata C3): only what happens next tells
            return False, None
        except Stopped as stopped:
            stopped.extend(
                after=f" Whether {servo.title} had got the SAVE by then, and what its ROM holds, is not known.",
                also="save_may_have_arrived",
                servo=servo.title,
            )
            return False, stopped
        return True, None


def _check_supply(servo: Servo, saved: Loaded | None = None) -> None:
    """Raises OutOfRange at a supply at which ROM must not be written."""
    problem = supply_problem(servo) or (None if saved is None else supply_problem(servo, saved))
    if problem is not None:
        supply, low, high = map(servo.number, ("current_voltage", "voltage_limit_lower", "voltage_limit_upper"))
        raise OutOfRange(
            f"{problem} Nothing was saved.", key="current_voltage", unit="V",
            requested=supply or 0.0, minimum=low or 0.0, maximum=high or 0.0,
            cause="supply_bad_save", servo=servo.title,
        )  # fmt: skip


def _switched(servo: Servo) -> TorqueOff:
    return TorqueOff(
        f"The output of {servo.title} was switched off while it was being saved. Save it again.",
        cause="switched_off_in_save",
        servo=servo.title,
    )


def _node_taken(servo: Servo, node: Raw | None, holder: Claim) -> Conflict:
    return Conflict(
        f"{servo.title} would come back on node ID {node}, where {holder.title} still is. Nothing was "
        "saved. Save that one first, or exchange them by commissioning.",
        key="node_id", requested=node, owner=holder.owner, owner_title=holder.title,
        cause="node_id_held", servo=servo.title,
    )  # fmt: skip
