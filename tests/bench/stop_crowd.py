"""Twenty servos behind a serial adapter that record every stop: `python -m bench.stop_crowd FD COUNT`.

For every torque off it prints the node ID and the time (CLOCK_MONOTONIC, one clock for all processes) at which the
adapter received the last of its frames.
"""

import sys
import time

from bench.crowd import HOST, NO_FAULT, Crowd
from bench.serial_crowd import speak
from hornbill.app.serving import raise_priority
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

    def report(self, now: float) -> None:
        """Print the servos stopped since the last call."""
        for node in self.stopped:
            sys.stdout.write(f"{node} {now:.6f}\n")
        if self.stopped:
            sys.stdout.flush()
            self.stopped.clear()


if __name__ == "__main__":
    raise_priority()  # an adapter does not wait for the CPU
    servos = Crowd(Catalog.load(), int(sys.argv[2]), NO_FAULT)
    writable = Writable(servos)
    speak(int(sys.argv[1]), servos, writable.respond, writable.report, pause_s=0.0005)
