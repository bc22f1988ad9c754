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
from hornbill.node.requests import RequestCounters, Requests, anything
from hornbill.node.shared_id import SharedNodeId
from hornbill.node.subscriptions import Subscriptions
from hornbill.units import Instant
from hornbill.wire.datatype import DataType, Kind, Structure
from hornbill.wire.frame import Frame
from hornbill.wire.port import RECORDINGS, CanPort, PortState, not_connected
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

ON_LINE_S: Final = 0.025
"""How long the answers to all requests on their way may take on a serial line: well within a timeout, and within what
an adapter has room for when some are answers to GetNodeInfo, four times as long."""
ANSWER_BYTES: Final = 77
"""Of a GetSet answer on a serial line, with the acknowledgement of its request; a write is about as long."""
LINE_LATENCY_S: Final = 0.02
"""What a USB serial chip may hold an answer back for, where it does not say: 16 ms with those of FTDI."""

STATUS_PRIORITY: Final = 24
"""Of our own NodeStatus: after everything a servo broadcasts."""

FIRST_REQUEST_PRIORITY: Final = 16
"""Answers come back at the priority of their request, and must not overtake what servos broadcast at 16."""

_STATUS_PERIOD_S: Final = 1.0
_LOOK_PERIOD_S: Final = 0.05
# No set: hashing an enum takes longer than three looks.
_GONE: Final = (PortState.LOST, PortState.CONNECTING, PortState.DISCONNECTED)
_NODE_INFO: Final = GetNodeInfoRequest.TYPE
_ANSWERS: Final[dict[int, type[Structure]]] = {
    _NODE_INFO.id: GetNodeInfoResponse,
    RestartNodeRequest.TYPE.id: RestartNodeResponse,
    ExecuteOpcodeRequest.TYPE.id: ExecuteOpcodeResponse,
    GetSetRequest.TYPE.id: GetSetResponse,
}


@dataclass(slots=True)
class ParticipantCounters:
    """Since the participant was made."""

    transfers: int = 0


