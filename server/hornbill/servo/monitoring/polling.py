"""Polling: which rows are active for regularly, how often, and what the bus allows of it."""

import asyncio
import logging
import math
from dataclasses import dataclass, field

from hornbill.domain.note import Note
from hornbill.domain.servo import TelemetryGrant
from hornbill.errors import HornbillError, InvalidValue, NoResponse, NotInThisModel, PortError, Refused
from hornbill.servo.device.requests import POLL, ServoRequests
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.monitoring.line_budget import LineBudget
from hornbill.servo.monitoring.poll_rates import DEFAULT_OWNER, PollRate, PollRates
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Uid

log = logging.getLogger(__name__)

READ_S = 556e-6
"""Bus time of one read by name at 1 Mbit/s, request and three frames of answer: 534 to 555 bits with real stuffing,
by row, value and node. The longest is reckoned with, so that the budget holds whatever is read."""

BUDGET = 0.40
"""Share of the bus all polling together may take, unless set otherwise. What servos say unasked (Status, NodeStatus:
0.26 % a servo) is no polling and comes on top."""

BACKGROUND = 0.5
"""Share of the budget above which what every servo is active for is active less often, but never less than STRETCH
times so, unless it would take more than BACKGROUND_MOST of the budget."""

STRETCH = 2.0
"""So that a reading is never stale for want of a poll: see LIVE_PERIOD_S of reading.py."""

BACKGROUND_MOST = 0.9

FAULT_WORDS_S = 1.0
"""Period at which the fault words are active for while the overview is not zero (B52)."""

SCHEDULE_S = 1.0
SLOTS = 20
"""Parts of a second in which servos are active in turn, so that a crowd fills the bus evenly; those of one part are
active together, because frames that come together cost the process less than frames that come one by one."""

PAUSED = frozenset((State.OFFLINE, State.IDENTIFYING, State.SAVING, State.RESTARTING, State.UPDATING))


@dataclass(slots=True)
class _Round:
    servo: Servo
    requested: PollRates = field(default_factory=PollRates)
    due: dict[str, Instant] = field(default_factory=dict[str, Instant])
    task: asyncio.Task[None] | None = None
    sleeping: "asyncio.Future[None] | None" = None
    paused: bool = False

    @property
    def active(self) -> bool:
        return self.task is not None and self.servo.state not in PAUSED


