"""Servos as prepared frames, so that results of the host do not include a simulator."""

import asyncio
from collections.abc import Callable, Iterator, Mapping, Sequence

from hornbill.errors import PortError
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Raw
from hornbill.wire.bittime import frame_bits
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, Mode, NodeHealth, NodeStatus
from hornbill.wire.port import PLAIN, FrameSink, PortState, PortStatistics
from hornbill.wire.services import EMPTY, GetNodeInfoRequest, GetSetRequest
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import AnyStructure

HOST = 127
FIRMWARE = "1.300"
ALL_ROWS = "BLA21-06U-AB"
"""A model with PWM: it has all 55 rows, and always reports missing pulses."""

NO_FAULT = "BLA21-06U-A0"
"""A model without PWM: 51 rows, and no faults."""

STATUS_S, ALIVE_S = 0.1, 1.0
"""Periods of Status and NodeStatus (table 2-2)."""

_TAIL_BITS = 0xE0


class Crowd:
    """Servos with node IDs 1 to `count` (at most 125), with all their responses prepared."""

    def __init__(
        self, catalog: Catalog, count: int, model: str = ALL_ROWS, *, rom: Mapping[str, Raw] | None = None
    ) -> None:
        self.count = count
        self._responses: dict[tuple[int, bytes], list[Frame]] = {}
        self._ready: dict[tuple[int, bytes], list[Frame]] = {}
        for node in range(1, count + 1):
            servo = Recipe(model, FIRMWARE, servo_id=node, node_id=node, rom=rom or {}).build(catalog, node)
            servo.power_on(0.0)
            servo.advance(1.0)
            requests: list[AnyStructure] = [GetSetRequest(0, EMPTY, row.name) for row in catalog.readable.values()]
            for request in (GetNodeInfoRequest(), *requests):
                (frame,) = _transfer(request, Kind.REQUEST, HOST, node, 0)
                servo.take_outbox()
                servo.on_frames([frame], 1.0)
                response = [one for one in servo.take_outbox() if one.id >> 16 & 0xFF == request.TYPE.id]
                self._responses[frame.id & 0xFF_FFFF, frame.data[:-1]] = response

    def respond(self, request: Frame) -> list[Frame]:
        """The response to a read, with the request's priority and transfer ID; none to other requests."""
        key = request.id, request.data
        found = self._ready.get(key)
        if found is None:
            canned = self._responses.get((request.id & 0xFF_FFFF, request.data[:-1]), [])
            priority, number = request.id & 0x1F00_0000, request.data[-1] & 31
            found = self._ready[key] = [
                Frame(one.id & 0xFF_FFFF | priority, one.data[:-1] + bytes((one.data[-1] & _TAIL_BITS | number,)))
                for one in canned
            ]
        return found

    def streams(self) -> Iterator[tuple[float, list[Frame]]]:
        """Times from 0, and the broadcasts of one servo then: Status and NodeStatus, servos evenly spaced."""
        turn = 0
        while True:
            for node in range(1, self.count + 1):
                at = turn * STATUS_S + (node - 1) * STATUS_S / self.count
                angle = ((turn + node) % 200 - 100) / 100
                said = _transfer(ActuatorStatus(node, angle, 0.0, 0.0, 0), Kind.MESSAGE, node, 0, turn)
                if (turn + node) % round(ALIVE_S / STATUS_S) == 0:
                    alive = NodeStatus(3600 + int(at), NodeHealth.OK, Mode.OPERATIONAL)
                    said = [*said, *_transfer(alive, Kind.MESSAGE, node, 0, turn // 10)]
                yield at, said
            turn += 1


def _transfer(structure: AnyStructure, kind: Kind, source: int, destination: int, number: int) -> list[Frame]:
    data_type = structure.TYPE
    sent = Transfer(kind, data_type.id, source, destination, 16, number & 31, structure.encode())
    return split(sent, data_type)


class CannedPort:
    """A CanPort with a crowd that responds in the loop's next turn; `sink` receives all other frames."""

    address = "canned:"
    bitrate = 1_000_000
    state = PortState.ACTIVE
    sample_point: float | None = None
    trouble: PortError | None = None
    retry_in_s: float | None = None
    details = PLAIN

    def __init__(self, crowd: Crowd) -> None:
        self.statistics = PortStatistics()
        self._crowd = crowd
        self.sink: FrameSink = list[Frame].clear
        self._due: list[Frame] = []

    def listen(self, sink: FrameSink) -> None:
        """Receive frames here."""
        self.sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """The crowd responds to requests."""
        self.statistics.tx_frames += len(frames)
        for frame in frames:
            response = self._crowd.respond(frame)
            if response and not self._due:
                asyncio.get_running_loop().call_soon(self._deliver)
            self._due += response

    async def close(self) -> None:
        """No more frames are received."""
        self.sink = list[Frame].clear

    def _deliver(self) -> None:
        due, self._due = self._due, []
        self.sink(due)


class CrowdPort:
    """A CanPort with a crowd behind it, on a wire with bit times where what came first goes first.

    Every frame is delivered alone, at the instant of its last bit: the hardest way an adapter could do it.
    """

    address = "canned:crowd"
    bitrate = 1_000_000
    state = PortState.ACTIVE
    sample_point: float | None = None
    trouble: PortError | None = None
    retry_in_s: float | None = None
    details = PLAIN

    def __init__(self, crowd: Crowd) -> None:
        self.statistics = PortStatistics()
        self._crowd = crowd
        self._loop = asyncio.get_running_loop()
        self._sink: FrameSink = list[Frame].clear
        self._free_at = self._began = self._loop.time()
        self._streams = crowd.streams()
        self._stream([])

    def listen(self, sink: FrameSink) -> None:
        """Receive frames here."""
        self._sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """The crowd responds to requests; other frames are sent and ignored."""
        for frame in frames:
            self._carry(frame, self._sent)

    async def close(self) -> None:
        """The crowd stops."""
        self._streams = iter(())

    def _stream(self, said: list[Frame]) -> None:
        for frame in said:
            self._carry(frame, self._received)
        for at, frames in self._streams:
            self._loop.call_at(self._began + at, self._stream, frames)
            return

    def _carry(self, frame: Frame, arrived: Callable[[Frame], None]) -> None:
        bits_s = frame_bits(frame) / self.bitrate
        self._free_at = max(self._loop.time(), self._free_at) + bits_s
        self.statistics.busy_s += bits_s
        self._loop.call_at(self._free_at, arrived, frame)

    def _sent(self, frame: Frame) -> None:
        self.statistics.tx_frames += 1
        for response in self._crowd.respond(frame):
            self._carry(response, self._received)

    def _received(self, frame: Frame) -> None:
        self.statistics.rx_frames += 1
        self._sink([frame._replace(at=self._loop.time())])
