"""A serial CAN adapter on a terminal, a crowd of servos behind it: `python -m bench.serial_crowd FD COUNT`."""

import os
import sys
import time

from bench.crowd import NO_FAULT, Crowd
from hornbill.schema.catalog import Catalog
from hornbill.wire.frame import Frame


def speak(terminal: int, crowd: Crowd) -> None:
    """Act as the adapter until the process is ended: stream and respond in slcan."""
    os.set_blocking(terminal, False)
    streams, began, rest = crowd.streams(), time.monotonic(), b""
    at, said = next(streams)
    while True:
        out: list[Frame] = []
        while began + at <= time.monotonic():
            out += said
            at, said = next(streams)
        try:
            *commands, rest = (rest + os.read(terminal, 65536)).split(b"\r")
        except BlockingIOError:
            commands = []
        for command in commands:
            if command[:1] == b"T":
                out += crowd.respond(Frame(int(command[1:9], 16), bytes.fromhex(command[10:].decode())))
        done = b"".join(b"Z\r" if command[:1] == b"T" else b"\r" for command in commands)
        text = b"".join(b"T%08X%d%s\r" % (one.id, len(one.data), one.data.hex().encode()) for one in out)
        try:
            os.write(terminal, done + text)
        except BlockingIOError:
            pass  # the buffer is full because the host does not read
        time.sleep(0.001)


if __name__ == "__main__":
    speak(int(sys.argv[1]), Crowd(Catalog.load(), int(sys.argv[2]), NO_FAULT))
