"""Owns Restarts: following one servo through silence, restart, another node id and soft start, on evidence alone."""

import asyncio
import contextlib
from collections.abc import Coroutine
from dataclasses import dataclass
from typing import Any, TypeVar

from hornbill.errors import DidNotMove, NoAnswer, Refused
from hornbill.servo.asking import POLL, Asker
from hornbill.servo.configuration.forecast import ARRIVED_DEG
from hornbill.servo.fleet import Fleet
from hornbill.servo.hub import Hub, ServoChanged, StopChanged
from hornbill.servo.servo import Servo, State
from hornbill.servo.stop import Stop
from hornbill.servo.timebase import TimeBase
from hornbill.units import Instant, NodeId
from hornbill.wire.services import MAGIC

RESTART_WITHIN_S = 45.0
"""Silence after a save is about 0.05 s, a restart and a new node id take up to about 4 s. The rest is for whoever
pulled the plug and puts it back, and for lost messages: with a fifth of them lost, a node id takes 4 to 42 s."""

IDENTIFIED_WITHIN_S = 40.0
"""Reading every row after a restart takes 0.1 s, or 20 s when a fifth of all frames is lost."""

RUNS_ON_S = 3.0
"""A servo that has been heard for this long without restarting is not about to: what was sent to it is over."""

OLD_ENOUGH_S = 2
"""Uptime a servo must have reached before it is sent into a restart: a younger one's uptime, told in whole seconds,
could not prove that it started anew."""

RESTART_TRIES = 4
"""Times a restart is asked for, each only after the servo was heard for RUNS_ON_S without one: what was lost on the
bus was never carried out, so this repeats nothing."""

SOFT_START_WITHIN_S = 15.0
"""180 degrees at 30 rpm take 1 s. A horn that is not there by then is blocked."""

LOOK_AGAIN_S = 0.02

T = TypeVar("T")


@dataclass(slots=True)
class Departure:
    """A servo as it was when something was sent that restarts it, and the longest it was not heard since."""

    boots: int
    node_id: NodeId | None
    at: Instant
    heard: Instant
    silence: tuple[Instant, Instant]


