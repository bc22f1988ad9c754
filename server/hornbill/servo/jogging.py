"""Owns Jogs: moves that go at a limited speed and acceleration, as a stream of angles to one servo."""

import asyncio
import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

from hornbill.errors import Busy, HornbillError, NoAnswer
from hornbill.servo.asking import READ, Asker
from hornbill.servo.hub import Happened, Hub
from hornbill.servo.motion import Motion
from hornbill.servo.permission import Target
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.units import Uid

PERIOD_S: Final = 0.02
"""Between two angles of a move: 50 a second, each through 0x00, which is exact and answered."""

SILENT_S: Final = 0.5
"""A move ends when the servo has not answered for this long."""


@dataclass(frozen=True, slots=True)
class Profile:
    """`speed` in degrees a second and `acceleration` in degrees a second squared, both above 0."""

    speed: float
    acceleration: float


@dataclass(slots=True)
class Track:
    """Where a move is: degrees and degrees a second."""

    at: float
    speed: float = 0.0

    def step(self, target: float, profile: Profile, dt: float) -> bool:
        """Go on for `dt` seconds towards `target`, never faster than the profile; true when there and at rest.

        The speed is kept to what can still be braked before the target: a target that moves is followed smoothly.
        """
        way = target - self.at
        # brake from here: v²/2a within the way that is left after this step
        brake = profile.acceleration * dt
        most = min(
            profile.speed, max(0.0, math.sqrt(2 * profile.acceleration * abs(way) + brake * brake / 4) - brake / 2)
        )
        wanted = math.copysign(most, way)
        self.speed += min(max(wanted - self.speed, -brake), brake)
        moved = self.speed * dt
        if abs(way) <= abs(moved) + 1e-9 and abs(self.speed) <= brake + 1e-9 and (way == 0 or moved * way >= 0):
            self.at, self.speed = target, 0.0
            return True
        self.at += moved
        return False


@dataclass(slots=True)
class _Jog:
    track: Track
    target: Target
    degrees: float
    profile: Profile
    lease_id: str
    task: "asyncio.Task[None] | None" = None


class Jogs:
    """Moves under way, one a servo. A new target for a servo that moves bends its way; it does not begin anew."""

    def __init__(self, asker: Asker, hub: Hub, base: TimeBase, motion: Motion) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._motion = motion
        self._jogs: dict[Uid, _Jog] = {}

    async def move(
        self,
        servo: Servo,
        lease_id: str | None,
        degrees: float,
        profile: Profile,
        *,
        clamp: bool,
        confirm: Collection[str] = (),
    ) -> tuple[Target, "asyncio.Task[None]"]:
        """Begin a move to `degrees`; the answer is its end, checked now, and the task that goes there.

        A command of somebody else for this servo ends it where it is.

        Raises what Motion.command raises; the horn has not moved then.
        """
        lease = self._motion.may_move(servo, lease_id)
        await self._motion.freshen(servo, "angle")
        target = self._motion.permit(servo, lease, "angle", degrees, clamp=clamp, confirm=confirm)
        row = servo.registers["current_angle"].parameter
        here = await self._asker.read(servo, row, READ) / row.per_unit
        lease = self._motion.may_move(servo, lease_id)
        going = self._jogs.get(servo.uid)
        track = Track(here)
        if going is not None and going.task is not None and not going.task.done() and going.lease_id == lease.id:
            track = going.track
            going.task.cancel()
        jog = _Jog(track, target, target.raw / target.parameter.per_unit, profile, lease.id)
        jog.task = asyncio.get_running_loop().create_task(self._go(servo, jog))
        self._jogs[servo.uid] = jog
        return target, jog.task

    def end(self, uid: Uid) -> None:
        """End the move of one servo where it is, for whoever commands it now."""
        going = self._jogs.pop(uid, None)
        if going is not None and going.task is not None:
            going.task.cancel()

    async def close(self) -> None:
        """End every move where it is."""
        tasks = [jog.task for jog in self._jogs.values() if jog.task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _go(self, servo: Servo, jog: _Jog) -> None:
        """One angle a period. What the lease, a stop or the servo refuses ends the move; torque is theirs to take."""
        due = answered = self._base.now()
        sent: Target | None = None
        try:
            while True:
                there = jog.track.step(jog.degrees, jog.profile, PERIOD_S)
                try:
                    sent = await self._motion.command(
                        servo, jog.lease_id, "angle", round(jog.track.at, 1), clamp=True, confirm=jog.target.confirmed
                    )
                    answered = self._base.now()
                except NoAnswer:
                    if self._base.now() - answered > SILENT_S:
                        raise
                    there = False  # the last angle has to arrive
                if there:
                    return
                due = max(due + PERIOD_S, self._base.now())
                await asyncio.sleep(due - self._base.now())
                if sent is not None and not self._still(servo, jog, sent):
                    return
        except HornbillError as error:
            text = f"The move of {servo.title} to {jog.degrees:g}° has ended at {jog.track.at:.1f}°: {error.detail}"
            self._hub.tell(Happened("notice", "move_ended", text, servo.uid))

    def _still(self, servo: Servo, jog: _Jog, sent: Target) -> bool:
        """Whether nobody else has commanded it since. Raises what ends every motion."""
        try:
            self._motion.still_holds(servo, jog.lease_id, sent)
        except Busy:
            return False
        return True
