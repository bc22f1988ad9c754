"""A serial CAN adapter on a terminal, a crowd of servos behind it: `python -m bench.serial_crowd FD COUNT`."""

import os
import sys
import time
from collections.abc import Callable

from bench.crowd import NO_FAULT, Crowd
from hornbill.schema.catalog import Catalog
from hornbill.wire.frame import Frame


def speak(
    terminal: int,
    crowd: Crowd,
    respond: Callable[[Frame], list[Frame]],
    received: Callable[[float], None] = lambda _at: None,
    pause_s: float = 0.001,
) -> None:
    """Act as the adapter until the process is ended: stream and respond in slcan.

    `received` is called after each batch of commands, with the time at which it was read.
    """
    os.set_blocking(terminal, False)
    streams, began, rest = crowd.streams(), time.monotonic(), b""
    at, due = next(streams)
    while True:
        out: list[Frame] = []
        while began + at <= time.monotonic():
            out += due
            at, due = next(streams)
        try:
            *commands, rest = (rest + os.read(terminal, 65536)).split(b"\r")
        except BlockingIOError:
            commands = []
        now = time.monotonic()
        for command in commands:
            if command[:1] == b"T":
                out += respond(Frame(int(command[1:9], 16), bytes.fromhex(command[10:].decode())))
        received(now)
        done = b"".join(b"Z\r" if command[:1] == b"T" else b"\r" for command in commands)
        text = b"".join(b"T%08X%d%s\r" % (one.id, len(one.data), one.data.hex().encode()) for one in out)
        try:
            os.write(terminal, done + text)
        except BlockingIOError:
            pass  # the buffer is full because the host does not read
        time.sleep(pause_s)


if __name__ == "__main__":
    servos = Crowd(Catalog.load(), int(sys.argv[2]), NO_FAULT)
    speak(int(sys.argv[1]), servos, servos.respond)
