"""Twenty servos behind a serial adapter that record every stop: `python -m bench.stop_crowd FD COUNT`.

For every torque off it prints the node id and the instant (CLOCK_MONOTONIC, one clock for all processes) at which the
last of its frames came out of the adapter.
"""

import os
import sys
import time

from bench.crowd import HOST, NO_FAULT, Crowd
from hornbill.schema.catalog import Catalog
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, integer
from hornbill.wire.transfer import Transfer, split

SINGLE = 0xC0


class Writable:
    """A crowd whose torque mode can be written and read, and whose other rows accept every write."""

    def __init__(self, crowd: Crowd) -> None:
        self._crowd = crowd
        self._reassembler = Reassembler()
        self._modes: dict[int, int] = {}
        self.stopped: list[int] = []

    def respond(self, frame: Frame) -> list[Frame]:
        """The response of the addressed servo."""
        single = frame.data[-1] & SINGLE == SINGLE
        if single and b"0x20" not in frame.data:
            return self._crowd.respond(frame)
        return [
            one for received in self._reassembler.feed([frame], time.monotonic()) for one in self._get_set(received)
        ]

    def _get_set(self, received: Transfer) -> list[Frame]:
        request = GetSetRequest.decode(received.payload) if received.kind is Kind.REQUEST else None
        if request is None or received.type_id != GetSetRequest.TYPE.id:
            return []
        node, value = received.destination, request.value
        if request.name == "0x20":
            if value != EMPTY:
                assert isinstance(value.value, int)
                self._modes[node] = value.value
                if value.value == 1:
                    self.stopped.append(node)
            value = integer(self._modes.get(node, 0))
        response = GetSetResponse(value, EMPTY, EMPTY, EMPTY, request.name)
        reply = received._replace(kind=Kind.RESPONSE, source=node, destination=HOST, payload=response.encode())
        return split(reply, GetSetResponse.TYPE)


def speak(terminal: int, count: int) -> None:
    """Act as the adapter until the process is ended."""
    os.set_blocking(terminal, False)
    canned = Crowd(Catalog.load(), count, NO_FAULT)
    crowd, streams, rest = Writable(canned), canned.streams(), b""
    began = time.monotonic()
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
        now = time.monotonic()
        for command in commands:
            if command[:1] == b"T":
                out += crowd.respond(Frame(int(command[1:9], 16), bytes.fromhex(command[10:].decode())))
        for node in crowd.stopped:
            sys.stdout.write(f"{node} {now:.6f}\n")
        if crowd.stopped:
            sys.stdout.flush()
            crowd.stopped.clear()
        done = b"".join(b"Z\r" if command[:1] == b"T" else b"\r" for command in commands)
        text = b"".join(b"T%08X%d%s\r" % (one.id, len(one.data), one.data.hex().encode()) for one in out)
        try:
            os.write(terminal, done + text)
        except BlockingIOError:
            pass  # the buffer is full because the host does not read
        time.sleep(0.0005)


if __name__ == "__main__":
    speak(int(sys.argv[1]), int(sys.argv[2]))
