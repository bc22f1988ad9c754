"""A node of the public Python stack on vcan0, in the process of the test, as an independent reference."""

# The stack is dynamic and has no type hints.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# pyright: reportUnknownParameterType=false, reportMissingTypeStubs=false

import socket
import struct
import time
from collections import defaultdict, deque
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from types import TracebackType
from typing import Any, NamedTuple, Self

import dronecan
from dronecan import transport
from dronecan.node import Node

uavcan: Any = dronecan.uavcan
"""The stack's data types, by their full names."""

TIMEOUT_S = 120.0
_STEP_S = 0.01
# Kernel filters: any frame, and an extended one that is no message of type 1011.
_EVERYTHING = struct.pack("=II", 0, 0)
_ALL_BUT_STATUS = struct.pack("=II", 1011 << 8 | 0xA000_0000, 0xFFFF << 8 | 0x8000_0080)
_SO_RCVBUFFORCE = 33  # asm-generic/socket.h


class Received(NamedTuple):
    """A transfer received by the stack: `message` is its own object, `at` the kernel's time of the first frame."""

    source: int
    priority: int
    transfer_id: int
    at: float
    message: Any


class Register(NamedTuple):
    """A response to GetSet: the active kinds of its four unions, the value, and the name."""

    name: str
    kind: str
    value: int | float | str | None
    others: tuple[str, str, str]
    priority: int


REFUSED = ("", "empty", None, ("empty", "empty", "empty"))
"""A refusal, without its priority (table 2-16, column "fail")."""


class Peer:
    """A node with `node_id`, or anonymous with 0. It runs only within its methods."""

    def __init__(
        self,
        node_id: int = 0,
        *,
        name: str = "org.example.peer",
        unique_id: bytes = bytes(16),
        monitors: bool = False,
    ) -> None:
        """`monitors`: it will have a NodeMonitor, which raises when its own node info is requested."""
        # The stack's own driver: the one for python-can cannot send on SocketCAN, and waits 1000 times too long.
        from dronecan.driver.socketcan import SocketCAN  # only where there is fcntl

        info = uavcan.protocol.GetNodeInfo.Response()
        info.name = name.encode()
        info.hardware_version.unique_id = list(unique_id)
        driver = SocketCAN("vcan0")
        self._socket: socket.socket = driver.socket
        self._socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, _ALL_BUT_STATUS)
        with suppress(PermissionError):  # only root may have it keep more than usual while a test does something else
            self._socket.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, 1 << 23)
        self.node = Node(
            driver, node_id=node_id or None, node_info=info, catch_handler_exceptions=monitors,
            mode=uavcan.protocol.NodeStatus().MODE_OPERATIONAL,
        )  # fmt: skip

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.node.close()

    @property
    def node_id(self) -> int:
        """Its node ID, 0 if none."""
        return self.node.node_id or 0

    def listen(self, data_type: Any) -> list[Received]:
        """The messages of a data type from now on; the list grows while the peer runs."""
        kept: list[Received] = []

        def keep(event: Any) -> None:
            transfer = event.transfer
            number, priority = transfer.source_node_id, transfer.transfer_priority
            kept.append(Received(number, priority, transfer.transfer_id, transfer.ts_real, event.message))

        self.node.add_handler(data_type, keep)
        return kept

    @contextmanager
    def receiving_status(self) -> Generator[None]:
        """Receive actuator Status for some time. It is filtered out otherwise, because of its volume: the stack takes
        milliseconds for a frame where system calls are dear, and would fall behind.
        """
        self._socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, _EVERYTHING)
        try:
            yield
        finally:
            self._socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, _ALL_BUT_STATUS)

    def live(self, seconds: float) -> None:
        """Run on the bus for some time."""
        self.node.spin(seconds)

    def run_until(self, condition: Callable[[], object], what: str) -> None:
        """Run on the bus until a condition is true."""
        run_until([self], condition, what)

    def request(self, *requests: tuple[int, Any], priority: int = 20) -> list[Received]:
        """The responses to requests (node id, request object): one at a time per node, all nodes in parallel."""
        responses: dict[int, Received] = {}
        waiting: defaultdict[int, deque[tuple[int, Any]]] = defaultdict(deque)
        for place, (node_id, request) in enumerate(requests):
            waiting[node_id].append((place, request))

        def next_for(node_id: int) -> None:
            if not waiting[node_id]:
                return
            place, request = waiting[node_id].popleft()

            def take(event: Any) -> None:
                assert event is not None, f"node {node_id} left {request} unanswered"
                sent = event.transfer
                responses[place] = Received(
                    sent.source_node_id, sent.transfer_priority, sent.transfer_id, sent.ts_real, event.response
                )
                next_for(node_id)

            self.node.request(request, node_id, take, priority=priority, timeout=TIMEOUT_S)

        for node_id in list(waiting):
            next_for(node_id)
        self.run_until(lambda: len(responses) == len(requests), f"{len(requests)} responses")
        return [responses[place] for place in range(len(requests))]

    def registers(self, *requests: tuple[int, Any], priority: int = 20) -> list[Register]:
        """As `request`, for requests of GetSet."""
        return [_register(response) for response in self.request(*requests, priority=priority)]


def live_together(peers: list[Peer], seconds: float) -> None:
    """Run several peers for some time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for peer in peers:
            peer.live(_STEP_S)


def run_until(peers: list[Peer], condition: Callable[[], object], what: str) -> None:
    """Run several peers until a condition is true."""
    end = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < end, f"never came: {what}"
        for peer in peers:
            peer.live(_STEP_S)


def read(which: str | int) -> Any:
    """A GetSet request to read a register, by name or by index."""
    request = uavcan.protocol.param.GetSet.Request()
    if isinstance(which, int):
        request.index = which
    else:
        request.name = which.encode()
    return request


def write(name: str, value: float | str) -> Any:
    """A GetSet request that sets a register, with the kind of value of the Python type."""
    request = read(name)
    match value:
        case bool():
            request.value.boolean_value = value
        case int():
            request.value.integer_value = value
        case float():
            request.value.real_value = value
        case str():
            request.value.string_value = value.encode()
    return request


def _register(response: Received) -> Register:
    message = response.message
    unions = (message.value, message.default_value, message.max_value, message.min_value)
    kind, *others = (transport.get_active_union_field(union) for union in unions)
    value = None if kind == "empty" else getattr(message.value, kind)
    name = bytes(list(message.name)).decode("latin-1")
    first, second, third = others
    return Register(name, kind, value, (first, second, third), response.priority)
