"""Polling: which rows are read regularly, and how often, within the bus budget."""

import asyncio
import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, field

from hornbill.domain.note import Note
from hornbill.domain.servo import TelemetryGrant
from hornbill.errors import HornbillError, InvalidValue, NoResponse, NotInThisModel, PortError, Refused
from hornbill.servo.device.requests import POLL, ServoRequests
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.monitoring.line_budget import LineBudget
from hornbill.servo.monitoring.subscriptions import DEFAULT_OWNER, Subscription, Subscriptions
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Uid

log = logging.getLogger(__name__)

READ_S = 556e-6
"""Bus time of one read by name at 1 Mbit/s, request and three response frames: 534 to 555 bits with real stuffing,
depending on row, value and node. The longest is used, so that the budget is never exceeded."""

BUDGET = 0.40
"""Default share of the bus for all polling. Broadcasts of servos (Status, NodeStatus: 0.26 % per servo) come on top."""

GUEST_FPS = 200
"""Limit of all reads as guest, frames per second: 2.8 % of the bus."""

READ_FRAMES = 4
"""Frames of one read by name: the request and three frames of the response."""

BACKGROUND = 0.5
"""Share of the budget above which background polling slows down, by at most STRETCH unless it would take more than
MAX_BACKGROUND of the budget."""

STRETCH = 2.0
"""Limit of slowing down, so that readings do not become stale: see LIVE_PERIOD_S in reading.py."""

MAX_BACKGROUND = 0.9

FAULT_WORDS_S = 1.0
"""Polling period of the fault words while the overview is not zero (B52)."""

SCHEDULE_S = 1.0
SLOTS = 20
"""Slots per second among which servos are distributed, so that many servos load the bus evenly. Servos in one slot are
read together, because frames that arrive together cost less CPU time."""

PAUSED = frozenset((State.OFFLINE, State.IDENTIFYING, State.SAVING, State.RESTARTING, State.UPDATING))


@dataclass(slots=True)
class _Round:
    servo: Servo
    subscriptions: Subscriptions = field(default_factory=Subscriptions)
    due: dict[str, Instant] = field(default_factory=dict[str, Instant])
    task: asyncio.Task[None] | None = None
    sleeping: "asyncio.Future[None] | None" = None
    paused: bool = False

    @property
    def active(self) -> bool:
        return self.task is not None and self.servo.state not in PAUSED


