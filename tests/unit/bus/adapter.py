"""FakeAdapter: a serial adapter that speaks slcan, at the far end of a pseudo terminal, with every bad habit."""

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
"""What a servo on the bus behind an adapter says again and again."""


class FakeAdapter:
    """Answers commands in a thread of its own until it is unplugged.

    `answers` says how: "lawicel" with CR, BELL, z and Z; "silent" with nothing but its version, as CANable's first
    firmware; "mute" not even with that; "fixed" with BELL to all but O and C; "echo" with what it was told. `refuses`
    are commands it answers with BELL. `flags` is what F answers, or None for an adapter that does not know F.
    `boots_for_s`: deaf for so long after it is opened.

    `baud` is the rate it speaks at, None for any: at another one the computer understands nothing of what it says, nor
    it the computer. `bus`: a frame comes from the bus every 10 ms while its channel is open; "streaming": open or not.
    `noise`: unreadable bytes are on its line all the time. `throttled`: its line carries no more than `baud` allows,
    and it has room for 64 frames that wait for it.
    """

    def __init__(
        self,
        *,
        answers: str = "lawicel",
        refuses: tuple[bytes, ...] = (),
        flags: int | None = None,
        boots_for_s: float = 0.0,
        baud: int | None = None,
        bus: bool | str = False,
        noise: bool = False,
        throttled: bool = False,
    ) -> None:
        self.answers = answers
        self.refuses = refuses
        self.flags = flags
        self.off_bus = False
        """Whether its controller is off the bus: it refuses every frame until its channel is opened anew."""
        self.neighbour: FakeAdapter | None = None
        """The one at the other end of the bus: it hears the frames this one is told to send."""
        self.heard: list[bytes] = []
        """Commands, in the order they came."""
        self.on_sent: Callable[[bytes], None] = lambda _frame: None
        """Called, in its thread, with each frame it puts onto the bus, as a line."""
        self.dropped = 0
        """Frames of the bus it had no room for."""
        self._baud = baud
        self._bus = bus
        self._noise = noise
        self._throttled = throttled
        self._waiting: deque[bytes] = deque()
        self._line_free_at = 0.0
        self._random = random.Random(7)
        self._reading = threading.Event()
        self._reading.set()
        self._resting = threading.Event()
        self._hears_from = time.monotonic() + boots_for_s
        self._end, self._other_end = pty.openpty()
        tty.setraw(self._other_end)
        self.channel = os.ttyname(self._other_end)
        self._ending = False
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._live, name="fake adapter")
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.unplug()

    @property
    def sent(self) -> list[bytes]:
        """The frames it was told to send."""
        return [command for command in self.heard if command[:1] == b"T"]

    @property
    def is_open(self) -> bool:
        """Whether the channel is open, by the commands it has heard."""
        state = [command for command in self.heard if command in (b"O", b"C")]
        return state[-1:] == [b"O"]

    def put(self, line: bytes) -> None:
        """A frame of the bus, as a line: it goes out when the line is free, or is dropped where too many wait."""
        if len(self._waiting) >= 64:
            self.dropped += 1
        else:
            self._waiting.append(line)

    def say(self, data: bytes) -> None:
        """Send `data` to the computer, all of it, however long that takes."""
        if not self._fits():
            data = self._random.randbytes(len(data))
        with self._lock:
            while data:
                select.select([], [self._end], [], 1)
                try:
                    data = data[os.write(self._end, data) :]
                except BlockingIOError:
                    continue

    def stall(self) -> None:
        """Read no more, until `go_on`."""
        self._resting.clear()
        self._reading.clear()
        self._resting.wait()

    def fill(self) -> None:
        """Stall, and let so much be written that not one byte fits any more."""
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

    def go_on(self) -> None:
        """Read again."""
        self._reading.set()

    def unplug(self) -> None:
        """Be gone, as when the cable is pulled."""
        self._ending = True
        self._reading.set()
        self._thread.join()
        for end in (self._other_end, self._end):
            try:
                os.close(end)
            except OSError:
                pass  # unplugged before

    def _live(self) -> None:
        os.set_blocking(self._end, False)
        rest = b""
        due = time.monotonic()
        while not self._ending:
            if not self._reading.is_set():
                self._resting.set()
                self._reading.wait()
            ready, _, _ = select.select([self._end], [], [], 0.002 if self._throttled else 0.01)
            if time.monotonic() >= due:
                due += 0.01
                self._say_unasked()
            if self._throttled:
                self._pass_on()
            if not ready:
                continue
            data = os.read(self._end, 65536)
            if not self._fits():
                data, rest = self._random.randbytes(len(data)) + b"\r", b""
            elif self.answers == "echo":
                self.say(data)
            *commands, rest = (rest + data).split(b"\r")
            if time.monotonic() < self._hears_from:
                continue
            self.heard += commands
            answer = b"".join(map(self._answer, commands))
            if answer and self._throttled:
                self._waiting.appendleft(answer)
            elif answer:
                self.say(answer)

    def _fits(self) -> bool:
        """Whether the computer's end of the line is at this adapter's rate."""
        if self._baud is None:
            return True
        return termios.tcgetattr(self._other_end)[5] == getattr(termios, f"B{self._baud}")

    def _say_unasked(self) -> None:
        if self._noise:
            self.say(self._random.randbytes(3).replace(b"\r", b"\xff").replace(b"\a", b"\xff"))
        if self._bus == "streaming" or (self._bus and self.is_open):
            self.say(BUS_FRAME)

    def _pass_on(self) -> None:
        """As much of what waits as the line has carried by now."""
        assert self._baud is not None
        now = time.monotonic()
        self._line_free_at = max(self._line_free_at, now - 0.2)  # a busy computer must not slow it
        while self._waiting and self._line_free_at <= now:
            line = self._waiting.popleft()
            self._line_free_at += len(line) * 10 / self._baud
            self.say(line)

    def _answer(self, command: bytes) -> bytes:
        if self.answers in ("mute", "echo"):
            return b""
        if self.answers == "fixed" and command not in (b"O", b"C") and command[:1] not in (b"T", b"t"):
            return b"\a"
        if command == b"V":
            return b"V1013\r"
        if self.answers == "silent":
            return b""
        if command == b"O":
            self.off_bus = False
        if self.neighbour is not None and command[:1] == b"T":
            self.neighbour.say(command + b"\r")
        if command[:1] == b"T":
            self.on_sent(command)
        if command in self.refuses or (self.off_bus and command[:1] == b"T"):
            return b"\a"
        if command == b"F":
            return b"\a" if self.flags is None else b"F%02X\r" % self.flags
        return {b"T": b"Z\r", b"t": b"z\r"}.get(command[:1], b"\r")


def wait_until(condition: Callable[[], object], within_s: float = 5.0) -> None:
    """Return as soon as `condition` holds. Fails after `within_s` seconds."""
    end = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.002)
