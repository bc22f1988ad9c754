"""Owns Polling: which rows are asked for regularly, how often, and what the bus allows of it."""

import asyncio
import logging
import math
from dataclasses import dataclass, field

from hornbill.errors import HornbillError, InvalidValue, NoAnswer, NotInThisModel, PortError, Refused
from hornbill.servo.asking import POLL, Asker
from hornbill.servo.servo import Servo, State
from hornbill.servo.timebase import TimeBase
from hornbill.servo.wishing import REST, Wish, Wishes
from hornbill.units import Instant, Uid

log = logging.getLogger(__name__)

READ_S = 556e-6
"""Bus time of one read by name at 1 Mbit/s, request and three frames of answer: 534 to 555 bits with real stuffing,
by row, value and node. The longest is reckoned with, so that the budget holds whatever is read."""

BUDGET = 0.40
"""Share of the bus all polling together may take, unless set otherwise. What servos say unasked (Status, NodeStatus:
0.26 % a servo) is no polling and comes on top."""

BACKGROUND = 0.5
"""Share of the budget above which what every servo is asked for is asked less often, but never less than STRETCH
times so, unless it would take more than BACKGROUND_MOST of the budget."""

STRETCH = 2.0
"""So that a reading is never stale for want of a poll: see LIVE_PERIOD_S of reading.py."""

BACKGROUND_MOST = 0.9

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
"""Read when the overview is not zero (B52)."""

PAUSED = frozenset((State.OFFLINE, State.IDENTIFYING, State.SAVING, State.RESTARTING, State.UPDATING))


@dataclass(frozen=True, slots=True)
class Grant:
    """What of one owner's wish the bus budget allows; `bus_share` 0..1, `note` what a person should know of it."""

    owner: str
    channels: list[str]
    requested_hz: float
    granted_hz: float
    bus_share: float
    expires_in_s: float | None
    note: str | None = None


@dataclass(slots=True)
class _Round:
    servo: Servo
    wishes: Wishes = field(default_factory=Wishes)
    due: dict[str, Instant] = field(default_factory=dict[str, Instant])
    task: asyncio.Task[None] | None = None
    nap: "asyncio.Future[None] | None" = None

    @property
    def asked(self) -> bool:
        return self.task is not None and self.servo.state not in PAUSED


