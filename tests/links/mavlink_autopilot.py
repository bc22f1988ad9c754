"""An autopilot that forwards its CAN bus over MAVLink, with pymavlink's implementation: UDP or a pseudo terminal."""

import contextlib
import io
import os
import pty
import random
import select
import socket
import threading
import time
import tty
from collections import deque
from collections.abc import Callable
from typing import Any, Final, Protocol, Self

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hornbill.wire.frame import Frame

FORWARDED_S: Final = 5.0
"""How long an autopilot forwards after each request."""
ROOM: Final = 128
"""Frames an autopilot keeps for a busy line."""
BITS_PER_BYTE: Final = 10


class Way(Protocol):
    """How bytes come and go."""

    address: str

    def read(self, limit: int) -> bytes: ...
    def write(self, data: bytes) -> None: ...
    def close(self) -> None: ...


class Udp:
    """A UDP socket that answers whoever sent last, as mavlink-router does."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._peer: tuple[str, int] | None = None
        self.address = f"mavcan:udp:127.0.0.1:{self._socket.getsockname()[1]}"

    def read(self, limit: int) -> bytes:
        """The datagrams that arrived."""
        data = b""
        with contextlib.suppress(BlockingIOError, ConnectionRefusedError):
            while True:
                one, self._peer = self._socket.recvfrom(65536)
                data += one
        return data

    def write(self, data: bytes) -> None:
        """Send one datagram."""
        if self._peer is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(data, self._peer)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class Terminal:
    """A pseudo terminal."""

    def __init__(self, baud: int) -> None:
        self._ours, self._theirs = pty.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.address = f"mavcan:{os.ttyname(self._theirs)}@{baud}"

    def read(self, limit: int) -> bytes:
        """Up to `limit` bytes."""
        ready, _, _ = select.select([self._ours], [], [], 0)
        return os.read(self._ours, limit) if ready and limit else b""

    def write(self, data: bytes) -> None:
        """Write to the terminal. Without a reader, it fills and drops."""
        with contextlib.suppress(BlockingIOError):
            os.write(self._ours, data)

    def close(self) -> None:
        """Unplug it."""
        os.close(self._ours)
        os.close(self._theirs)


class Autopilot:
    """System 1. `put` is a frame of its bus; `on_frame` is called on its thread for each frame sent to it.

    `baud` limits both directions to 10 bits a byte; `delay_s` is added to what it sends. `loss` is the share of
    messages lost in each direction, `damage` that of messages sent with a wrong byte, `key` the signing key of 32
    bytes, `buses` the number of its CAN buses.
    """

    def __init__(
        self,
        way: Way,
        *,
        baud: int | None = None,
        loss: float = 0.0,
        damage: float = 0.0,
        key: bytes | None = None,
        buses: int = 1,
        delay_s: float = 0.0,
        on_frame: Callable[[Frame], object] = lambda _frame: None,
    ) -> None:
        self.way = way
        self.address = way.address
        self.on_frame = on_frame
        self.forwarded = self.injected = self.dropped = self.lost = self.damaged = self.requests = (
            self.wrongly_signed
        ) = 0
        self.filter: list[int] = []
        self.clients: set[tuple[int, int]] = set()
        self.silent = False
        """Whether it sends and hears nothing, as if its cable were cut."""
        self._mav: Any = mavlink.MAVLink(io.BytesIO(), srcSystem=1, srcComponent=1)
        self._mav.robust_parsing = True
        if key is not None:
            self._mav.signing.secret_key = key
            self._mav.signing.sign_outgoing = True
            self._mav.signing.timestamp = int((time.time() - 1_420_070_400) * 1e5)
        self._byte_s = 0.0 if baud is None else BITS_PER_BYTE / baud
        self._loss = loss
        self._damage = damage
        self._delay_s = delay_s
        self._delayed: deque[tuple[float, bytes]] = deque()
        self._buses = buses
        self._random = random.Random(5)
        self._outbox: deque[Frame] = deque()
        self._until = 0.0
        self._bus = 0
        self._free_at = self._read_at = 0.0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="autopilot", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self.way.close()

    @property
    def forwarding(self) -> bool:
        """Whether it forwards its bus now."""
        return time.monotonic() < self._until

    def put(self, frame: Frame) -> None:
        """A frame on its bus."""
        if not self.forwarding or (self.filter and _filter_id(frame.id) not in self.filter):
            return
        if len(self._outbox) >= ROOM:
            self.dropped += 1
        else:
            self._outbox.append(frame)

    def _run(self) -> None:
        beat_at = attitude_at = 0.0
        self._read_at = time.monotonic()
        while not self._ended.wait(0.001):
            now = time.monotonic()
            self._receive(now)
            while self._delayed and self._delayed[0][0] <= time.monotonic():
                self.way.write(self._delayed.popleft()[1])
            if now >= beat_at:
                beat_at = now + 1.0
                self._send(self._mav.heartbeat_encode(2, 3, 0, 0, 4, 3))
            if now >= attitude_at:
                attitude_at = now + 0.25
                self._send(self._mav.attitude_encode(0, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0))
            while self._outbox and self._free_at <= time.monotonic():
                frame = self._outbox.popleft()
                self.forwarded += 1
                data = [*frame.data, *bytes(8 - len(frame.data))]
                self._send(self._mav.can_frame_encode(250, 192, self._bus, len(frame.data), frame.id | 1 << 31, data))

    def _send(self, message: Any) -> None:
        data = bytes(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256
        self._free_at = max(self._free_at, time.monotonic()) + len(data) * self._byte_s
        if self._random.random() < self._loss:
            self.lost += 1
        elif not self.silent:
            if self._random.random() < self._damage:
                at = self._random.randrange(len(data))
                data = data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :]
                self.damaged += 1
            self._delayed.append((time.monotonic() + self._delay_s, data))

    def _receive(self, now: float) -> None:
        limit = 4096
        if self._byte_s:
            limit = min(int((now - self._read_at) / self._byte_s), 4096)
            self._read_at = now if limit == 4096 else self._read_at + limit * self._byte_s
        data = self.way.read(limit)
        if not data or self.silent:
            return
        messages: list[Any] = self._mav.parse_buffer(data) or []
        for message in messages:
            if message.get_type() == "BAD_DATA":
                self.wrongly_signed += 1
            elif self._random.random() < self._loss:
                self.lost += 1
            else:
                self._handle(message)

    def _handle(self, message: Any) -> None:
        self.clients.add((message.get_srcSystem(), message.get_srcComponent()))
        match message.get_type():
            case "COMMAND_LONG" if message.command == 32000 and message.target_system in (0, 1):
                self.requests += 1
                bus = int(message.param1)
                accepted = 0 <= bus <= self._buses
                if accepted and bus:
                    self._bus, self._until = bus - 1, time.monotonic() + FORWARDED_S
                elif accepted:  # stop; what waits is not sent
                    self._until = 0.0
                    self._outbox.clear()
                self._send(self._mav.command_ack_encode(32000, 0 if accepted else 4))
            case "CAN_FILTER_MODIFY" if message.operation == 0:
                self.filter = list(message.ids[: message.num_ids])
            case "CAN_FRAME" if message.bus < self._buses:
                self.injected += 1
                self.on_frame(Frame(message.id & 0x1FFF_FFFF, bytes(message.data[: message.len])))
            case _:
                pass


def _filter_id(can_id: int) -> int:
    """What a filter compares: message or service type ID, 0 for an anonymous message."""
    if not can_id & 0xFF:
        return 0
    return can_id >> 16 & 0xFF if can_id & 0x80 else can_id >> 8 & 0xFFFF
