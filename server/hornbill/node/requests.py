"""The requests under way: one per node, in order of priority, repeated and given up on time."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

from hornbill.errors import Busy, NoResponse
from hornbill.node.hooks import Hooks
from hornbill.node.lanes import Lanes
from hornbill.units import Instant
from hornbill.wire.datatype import DataType, Kind, Structure
from hornbill.wire.transfer import Transfer

_QUARANTINE_S: Final = 2.0
"""How long the transfer id of an unanswered try rests, so that a late answer finds no stranger."""

_TRANSFER_IDS: Final = 32

_AT_A_TIME: Final = 4
"""Requests given to the port in one go: enough that the bus never waits for us."""

_MOST_OPEN: Final = 127

_PUMP_PERIOD_S: Final = 0.001
"""How often to look whether the port is ready, when nothing is heard from the bus."""

_WAITS: Final = float("inf")

_STALL_S: Final = 0.01
"""A timer that rings later than this says that the loop was busy elsewhere; so much is then added once."""

_Key = tuple[int, int, int]
"""Node asked, service type id, transfer id: what an answer is recognised by."""


def anything(_answer: object) -> bool:
    """For services whose answers do not say to what they are one."""
    return True


@dataclass(slots=True)
class RequestCounters:
    """Since the participant was made. `late` answers are those nobody waits for any more."""

    requests: int = 0
    answers: int = 0
    repeats: int = 0
    unanswered: int = 0
    late: int = 0
    malformed: int = 0


@dataclass(slots=True, eq=False)
class _Exchange:
    """One request, from the call to its answer. `sent` holds the transfer id and instant of every try.

    `due` is the instant after which the last try counts as unanswered, infinity for one that waits for its turn.
    """

    destination: int
    data_type: DataType
    answer_type: type[Structure]
    payload: bytes
    priority: int
    patience_s: float
    tries: int
    done: "asyncio.Future[Any]"
    fits: Callable[[Any], bool]
    holds_lane: bool = False
    sent: dict[int, Instant] = field(default_factory=dict[int, Instant])
    due: Instant = _WAITS
    grace: bool = False


class Requests:
    """Sends requests through `transmit` and pairs the answers with them.

    Each node has its own queue, of which one request is on its way; one that is repeated lets the more urgent
    go first. Of many nodes a few at a time are asked,
    the next ones when those requests are out: a controller sends the lowest identifier first, so the lowest
    node id would otherwise always go before all others. An answer counts whichever try it belongs to; every
    try has a transfer id of its own.
    """

    def __init__(
        self,
        node_id: int,
        transmit: Callable[[Transfer, DataType], None],
        clock: Callable[[], Instant],
        is_port_idle: Callable[[], bool] = lambda: True,
    ) -> None:
        """`transmit` sends one transfer or raises; `clock` is the event loop's.

        `is_port_idle` says whether everything handed to the port is out.
        """
        self.most_open = _MOST_OPEN
        """How many requests may be on their way at once; fewer where answers come over a slow line."""
        self.line_latency_s = self.line_answer_s = 0.0
        """What a serial line adds to the time until an answer: by itself, and for each request on its way."""
        self.counters = RequestCounters()
        self.on_round_trip: Hooks[int, float] = Hooks()
        """Called with the node and the seconds from sending to answer of every try that was answered."""
        self._node_id = node_id
        self._transmit = transmit
        self._clock = clock
        self._is_port_idle = is_port_idle
        self._lanes = Lanes[_Exchange]()
        self._pump_timer: asyncio.TimerHandle | None = None
        self._pumping = False
        self._alarm: asyncio.TimerHandle | None = None
        self._open: dict[_Key, _Exchange] = {}
        self._unanswered: dict[_Key, Instant] = {}
        self._next_ids: dict[tuple[int, int], int] = {}
        self._alive: set[_Exchange] = set()
        self._held_lanes = 0

    @property
    def waiting(self) -> int:
        """How many requests have no answer yet, sent or not."""
        return len(self._alive)

    async def ask(
        self,
        destination: int,
        request: Structure,
        answer_type: type[Structure],
        *,
        priority: int,
        patience_s: float,
        tries: int,
        urgent: bool,
        fits: Callable[[Any], bool] = anything,
    ) -> Any:
        """The decoded answer, of which `fits` says whether it can be one to this request.

        Raises NoResponse `patience_s` after the last try, and what `transmit` raises. Cancelling it frees the node for
        the next request at once.
        """
        done: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        exchange = _Exchange(
            destination,
            request.TYPE,
            answer_type,
            request.encode(),
            priority,
            patience_s,
            tries,
            done,
            fits,
        )
        self.counters.requests += 1
        self._alive.add(exchange)
        try:
            if urgent:
                self._try(exchange)
            else:
                self._lanes.put(destination, priority, exchange)
                self._pump_soon()
            return await done
        finally:
            self._finish(exchange)

    def answered(self, transfer: Transfer) -> None:
        """Take a response from the bus: it ends the request it belongs to, or is counted and dropped."""
        key = (transfer.source, transfer.type_id, transfer.transfer_id)
        exchange = self._open.get(key)
        if exchange is None or exchange.done.done():
            self.counters.late += 1
            self._unanswered.pop(key, None)
            return
        answer = exchange.answer_type.decode(transfer.payload)
        if answer is None:
            self.counters.malformed += 1
            return
        if not exchange.fits(answer):
            # So late that its transfer id has come round: the answer to this request may still come.
            self.counters.late += 1
            return
        self.counters.answers += 1
        sent = exchange.sent.pop(transfer.transfer_id)
        del self._open[key]
        exchange.done.set_result(answer)
        # The node is free now; its next request need not wait until the caller runs.
        self._release(exchange)
        if self.on_round_trip:
            self.on_round_trip.tell(transfer.source, self._clock() - sent)

    def fail_all(self, error: Callable[[], Exception]) -> None:
        """End every request, sent or queued, each with an error of its own."""
        self._lanes.clear()
        for exchange in tuple(self._alive):
            if not exchange.done.done():
                exchange.done.set_exception(error())
            self._release(exchange)

    def pump(self, scheduled: bool = False) -> None:
        """Send the next few requests, if the port is ready for them. Call it whenever the bus has moved.

        `scheduled` is for the call that `_pump_soon` has put on the loop.
        """
        if scheduled:
            self._pumping = False
        if not self._lanes:
            return
        if self._is_port_idle():
            for _ in range(_AT_A_TIME):
                if self._held_lanes >= self.most_open or (exchange := self._lanes.take()) is None:
                    break
                exchange.holds_lane = True
                self._held_lanes += 1
                if exchange.done.done():
                    self._release(exchange)
                else:
                    self._try(exchange)
        if self._lanes and self._pump_timer is None:
            self._pump_timer = asyncio.get_running_loop().call_later(_PUMP_PERIOD_S, self._pump_again)

    def _pump_soon(self) -> None:
        """When everybody who is about to ask has asked: what is sent together costs the port one wake-up."""
        if not self._pumping:
            self._pumping = True
            asyncio.get_running_loop().call_soon(self.pump, True)

    def _pump_again(self) -> None:
        self._pump_timer = None
        self.pump()

    def _try(self, exchange: _Exchange) -> None:
        """Send one try, under a transfer ID of its own. What the port refuses is raised by `ask`, not here."""
        now = self._clock()
        destination, data_type = exchange.destination, exchange.data_type
        try:
            transfer_id = self._next_transfer_id(destination, data_type.id, now)
            self._transmit(
                Transfer(
                    Kind.REQUEST,
                    data_type.id,
                    self._node_id,
                    destination,
                    exchange.priority,
                    transfer_id,
                    exchange.payload,
                ),
                data_type,
            )
        except Exception as error:
            self._release(exchange)
            if not exchange.done.done():
                exchange.done.set_exception(error)
            return
        exchange.tries -= 1
        exchange.sent[transfer_id] = now
        self._open[destination, data_type.id, transfer_id] = exchange
        exchange.due = now + exchange.patience_s + self.line_latency_s + self.line_answer_s * len(self._open)
        self._ring_at(exchange.due)

    def _ring_at(self, due: Instant) -> None:
        """Look for unanswered tries at `due` at the latest.

        One alarm for all of them, which may ring in vain: most are answered, and a timer each would cost more than
        all else a request needs.
        """
        if self._alarm is not None:
            if self._alarm.when() <= due:
                return
            self._alarm.cancel()
        self._alarm = asyncio.get_running_loop().call_at(due, self._ring)

    def _ring(self) -> None:
        self._alarm = None
        now = self._clock()
        for exchange in dict.fromkeys(self._open.values()):
            if exchange.due <= now and not exchange.done.done():
                self._timed_out(exchange, now)
        due = min((each.due for each in self._open.values() if not each.done.done()), default=_WAITS)
        if due != _WAITS:
            self._ring_at(due)

    def _timed_out(self, exchange: _Exchange, now: Instant) -> None:
        if now - exchange.due > _STALL_S and not exchange.grace:
            # We were held up, not the node: what came meanwhile is delivered in the turns of the loop that follow.
            exchange.grace = True
            exchange.due = now + _STALL_S
            return
        exchange.grace = False
        if exchange.tries > 0:
            self.counters.repeats += 1
            if exchange.holds_lane and self._lanes.give_way(exchange.destination, exchange.priority, exchange):
                # Motion does not wait for all the tries of a read. An answer that is late still counts.
                exchange.holds_lane, exchange.due = False, _WAITS
                self._held_lanes -= 1
                self.pump()
                return
            self._try(exchange)
            return
        self.counters.unanswered += 1
        tried = len(exchange.sent)
        service = exchange.data_type.name.rpartition(".")[2]
        exchange.done.set_exception(
            NoResponse(
                f"Node {exchange.destination} did not answer {service} in {tried} "
                f"{'try' if tried == 1 else 'tries'} of {exchange.patience_s * 1000:.0f} ms. "
                "Check its power, its cable and the bus.",
                node_id=exchange.destination,
                service=service,
                tries=tried,
                timeout_s=exchange.patience_s,
                cause="silent_node",
            )
        )
        self._release(exchange)

    def _finish(self, exchange: _Exchange) -> None:
        self._alive.discard(exchange)
        exchange.done.cancel()  # a request whose caller was cancelled is not sent any more
        if exchange.sent or exchange.holds_lane:
            self._release(exchange)

    def _release(self, exchange: _Exchange) -> None:
        """Forget the tries of an ended request and let the next one for its node go. Twice is harmless."""
        if exchange.sent:
            now = self._clock()
            for transfer_id in exchange.sent:
                key = (exchange.destination, exchange.data_type.id, transfer_id)
                self._open.pop(key, None)
                self._unanswered[key] = now + _QUARANTINE_S
            exchange.sent.clear()
        if exchange.holds_lane:
            exchange.holds_lane = False
            self._held_lanes -= 1
            self._lanes.free(exchange.destination)
            if self._lanes:
                self._pump_soon()

    def _next_transfer_id(self, destination: int, type_id: int, now: Instant) -> int:
        """The next of the 32 that no open request has and no late answer may still bring. Raises Busy."""
        # A participant made anew right after another (the bus was opened again) must not begin with the same
        # number: a node that remembers it would take the request for a repetition and stay silent.
        start = self._next_ids.get((destination, type_id), int(now * 1000))
        spare: int | None = None
        for step in range(_TRANSFER_IDS):
            candidate = (start + step) % _TRANSFER_IDS
            key = (destination, type_id, candidate)
            if key in self._open:
                continue
            if self._unanswered.get(key, now) <= now:
                self._unanswered.pop(key, None)
                break
            spare = candidate if spare is None else spare
        else:
            if spare is None:
                raise Busy(
                    f"{_TRANSFER_IDS} requests to node {destination} wait for an answer, and no more can. "
                    "Ask again when one has been answered.",
                    node_id=destination,
                    cause="too_many_requests",
                )
            candidate = spare
            self._unanswered.pop((destination, type_id, candidate), None)
        self._next_ids[destination, type_id] = (candidate + 1) % _TRANSFER_IDS
        return candidate
