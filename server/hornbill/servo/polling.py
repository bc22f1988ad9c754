"""Owns Polling: which rows are asked for regularly, how often, and what the bus allows of it."""

import asyncio
import logging
import math
from dataclasses import dataclass, field

from hornbill.errors import HornbillError, InvalidValue, NoAnswer, NotInThisModel, PortError, Refused
from hornbill.servo.asking import POLL, Asker
from hornbill.servo.servo import Servo, State
from hornbill.servo.timebase import TimeBase
from hornbill.units import Instant, Uid

log = logging.getLogger(__name__)

READ_S = 534e-6
"""Bus time of one read by name: 534 bits at 1 Mbit/s, request and answer, real stuffing."""

BUDGET = 0.40
"""Share of the bus all polling together may take."""

BACKGROUND = 0.20
"""Share above which what every servo is asked for is asked less often, but never less than STRETCH times so."""

STRETCH = 2.0
"""So that a reading is never stale for want of a poll: see LIVE_PERIOD_S of reading.py."""

ALWAYS = {
    "fault_overview": 1.0,
    "current_temperature": 2.0,
    "current_voltage": 2.0,
    "command_angle": 1.0,
    "command_speed": 1.0,
    "command_torque": 1.0,
    "torque_mode": 1.0,
}
"""Rows every servo is asked for, and the period in seconds: enough for health, supply and what is in command."""

WEIGH_S = 1.0
SLOTS = 20
"""Parts of a second in which servos are asked in turn, so that a crowd fills the bus evenly; those of one part are
asked together, because frames that come together cost the process less than frames that come one by one."""

FAULT_WORDS = ("fault_notification", "fault_warning", "fault_failure")

PAUSED = frozenset((State.OFFLINE, State.IDENTIFYING, State.SAVING, State.RESTARTING, State.UPDATING))


@dataclass(frozen=True, slots=True)
class Grant:
    """What of a wish the bus budget allows; `bus_share` 0..1."""

    channels: list[str]
    requested_hz: float
    granted_hz: float
    bus_share: float


@dataclass(slots=True)
class _Round:
    servo: Servo
    wish: tuple[tuple[str, ...], float] = ((), 0.0)
    due: dict[str, Instant] = field(default_factory=dict[str, Instant])
    task: asyncio.Task[None] | None = None
    nap: "asyncio.Future[None] | None" = None


