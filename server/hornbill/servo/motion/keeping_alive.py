"""Keep-alive: repeats the last command before the servo's timeout (0x27), and never restores an output that is off."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, replace
from typing import Any, Final

from hornbill.errors import BusDisconnected, Busy, HornbillError, LeaseHeld, LeaseRequired, NoResponse, Stopped
from hornbill.servo.device.permission import Target
from hornbill.servo.device.requests import COMMAND, READ, RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.cautions import needs_feeding
from hornbill.servo.runtime.hub import Hub, LogEvent, ReadingChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Raw, Uid

SHORTEST_S, LONGEST_S = 0.02, 60.0
"""Bounds of the interval, which is a third of 0x27 (1 to 60,000 ms). A round trip takes a few milliseconds."""

TIMEOUT: Final = "timeout_time"
LATENESS_S: Final = 30.0
"""The lateness of the keep-alive is the worst of this window and the one before."""


@dataclass(slots=True)
class CommandedServo:
    """A servo under command: its lease, its last command, and the task that repeats it.

    `register_raw`: the acknowledged register value, None after a broadcast without response. `boot_count`: boot count
    of the servo at the last command, which was sent at `fed`. `found`: already energised under this lease before.
    `end_reason`: why the keep-alive ended, if it ended automatically.
    """

    servo: Servo
    lease_id: str
    target: Target | None = None
    register_raw: Raw | None = None
    boot_count: int = 0
    fed: Instant = 0.0
    writing: bool = False
    alive: asyncio.Task[None] | None = None
    found: bool = False
    end_reason: HornbillError | None = None


class KeepingAlive:
    """Keeps servos under command alive, with one task each. Motion passes in what it needs.

    `gate` raises what ends the motion of a servo (Stopped, LeaseRequired, Busy, TorqueOff, …); `send` writes a target.
    """

    def __init__(
        self,
        requests: ServoRequests,
        hub: Hub,
        base: TimeBase,
        gate: Callable[[CommandedServo], None],
        send: Callable[[CommandedServo, Target, RetryPolicy], Coroutine[Any, Any, Raw]],
        find: Callable[[Uid], CommandedServo | None],
    ) -> None:
        """`find` returns the servo under command with a unique ID."""
        self._requests = requests
        self._hub = hub
        self._base = base
        self._gate = gate
        self._send = send
        self._find = find
        self._shows: set[Uid] = set()
        self._late_s, self._late_before_s, self._window_ends = 0.0, 0.0, base.now() + LATENESS_S
        hub.subscribe(self._on_reading, ReadingChanged)

    @property
    def shortest_s(self) -> float:
        """The shortest timeout (0x27) under which a command can be kept alive, s.

        At least three of the shortest intervals; more if the keep-alive was late by more than the remaining two thirds.
        """
        return max(3 * SHORTEST_S, 1.5 * max(self._late_s, self._late_before_s))

    def begin(self, commanded: CommandedServo, target: Target, holds: Raw) -> None:
        """Start repeating a command that the servo acknowledged with the register value `holds`."""
        self.pause(commanded)
        self._note_sent(commanded, target, holds)
        self._start(commanded)

    def begin_unacknowledged(self, commanded: CommandedServo, target: Target) -> None:
        """Start repeating a command sent by broadcast: its timeout runs from now, and the register is read later.

        Fast enough for every burst of a stream, because the task keeps sleeping.
        """
        if commanded.writing:  # the pending write is of the old target and must not leave after the new one
            self.pause(commanded)
        self._note_sent(commanded, target, None)
        if commanded.alive is None or commanded.alive.done():
            self._start(commanded)

    @staticmethod
    def pause(commanded: CommandedServo) -> None:
        """Stop repeating."""
        commanded.writing = False
        if commanded.alive is not None:
            commanded.alive.cancel()
            commanded.alive = None

    def _note_sent(self, commanded: CommandedServo, target: Target, holds: Raw | None) -> None:
        commanded.target, commanded.register_raw = target, holds
        commanded.fed, commanded.boot_count, commanded.end_reason = self._base.now(), commanded.servo.boot_count, None

    def _start(self, commanded: CommandedServo, fed: "asyncio.Future[None] | None" = None) -> None:
        commanded.alive = asyncio.get_running_loop().create_task(self._repeat(commanded, fed))

    def _feed_now(self, commanded: CommandedServo) -> "asyncio.Future[None]":
        """Repeat the command without waiting for the interval. Returns a future that is done once it was sent."""
        fed = asyncio.get_running_loop().create_future()
        self.pause(commanded)
        self._start(commanded, fed)
        return fed

    def _on_reading(self, change: ReadingChanged) -> None:
        """React to a changed timeout: the previous interval may be too long."""
        commanded = self._find(change.uid) if change.key == TIMEOUT else None
        if commanded is not None and commanded.alive is not None and not commanded.alive.done():
            self._feed_now(commanded)

    async def before_timeout(self, servo: Servo, raw: Raw) -> None:
        """Repeat the command before the timeout is shortened: the new one may already have passed."""
        commanded = self._find(servo.uid)
        if commanded is None or commanded.alive is None or commanded.alive.done() or raw > (servo.raw(TIMEOUT) or 0):
            return
        fed = self._feed_now(commanded)
        assert commanded.alive is not None
        await asyncio.wait({commanded.alive, fed}, timeout=COMMAND.timeout_s, return_when=asyncio.FIRST_COMPLETED)

    async def _repeat(self, commanded: CommandedServo, fed: "asyncio.Future[None] | None") -> None:
        """Repeat the command of a servo at its interval until that ends.

        After a restart, in protection, or after a possible timeout, repeating it would make the horn jump to the old
        target. The keep-alive then ends until the servo is commanded again.

        `fed`: repeat immediately, then set its result.
        """
        servo, unacknowledged = commanded.servo, False
        while True:
            interval = interval_s(servo)
            rest = commanded.fed + interval - self._base.now()
            if rest > 0 and not unacknowledged and fed is None:
                await asyncio.sleep(rest)
                continue
            # another read of this servo may lose its response and wait longer than the interval
            urgent = interval < READ.timeout_s
            policy = RetryPolicy(
                COMMAND.priority, min(COMMAND.timeout_s, interval / 2), 1, urgent=urgent, kind="command"
            )
            commanded.writing = True
            try:
                before = commanded.fed
                unacknowledged = not await self._feed(commanded, policy, check=not unacknowledged)
            except HornbillError as error:
                self._end(commanded, error)
                return
            finally:
                if commanded.alive is asyncio.current_task():
                    commanded.writing = False
            if unacknowledged:
                continue
            if fed is None:
                self._note_lateness(commanded.fed - before - interval)
            elif not fed.done():
                fed.set_result(None)
            fed = None

    async def _feed(self, commanded: CommandedServo, policy: RetryPolicy, *, check: bool) -> bool:
        """Write the command once more, if needed; with `check`, first verify that the register still has it.

        False if not acknowledged although the servo has certainly not restarted. Raises what ends its motion.
        """
        servo = commanded.servo
        try:
            if not needs_feeding(servo):
                commanded.fed = self._base.now()
                if commanded.register_raw is None:
                    await self._verify(commanded, policy)
                return True
            self._gate(commanded)
            if servo.boot_count != commanded.boot_count:
                raise Busy(f"{servo.title} restarted.", cause="servo_restarted", servo=servo.title)
            if check:
                if late := self._too_late(commanded):
                    raise Busy(
                        f"{servo.title} was not commanded for {late}.", cause="commands_interrupted", servo=servo.title
                    )
                await self._verify(commanded, policy)
            assert commanded.target is not None
            commanded.register_raw = await self._send(commanded, commanded.target, policy)
            commanded.fed = self._base.now()
        except NoResponse:
            if not needs_feeding(servo):
                return True
            if not await self._has_not_restarted(servo, commanded.boot_count):
                raise
            if late := self._too_late(commanded):
                raise NoResponse(
                    f"{servo.title} did not respond for {late}.", cause="response_gap", servo=servo.title
                ) from None
            return False
        return True

    def _too_late(self, commanded: CommandedServo) -> str | None:
        """Text of the time without a command, if longer than its timeout. None otherwise."""
        silent_s, limit_s = self._base.now() - commanded.fed, (commanded.servo.raw(TIMEOUT) or 1000) / 1000
        if silent_s <= max(limit_s, 3 * SHORTEST_S):
            return None
        return f"{silent_s * 1000:.0f} ms, longer than its timeout (0x27) of {limit_s * 1000:.0f} ms"

    def _note_lateness(self, late_s: float) -> None:
        if (now := self._base.now()) >= self._window_ends:
            recent = now < self._window_ends + LATENESS_S
            self._late_before_s = self._late_s if recent else 0.0
            self._late_s, self._window_ends = 0.0, now + LATENESS_S
        self._late_s = max(self._late_s, late_s)

    async def _verify(self, commanded: CommandedServo, policy: RetryPolicy) -> None:
        """Raises Busy if its register no longer has the command. An unnoticed restart, the return from protection
        (4.7), PWM input (4.30) or another tool may have overwritten it; none of these is undone.

        Whether ArrayCommand changes the registers is not documented. If it did once on a servo, another value means
        that a burst did not arrive; otherwise it means nothing, and the command is repeated through 0x00.
        """
        servo, target = commanded.servo, commanded.target
        assert target is not None
        held = await self._requests.read(servo, target.parameter, policy)
        if commanded.register_raw is not None:
            if held != commanded.register_raw:
                raise Busy(
                    f"{servo.title} has a different command from the one sent.",
                    held=held,
                    cause="other_command_active",
                    servo=servo.title,
                )
        elif abs(held - target.raw) <= 1:  # float16 may have changed it by one step
            self._shows.add(servo.uid)
            commanded.target, commanded.register_raw = replace(target, raw=held), held
        elif servo.uid in self._shows:
            raise Busy(
                f"{servo.title} did not receive the command of the last burst.",
                held=held,
                cause="last_command_not_accepted",
                servo=servo.title,
            )

    async def _has_not_restarted(self, servo: Servo, boot_count: int) -> bool:
        """Whether a servo that missed a command has certainly not restarted, by its uptime (table 2-17)."""
        before, at, node = servo.status, servo.status_at, servo.node_id
        if before is None or at is None or node is None:
            return False
        try:
            uptime = (await self._requests.node_info(node)).status.uptime_sec
        except HornbillError:
            return False
        # It started before the last known status, however long the response took.
        since = self._base.now() - at
        return servo.boot_count == boot_count and before.uptime_sec <= uptime and uptime > since

    def _end(self, commanded: CommandedServo, error: HornbillError) -> None:
        commanded.end_reason = error
        expected = isinstance(error, Stopped | LeaseRequired | LeaseHeld | BusDisconnected)
        if self._find(commanded.servo.uid) is commanded and not expected:
            text = (
                f"{error.detail} The last command of {commanded.servo.title} is no longer repeated. Command it again."
            )
            self._hub.publish(
                LogEvent(
                    "warning",
                    "command_ended",
                    text,
                    commanded.servo.uid,
                    {**error.note_params, "servo": commanded.servo.title},
                )
            )


def interval_s(servo: Servo) -> float:
    """Keep-alive interval, s: a third of the timeout (0x27), the shorter one while a write of it is pending."""
    row = servo.registers.get(TIMEOUT)
    found = [] if row is None else [row.raw]
    if row is not None and row.written and (row.at is None or row.written_at >= row.at):
        found.append(row.written_raw)
    return max(SHORTEST_S, min(LONGEST_S, min((raw for raw in found if raw), default=1000) / 3000))
