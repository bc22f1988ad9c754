"""Owns FakeAdapter: a serial adapter that speaks slcan, at the far end of a pseudo terminal, with every bad habit."""

import os
import pty
import select
import threading
import time
import tty
from collections.abc import Callable
from types import TracebackType
from typing import Self


class FakeAdapter:
    """Answers commands in a thread of its own until it is unplugged.

    `answers` says how: "lawicel" with CR, BELL, z and Z; "silent" with nothing but its version, as CANable's first
    firmware; "mute" not even with that. `refuses` are commands it answers with BELL. `flags` is what F answers, or
    None for an adapter that does not know F. `boots_for_s`: deaf for so long after it is opened.
    """

    def __init__(
        self,
        *,
        answers: str = "lawicel",
        refuses: tuple[bytes, ...] = (),
        flags: int | None = None,
        boots_for_s: float = 0.0,
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

    def say(self, data: bytes) -> None:
        """Send `data` to the computer, all of it, however long that takes."""
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
        while not self._ending:
            if not self._reading.is_set():
                self._resting.set()
                self._reading.wait()
            ready, _, _ = select.select([self._end], [], [], 0.01)
            if not ready:
                continue
            *commands, rest = (rest + os.read(self._end, 65536)).split(b"\r")
            if time.monotonic() < self._hears_from:
                continue
            self.heard += commands
            answer = b"".join(map(self._answer, commands))
            if answer:
                self.say(answer)

    def _answer(self, command: bytes) -> bytes:
        if self.answers == "mute":
            return b""
        if command == b"V":
            return b"V1013\r"
        if self.answers == "silent":
            return b""
        if command == b"O":
            self.off_bus = False
        if self.neighbour is not None and command[:1] == b"T":
            self.neighbour.say(command + b"\r")
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