class Restarts:
    """What save, restart and factory reset share. Sends nothing but RestartNode, and that not while stopped."""

    def __init__(self, asker: Asker, hub: Hub, base: TimeBase, stop: Stop, fleet: Fleet) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._stop = stop
        self._fleet = fleet

    async def unless_stopped(self, work: Coroutine[Any, Any, T]) -> T:
        """Do what sends something, and drop it in the very call that presses stop, before the first frame of stop.

        Raises Stopped then; what had left already has left.
        """
        task = asyncio.get_running_loop().create_task(work)

        def look(_change: StopChanged) -> None:
            if self._stop.latched:
                task.cancel()

        look(StopChanged())
        forget = self._hub.listen(look, StopChanged)
        try:
            return await task
        except asyncio.CancelledError:
            if not asyncio.current_task().cancelling():  # pyright: ignore[reportOptionalMemberAccess]
                self._stop.check()
            raise
        finally:
            forget()

    async def old_enough(self, servo: Servo) -> None:
        """Wait until a restart could be told from its uptime."""
        until = self._base.now() + OLD_ENOUGH_S + 2
        while servo.status is not None and servo.status.uptime_sec < OLD_ENOUGH_S:
            if self._base.now() > until:
                return
            await asyncio.sleep(LOOK_AGAIN_S)

    def depart(self, servo: Servo) -> Departure:
        """Call it right before what restarts the servo is sent."""
        now = self._base.now()
        heard = _heard(servo) or now
        return Departure(servo.boots, servo.node_id, now, heard, (heard, heard))

    async def left(self, servo: Servo, departure: Departure) -> bool:
        """Wait for what tells: True once a start is seen, False when the servo runs on for RUNS_ON_S from now.

        Raises NoAnswer when neither is seen within RESTART_WITHIN_S.
        """
        began = self._base.now()
        while servo.boots == departure.boots:
            self._listen(servo, departure)
            waited = self._base.now() - began
            since = None if servo.status_at is None or not servo.online else servo.status_at - began
            if waited > RUNS_ON_S and since is not None and since > RUNS_ON_S - 1.0:
                return False
            if waited > RESTART_WITHIN_S:
                raise NoAnswer(
                    f"{servo.title} was not seen to restart within {RESTART_WITHIN_S:.0f} s. "
                    "What ROM holds is not known. Check its supply; once it is back, what it holds is read.",
                )
            await asyncio.sleep(LOOK_AGAIN_S)
        self._listen(servo, departure)
        return True

    async def ask(self, servo: Servo, departure: Departure) -> int:
        """Have it restart, and see it do so: how often it had to be asked.

        Raises Stopped, Refused, BusDisconnected, and NoAnswer when it is not seen to.
        """
        for tries in range(1, RESTART_TRIES + 1):
            servo.writes_are_over()
            try:
                if not await self.unless_stopped(self._asker.restart(servo, MAGIC)):
                    raise Refused(f"{servo.title} refused to restart (ok = 0).")
            except NoAnswer:
                pass  # it may have restarted before it could answer; the wait that follows decides
            if await self.left(servo, departure):
                return tries
        raise NoAnswer(f"{servo.title} runs on, although it was asked {RESTART_TRIES} times to restart.")

    def silence(self, departure: Departure) -> str:
        """The silence as evidence: from when to when after the write nothing was heard."""
        begun, ended = (max(0.0, at - departure.at) for at in departure.silence)
        return f"nothing heard from {begun:.2f} s to {ended:.2f} s after it was sent ({ended - begun:.2f} s)"

    async def back(self, servo: Servo, departure: Departure) -> str:
        """Wait for the servo to be identified, on whatever node id: the evidence, which names both.

        Raises NoAnswer when it is not within IDENTIFIED_WITHIN_S.
        """
        servo.busy = State.RESTARTING
        self._hub.tell(ServoChanged(servo.uid))
        began = self._base.now()
        while not servo.identified or not servo.online:
            if self._base.now() - began > IDENTIFIED_WITHIN_S:
                raise NoAnswer(
                    f"{servo.title} restarted, but could not be read within {IDENTIFIED_WITHIN_S:.0f} s since. "
                    "What ROM holds is not known. Check its supply and the wiring.",
                )
            await asyncio.sleep(LOOK_AGAIN_S)
        before, now = departure.node_id, servo.node_id
        took = f"identified {self._base.now() - departure.at:.1f} s after it was sent"
        return f"node {now}, as before, {took}" if now == before else f"node {before} → node {now}, {took}"

    async def soft_start_over(self, servo: Servo) -> str | None:
        """Wait for the end of soft start: the evidence, None when there is none. Raises DidNotMove if it is blocked."""
        if not servo.soft_starting:
            return None
        began = self._base.now()
        while servo.soft_starting:
            if servo.registers["torque_mode"].written and servo.raw("torque_mode") != 0:
                return "ended, for torque was taken away"
            if self._base.now() - began > SOFT_START_WITHIN_S:
                raise DidNotMove(
                    f"The horn of {servo.title} does not come to 0° in its soft start, so what ROM holds of speed and "
                    "torque cannot be read. Look whether it is blocked, then restart the servo."
                )
            with contextlib.suppress(NoAnswer, Refused):  # what Status says is no angle until its unit is measured
                row = servo.registers["current_angle"].parameter
                angle = await self._asker.read(servo, row, POLL) / row.per_unit
                if servo.soft_starting and abs(angle) <= ARRIVED_DEG:
                    self._fleet.near_zero(servo, self._base.now())
            await asyncio.sleep(LOOK_AGAIN_S)
        angle = "" if servo.angle_deg is None else f", horn at {servo.angle_deg:+.1f}°"
        return f"over after {self._base.now() - began:.1f} s{angle}"

    def _listen(self, servo: Servo, departure: Departure) -> None:
        heard = _heard(servo)
        if heard is None or heard <= departure.heard:
            return
        begun, ended = departure.silence
        if heard - departure.heard > ended - begun:
            departure.silence = departure.heard, heard
        departure.heard = heard


def _heard(servo: Servo) -> Instant | None:
    return max((at for at in (servo.status_at, servo.angle_at) if at is not None), default=None)