class Polling:
    """Polls servos with one task each: one request in flight per servo, and an unresponsive servo delays no other.

    The budget left by background polling is distributed to subscriptions in proportion to their requested rates. Among
    the rows of a servo, the one longest overdue goes first, so a fast row never delays a slow one.
    """

    def __init__(
        self,
        requests: ServoRequests,
        base: TimeBase,
        budget: float = BUDGET,
        line: LineBudget | None = None,
        watched: Callable[[], bool] = lambda: True,
    ) -> None:
        """`budget`: share of the bus, and of a serial adapter's line, available to all polling, 0..1.

        While nobody has `watched` the servos, background polling is slowed down by STRETCH: readings stay fresh.
        """
        self.budget = budget
        self._line = line or LineBudget(lambda: None)
        self._reads = 0
        self._requests = requests
        self._watched = watched
        self._base = base
        self._rounds: dict[Uid, _Round] = {}
        self._schedule_at: Instant = 0.0
        self._stretch = 1.0
        self._scale = 1.0

    @property
    def cap(self) -> float:
        """Current limit of polling as a share of the bus. Below `budget` if a serial line is slower."""
        return min(self.budget, self._capacity(self._base.now()) * READ_S)

    def _capacity(self, now: Instant) -> float:
        """Maximum reads per second of all polling, limited by the slower of bus and serial line."""
        servos = sum(1 for one in self._rounds.values() if one.active)
        reads_per_s = min(self.budget / READ_S, self._line.reads_per_s(self.budget, servos, self._reads, now))
        interval_s = self._requests.read_interval_s
        return min(reads_per_s, 1 / interval_s) if interval_s else reads_per_s

    def begin(self, servo: Servo) -> None:
        """Start polling a servo. Its rows have just been read, so nothing is due immediately."""
        found = self._rounds.setdefault(servo.uid, _Round(servo))
        if found.task is None or found.task.done():
            first = math.ceil(self._base.now()) + len(self._rounds) % SLOTS / SLOTS
            found.due = dict.fromkeys(servo.catalog.polled, first)
            found.task = asyncio.get_running_loop().create_task(self._poll(found))

    def subscribe(
        self,
        servo: Servo,
        channels: list[str],
        rate_hz: float,
        *,
        owner: str = DEFAULT_OWNER,
        ttl_s: float | None = None,
    ) -> TelemetryGrant:
        """Poll these rows at this rate for `ttl_s` seconds, or until replaced. An empty list ends the subscription.

        Each owner has one subscription per servo. Raises Unknown, NotInThisModel, InvalidValue. A servo that has not
        been identified cannot be polled: the grant is empty, with a note.
        """
        rows = [(key, servo.catalog.parameter(key)) for key in dict.fromkeys(channels)]
        if not servo.registers:
            note = f"{servo.title} has not been identified yet, so it cannot be polled."
            return TelemetryGrant(
                owner=owner, channels=[], requested_hz=rate_hz, granted_hz=0.0, bus_share=0.0,
                note=note, note_code="not_pollable_yet", note_params={"servo": servo.title},
            )  # fmt: skip
        for key, row in rows:
            if key not in servo.registers:
                raise NotInThisModel(
                    f"{servo.title} does not have {key} ({row.name}).",
                    key=key,
                    cause="row_not_in_servo",
                    servo=servo.title,
                )
            if row.kind != "number":
                raise InvalidValue(
                    f"{key} is not numeric, so it cannot be a channel.", key=key, cause="channel_not_numeric"
                )
        now = self._base.now()
        one = self._rounds.setdefault(servo.uid, _Round(servo))
        until = None if ttl_s is None else now + ttl_s
        subscription = Subscription(tuple(key for key, _ in rows), rate_hz, until)
        one.subscriptions.put(owner, subscription)
        if one.sleeping is not None and not one.sleeping.done():
            one.sleeping.set_result(None)
        self._schedule(now)
        return self._grant(one, owner, subscription, now)

    def grants(self, servo: Servo) -> list[TelemetryGrant]:
        """Subscriptions to a servo, each with its currently granted rate."""
        one = self._current(servo)
        now = self._base.now()
        return [
            self._grant(one, owner, subscription, now) for owner, subscription in one.subscriptions.by_owner.items()
        ]

    def rates(self, servo: Servo) -> dict[str, float]:
        """Current polling rate of each subscribed row, Hz."""
        return {key: hz * self._scale for key, hz in self._current(servo).subscriptions.rates.items()}

    def background(self, servo: Servo) -> dict[str, float]:
        """Background polling rate of each row, Hz, independent of subscriptions."""
        return {key: 1 / (period * self._stretch) for key, period in self._background(servo).items()}

    async def close(self) -> None:
        """End every task."""
        tasks = [one.task for one in self._rounds.values() if one.task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _current(self, servo: Servo) -> _Round:
        self._schedule(self._base.now())
        return self._rounds.get(servo.uid) or _Round(servo)

    def _grant(self, one: _Round, owner: str, subscription: Subscription, now: Instant) -> TelemetryGrant:
        hz = {key: one.subscriptions.rates[key] * self._scale for key in subscription.channels}
        note = None
        if subscription.channels and one.servo.state in PAUSED:
            title, state = one.servo.title, one.servo.state.value
            text = f"{title} is {state}; polling resumes once it is ready."
            note = Note(text, "polled_when_ready", {"servo": title, "state": state})
        if subscription.channels and self._requests.silent:
            text = "As observer, hornbill requests nothing, so nothing is polled."
            note = Note(text, "not_polled_as_observer")
        return TelemetryGrant(
            owner=owner,
            channels=list(subscription.channels),
            requested_hz=subscription.rate_hz,
            granted_hz=round(min([subscription.rate_hz, *hz.values()]) if hz else 0.0, 2),
            bus_share=round(sum(hz.values()) * READ_S, 4),
            expires_in_s=None if subscription.until is None else round(max(0.0, subscription.until - now), 3),
            note=None if note is None else note.text,
            note_code=None if note is None else note.code,
            note_params={} if note is None else note.params,
        )

    @staticmethod
    def _background(servo: Servo) -> dict[str, float]:
        """Rows polled without a subscription, and their periods in seconds if the budget allows."""
        rows = {key: period for key, period in servo.catalog.polled.items() if key in servo.registers}
        return rows | dict.fromkeys(servo.catalog.fault_words, FAULT_WORDS_S) if servo.raw("fault_overview") else rows

    def _schedule(self, now: Instant) -> None:
        """Compute how far background and subscribed rates must be reduced; drop expired subscriptions.

        Called at least once a second, and whenever a subscription starts or ends or a servo is back. An inactive servo
        uses no budget.
        """
        ends: list[Instant] = []
        for one in self._rounds.values():
            one.subscriptions.expire(now)
            end = one.subscriptions.next_end
            if end is not None:
                ends.append(end)
        self._schedule_at = min([now + SCHEDULE_S, *ends])
        active = [one for one in self._rounds.values() if one.active]
        always = sum(1 / period for one in active for period in self._background(one.servo).values())
        capacity = self._capacity(now)
        gently = min(STRETCH, max(1.0, always / (capacity * BACKGROUND))) if self._watched() else STRETCH
        self._stretch = max(gently, always / (capacity * MAX_BACKGROUND))
        requested_hz = sum(one.subscriptions.total_hz for one in active)
        left = capacity - always / self._stretch
        self._scale = min(1.0, left / requested_hz) if requested_hz else 1.0

    async def _poll(self, one: _Round) -> None:
        one.paused = False
        while True:
            try:
                await self._turn(one)
            except Exception:  # a bug here or in a subscriber must not make this servo stale
                log.exception("polling %s failed; polling continues", one.servo.title)
                await asyncio.sleep(SCHEDULE_S)

    async def _turn(self, one: _Round) -> None:
        """Poll the next row, or wait until it is due."""
        now = self._base.now()
        if one.servo.state in PAUSED or self._requests.silent:
            one.paused = True
            await asyncio.sleep(0.1)
            return
        if one.paused or now >= self._schedule_at:
            one.paused = False
            self._schedule(now)
        key, at = self._next(one, now)
        if at > now:
            await self._sleep(one, at - now)
        else:
            await self._read(one, key)

    async def _sleep(self, one: _Round, seconds: float) -> None:
        """Sleep until a row is due or a subscription changes."""
        loop = asyncio.get_running_loop()
        one.sleeping = sleeping = loop.create_future()
        alarm = loop.call_later(seconds, lambda: sleeping.done() or sleeping.set_result(None))
        try:
            await sleeping
        finally:
            alarm.cancel()

    def _next(self, one: _Round, now: Instant) -> tuple[str, Instant]:
        registers, due = one.servo.registers, one.due
        keys = {**one.subscriptions.rates, **self._background(one.servo)}
        there = [key for key in keys if key in registers]
        if not there:
            return "", now + 0.1
        key = min(there, key=lambda key: due.get(key, now))
        return key, due.get(key, now)

    async def _read(self, one: _Round, key: str) -> None:
        servo, now = one.servo, self._base.now()
        hz = one.subscriptions.rates.get(key)
        period = math.inf if hz is None else 1 / (hz * self._scale)
        period = min(period, self._background(servo).get(key, math.inf) * self._stretch)
        # the next slot follows from the last one, so the rate is kept; missed slots are not made up for
        one.due[key] = max(one.due.get(key, now) + period, now)
        self._reads += 1
        try:
            raw = await self._requests.read(servo, servo.registers[key].parameter, POLL)
        except (NoResponse, Refused, PortError, KeyError) as error:
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
            for word in servo.catalog.fault_words:
                if servo.raw(word):
                    one.due[word] = 0.0
                    await self._clear(one, word)

    async def _clear(self, one: _Round, word: str) -> None:
        """Read a fault word once more when the overview is zero, so that it does not stay set."""
        try:
            await self._requests.read(one.servo, one.servo.registers[word].parameter, POLL)
        except (NoResponse, Refused, PortError) as error:
            log.debug("%s: %s: %s", one.servo.title, word, error)
