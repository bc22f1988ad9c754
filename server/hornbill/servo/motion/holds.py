"""Holds: speed or torque that lasts only while a client confirms that the button is held."""

import asyncio
from collections.abc import Callable, Collection, Coroutine
from dataclasses import dataclass
from typing import Any, Final

from hornbill.domain.note import Note
from hornbill.errors import Busy, HornbillError, InvalidValue, NoResponse
from hornbill.servo.device.permission import Target
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.motion.setpoint_runner import SetpointRunner, SetpointSource
from hornbill.servo.runtime.hub import LogEvent
from hornbill.units import Instant, Uid

UNIT: Final = {"speed": "rpm", "torque": "%"}

BRAKE_S: Final = 0.4
"""Time for a servo to acknowledge braking, after which torque off follows. A few milliseconds are usual."""


@dataclass(slots=True, eq=False)
class _Hold(SetpointSource):
    """One servo running at `value`, which Motion keeps alive, until it is braked at `until`.

    Each renewal extends `until`; `expire` brakes.
    """

    servo: Servo
    kind: str
    value: float
    lease_id: str
    until: Instant
    expire: Callable[["_Hold"], Coroutine[Any, Any, None]]
    target: Target | None = None

    async def send(self, due: Instant, now: Instant) -> Instant | None:
        """Brake once it has expired."""
        if now < self.until:
            return self.until
        await self.expire(self)
        return None

    def interrupt(self, why: Note) -> LogEvent:
        """Event for an early end of the hold."""
        text = f"The hold of {self.servo.title} at {self.value:g} {UNIT[self.kind]} ended: {why.text}"
        return LogEvent("notice", "hold_ended", text, self.servo.uid, self.params)

    @property
    def params(self) -> dict[str, object]:
        """Servo and value, for an event."""
        unit = "rpm" if self.kind == "speed" else "pct"
        return {"servo": self.servo.title, f"at_{unit}": self.value}


class Holds:
    """Holds confirm that the button is still pressed, within a much shorter time than the lease.

    If a release is lost (frozen page, dead WebSocket, requests out of order), the servo is braked when the hold
    expires: 0 rpm or 0 %, which brakes (4.2, 4.3), then torque off if that is not acknowledged.
    """

    def __init__(
        self, services: HostServices, motion: Motion, runner: SetpointRunner, end_move: Callable[[Uid], None]
    ) -> None:
        """`end_move` ends a running move, whose next angle would override the hold."""
        self._end_move = end_move
        self._hub = services.hub
        self._base = services.base
        self._motion = motion
        self._runner = runner
        self._holds: dict[Uid, _Hold] = {}

    async def run(
        self,
        servo: Servo,
        lease_id: str | None,
        kind: str,
        value: float,
        for_s: float,
        *,
        renew: bool = False,
        confirm: Collection[str] = (),
    ) -> Target:
        """Run at `value` (rpm or %) for `for_s` seconds from now; 0 brakes immediately and ends the hold.

        `renew`: only extend a running hold, never start one, so that a delayed request moves nothing. Raises
        InvalidValue for angles, Busy if there is nothing to renew, and what Motion.command raises.
        """
        if kind not in UNIT:
            raise InvalidValue(
                '"hold" applies to speed and torque only. Omit it for an angle.',
                cause="hold_angle_unsupported",
            )
        if value == 0:
            self._end_move(servo.uid)
            return await self._release(servo, lease_id, kind)
        lease = self._motion.may_move(servo, lease_id)
        now = self._base.now()
        going = self._holds.get(servo.uid)
        if going is not None and going.lease_id != lease.id:
            going = None
        if renew and going is None:
            raise Busy(
                f"{servo.title} was braked because the hold was not renewed in time. Release and press again.",
                cause="hold_not_renewed",
                servo=servo.title,
            )
        same = going is not None and (going.kind, going.value) == (kind, value)
        if going is not None and going.target is not None and (renew or same):
            self._motion.check_command(servo, lease_id, going.target)
            if same:
                going.until = now + for_s
                return going.target
        hold = _Hold(servo, kind, value, lease.id, now + for_s, self._expire)
        self._begin(hold)
        self._end_move(servo.uid)
        try:
            await self._motion.freshen(servo, kind)
            if self._holds.get(servo.uid) is not hold:
                raise Busy(
                    f"{servo.title} was released before it started.",
                    cause="released_before_start",
                    servo=servo.title,
                )
            hold.target = await self._motion.command(servo, lease_id, kind, value, clamp=False, confirm=confirm)
        except HornbillError as error:
            self._forget(hold)
            if going is not None or isinstance(
                error, NoResponse
            ):  # it runs, or may have received the command without its response arriving
                await self._brake(servo, lease.id, kind)
            raise
        if self._holds.get(servo.uid) is not hold:  # released while the command was being sent
            await self._brake(servo, lease.id, kind)
        return hold.target

    def _begin(self, hold: _Hold) -> None:
        before = self._holds.get(hold.servo.uid)
        if before is not None:
            self._runner.end(before)
        self._holds[hold.servo.uid] = hold
        self._runner.start(hold)

    def _forget(self, hold: _Hold) -> None:
        if self._holds.get(hold.servo.uid) is hold:
            del self._holds[hold.servo.uid]
            self._runner.end(hold)

    async def _expire(self, hold: _Hold) -> None:
        servo = hold.servo
        if self._holds.get(servo.uid) is not hold:
            return
        del self._holds[servo.uid]
        if hold.target is not None and self._motion.last_command(servo.uid) is not hold.target:
            return  # commanded again since, or torque off: no longer this hold's
        text = f"{servo.title} was braked: its hold at {hold.value:g} {UNIT[hold.kind]} was not renewed in time."
        self._hub.publish(LogEvent("notice", "hold_ended", text, servo.uid, {**hold.params, "braked": True}))
        await self._brake(servo, hold.lease_id, hold.kind)

    async def _release(self, servo: Servo, lease_id: str | None, kind: str) -> Target:
        hold = self._holds.get(servo.uid)
        if hold is not None:
            self._forget(hold)
        try:
            return await self._still(servo, lease_id, kind)
        except HornbillError:
            if hold is not None:
                await self._disable_torque(servo)
            raise

    async def _brake(self, servo: Servo, lease_id: str, kind: str) -> None:
        """Brake under the lease of the hold; torque off if that is refused or not acknowledged. Never raises."""
        if not self._motion.is_commanded(servo.uid):
            return  # torque off was acknowledged or is pending
        try:
            await self._still(servo, lease_id, kind)
        except HornbillError:
            await self._disable_torque(servo)

    async def _still(self, servo: Servo, lease_id: str | None, kind: str) -> Target:
        """Command 0, which brakes. Raises NoResponse after BRAKE_S, and what Motion.command raises."""
        try:
            async with asyncio.timeout(BRAKE_S):
                return await self._motion.command(servo, lease_id, kind, 0.0, clamp=False)
        except TimeoutError as error:
            raise NoResponse(
                f"{servo.title} did not acknowledge braking. Torque is switched off.",
                cause="brake_not_acknowledged",
                servo=servo.title,
            ) from error

    async def _disable_torque(self, servo: Servo) -> None:
        if not self._motion.is_commanded(servo.uid):
            return
        try:
            await self._motion.disable_torque(servo, "off")
        except HornbillError as error:  # torque off is pending now and repeated until acknowledged
            self._hub.publish(
                LogEvent("warning", "hold_ended", error.detail, servo.uid, {**error.note_params, "servo": servo.title})
            )