class Participant:
    """One node on one CanPort. Everything happens on the event loop; only `request` and `close` are awaited.

    The port stays its opener's: closing the participant does not close it. A lost port fails every waiting
    request within 50 ms (at once when something is sent); when it comes back, the participant goes on.
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

        `clock` is the running event loop's time unless given. Raises ValueError for what does not fit.
        """
        if not 1 <= node_id <= 127:
            raise ValueError(f"Node id {node_id} is outside 1 to 127. Tools use 126 or 127.")
        self.node_id = node_id
        self.port = port
        self.clock = clock or asyncio.get_running_loop().time
        self.counters = ParticipantCounters()
        self.subscriptions = Subscriptions()
        self.shared_id = SharedNodeId(node_id)
        """What others say with our node id."""
        self.on_frames: Hooks[Sequence[Frame], bool] = Hooks()
        """Called with every batch of frames and whether we sent it; sent frames carry the instant the port
        took them."""
        self.heard: dict[int, Instant] = {}
        """When a transfer of each other node last came, of whatever type."""
        self._presence = Presence(name=name, unique_id=unique_id, software_version=software_version, born=self.clock())
        self._backlog = Backlog(port.statistics)
        self._requests = Requests(node_id, self._transmit, self.clock, lambda: self._backlog.is_empty(self.clock()))
        self._with_own_id: list[Frame] = []
        self._reassembler = Reassembler(node_id, on_own_id=self._with_own_id.append)
        self._transfer_ids: dict[int, int] = {}
        self._running = False
        self._status_timer: asyncio.TimerHandle | None = None
        self._look_timer: asyncio.TimerHandle | None = None

    @property
    def request_counters(self) -> RequestCounters:
        """What became of our requests."""
        return self._requests.counters

    @property
    def reassembly_counters(self) -> ReassemblyCounters:
        """What became of the frames received."""
        return self._reassembler.counters

    @property
    def on_round_trip(self) -> Hooks[int, float]:
        """Called with the node id and the seconds from sending to answer, for every answer taken."""
        return self._requests.on_round_trip

    def info(self) -> GetNodeInfoResponse:
        """What we answer to GetNodeInfo now."""
        return self._presence.info(self.clock())

    def start(self) -> None:
        """Listen on the port, and say NodeStatus now and once a second (table 2-2). Twice is harmless."""
        if self._running:
            return
        self._running = True
        self._fit_line()
        self.port.listen(self._receive)
        self._say_status(asyncio.get_running_loop().time())

    async def close(self) -> None:
        """Stop at once; every waiting request ends with BusDisconnected. Twice is harmless."""
        self._running = False
        for timer in (self._status_timer, self._look_timer):
            if timer is not None:
                timer.cancel()
        self._status_timer = self._look_timer = None
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
        """Ask another node; awaiting it gives the decoded answer.

        One request a node is on its way; others for it wait, lower `priority` (16..31) first, then in order.
        With `urgent` it is sent at once, beside whatever is under way. `timeout` (seconds) runs from each
        sending; allow more than one of the `tries` only where doing it twice does no harm.

        Raises ValueError for arguments out of range at the call. Raises NoResponse, BusDisconnected, what the
        port refuses (ForbiddenParameter) and, beyond 32 urgent ones, Busy when awaited.
        """
        if not 1 <= destination <= 127 or destination == self.node_id:
            raise ValueError(f"Node id {destination} cannot be asked. Give another node's id, 1 to 127.")
        if not FIRST_REQUEST_PRIORITY <= priority <= 31:
            raise ValueError(f"Priority {priority} is outside the {FIRST_REQUEST_PRIORITY} to 31 of requests.")
        if timeout <= 0 or tries < 1:
            raise ValueError(f"timeout {timeout} s and tries {tries} must be above 0.")
        if self.port.state in _GONE:
            return self._refuse()  # at once: what is asked of a lost bus must not leave when it is back
        if self._look_timer is None:
            self._look_timer = asyncio.get_running_loop().call_later(_LOOK_PERIOD_S, self._look)
        return self._requests.ask(
            destination,
            request,
            _ANSWERS[request.TYPE.id],
            priority=priority,
            patience_s=timeout,
            tries=tries,
            urgent=urgent,
            fits=request.is_answered_by if isinstance(request, GetSetRequest) else anything,
        )

    def broadcast(self, message: Structure, *, priority: int) -> None:
        """Send a message to everybody; `priority` 0 (first) to 31.

        Raises BusDisconnected, what the port refuses, and ValueError for a value that does not fit.
        """
        data_type = message.TYPE
        payload = message.encode()
        transfer_id = self._transfer_ids.get(data_type.id, 0)
        self._transfer_ids[data_type.id] = (transfer_id + 1) & 31
        self._transmit(Transfer(Kind.MESSAGE, data_type.id, self.node_id, 0, priority, transfer_id, payload), data_type)

    def subscribe(self, message: type[M], handler: Callable[[Transfer, M], object]) -> Callable[[], None]:
        """Call `handler` with every message of a type, anonymous ones included; returns what ends it.

        Raises ValueError for a structure that is not a message. What a handler raises is logged.
        """
        return self.subscriptions.add(message, handler)

    def _receive(self, frames: list[Frame]) -> None:
        if not self._running:
            return
        if self.on_frames:
            self.on_frames.tell(frames, False)
        heard, now = self.heard, self.clock()
        transfers = self._reassembler.feed(frames, now)
        if self._with_own_id:
            self._hear_own_id(now)
        self.counters.transfers += len(transfers)
        for transfer in transfers:
            source = transfer.source
            if source:
                heard[source] = transfer.at
            if transfer.kind == Kind.RESPONSE:
                self._requests.answered(transfer)
            elif transfer.kind == Kind.MESSAGE:
                self.subscriptions.dispatch(transfer)
            elif transfer.type_id == _NODE_INFO.id:
                self._answer_info(transfer)
        self._requests.pump()

    def _answer_info(self, asked: Transfer) -> None:
        """At the priority and with the transfer id of the request."""
        payload = self._presence.info(self.clock()).encode()
        answer = asked._replace(kind=Kind.RESPONSE, source=self.node_id, destination=asked.source, payload=payload)
        try:
            self._transmit(answer, _NODE_INFO)
        except BusDisconnected:
            log.debug("no bus to answer node %d on", asked.source)

    def _hear_own_id(self, now: Instant) -> None:
        frames = list(self._with_own_id)
        self._with_own_id.clear()
        if self.port.address.startswith(RECORDINGS):
            return  # what we said ourselves when it was recorded
        known = self.shared_id.frames > 0
        self.shared_id.hear(frames, now)
        if not known and self.shared_id.frames:
            log.warning("another node uses our node id %d", self.node_id)

    def _fit_line(self) -> None:
        """Have no more requests on their way than a serial line brings the answers of in time, and wait for those.

        Without the wait an urgent request would be repeated before its answer can be there, and fill the line.
        """
        line = self.port.details.serial_line
        rate = None if line is None else line.bytes_per_s
        if line is None or rate is None:
            return
        requests = self._requests
        requests.most_open = max(2, int(rate * ON_LINE_S / ANSWER_BYTES))
        requests.line_answer_s = 2 * ANSWER_BYTES / rate
        requests.line_latency_s = LINE_LATENCY_S if line.latency_ms is None else line.latency_ms / 1000

    def _say_status(self, due: Instant) -> None:
        self._fit_line()
        try:
            self.broadcast(self._presence.status(self.clock()), priority=STATUS_PRIORITY)
        except BusDisconnected:
            log.debug("no bus to say our status on")
        loop = asyncio.get_running_loop()
        # A loop that was held up says it once, not once for every second it missed.
        due = max(due + _STATUS_PERIOD_S, loop.time())
        self._status_timer = loop.call_at(due, self._say_status, due)

    def _look(self) -> None:
        """While somebody waits: a port does not tell us that it was lost, so we ask."""
        self._look_timer = None
        if self.port.state in _GONE:
            self._requests.fail_all(self._disconnected)
        elif self._requests.waiting:
            self._look_timer = asyncio.get_running_loop().call_later(_LOOK_PERIOD_S, self._look)

    async def _refuse(self) -> NoReturn:
        raise self._disconnected()

    def _disconnected(self) -> BusDisconnected:
        return not_connected(self.port.address, self.port.trouble)

    def _transmit(self, transfer: Transfer, data_type: DataType) -> None:
        if not self._running or self.port.state in _GONE:
            raise self._disconnected()
        frames = split(transfer, data_type)
        now = self.clock()
        self._backlog.handing(len(frames), now)  # before sending: a port may count them at once
        self.port.send(frames)
        self.shared_id.sent(frames, now)
        if self.on_frames:
            self.on_frames.tell([frame._replace(at=now) for frame in frames], True)