class Polling:
    """One task a servo, so that one request is in flight a servo and a silent one delays nobody.

    What is left of the budget beside the background goes to requested in proportion to the rates they ask for. Of one
    servo's rows the one longest due goes first, so a fast row never keeps a slow one waiting.
    """

    def __init__(
        self, requests: ServoRequests, base: TimeBase, budget: float = BUDGET, line: LineBudget | None = None
    ) -> None:
        """`budget` is the share of the bus all polling may take, 0..1, and of the serial line of a serial adapter."""
        self.budget = budget
        self._line = line or LineBudget(lambda: None)
        self._reads = 0
        self._requests = requests
        self._base = base
        self._rounds: dict[Uid, _Round] = {}
        self._schedule_at: Instant = 0.0
        self._stretch = 1.0
        self._scale = 1.0

    @property
    def cap(self) -> float:
        """The share of the bus that polling keeps within now: less than `budget` where a serial line is slower."""
        return min(self.budget, self._capacity(self._base.now()) * READ_S)

    def _capacity(self, now: Instant) -> float:
        """Reads per second that all polling may do, by the slower of the bus and the serial line."""
        servos = sum(1 for one in self._rounds.values() if one.active)
        return min(self.budget / READ_S, self._line.reads_per_s(self.budget, servos, self._reads, now))

    def begin(self, servo: Servo) -> None:
        """Ask this servo regularly from now on. Its rows have just been read, so nothing is due at once."""
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
        """Poll these rows at this rate as well, for `ttl_s` seconds or until replaced; an empty list ends it.

        Every owner has one request a servo. Raises Unknown, NotInThisModel, InvalidValue. Of a servo that has not said
        yet what it is nothing can be polled: then the grant is empty, and says so.
        """
        rows = [(key, servo.catalog.parameter(key)) for key in dict.fromkeys(channels)]
        if not servo.registers:
            note = (
                f"Nothing of {servo.title} can be polled: it has not said yet what it is, and so not which rows it has."
            )
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
                raise InvalidValue(f"{key} is no number, so it is no channel.", key=key, cause="channel_not_numeric")
        now = self._base.now()
        one = self._rounds.setdefault(servo.uid, _Round(servo))
        until = None if ttl_s is None else now + ttl_s
        request = PollRate(tuple(key for key, _ in rows), rate_hz, until)
        one.requested.put(owner, request)
        if one.sleeping is not None and not one.sleeping.done():
            one.sleeping.set_result(None)
        self._schedule(now)
        return self._grant(one, owner, request, now)

    def grants(self, servo: Servo) -> list[TelemetryGrant]:
        """Every owner's request for a servo, and what is granted of it now."""
        one = self._current(servo)
        now = self._base.now()
        return [self._grant(one, owner, request, now) for owner, request in one.requested.by_owner.items()]

    def rates(self, servo: Servo) -> dict[str, float]:
        """Hz at which each requested_hz row of a servo is polled now."""
        return {key: hz * self._scale for key, hz in self._current(servo).requested.rates.items()}

    def background(self, servo: Servo) -> dict[str, float]:
        """Hz at which its rows are polled whether anybody requested it or not."""
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

    def _grant(self, one: _Round, owner: str, request: PollRate, now: Instant) -> TelemetryGrant:
        hz = {key: one.requested.rates[key] * self._scale for key in request.channels}
        note = None
        if request.channels and one.servo.state in PAUSED:
            title, state = one.servo.title, one.servo.state.value
            text = f"{title} is {state}; it is polled once it is ready."
            note = Note(text, "polled_when_ready", {"servo": title, "state": state})
        return TelemetryGrant(
            owner=owner,
            channels=list(request.channels),
            requested_hz=request.rate_hz,
            granted_hz=round(min([request.rate_hz, *hz.values()]) if hz else 0.0, 2),
            bus_share=round(sum(hz.values()) * READ_S, 4),
            expires_in_s=None if request.until is None else round(max(0.0, request.until - now), 3),
            note=None if note is None else note.text,
            note_code=None if note is None else note.code,
            note_params={} if note is None else note.params,
        )

    @staticmethod
    def _background(servo: Servo) -> dict[str, float]:
        """The rows active for without a request, and their periods in seconds while the budget allows them."""
        rows = {key: period for key, period in servo.catalog.polled.items() if key in servo.registers}
        return rows | dict.fromkeys(servo.catalog.fault_words, FAULT_WORDS_S) if servo.raw("fault_overview") else rows

    def _schedule(self, now: Instant) -> None:
        """How much is active of everybody, and so how much less often than requested_hz; requested that ended are dropped.

        At least once a second, and whenever a request comes or ends or a servo is there again. A servo that is not
        active takes nothing from others.
        """
        ends: list[Instant] = []
        for one in self._rounds.values():
            one.requested.expire(now)
            end = one.requested.next_end
            if end is not None:
                ends.append(end)
        self._schedule_at = min([now + SCHEDULE_S, *ends])
        active = [one for one in self._rounds.values() if one.active]
        always = sum(1 / period for one in active for period in self._background(one.servo).values())
        capacity = self._capacity(now)
        gently = min(STRETCH, max(1.0, always / (capacity * BACKGROUND)))
        self._stretch = max(gently, always / (capacity * BACKGROUND_MOST))
        requested_hz = sum(one.requested.total_hz for one in active)
        left = capacity - always / self._stretch
        self._scale = min(1.0, left / requested_hz) if requested_hz else 1.0

    async def _poll(self, one: _Round) -> None:
        one.paused = False
        while True:
            try:
                await self._turn(one)
            except Exception:  # a defect of ours, or of a listener: this servo must not go stale for it
                log.exception("polling %s failed; it goes on", one.servo.title)
                await asyncio.sleep(SCHEDULE_S)

    async def _turn(self, one: _Round) -> None:
        """Wait for what is due next, or poll it."""
        now = self._base.now()
        if one.servo.state in PAUSED:
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
        """Until something is due, or a new request."""
        loop = asyncio.get_running_loop()
        one.sleeping = sleeping = loop.create_future()
        alarm = loop.call_later(seconds, lambda: sleeping.done() or sleeping.set_result(None))
        try:
            await sleeping
        finally:
            alarm.cancel()

    def _next(self, one: _Round, now: Instant) -> tuple[str, Instant]:
        registers, due = one.servo.registers, one.due
        keys = {**one.requested.rates, **self._background(one.servo)}
        there = [key for key in keys if key in registers]
        if not there:
            return "", now + 0.1
        key = min(there, key=lambda key: due.get(key, now))
        return key, due.get(key, now)

    async def _read(self, one: _Round, key: str) -> None:
        servo, now = one.servo, self._base.now()
        hz = one.requested.rates.get(key)
        period = math.inf if hz is None else 1 / (hz * self._scale)
        period = min(period, self._background(servo).get(key, math.inf) * self._stretch)
        # the next slot follows from the last one, so the rate holds; slots that were missed are not caught up
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
        """The overview says nothing is left: read the word once more, so that it does not stay set for ever."""
        try:
            await self._requests.read(one.servo, one.servo.registers[word].parameter, POLL)
        except (NoResponse, Refused, PortError) as error:
            log.debug("%s: %s: %s", one.servo.title, word, error)
