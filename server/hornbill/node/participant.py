"""Hornbill as one node of a DroneCAN bus."""

import asyncio
import logging
from collections.abc import Callable, Coroutine, Sequence
from dataclasses import dataclass
from typing import Any, Final, NoReturn, TypeVar, overload

from hornbill.errors import BusDisconnected
from hornbill.node.backlog import Backlog
from hornbill.node.hooks import Hooks
from hornbill.node.presence import Presence
from hornbill.node.requests import RequestCounters, Requests, any_response
from hornbill.node.shared_id import SharedNodeId
from hornbill.node.subscriptions import Subscriptions
from hornbill.units import Instant
from hornbill.wire.datatype import DataType, Kind, Structure
from hornbill.wire.frame import Frame
from hornbill.wire.port import REPLAYS, CanPort, PortState, not_connected
from hornbill.wire.reassembly import Reassembler, ReassemblyCounters
from hornbill.wire.services import (
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetNodeInfoRequest,
    GetNodeInfoResponse,
    GetSetRequest,
    GetSetResponse,
    RestartNodeRequest,
    RestartNodeResponse,
    SoftwareVersion,
)
from hornbill.wire.transfer import Transfer, split

log = logging.getLogger(__name__)

M = TypeVar("M", bound=Structure)

LINE_RESPONSES_S: Final = 0.025
"""Serial line time allowed for the responses to all requests in flight. Well within a timeout, and within the buffer of
an adapter even if some are GetNodeInfo responses, which are four times as long."""
RESPONSE_BYTES: Final = 77
"""Bytes of a GetSet response on a serial line, with the acknowledgement of its request. A write takes about as many."""
LINE_LATENCY_S: Final = 0.02
"""Delay of a USB serial chip that does not report its latency: 16 ms for FTDI chips."""

STATUS_PRIORITY: Final = 24
"""Priority of our own NodeStatus: below everything a servo broadcasts."""

FIRST_REQUEST_PRIORITY: Final = 16
"""Responses have the priority of their request and must not overtake what servos broadcast at 16."""

_STATUS_PERIOD_S: Final = 1.0
_PORT_CHECK_PERIOD_S: Final = 0.05
# Not a set: hashing an enum takes longer than comparing with the most frequent state.
_OPEN_STATES: Final = (PortState.ACTIVE, PortState.PASSIVE, PortState.BUS_OFF)
_NODE_INFO: Final = GetNodeInfoRequest.TYPE
_RESPONSES: Final[dict[int, type[Structure]]] = {
    _NODE_INFO.id: GetNodeInfoResponse,
    RestartNodeRequest.TYPE.id: RestartNodeResponse,
    ExecuteOpcodeRequest.TYPE.id: ExecuteOpcodeResponse,
    GetSetRequest.TYPE.id: GetSetResponse,
}


@dataclass(slots=True)
class ParticipantCounters:
    """Counters since the participant was created."""

    transfers: int = 0


