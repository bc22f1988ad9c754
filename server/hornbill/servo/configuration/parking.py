"""Owns Parking: how servos step aside for one another, so that ids are exchanged without a clash on the way."""

from hornbill.errors import Conflict, HornbillError
from hornbill.node.node_ids import HIGHEST_DYNAMIC, find_free
from hornbill.servo.allocating import Allocating
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.commission_hands import Hands
from hornbill.servo.configuration.commission_run import Run, Unit
from hornbill.servo.fleet import Fleet
from hornbill.servo.servo import Servo
from hornbill.store.allocations import Allocations


class Parking:
    """Servo ids are parked on 0 in RAM (section 4.37), node ids on a dynamic one nobody wants, saved (section 4.38)."""

    def __init__(
        self, hands: Hands, fleet: Fleet, claims: Claims, allocating: Allocating, allocations: Allocations
    ) -> None:
        self._hands = hands
        self._fleet = fleet
        self._claims = claims
        self._allocating = allocating
        self._allocations = allocations

    async def aside(self, run: Run, unit: Unit) -> None:
        """Park a servo id on 0 in RAM: another servo is to have it, and this one gets its own when its turn comes."""

        async def park(run: Run, unit: Unit) -> str:
            servo = await self._hands.present(unit)
            before = unit.aside = servo.servo_id  # before it is written: a job that is cancelled lets a write end
            try:
                await self._hands.apply(run, servo, {"servo_id": 0})
            except HornbillError:
                unit.aside = None
                raise
            return f"servo ID {before} is free"

        await self._hands.step(run, unit, "aside", park)

    async def away(self, run: Run, unit: Unit) -> None:
        """Let a servo give its node id up: it is dynamic after a save, on an id that nobody of this job wants."""

        async def park(run: Run, unit: Unit) -> str:
            servo = await self._hands.present(unit)
            before = servo.node_id
            self.pin_elsewhere(run, servo)
            await self._hands.apply(run, servo, {"node_id": 0})
            await self._hands.save(run, servo)
            servo = await self._hands.present(unit)
            if servo.node_id == before:
                raise Conflict(
                    f"{servo.title} was to give node ID {before} up, and got it again. Another tool may give node IDs "
                    "here: see GET /api/v1/bus.",
                    key="node_id", requested=before, owner=servo.uid, owner_title=servo.title,
                )  # fmt: skip
            return f"node ID {before} is free, it is on {servo.node_id}"

        await self._hands.step(run, unit, "away", park)

    async def put_back(self, run: Run, unit: Unit) -> None:
        """Give a servo that was moved aside its servo id again, unless somebody else holds it by now."""
        before, unit.aside = unit.aside, None
        name = f"aside {unit.place}"
        evidence = f"its servo ID {before} was put back"
        try:
            servo = await self._hands.present(unit)
            if any(one.servo_id == before for one in self._fleet.all() if one.online and one is not servo):
                raise Conflict("another servo has it now")
            await self._hands.apply(run, servo, {"servo_id": before})
        except HornbillError as error:
            evidence = f"its servo ID is 0 in RAM: {before} could not be put back ({error.detail})"
            unit.sheet.problem = unit.sheet.problem or evidence
        run.tell()
        run.job.done(name, evidence)

    def say_parked(self, run: Run) -> None:
        """Of a job that was cancelled: whose servo ID is 0 in RAM until it is resumed. Writes nothing."""
        for unit in run.units:
            if unit.aside is not None and unit.sheet.verdict != "done":
                text = f"its servo ID is 0 in RAM, and was {unit.aside}. Resume the job, or restart the servo."
                unit.sheet.problem = unit.sheet.problem or text
        run.tell()

    def pin_elsewhere(self, run: Run, servo: Servo) -> None:
        """Choose the node id a servo is given when it asks, so that it is none this job is to give to another.

        Raises Conflict when none is left.
        """
        taken = {claim.number for claim in self._claims.of("node_id", servo)} | run.fixed
        free = find_free(HIGHEST_DYNAMIC, taken | {servo.node_id or 0})
        if free is None:
            raise Conflict("No node ID is left to park a servo on. Forget allocations of nodes that are gone.")
        self._allocating.pin(servo.uid, free)
        run.pinned.add(servo.uid)
        run.tell()

    def forget_allocation(self, run: Run, servo: Servo) -> None:
        """A servo with a node id of its own leaves the one it was given to others. A person's pin stays."""
        if servo.uid in self._allocations.entries() and (
            servo.uid in run.pinned or not self._allocations.pinned(servo.uid)
        ):
            self._allocations.forget(servo.uid)
        run.pinned.discard(servo.uid)
