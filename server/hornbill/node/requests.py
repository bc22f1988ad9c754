"""Requests in flight: one per node, in order of priority, with retries and timeouts."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from hornbill.errors import Busy, NoResponse
from hornbill.node.hooks import Hooks
from hornbill.node.lanes import Lanes
from hornbill.units import Instant
from hornbill.wire.datatype import DataType, Kind, Structure
from hornbill.wire.transfer import Transfer

_QUARANTINE_S: Final = 2.0
"""How long the transfer ID of an unanswered try stays unused, so that a late response cannot match another request."""

_TRANSFER_IDS: Final = 32

_BATCH: Final = 4
"""Requests passed to the port at once: enough to keep the bus busy."""

_MAX_OPEN: Final = 127

_PUMP_PERIOD_S: Final = 0.001
"""How often to check whether the port is ready while nothing is received."""

_WAITS: Final = float("inf")

_STALL_S: Final = 0.01
"""A timer this late means that the event loop was blocked. The timeout is then extended once by this time."""

_Key = tuple[int, int, int]
"""Destination node, service type ID, transfer ID: what identifies a response."""


def any_response(_response: object) -> bool:
    """Accept every response: for services whose responses do not identify their request."""
    return True


@dataclass(slots=True)
class RequestCounters:
    """Counters since the participant was created. `late` responses arrived after their request had ended."""

    requests: int = 0
    responses: int = 0
    retries: int = 0
    timeouts: int = 0
    late: int = 0
    malformed: int = 0


@dataclass(slots=True, eq=False)
class _Exchange:
    """One request, from the call to its response. `sent` maps the transfer ID of every try to its time.

    `due` is when the last try times out, infinity for a queued request.
    """

    destination: int
    data_type: DataType
    response_type: type[Structure]
    payload: bytes
    priority: int
    timeout_s: float
    tries: int
    done: "asyncio.Future[Any]"
    accepts: Callable[[Any], bool]
    sent: dict[int, Instant]
    holds_lane: bool = False
    due: Instant = _WAITS
    grace: bool = False


class Requests:
    """Sends requests through `transmit` and matches responses to them.

    Each node has its own queue with one request in flight; a retry yields to more urgent requests. Requests are
    passed to the port a few at a time, the next batch when those have left: a controller sends the lowest identifier
    first, so the lowest node ID would otherwise always precede all others. Every try has its own transfer ID; a
    response to any of them counts.
    """

    def __init__(
        self,
        node_id: int,
        transmit: Callable[[Transfer, DataType], None],
        clock: Callable[[], Instant],
        is_port_idle: Callable[[], bool] = lambda: True,
    ) -> None:
        """`transmit` sends one transfer or raises. `clock` is the event loop's.

        `is_port_idle` returns whether the port has sent everything queued.
        """
        self.max_open = _MAX_OPEN
        """Limit of requests in flight. Lower if responses arrive over a slow line."""
        self.line_latency_s = self.line_response_s = 0.0
        """Response delay of a serial line, s: fixed, and per request in flight."""
        self.counters = RequestCounters()
        self.on_round_trip: Hooks[int, float] = Hooks()
        """Called for every accepted response with the node ID and the seconds from its try to the response."""
        self._node_id = node_id
        self._transmit = transmit
        self._clock = clock
        self._is_port_idle = is_port_idle
        self._lanes = Lanes[_Exchange]()
        self._pump_timer: asyncio.TimerHandle | None = None
        self._pumping = False
        self._timer: asyncio.TimerHandle | None = None
        self._open: dict[_Key, _Exchange] = {}
        self._quarantined: dict[_Key, Instant] = {}
        self._next_ids: dict[tuple[int, int], int] = {}
        self._alive: set[_Exchange] = set()
        self._held_lanes = 0

    @property
    def waiting(self) -> int:
        """Number of requests without a response, sent or queued."""
        return len(self._alive)

    async def request(
        self,
        destination: int,
        request: Structure,
        response_type: type[Structure],
        priority: int,
        timeout_s: float,
        tries: int,
        urgent: bool,
        accepts: Callable[[Any], bool] = any_response,
    ) -> Any:
        """Send a request and return the decoded response. `accepts` rejects responses to other requests.

        Raises NoResponse `timeout_s` after the last try, and the errors of `transmit`. Cancelling it frees the node
        for the next request at once.
        """
        done: asyncio.Future[Any] = asyncio.Future()
        exchange = _Exchange(
            destination,
            request.TYPE,
            response_type,
            request.encode(),
            priority,
            timeout_s,
            tries,
            done,
            accepts,
            {},
        )
        self.counters.requests += 1
        self._alive.add(exchange)
        try:
            if urgent:
                self._try(exchange)
            else:
                self._lanes.put(destination, priority, exchange)
                if not self._pumping:
                    self._pump_soon()
            return await done
        except BaseException:
            done.cancel()  # a request whose caller was cancelled is no longer sent
            self._release(exchange)
            raise

    def receive(self, transfer: Transfer) -> None:
        """Process a received response: it ends its request, or is counted and dropped."""
        _, type_id, source, _, _, transfer_id, payload, _ = transfer
        key = (source, type_id, transfer_id)
        exchange = self._open.get(key)
        if exchange is None or exchange.done.done():
            self.counters.late += 1
            self._quarantined.pop(key, None)
            return
        response = exchange.response_type.decode(payload)
        if response is None:
            self.counters.malformed += 1
            return
        if not exchange.accepts(response):
            # So late that its transfer ID is in use again. The response to this request may still arrive.
            self.counters.late += 1
            return
        self.counters.responses += 1
        sent = exchange.sent.pop(transfer_id)
        del self._open[key]
        exchange.done.set_result(response)
        # The node is free: send its next request without waiting for the caller to run.
        self._release(exchange)
        if self.on_round_trip:
            self.on_round_trip.notify(source, self._clock() - sent)

    def fail_all(self, error: Callable[[], Exception]) -> None:
        """Fail every request, sent or queued, each with its own error."""
        self._lanes.clear()
        for exchange in tuple(self._alive):
            if not exchange.done.done():
                exchange.done.set_exception(error())
            self._release(exchange)

    def pump(self, scheduled: bool = False) -> None:
        """Send the next requests if the port is ready. Call it after every received batch.

        `scheduled` is for the call scheduled by `_pump_soon`.
        """
        if scheduled:
            self._pumping = False
        if not self._lanes:
            return
        if self._is_port_idle():
            for _ in range(_BATCH):
                if self._held_lanes >= self.max_open or (exchange := self._lanes.take()) is None:
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
        """Send at the end of this loop iteration: requests sent together cost the port one wake-up."""
        if not self._pumping:
            self._pumping = True
            asyncio.get_running_loop().call_soon(self.pump, True)

    def _pump_again(self) -> None:
        self._pump_timer = None
        self.pump()

    def _try(self, exchange: _Exchange) -> None:
        """Send one try with its own transfer ID. Errors of the port are raised by `request`, not here."""
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
        exchange.due = now + exchange.timeout_s + self.line_latency_s + self.line_response_s * len(self._open)
        self._set_timer(exchange.due)

    def _set_timer(self, due: Instant) -> None:
        """Check for timed out tries at `due` at the latest.

        One shared timer, which may fire needlessly: most tries are answered, and one timer each would cost more than
        the rest of a request.
        """
        if self._timer is not None:
            if self._timer.when() <= due:
                return
            self._timer.cancel()
        self._timer = asyncio.get_running_loop().call_at(due, self._check_timeouts)

    def _check_timeouts(self) -> None:
        self._timer = None
        now = self._clock()
        for exchange in dict.fromkeys(self._open.values()):
            if exchange.due <= now and not exchange.done.done():
                self._timed_out(exchange, now)
        due = min((each.due for each in self._open.values() if not each.done.done()), default=_WAITS)
        if due != _WAITS:
            self._set_timer(due)

    def _timed_out(self, exchange: _Exchange, now: Instant) -> None:
        if now - exchange.due > _STALL_S and not exchange.grace:
            # We stalled, not the node: frames received meanwhile are delivered in the next loop iterations.
            exchange.grace = True
            exchange.due = now + _STALL_S
            return
        exchange.grace = False
        if exchange.tries > 0:
            self.counters.retries += 1
            if exchange.holds_lane and self._lanes.preempt(exchange.destination, exchange.priority, exchange):
                # Motion does not wait for all tries of a read. A late response still counts.
                exchange.holds_lane, exchange.due = False, _WAITS
                self._held_lanes -= 1
                self.pump()
                return
            self._try(exchange)
            return
        self.counters.timeouts += 1
        tried = len(exchange.sent)
        service = exchange.data_type.name.rpartition(".")[2]
        exchange.done.set_exception(
            NoResponse(
                f"Node {exchange.destination} did not respond to {service} in {tried} "
                f"{'try' if tried == 1 else 'tries'} of {exchange.timeout_s * 1000:.0f} ms. "
                "Check its power, cable and bus.",
                node_id=exchange.destination,
                service=service,
                tries=tried,
                timeout_s=exchange.timeout_s,
                cause="node_not_responding",
            )
        )
        self._release(exchange)

    def _release(self, exchange: _Exchange) -> None:
        """Discard the tries of a completed request and allow the next one for its node. Idempotent."""
        self._alive.discard(exchange)
        if exchange.sent:
            now = self._clock()
            for transfer_id in exchange.sent:
                key = (exchange.destination, exchange.data_type.id, transfer_id)
                self._open.pop(key, None)
                self._quarantined[key] = now + _QUARANTINE_S
            exchange.sent.clear()
        if exchange.holds_lane:
            exchange.holds_lane = False
            self._held_lanes -= 1
            self._lanes.free(exchange.destination)
            if self._lanes:
                self._pump_soon()

    def _next_transfer_id(self, destination: int, type_id: int, now: Instant) -> int:
        """The next of the 32 transfer IDs that is neither in use nor quarantined. Raises Busy."""
        # After reopening the bus, a new participant must not start with the same ID: a node that remembers it would
        # treat the request as a repetition and not respond.
        start = self._next_ids.get((destination, type_id))
        if start is None:
            start = int(now * 1000)
        spare: int | None = None
        for step in range(_TRANSFER_IDS):
            candidate = (start + step) % _TRANSFER_IDS
            key = (destination, type_id, candidate)
            if key in self._open:
                continue
            if self._quarantined.get(key, now) <= now:
                self._quarantined.pop(key, None)
                break
            spare = candidate if spare is None else spare
        else:
            if spare is None:
                raise Busy(
                    f"{_TRANSFER_IDS} requests to node {destination} are waiting for a response, which is the limit. "
                    "Retry when one has completed.",
                    node_id=destination,
                    cause="too_many_requests",
                )
            candidate = spare
            self._quarantined.pop((destination, type_id, candidate), None)
        self._next_ids[destination, type_id] = (candidate + 1) % _TRANSFER_IDS
        return candidate