class Participant:
    """One node on one CanPort. Everything runs on the event loop; only `request` and `close` are awaited.

    Closing the participant does not close the port. When the port is lost, every pending request fails within 50 ms
    (at once on sending). When it is back, the participant resumes.
    """

    def __init__(
        self,
        port: CanPort,
        *,
        node_id: int,
        name: str,
        unique_id: bytes,
        software_version: SoftwareVersion,
        clock: Callable[[], Instant] | None = None,
    ) -> None:
        """`node_id` is 1..127 and free on the bus, `name` at most 80 characters, `unique_id` 16 bytes.

        `clock` defaults to the running event loop's time. Raises ValueError for values out of range.
        """
        if not 1 <= node_id <= 127:
            raise ValueError(f"Node ID {node_id} is outside 1 to 127. Tools use 126 or 127.")
        self.node_id = node_id
        self.port = port
        self.clock = clock or asyncio.get_running_loop().time
        self.counters = ParticipantCounters()
        self.subscriptions = Subscriptions()
        self.shared_id = SharedNodeId(node_id)
        """Traffic of other programs under our node ID."""
        self.on_frames: Hooks[Sequence[Frame], bool] = Hooks()
        """Called with every batch of frames and whether we sent it. Sent frames carry the time at which the port
        accepted them."""
        self.last_seen: dict[int, Instant] = {}
        """Time of the last transfer of each other node, of any type."""
        self._presence = Presence(name=name, unique_id=unique_id, software_version=software_version, born=self.clock())
        self._backlog = Backlog(port.statistics, self.clock)
        self._requests = Requests(node_id, self._transmit, self.clock, self._backlog.is_empty)
        self._with_own_id: list[Frame] = []
        self._reassembler = Reassembler(node_id, on_own_id=self._with_own_id.append)
        self._transfer_ids: dict[int, int] = {}
        self._running = False
        self._status_timer: asyncio.TimerHandle | None = None
        self._port_timer: asyncio.TimerHandle | None = None

    @property
    def request_counters(self) -> RequestCounters:
        """Counters of our requests."""
        return self._requests.counters

    @property
    def reassembly_counters(self) -> ReassemblyCounters:
        """Counters of received frames."""
        return self._reassembler.counters

    @property
    def on_round_trip(self) -> Hooks[int, float]:
        """Called for every accepted response with the node ID and the seconds from request to response."""
        return self._requests.on_round_trip

    def info(self) -> GetNodeInfoResponse:
        """Our current GetNodeInfo response."""
        return self._presence.info(self.clock())

    def start(self) -> None:
        """Listen on the port, and publish NodeStatus now and once a second (table 2-2). Idempotent."""
        if self._running:
            return
        self._running = True
        self._fit_line()
        self.port.listen(self._receive)
        self._publish_status(asyncio.get_running_loop().time())

    async def close(self) -> None:
        """Stop at once. Pending requests raise BusDisconnected. Idempotent."""
        self._running = False
        for timer in (self._status_timer, self._port_timer):
            if timer is not None:
                timer.cancel()
        self._status_timer = self._port_timer = None
        self._requests.fail_all(self._disconnected)

    @overload
    def request(
        self, destination: int, request: GetSetRequest, *,
        priority: int = ..., timeout: float = ..., tries: int = ..., urgent: bool = ...,
    ) -> Coroutine[Any, Any, GetSetResponse]: ...  # fmt: skip
    @overload
    def request(
        self, destination: int, request: GetNodeInfoRequest, *,
        priority: int = ..., timeout: float = ..., tries: int = ..., urgent: bool = ...,
    ) -> Coroutine[Any, Any, GetNodeInfoResponse]: ...  # fmt: skip
    @overload
    def request(
        self, destination: int, request: ExecuteOpcodeRequest, *,
        priority: int = ..., timeout: float = ..., tries: int = ..., urgent: bool = ...,
    ) -> Coroutine[Any, Any, ExecuteOpcodeResponse]: ...  # fmt: skip
    @overload
    def request(
        self, destination: int, request: RestartNodeRequest, *,
        priority: int = ..., timeout: float = ..., tries: int = ..., urgent: bool = ...,
    ) -> Coroutine[Any, Any, RestartNodeResponse]: ...  # fmt: skip
    def request(
        self,
        destination: int,
        request: Structure,
        *,
        priority: int = 24,
        timeout: float = 0.15,
        tries: int = 1,
        urgent: bool = False,
    ) -> Coroutine[Any, Any, Any]:
        """Send a request to another node. Await it for the decoded response.

        One request per node is in flight; others for it are queued by `priority` (16..31, lower first), then in
        order. An `urgent` request is sent at once, in parallel. `timeout` (seconds) starts with each try. Use more
        than one of the `tries` only for idempotent requests.

        The call raises ValueError for arguments out of range. Awaiting raises NoResponse, BusDisconnected,
        ForbiddenParameter if the port refuses the request, and Busy for more than 32 urgent requests.
        """
        if not 1 <= destination <= 127 or destination == self.node_id:
            raise ValueError(f"Cannot send a request to node ID {destination}. Enter the ID of another node, 1 to 127.")
        if not FIRST_REQUEST_PRIORITY <= priority <= 31:
            raise ValueError(f"Priority {priority} is outside the {FIRST_REQUEST_PRIORITY} to 31 of requests.")
        if timeout <= 0 or tries < 1:
            raise ValueError(f"timeout {timeout} s and tries {tries} must be above 0.")
        if self.port.state not in _OPEN_STATES:
            return self._refuse()  # at once: a request on a lost bus must not be sent when the bus is back
        if self._port_timer is None:
            self._port_timer = asyncio.get_running_loop().call_later(_PORT_CHECK_PERIOD_S, self._check_port)
        response_type = _RESPONSES[request.TYPE.id]
        accepts = request.matches if isinstance(request, GetSetRequest) else any_response
        return self._requests.request(destination, request, response_type, priority, timeout, tries, urgent, accepts)

    def broadcast(self, message: Structure, *, priority: int) -> None:
        """Broadcast a message. `priority` is 0 (first) to 31.

        Raises BusDisconnected, the errors of the port, and ValueError for values out of range.
        """
        data_type = message.TYPE
        payload = message.encode()
        transfer_id = self._transfer_ids.get(data_type.id, 0)
        self._transfer_ids[data_type.id] = (transfer_id + 1) & 31
        self._transmit(Transfer(Kind.MESSAGE, data_type.id, self.node_id, 0, priority, transfer_id, payload), data_type)

    def subscribe(self, message: type[M], handler: Callable[[Transfer, M], object]) -> Callable[[], None]:
        """Call `handler` with every message of a type, including anonymous ones. Returns a function that unsubscribes.

        Raises ValueError for a structure that is not a message. Exceptions of a handler are logged.
        """
        return self.subscriptions.add(message, handler)

    def _receive(self, frames: list[Frame]) -> None:
        if not self._running:
            return
        if self.on_frames:
            self.on_frames.notify(frames, False)
        last_seen, now = self.last_seen, self.clock()
        transfers = self._reassembler.feed(frames, now)
        if self._with_own_id:
            self._note_own_id(now)
        self.counters.transfers += len(transfers)
        for transfer in transfers:
            source = transfer.source
            if source:
                last_seen[source] = transfer.at
            if transfer.kind == Kind.RESPONSE:
                self._requests.receive(transfer)
            elif transfer.kind == Kind.MESSAGE:
                self.subscriptions.dispatch(transfer)
            elif transfer.type_id == _NODE_INFO.id:
                self._respond_info(transfer)
        self._requests.pump()

    def _respond_info(self, request: Transfer) -> None:
        """Respond to GetNodeInfo with the priority and transfer ID of the request."""
        payload = self._presence.info(self.clock()).encode()
        response = request._replace(
            kind=Kind.RESPONSE, source=self.node_id, destination=request.source, payload=payload
        )
        try:
            self._transmit(response, _NODE_INFO)
        except BusDisconnected:
            log.debug("response to node %d not sent: no bus", request.source)

    def _note_own_id(self, now: Instant) -> None:
        frames = list(self._with_own_id)
        self._with_own_id.clear()
        if self.port.address.startswith(REPLAYS):
            return  # our own traffic at the time of recording
        known = self.shared_id.frames > 0
        self.shared_id.receive(frames, now)
        if not known and self.shared_id.frames:
            log.warning("another node uses our node ID %d", self.node_id)

    def _fit_line(self) -> None:
        """Limit the requests in flight to what a serial line can deliver in time, and extend their timeouts.

        Without the extension an urgent request would be repeated before its response can arrive, filling the line.
        """
        details = self.port.details
        line, requests = details.serial_line, self._requests
        rate = None if line is None else line.slcan_bytes_per_s
        if line is None or rate is None:
            requests.line_latency_s = details.round_trip_s
            return
        requests.max_open = max(2, int(rate * LINE_RESPONSES_S / RESPONSE_BYTES))
        requests.line_response_s = 2 * RESPONSE_BYTES / rate
        latency_s = LINE_LATENCY_S if line.latency_ms is None else line.latency_ms / 1000
        requests.line_latency_s = max(latency_s, details.round_trip_s)

    def _publish_status(self, due: Instant) -> None:
        self._fit_line()
        try:
            self.broadcast(self._presence.status(self.clock()), priority=STATUS_PRIORITY)
        except BusDisconnected:
            log.debug("NodeStatus not sent: no bus")
        loop = asyncio.get_running_loop()
        # After a stall of the loop send one, not one for every missed second.
        due = max(due + _STATUS_PERIOD_S, loop.time())
        self._status_timer = loop.call_at(due, self._publish_status, due)

    def _check_port(self) -> None:
        """While requests are pending, poll the port: it does not report when it is lost."""
        self._port_timer = None
        if self.port.state not in _OPEN_STATES:
            self._requests.fail_all(self._disconnected)
        elif self._requests.waiting:
            self._port_timer = asyncio.get_running_loop().call_later(_PORT_CHECK_PERIOD_S, self._check_port)

    async def _refuse(self) -> NoReturn:
        raise self._disconnected()

    def _disconnected(self) -> BusDisconnected:
        return not_connected(self.port.address, self.port.trouble)

    def _transmit(self, transfer: Transfer, data_type: DataType) -> None:
        if not self._running or self.port.state not in _OPEN_STATES:
            raise self._disconnected()
        frames = split(transfer, data_type)
        now = self.clock()
        self._backlog.queue(len(frames), now)  # before sending: a port may count them at once
        self.port.send(frames)
        self.shared_id.sent(frames, now)
        if self.on_frames:
            self.on_frames.notify([frame._replace(at=now) for frame in frames], True)
