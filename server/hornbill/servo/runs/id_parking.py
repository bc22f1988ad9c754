"""Parking of IDs while servos exchange them, so that no two share one."""

from functools import partial

from hornbill.domain.fields import known
from hornbill.errors import Conflict, HornbillError, NotAsWanted
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

PARK_STEPS = {"servo_id": "aside", "node_id": "away"}
"""Name of the step that parks an ID, by row."""


class IdParking:
    """Servo ids are parked on 0 in RAM (section 4.37), node ids on a dynamic one nobody wants, saved (section 4.38)."""

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
        run.ids.settle(servo.uid, key)  # it was saved: it stays
        text = f"node ID {before} is free, it is on {servo.node_id}"
        return Evidence("node_id_parked", text, known(node_id=servo.node_id, node_id_before=before))

    async def put_back(self, run: CommissionRun) -> None:
        """Restore the servo IDs of parked servos whose turn did not come, unless another servo has them by now."""
        for move, problem in await run.ids.put_back(partial(self._write, run)):
            target, before = run.target(move.servo.uid), move.before
            evidence = Evidence("servo_id_put_back", f"its servo ID {before} was put back", known(servo_id=before))
            if problem is not None:
                text = f"its servo ID is 0 in RAM: {before} could not be put back ({problem.detail})"
                evidence = Evidence("servo_id_lost", text, known(servo_id=before, problem=problem.code))
                _note(target, NotAsWanted(text, cause="servo_id_not_put_back", servo_id=before, failure=problem.code))
            run.tell()
            run.job.done(target.step_name(PARK_STEPS[move.key]), evidence)

    def note_parked(self, run: CommissionRun) -> None:
        """Record, in a cancelled job, which servo IDs stay 0 in RAM until it is resumed. Writes nothing."""
        for move in run.ids.parked("servo_id"):
            text = f"its servo ID is 0 in RAM, and was {move.before}. Resume the job, or restart the servo."
            _note(run.target(move.servo.uid), NotAsWanted(text, cause="servo_id_parked", servo_id=move.before))
        run.tell()

    async def _write(self, run: CommissionRun, move: IdMove) -> None:
        """Write an ID: a servo ID in RAM, a node ID saved, because the servo leaves it at its restart."""
        target = run.target(move.servo.uid)
        servo = await self._writer.present(target)
        others = (one for one in self._fleet.all() if one.online and one.uid != servo.uid)
        if move.number and any(getattr(one, move.key) == move.number for one in others):
            raise Conflict("another servo has it now", cause="servo_id_taken_meanwhile", servo_id=move.number)
        await self._writer.apply(run, servo, {move.key: move.number})
        if move.key == "node_id":
            await self._writer.save(run, servo, {})
            servo = await self._writer.present(target)
            if servo.node_id == move.before:
                raise Conflict(
                    f"{servo.title} was to give node ID {move.before} up, and got it again. Another tool may give node "
                    "IDs here.",
                    key="node_id", requested=move.before, owner=servo.uid, owner_title=servo.title,
                    cause="node_id_came_back", servo=servo.title,
                )  # fmt: skip

    async def pin_elsewhere(self, run: CommissionRun, servo: Servo) -> None:
        """Pin the dynamic node ID that the servo gets to one that this job gives to no other servo.

        Raises Conflict when none is left.
        """
        taken = {claim.number for claim in self._claims.of("node_id", servo)} | run.request.fixed
        free = find_free(HIGHEST_DYNAMIC, taken | {servo.node_id or 0})
        if free is None:
            raise Conflict(
                "No node ID is left to park a servo on. Forget allocations of nodes that are gone.",
                cause="no_node_id_left",
            )
        await self._allocating.pin(servo.uid, free)
        run.pinned.add(servo.uid)
        run.tell()

    def forget_allocation(self, run: CommissionRun, servo: Servo) -> None:
        """Free the dynamic node ID of a servo that has a static one. A pin set by a user stays."""
        if servo.uid in self._allocations.entries() and (
            servo.uid in run.pinned or not self._allocations.pinned(servo.uid)
        ):
            self._allocations.drop(servo.uid)
        run.pinned.discard(servo.uid)


def _note(target: CommissionTarget, problem: HornbillError) -> None:
    """What is left of its parked servo ID, unless another problem is known of it already."""
    target.record.problem = target.record.problem or problem_document(problem)
