"""Jogs: moves of one servo at limited speed and acceleration."""

import asyncio
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Final

from hornbill.domain.note import Note
from hornbill.errors import Busy, NoResponse
from hornbill.servo.device.permission import Target
from hornbill.servo.device.requests import READ
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.motion.setpoint_runner import PeriodicSource, SetpointRunner
from hornbill.servo.motion.trapezoid import Track, TrapezoidProfile
from hornbill.servo.runtime.hub import LogEvent
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Uid

PERIOD_S: Final = 0.02
"""Interval of the angles of a move: 50 per second, each through 0x00, which is exact and acknowledged."""

SILENT_S: Final = 0.5
"""A move ends if the servo has not responded for this time."""


@dataclass(slots=True, eq=False)
class _Jog(PeriodicSource):
    """The angles of one move. A refusal (lease, stop or servo) ends it; switching torque off is left to Motion."""

    base: TimeBase
    motion: Motion
    servo: Servo
    lease_id: str
    target: Target
    profile: TrapezoidProfile
    track: Track
    sent: Target | None = field(default=None, init=False)
    acknowledged_at: Instant = field(init=False)

    def __post_init__(self) -> None:
        self.acknowledged_at = self.base.now()

    @property
    def degrees(self) -> float:
        """Target of the move, degrees."""
        return self.target.raw / self.target.parameter.per_unit

    async def send_next(self) -> bool:
        """Send the next angle, unless another command ended the move."""
        if self.sent is not None and not self._still_ours(self.sent):
            return True
        there = self.track.step(self.degrees, self.profile, self.period_s)
        try:
            self.sent = await self.motion.command(
                self.servo, self.lease_id, "angle", round(self.track.at, 1), clamp=True, confirm=self.target.confirmed
            )
        except NoResponse:
            if self.base.now() - self.acknowledged_at > SILENT_S:
                raise
            return False  # the last angle must be acknowledged
        self.acknowledged_at = self.base.now()
        return there

    def interrupt(self, why: Note) -> LogEvent:
        """Event with the reason and angle at which the move ended."""
        text = f"The move of {self.servo.title} to {self.degrees:g}° ended at {self.track.at:.1f}°: {why.text}"
        params: dict[str, object] = {
            "servo": self.servo.title, "to_deg": self.degrees, "at_deg": round(self.track.at, 1),
        }  # fmt: skip
        return LogEvent("notice", "move_ended", text, self.servo.uid, params)

    def _still_ours(self, sent: Target) -> bool:
        """Whether the servo has not been commanded otherwise since. Raises what ends every motion."""
        try:
            self.motion.check_command(self.servo, self.lease_id, sent)
        except Busy:
            return False
        return True


class Jogs:
    """Running moves, one per servo. A new target for a moving servo changes its course without a new start."""

    def __init__(self, services: HostServices, motion: Motion, runner: SetpointRunner) -> None:
        self._requests = services.requests
        self._base = services.base
        self._motion = motion
        self._runner = runner
        self._jogs: dict[Uid, _Jog] = {}

    async def move(
        self,
        servo: Servo,
        lease_id: str | None,
        degrees: float,
        profile: TrapezoidProfile,
        *,
        clamp: bool,
        confirm: Collection[str] = (),
    ) -> tuple[Target, asyncio.Task[None]]:
        """Start a move to `degrees`. Returns the checked target and the task of the move.

        Another command for this servo ends the move where it is.

        Raises what Motion.command raises, before the horn has moved.
        """
        lease = self._motion.may_move(servo, lease_id)
        await self._motion.freshen(servo, "angle")
        target = self._motion.permit(servo, lease, "angle", degrees, clamp=clamp, confirm=confirm)
        row = servo.registers["current_angle"].parameter
        here = await self._requests.read(servo, row, READ) / row.per_unit
        lease = self._motion.may_move(servo, lease_id)
        going = self._jogs.get(servo.uid)
        track = Track(here)
        if going is not None and going.lease_id == lease.id and self._runner.runs(going):
            track = going.track
            self._runner.end(going)
        jog = _Jog(PERIOD_S, self._base, self._motion, servo, lease.id, target, profile, track)
        self._jogs[servo.uid] = jog
        return target, self._runner.start(jog)

    def end(self, uid: Uid) -> None:
        """End the move of a servo where it is, because of another command."""
        going = self._jogs.pop(uid, None)
        if going is not None:
            self._runner.end(going)
