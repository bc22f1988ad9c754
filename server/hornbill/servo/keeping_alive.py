"""Owns KeepingAlive: feeding a servo's own time-out with its last command, and never giving back what was taken."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, replace
from typing import Any

from hornbill.errors import BusDisconnected, Busy, HornbillError, LeaseHeld, LeaseRequired, NoAnswer, Stopped
from hornbill.servo.asking import COMMAND, Asker, Patience
from hornbill.servo.hub import Happened, Hub
from hornbill.servo.permission import Target
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.units import Instant, Raw, Uid

SHORTEST_S, LONGEST_S = 0.02, 60.0
"""Bounds of a third of 0x27, whose range is 1 to 60,000 ms: one round trip takes some milliseconds."""


@dataclass(slots=True)
class Driven:
    """A servo under command: whose lease, what it was told last, and the task that keeps telling it.

    `holds` is what its register answered, None after a message that nobody answers; `boots` counts the starts it had
    made when it was told, at `fed`. `let_go` is why it is not told any more, when that ended by itself.
    """

    servo: Servo
    lease_id: str
    target: Target | None = None
    holds: Raw | None = None
    boots: int = 0
    fed: Instant = 0.0
    asking: bool = False
    alive: asyncio.Task[None] | None = None
    let_go: HornbillError | None = None


class KeepingAlive:
    """One task for every servo under command. What it needs of Motion is handed in.

    `gate` raises what ends the motion of a servo (Stopped, LeaseRequired, Busy, TorqueOff, …); `send` writes a target.
    """

    def __init__(
        self,
        asker: Asker,
        hub: Hub,
        base: TimeBase,
        gate: Callable[[Driven], None],
        send: Callable[[Driven, Target, Patience], Coroutine[Any, Any, Raw]],
        is_driven: Callable[[Driven], bool],
    ) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._gate = gate
        self._send = send
        self._is_driven = is_driven
        self._shows: set[Uid] = set()

    def begin(self, driven: Driven, target: Target, holds: Raw) -> None:
        """It took a command and answered that it holds `holds`: repeat that from now on."""
        self.pause(driven)
        self._told(driven, target, holds)
        self._start(driven)

    def told(self, driven: Driven, target: Target) -> None:
        """It was told by a message that nobody answers: its time-out counts from now, and the register is read later.

        Cheap enough for every burst of a stream: the task goes on sleeping.
        """
        if driven.asking:  # what is under way is the old target, and must not leave after the new one
            self.pause(driven)
        self._told(driven, target, None)
        if driven.alive is None or driven.alive.done():
            self._start(driven)

    @staticmethod
    def pause(driven: Driven) -> None:
        """Repeat nothing any more."""
        driven.asking = False
        if driven.alive is not None:
            driven.alive.cancel()
            driven.alive = None

    def _told(self, driven: Driven, target: Target, holds: Raw | None) -> None:
        driven.target, driven.holds = target, holds
        driven.fed, driven.boots, driven.let_go = self._base.now(), driven.servo.boots, None

    def _start(self, driven: Driven) -> None:
        driven.alive = asyncio.get_running_loop().create_task(self._repeat(driven))

    async def _repeat(self, driven: Driven) -> None:
        """After a restart, in protection, and when its time-out may have struck, the horn would jump to where it was
        commanded before: then the servo is left alone until somebody commands it again.
        """
        servo, unanswered = driven.servo, False
        while True:
            time_out = (servo.raw("timeout_time") or 1000) / 1000
            interval = max(SHORTEST_S, min(LONGEST_S, time_out / 3))
            rest = driven.fed + interval - self._base.now()
            if rest > 0 and not unanswered:
                await asyncio.sleep(rest)
                continue
            patience = Patience(COMMAND.priority, min(COMMAND.timeout_s, interval / 2), 1, kind="command")
            driven.asking = True
            try:
                if not needs_feeding(servo):
                    unanswered, driven.fed = False, self._base.now()
                    if driven.holds is None:
                        await self._see(driven, patience)
                    continue
                self._gate(driven)
                if servo.boots != driven.boots:
                    raise Busy(f"{servo.title} restarted.")
                if self._base.now() - driven.fed > max(time_out, 3 * interval):
                    self._let_go(driven, NoAnswer(f"{servo.title} did not answer for longer than its time-out (0x27)."))
                    return
                if not unanswered:
                    await self._see(driven, patience)
                assert driven.target is not None
                driven.holds = await self._send(driven, driven.target, patience)
                driven.fed, unanswered = self._base.now(), False
            except NoAnswer as error:
                if not needs_feeding(servo):
                    continue
                if not await self._runs_on(servo, driven.boots):
                    self._let_go(driven, error)
                    return
                unanswered = True
            except HornbillError as error:
                self._let_go(driven, error)
                return
            finally:
                if driven.alive is asyncio.current_task():
                    driven.asking = False

    async def _see(self, driven: Driven, patience: Patience) -> None:
        """Raises Busy when its register does not hold the command any more: a restart too quick to be noticed, the
        return from protection (4.7), PWM input (4.30) or another tool overwrites it, and none of that is undone.

        Whether ArrayCommand shows in the registers is not documented. From a servo where it did once, another value
        means that a burst did not arrive; from any other it means nothing, and the command is repeated by 0x00.
        """
        servo, target = driven.servo, driven.target
        assert target is not None
        held = await self._asker.read(servo, target.parameter, patience)
        if driven.holds is not None:
            if held != driven.holds:
                raise Busy(f"{servo.title} holds another command than the one it was given.", held=held)
        elif abs(held - target.raw) <= 1:  # float16 may have moved it by a step
            self._shows.add(servo.uid)
            driven.target, driven.holds = replace(target, raw=held), held
        elif servo.uid in self._shows:
            raise Busy(f"{servo.title} did not take the command of the last burst.", held=held)

    async def _runs_on(self, servo: Servo, boots: int) -> bool:
        """Whether a servo that missed a command has surely not restarted, by its uptime (whole seconds, table 2-17)."""
        before, at, node = servo.status, servo.status_at, servo.node_id
        if before is None or at is None or node is None:
            return False
        try:
            uptime = (await self._asker.node_info(node)).status.uptime_sec
        except HornbillError:
            return False
        # It ran before the status we know: that holds however long its answer took to reach us.
        since = self._base.now() - at
        return servo.boots == boots and before.uptime_sec <= uptime and uptime > since

    def _let_go(self, driven: Driven, error: HornbillError) -> None:
        driven.let_go = error
        if self._is_driven(driven) and not isinstance(error, Stopped | LeaseRequired | LeaseHeld | BusDisconnected):
            text = f"{error.detail} {driven.servo.title} is not kept under its last command any more. Command it again."
            self._hub.tell(Happened("warning", "let_go", text, driven.servo.uid))


def needs_feeding(servo: Servo) -> bool:
    """Whether silence changes what the servo does: with 0x26 "hold" it does not, unless PWM input takes over (4.30)."""
    return servo.raw("timeout_action") != 0 or bool(servo.model is not None and servo.model.pwm)
