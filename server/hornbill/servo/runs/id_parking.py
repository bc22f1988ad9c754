"""Parking of IDs while servos exchange them, so that no two share one."""

from hornbill.domain.fields import known
from hornbill.errors import Conflict, HornbillError, NotAsWanted
from hornbill.node.node_ids import HIGHEST_DYNAMIC, find_free
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.record import problem_document
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.servo import Servo
from hornbill.servo.monitoring.node_id_table import NodeIdTable
from hornbill.servo.runs.commission_run import CommissionRun, CommissionTarget, CommissionWriter
from hornbill.servo.runtime.steps import Evidence
from hornbill.store.allocations import AllocationStore


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

    async def aside(self, run: CommissionRun, target: CommissionTarget) -> Evidence:
        """Park a servo ID on 0 in RAM, because another servo gets it first."""
        servo = await self._writer.present(target)
        before = target.aside = servo.servo_id  # before it is written: a job that is cancelled lets a write end
        try:
            await self._writer.apply(run, servo, {"servo_id": 0})
        except HornbillError:
            target.aside = None
            raise
        return Evidence("servo_id_parked", f"servo ID {before} is free", known(servo_id=before))

    async def away(self, run: CommissionRun, target: CommissionTarget) -> Evidence:
        """Park a node ID: dynamic after a save, at an ID that no servo of this job gets."""
        servo = await self._writer.present(target)
        before = servo.node_id
        await self.pin_elsewhere(run, servo)
        await self._writer.apply(run, servo, {"node_id": 0})
        await self._writer.save(run, servo, {})
        servo = await self._writer.present(target)
        if servo.node_id == before:
            raise Conflict(
                f"{servo.title} was to give node ID {before} up, and got it again. Another tool may give node IDs "
                "here.",
                request=": see GET /api/v1/bus.",
                key="node_id", requested=before, owner=servo.uid, owner_title=servo.title,
                cause="node_id_came_back", servo=servo.title,
            )  # fmt: skip
        text = f"node ID {before} is free, it is on {servo.node_id}"
        return Evidence("node_id_parked", text, known(node_id=servo.node_id, node_id_before=before))

    async def put_back(self, run: CommissionRun, target: CommissionTarget) -> None:
        """Restore the servo ID of a parked servo, unless another servo has it by now."""
        before, target.aside = target.aside, None
        name = target.step_name("aside")
        evidence = Evidence("servo_id_put_back", f"its servo ID {before} was put back", known(servo_id=before))
        try:
            servo = await self._writer.present(target)
            if any(one.servo_id == before for one in self._fleet.all() if one.online and one is not servo):
                raise Conflict("another servo has it now", cause="servo_id_taken_meanwhile", servo_id=before)
            await self._writer.apply(run, servo, {"servo_id": before})
        except HornbillError as error:
            text = f"its servo ID is 0 in RAM: {before} could not be put back ({error.detail})"
            evidence = Evidence("servo_id_lost", text, known(servo_id=before, problem=error.code))
            _note(target, NotAsWanted(text, cause="servo_id_not_put_back", servo_id=before, failure=error.code))
        run.tell()
        run.job.done(name, evidence)

    def note_parked(self, run: CommissionRun) -> None:
        """Record, in a cancelled job, which servo IDs stay 0 in RAM until it is resumed. Writes nothing."""
        for target in run.targets:
            if target.aside is not None and target.record.verdict != "done":
                text = f"its servo ID is 0 in RAM, and was {target.aside}. Resume the job, or restart the servo."
                _note(target, NotAsWanted(text, cause="servo_id_parked", servo_id=target.aside))
        run.tell()

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