class Polling:
    """One task a servo, so that one request is in flight a servo and a silent one delays nobody."""

    def __init__(self, asker: Asker, base: TimeBase) -> None:
        self._asker = asker
        self._base = base
        self._rounds: dict[Uid, _Round] = {}
        self._weighed: Instant = -WEIGH_S
        self._always_hz = 0.0
        self._stretch = 1.0

    def begin(self, servo: Servo) -> None:
        """Ask this servo regularly from now on. Its rows have just been read, so nothing is due at once."""
        found = self._rounds.setdefault(servo.uid, _Round(servo))
        if found.task is None or found.task.done():
            first = math.ceil(self._base.now()) + len(self._rounds) % SLOTS / SLOTS
            found.due = dict.fromkeys(ALWAYS, first)
            found.task = asyncio.get_running_loop().create_task(self._poll(found))

    def wish(self, servo: Servo, channels: list[str], rate_hz: float) -> Grant:
        """Poll these rows at this rate as well; an empty list ends it. Raises Unknown, NotInThisModel, InvalidValue."""
        for key in channels:
            row = servo.catalog.parameter(key)
            if key not in servo.registers:
                raise NotInThisModel(f"{servo.title} does not have {key} ({row.name}).", key=key)
            if row.kind != "number":
                raise InvalidValue(f"{key} is no number, so it is no channel.", key=key)
        wished = self._rounds.setdefault(servo.uid, _Round(servo))
        wished.wish = (tuple(dict.fromkeys(channels)), rate_hz)
        if wished.nap is not None and not wished.nap.done():
            wished.nap.set_result(None)
        self._weigh(self._base.now())
        granted = self._granted_hz(wished)
        return Grant(channels, rate_hz, round(granted, 2), round(granted * len(channels) * READ_S, 4))

    async def close(self) -> None:
        """End every task."""
        tasks = [one.task for one in self._rounds.values() if one.task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _granted_hz(self, one: _Round) -> float:
        """Everybody's wish is cut by the same factor once all of them together pass the budget."""
        wished = sum(len(other.wish[0]) * other.wish[1] for other in self._rounds.values())
        left = max(1.0, BUDGET / READ_S - self._always_hz / self._stretch)
        return one.wish[1] * min(1.0, left / wished) if wished else 0.0

    def _weigh(self, now: Instant) -> None:
        """Once a second: how much is asked of everybody, and so how much less often a crowd is asked."""
        if now - self._weighed < WEIGH_S:
            return
        self._weighed = now
        faulty = sum(1 for one in self._rounds.values() if one.servo.raw("fault_overview"))
        self._always_hz = len(self._rounds) * sum(1 / period for period in ALWAYS.values()) + faulty * len(FAULT_WORDS)
        self._stretch = min(STRETCH, max(1.0, self._always_hz * READ_S / BACKGROUND))

    async def _poll(self, one: _Round) -> None:
        while True:
            now = self._base.now()
            if one.servo.state in PAUSED:
                await asyncio.sleep(0.1)
                continue
            key, at = self._next(one, now)
            if at > now:
                await self._nap(one, at - now)
                continue
            await self._ask(one, key)

    async def _nap(self, one: _Round, seconds: float) -> None:
        """Until something is due, or a new wish."""
        loop = asyncio.get_running_loop()
        one.nap = nap = loop.create_future()
        alarm = loop.call_later(seconds, lambda: nap.done() or nap.set_result(None))
        try:
            await nap
        finally:
            alarm.cancel()

    def _next(self, one: _Round, now: Instant) -> tuple[str, Instant]:
        registers, due = one.servo.registers, one.due
        keys = [*one.wish[0], *[key for key in ALWAYS if key in registers]]
        if one.servo.raw("fault_overview"):
            keys += FAULT_WORDS
        if not keys:
            return "", now + 0.1
        key = min(keys, key=lambda key: due.get(key, now))
        return key, due.get(key, now)

    async def _ask(self, one: _Round, key: str) -> None:
        servo, now = one.servo, self._base.now()
        channels, _rate = one.wish
        self._weigh(now)
        period = ALWAYS.get(key, 1.0) * self._stretch
        if key in channels:
            hz = self._granted_hz(one)
            period = min(period, 1 / hz) if hz > 0 else period
        # the next slot follows from the last one, so the rate holds; slots that were missed are not caught up
        one.due[key] = max(one.due.get(key, now) + period, now)
        try:
            raw = await self._asker.read(servo, servo.registers[key].parameter, POLL)
        except (NoAnswer, Refused, PortError, KeyError) as error:
            log.debug("%s: poll %s: %s", servo.title, key, error)
            await asyncio.sleep(0.05)
            return
        except HornbillError as error:
            log.info("%s: poll %s: %s", servo.title, key, error.detail)
            return
        if key == "current_angle":
            row = servo.registers[key].parameter
            servo.angle_deg, servo.angle_at = raw / row.per_unit, self._base.now()
            servo.angle_polled_at = servo.angle_at
        elif key == "fault_overview" and raw == 0:
            for word in FAULT_WORDS:
                if servo.raw(word):
                    one.due[word] = 0.0
                    await self._clear(one, word)

    async def _clear(self, one: _Round, word: str) -> None:
        """The overview says nothing is left: read the word once more, so that it does not stay set for ever."""
        try:
            await self._asker.read(one.servo, one.servo.registers[word].parameter, POLL)
        except (NoAnswer, Refused, PortError) as error:
            log.debug("%s: %s: %s", one.servo.title, word, error)
