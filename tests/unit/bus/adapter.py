"""FakeAdapter: a simulated slcan adapter at the other end of a pseudo terminal, with configurable defects."""

import os
import pty
import random
import select
import termios
import threading
import time
import tty
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Self

BUS_FRAME = b"T1E08FF05801020304050607C0\r"
"""A frame from the bus behind the adapter, as a line."""


class FakeAdapter:
    """An adapter that handles commands in its own thread until it is unplugged.

    `responds`: "lawicel" with CR, BELL, z and Z; "silent" only to V, as CANable's first firmware; "mute" to nothing;
    "fixed" with BELL to all but O, C and frames; "echo" with what it receives. `refuses`: commands it refuses with
    BELL. `flags`: its response to F, None if it does not support F.

    `baud`: its rate, None for any. At another rate both ends receive invalid data. `bus`: a frame arrives from the bus
    every 10 ms while its channel is open; "streaming": always. `noise`: invalid bytes arrive all the time.
    `throttled`: its line carries no more than `baud` allows, and it queues up to 64 frames.
    """

    rates = threading.Lock()
    """Held while data is sent: tests hold it to change the rate and drop received data in one step."""

    def __init__(
        self,
        *,
        responds: str = "lawicel",
        refuses: tuple[bytes, ...] = (),
        flags: int | None = None,
        baud: int | None = None,
        bus: bool | str = False,
        noise: bool = False,
        throttled: bool = False,
    ) -> None:
        self.responds = responds
        self.refuses = refuses
        self.flags = flags
        self.off_bus = False
        """Whether its controller is bus-off: it refuses every frame until its channel is reopened."""
        self.neighbour: FakeAdapter | None = None
        """The adapter at the other end of the bus, which receives the frames sent by this one."""
        self.received: list[bytes] = []
        """Commands, in order of arrival."""
        self.on_sent: Callable[[bytes], None] = lambda _frame: None
        """Called in its thread with each frame it sends to the bus, as a line."""
        self.on_open: Callable[[], object] = lambda: None
        """Called in its thread before its channel opens."""
        self.opened = 0
        """How often its channel was opened."""
        self.dropped = 0
        """Number of frames from the bus that did not fit into its queue."""
        self._baud = baud
        self.bus = bus
        self._noise = noise
        self._throttled = throttled
        self._queue: deque[bytes] = deque()
        self._line_free_at = 0.0
        self._random = random.Random(7)
        self._reading = threading.Event()
        self._reading.set()
        self._stalled = threading.Event()
        self._end, self._other_end = pty.openpty()
        tty.setraw(self._other_end)
        self.channel = os.ttyname(self._other_end)
        self._ending = False
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="fake adapter")
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.unplug()

    @property
    def sent(self) -> list[bytes]:
        """The frames it was given to send."""
        return [command for command in self.received if command[:1] == b"T"]

    @property
    def is_open(self) -> bool:
        """Whether the channel is open, by the commands received."""
        state = [command for command in self.received if command in (b"O", b"C")]
        return state[-1:] == [b"O"]

    def put(self, line: bytes) -> None:
        """Queue a frame from the bus, as a line; dropped if too many are queued."""
        if len(self._queue) >= 64:
            self.dropped += 1
        else:
            self._queue.append(line)

    def send(self, data: bytes) -> None:
        """Send all of `data` to the computer, as invalid bytes while it is set to another rate."""
        with self._lock:
            while data:
                select.select([], [self._end], [], 1)
                with self.rates:
                    sent = data if self._same_rate() else self._random.randbytes(len(data))
                    try:
                        data = data[os.write(self._end, sent) :]
                    except BlockingIOError:
                        continue

    def stall(self) -> None:
        """Stop reading, until `resume`."""
        self._stalled.clear()
        self._reading.clear()
        self._stalled.wait()

    def fill(self) -> None:
        """Stall, and fill the line until no byte fits."""
        self.stall()
        end = os.open(self.channel, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
        full = 0
        while full < 5:  # the kernel passes some of it on a little later
            try:
                os.write(end, b"\0")
                full = 0
            except BlockingIOError:
                full += 1
                time.sleep(0.005)
        os.close(end)

    def resume(self) -> None:
        """Continue reading."""
        self._reading.set()

    def unplug(self) -> None:
        """Disappear, as when the cable is pulled."""
        self._ending = True
        self._reading.set()
        self._thread.join()
        for end in (self._other_end, self._end):
            try:
                os.close(end)
            except OSError:
                pass  # unplugged before

    def _run(self) -> None:
        os.set_blocking(self._end, False)
        rest = b""
        due = time.monotonic()
        while not self._ending:
            if not self._reading.is_set():
                self._stalled.set()
                self._reading.wait()
            ready, _, _ = select.select([self._end], [], [], 0.002 if self._throttled else 0.01)
            if time.monotonic() >= due:
                due += 0.01
                self._send_unsolicited()
            if self._throttled:
                self._forward()
            if not ready:
                continue
            data = os.read(self._end, 65536)
            if not self._same_rate():
                data, rest = self._random.randbytes(len(data)) + b"\r", b""
            elif self.responds == "echo":
                self.send(data)
            *commands, rest = (rest + data).split(b"\r")
            self.received += commands
            response = b"".join(map(self._respond, commands))
            if response and self._throttled:
                self._queue.appendleft(response)
            elif response:
                self.send(response)

    def _same_rate(self) -> bool:
        """Whether the computer's end of the line is at this adapter's rate."""
        if self._baud is None:
            return True
        return termios.tcgetattr(self._other_end)[5] == getattr(termios, f"B{self._baud}")

    def _send_unsolicited(self) -> None:
        if self._noise:
            self.send(self._random.randbytes(3).replace(b"\r", b"\xff").replace(b"\a", b"\xff"))
        if self.bus == "streaming" or (self.bus and self.is_open):
            self.send(BUS_FRAME)

    def _forward(self) -> None:
        """Send as much of the queue as the line could carry until now."""
        assert self._baud is not None
        now = time.monotonic()
        self._line_free_at = max(self._line_free_at, now - 0.2)  # a busy computer must not slow it
        while self._queue and self._line_free_at <= now:
            line = self._queue.popleft()
            self._line_free_at += len(line) * 10 / self._baud
            self.send(line)

    def _respond(self, command: bytes) -> bytes:
        if self.responds in ("mute", "echo"):
            return b""
        if self.responds == "fixed" and command not in (b"O", b"C") and command[:1] not in (b"T", b"t"):
            return b"\a"
        if command == b"V":
            return b"V1013\r"
        if self.responds == "silent":
            return b""
        if command == b"O":
            self.on_open()
            self.off_bus = False
            self.opened += 1
        if self.neighbour is not None and command[:1] == b"T":
            self.neighbour.send(command + b"\r")
        if command[:1] == b"T":
            self.on_sent(command)
        if command in self.refuses or (self.off_bus and command[:1] == b"T"):
            return b"\a"
        if command == b"F":
            return b"\a" if self.flags is None else b"F%02X\r" % self.flags
        return {b"T": b"Z\r", b"t": b"z\r"}.get(command[:1], b"\r")


def wait_until(condition: Callable[[], object], within_s: float = 30.0) -> None:
    """Return as soon as `condition` is true. Fails after `within_s` seconds, generous for a busy machine."""
    end = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < end, "timed out"
        time.sleep(0.002)
