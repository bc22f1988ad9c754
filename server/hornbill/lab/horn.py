"""The horn of one servo under a lease: angle commands, and samples with the times at which they were taken."""

from hornbill.errors import HornbillError, NoResponse
from hornbill.servo.device.requests import POLL, RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant


class CommandedHorn:
    """What all procedures do with a horn. Commands and samples raise what ends motion: a stop, the end of the lease."""

    def __init__(
        self, requests: ServoRequests, motion: Motion, base: TimeBase, servo: Servo, lease_id: str | None
    ) -> None:
        self._requests = requests
        self._motion = motion
        self._base = base
        self.servo = servo
        self.lease_id = lease_id

    async def angle(self, policy: RetryPolicy = POLL) -> float:
        """Read the angle, °. Raises NoResponse, Refused, BusDisconnected."""
        row = self.servo.registers["current_angle"].parameter
        return await self._requests.read(self.servo, row, policy) / row.per_unit

    async def sample(self, key: str = "current_angle", policy: RetryPolicy = POLL) -> tuple[Instant, float] | None:
        """Read a row: the middle of the round trip, and its value. None without a response."""
        self._motion.may_move(self.servo, self.lease_id)
        row, sent = self.servo.registers[key].parameter, self._base.now()
        try:
            raw = await self._requests.read(self.servo, row, policy)
        except NoResponse:
            return None
        return (sent + self._base.now()) / 2, raw / row.per_unit

    async def command(self, angle_deg: float) -> Instant:
        """Command an angle. Returns when it was acknowledged. Raises as `Motion.command`."""
        await self._motion.command(self.servo, self.lease_id, "angle", angle_deg, clamp=False)
        at = self.servo.registers["command_angle"].at
        assert at is not None  # it was just acknowledged
        return at

    async def return_to(self, angle_deg: float) -> None:
        """Command an angle at the end of a procedure, if the lease and the servo still allow that."""
        try:
            await self.command(angle_deg)
        except HornbillError:
            pass  # stopped, or without a lease: torque is off or turning off