class Polling:
    """One task a servo, so that one request is in flight a servo and a silent one delays nobody.

    What is left of the budget beside the background goes to wishes in proportion to the rates they ask for. Of one
    servo's rows the one longest due goes first, so a fast row never keeps a slow one waiting.
    """

    def __init__(self, asker: Asker, base: TimeBase, budget: float = BUDGET) -> None:
        """`budget` is the share of the bus all polling may take, 0..1."""
        self.budget = budget
        self._asker = asker
        self._base = base
        self._rounds: dict[Uid, _Round] = {}
        self._weigh_at: Instant = 0.0
        self._stretch = 1.0
        self._cut = 1.0

    def begin(self, servo: Servo) -> None:
        """Ask this servo regularly from now on. Its rows have just been read, so nothing is due at once."""
        found = self._rounds.setdefault(servo.uid, _Round(servo))
        if found.task is None or found.task.done():
            first = math.ceil(self._base.now()) + len(self._rounds) % SLOTS / SLOTS
            found.due = dict.fromkeys(ALWAYS, first)
            found.task = asyncio.get_running_loop().create_task(self._poll(found))

    def wish(
        self, servo: Servo, channels: list[str], rate_hz: float, *, owner: str = REST, ttl_s: float | None = None
    ) -> Grant:
        """Poll these rows at this rate as well, for `ttl_s` seconds or until replaced; an empty list ends it.

        Every owner has one wish a servo. Raises Unknown, NotInThisModel, InvalidValue. Of a servo of an unknown
        model nothing can be polled: then the grant is empty, and says so.
        """
        rows = [(key, servo.catalog.parameter(key)) for key in dict.fromkeys(channels)]
        if servo.model is None:
            note = f"Nothing of {servo.title} can be polled: its model is not known, and so not which rows it has."
            return Grant(owner, [], rate_hz, 0.0, 0.0, None, note)
        for key, row in rows:
            if key not in servo.registers:
                raise NotInThisModel(f"{servo.title} does not have {key} ({row.name}).", key=key)
            if row.kind != "number":
                raise InvalidValue(f"{key} is no number, so it is no channel.", key=key)
        now = self._base.now()
        one = self._rounds.setdefault(servo.uid, _Round(servo))
        until = None if ttl_s is None else now + ttl_s
        wish = Wish(tuple(key for key, _ in rows), rate_hz, until)
        one.wishes.put(owner, wish)
        if one.nap is not None and not one.nap.done():
            one.nap.set_result(None)
        self._weigh(now)
        return self._grant(one, owner, wish, now)

    def grants(self, servo: Servo) -> list[Grant]:
        """Every owner's wish for a servo, and what is granted of it now."""
        one = self._current(servo)
        now = self._base.now()
        return [self._grant(one, owner, wish, now) for owner, wish in one.wishes.by_owner.items()]

    def rates(self, servo: Servo) -> dict[str, float]:
        """Hz at which each wished row of a servo is polled now."""
        return {key: hz * self._cut for key, hz in self._current(servo).wishes.rates.items()}

    def background(self, servo: Servo) -> dict[str, float]:
        """Hz at which its rows are polled whether anybody wishes it or not."""
        return {key: 1 / self._background_s(key) for key in self._background(servo)}

    async def close(self) -> None:
        """End every task."""
        tasks = [one.task for one in self._rounds.values() if one.task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _current(self, servo: Servo) -> _Round:
        self._weigh(self._base.now())
        return self._rounds.get(servo.uid) or _Round(servo)

    def _grant(self, one: _Round, owner: str, wish: Wish, now: Instant) -> Grant:
        hz = {key: one.wishes.rates[key] * self._cut for key in wish.channels}
        note = None
        if wish.channels and one.servo.state in PAUSED:
            note = f"{one.servo.title} is {one.servo.state.value}; it is polled once it is ready."
        return Grant(
            owner,
            list(wish.channels),
            wish.rate_hz,
            round(min([wish.rate_hz, *hz.values()]) if hz else 0.0, 2),
            round(sum(hz.values()) * READ_S, 4),
            None if wish.until is None else round(max(0.0, wish.until - now), 3),
            note,
        )

    def _background(self, servo: Servo) -> list[str]:
        keys = [key for key in ALWAYS if key in servo.registers]
        return [*keys, *FAULT_WORDS] if servo.raw("fault_overview") else keys

    def _background_s(self, key: str) -> float:
        return ALWAYS.get(key, 1.0) * self._stretch

    def _weigh(self, now: Instant) -> None:
        """How much is asked of everybody, and so how much less often than wished; wishes that ended are dropped.

        At least once a second, and whenever a wish comes or ends or a servo is there again. A servo that is not
        asked takes nothing from others.
        """
        ends: list[Instant] = []
        for one in self._rounds.values():
            one.wishes.expire(now)
            end = one.wishes.next_end
            if end is not None:
                ends.append(end)
        self._weigh_at = min([now + WEIGH_S, *ends])
        asked = [one for one in self._rounds.values() if one.asked]
        faulty = sum(1 for one in asked if one.servo.raw("fault_overview"))
        always = len(asked) * sum(1 / period for period in ALWAYS.values()) + faulty * len(FAULT_WORDS)
        whole = self.budget / READ_S
        gently = min(STRETCH, max(1.0, always / (whole * BACKGROUND)))
        self._stretch = max(gently, always / (whole * BACKGROUND_MOST))
        wished = sum(one.wishes.total_hz for one in asked)
        left = whole - always / self._stretch
        self._cut = min(1.0, left / wished) if wished else 1.0

    async def _poll(self, one: _Round) -> None:
        paused = False
        while True:
            now = self._base.now()
            if one.servo.state in PAUSED:
                paused = True
                await asyncio.sleep(0.1)
                continue
            if paused or now >= self._weigh_at:
                paused = False
                self._weigh(now)
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
        keys = {**one.wishes.rates, **dict.fromkeys(self._background(one.servo))}
        there = [key for key in keys if key in registers]
        if not there:
            return "", now + 0.1
        key = min(there, key=lambda key: due.get(key, now))
        return key, due.get(key, now)

    async def _ask(self, one: _Round, key: str) -> None:
        servo, now = one.servo, self._base.now()
        hz = one.wishes.rates.get(key)
        period = math.inf if hz is None else 1 / (hz * self._cut)
        if key in ALWAYS or key in FAULT_WORDS:
            period = min(period, self._background_s(key))
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
