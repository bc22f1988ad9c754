"""Parking of IDs while servos exchange them, so that no two share one."""

from functools import partial

from hornbill.domain.fields import known
from hornbill.errors import Conflict, HornbillError, UnexpectedResult
from hornbill.node.node_ids import HIGHEST_DYNAMIC, find_free
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.record import problem_document
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.servo import Servo
from hornbill.servo.monitoring.node_id_table import NodeIdTable
from hornbill.servo.runs.commission_run import CommissionRun, CommissionTarget, CommissionWriter
from hornbill.servo.runs.id_exchange import IdMove
from hornbill.servo.runtime.steps import Evidence
from hornbill.store.allocations import AllocationStore

PARK_STEPS = {"servo_id": "park_servo_id", "node_id": "park_node_id"}
"""Name of the step that parks an ID, by row."""


class IdParking:
    """Parks servo IDs on 0 in RAM (section 4.37), and node IDs on an unused dynamic ID, saved (section 4.38)."""

    def __init__(
        self,
        writer: CommissionWriter,
        fleet: Fleet,
        claims: Claims,
        allocating: NodeIdTable,
        allocations: AllocationStore,
    ) -> None:
        self._writer = writer
        self._fleet = fleet
        self._claims = claims
        self._allocating = allocating
        self._allocations = allocations

    async def park(self, key: str, run: CommissionRun, target: CommissionTarget) -> Evidence:
        """Park an ID, because another servo gets it first."""
        servo = await self._writer.present(target)
        before = servo.servo_id if key == "servo_id" else servo.node_id
        if key == "node_id":
            await self.pin_elsewhere(run, servo)
        try:
            await run.ids.move(IdMove(servo, key, before or 0, 0), partial(self._write, run))
        except HornbillError:
            run.ids.settle(servo.uid, key)
            raise
        if key == "servo_id":
            return Evidence("servo_id_parked", f"servo ID {before} is free", known(servo_id=before))
        run.ids.settle(servo.uid, key)  # saved, so it is not rolled back
        text = f"node ID {before} is free; the servo is on {servo.node_id}"
        return Evidence("node_id_parked", text, known(node_id=servo.node_id, node_id_before=before))

    async def restore(self, run: CommissionRun) -> None:
        """Restore the servo IDs of parked servos that were not reached, unless another servo uses them by now."""
        for move, problem in await run.ids.roll_back(partial(self._write, run)):
            target, before = run.target(move.servo.uid), move.before
            evidence = Evidence("servo_id_restored", f"servo ID {before} was restored", known(servo_id=before))
            if problem is not None:
                text = f"servo ID is 0 in RAM: {before} could not be restored ({problem.detail})"
                evidence = Evidence("servo_id_lost", text, known(servo_id=before, problem=problem.code))
                _note(
                    target, UnexpectedResult(text, cause="servo_id_not_restored", servo_id=before, failure=problem.code)
                )
            run.update_result()
            run.job.done(target.step_name(PARK_STEPS[move.key]), evidence)

    def note_parked(self, run: CommissionRun) -> None:
        """Record in a cancelled job which servo IDs stay 0 in RAM until it is resumed. Writes nothing to servos."""
        for move in run.ids.parked("servo_id"):
            text = f"Servo ID is 0 in RAM; it was {move.before}. Resume the job or restart the servo."
            _note(run.target(move.servo.uid), UnexpectedResult(text, cause="servo_id_parked", servo_id=move.before))
        run.update_result()

    async def _write(self, run: CommissionRun, move: IdMove) -> None:
        """Write an ID: a servo ID in RAM; a node ID with a save, because it changes at a restart."""
        target = run.target(move.servo.uid)
        servo = await self._writer.present(target)
        others = (one for one in self._fleet.all() if one.online and one.uid != servo.uid)
        if move.number and any(getattr(one, move.key) == move.number for one in others):
            raise Conflict("another servo uses it now", cause="servo_id_in_use", servo_id=move.number)
        await self._writer.apply(run, servo, {move.key: move.number})
        if move.key == "node_id":
            await self._writer.save(run, servo, {})
            servo = await self._writer.present(target)
            if servo.node_id == move.before:
                raise Conflict(
                    f"{servo.title} should have freed node ID {move.before}, but got it again. Another node ID "
                    "allocator may be active.",
                    key="node_id", requested=move.before, owner=servo.uid, owner_title=servo.title,
                    cause="node_id_reassigned", servo=servo.title,
                )  # fmt: skip

    async def pin_elsewhere(self, run: CommissionRun, servo: Servo) -> None:
        """Pin the servo's dynamic node ID to one that this job assigns to no other servo.

        Raises Conflict if none is free.
        """
        taken = {claim.number for claim in self._claims.of("node_id", servo)} | run.request.fixed
        free = find_free(HIGHEST_DYNAMIC, taken | {servo.node_id or 0})
        if free is None:
            raise Conflict(
                "No free node ID to park a servo on. Forget allocations of nodes that are no longer used.",
                cause="node_ids_exhausted",
            )
        await self._allocating.pin(servo.uid, free)
        run.pinned.add(servo.uid)
        run.update_result()

    def forget_allocation(self, run: CommissionRun, servo: Servo) -> None:
        """Free the dynamic node ID of a servo that has a static one. A pin set by a user is retained."""
        if servo.uid in self._allocations.entries() and (
            servo.uid in run.pinned or not self._allocations.pinned(servo.uid)
        ):
            self._allocations.drop(servo.uid)
        run.pinned.discard(servo.uid)


def _note(target: CommissionTarget, problem: HornbillError) -> None:
    """Record a problem of a parked servo ID, unless the target already has a problem."""
    target.record.problem = target.record.problem or problem_document(problem)
