"""SimulatedAutopilot: ArduPilot or PX4 as a node: allocator, ArrayCommand, arming, safety switch, restart."""

import asyncio
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Final

from hornbill.domain.autopilot import Program
from hornbill.errors import BusDisconnected
from hornbill.units import Instant
from hornbill.wire.datatype import DataType, Kind, Structure
from hornbill.wire.frame import Frame
from hornbill.wire.messages import (
    ActuatorCommand,
    AllocationMessage,
    ArrayCommand,
    CommandType,
    Mode,
    NodeHealth,
    NodeStatus,
)
from hornbill.wire.port import CanPort
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import GetNodeInfoRequest, GetNodeInfoResponse, HardwareVersion, SoftwareVersion
from hornbill.wire.transfer import END, START, Transfer, split

MAX_OUTPUTS: Final = 15

_NAMES: Final = {"ardupilot": "org.ardupilot:0", "px4": "org.pixhawk.px4_fmu-v5"}
_NODE_IDS: Final = {"ardupilot": 10, "px4": 1}
_FIRST_ACTUATOR: Final = {"ardupilot": 1, "px4": 0}
_UID_PARTS: Final = (6, 6, 4)
"""Bytes of the unique ID in the three requests of an allocation (section 2.3)."""
_FOLLOW_UP_S: Final = 1.0
_STATUS_S: Final = 1.0
_HIGHEST_ID: Final = 125
_ARMING_STATUS: Final = 1100
"""Data type ID of uavcan.equipment.safety.ArmingStatus, one byte: 0 disarmed, 255 armed."""
_ARMED: Final = 255
_PRIORITY: Final = 16
_LOW_PRIORITY: Final = 24


@dataclass(slots=True)
class AutopilotOutput:
    """One output: end and neutral angles of the servo, °, and the demand, −1 to 1."""

    low_deg: float = -45.0
    high_deg: float = 45.0
    neutral_deg: float = 0.0
    reversed: bool = False
    demand: float = 0.0
    sent: bool = True
    """Whether ArrayCommand has an entry for it (CAN_D1_UC_SRV_BM, UAVCAN_SV_FUNCn)."""

    @property
    def degrees(self) -> float:
        """Commanded angle, °, in steps of 0.36°."""
        demand = max(-1.0, min(1.0, -self.demand if self.reversed else self.demand))
        end = self.high_deg if demand > 0 else self.low_deg
        exact = self.neutral_deg + abs(demand) * (end - self.neutral_deg)
        return round(exact / 0.36) * 0.36


class SimulatedAutopilot:
    """An autopilot on one port. It moves its outputs by `sweep` unless demands are set."""

    def __init__(
        self,
        port: CanPort,
        program: Program,
        *,
        outputs: int = 4,
        rate_hz: float = 50.0,
        clock: Callable[[], Instant],
        taken: Collection[int] = (),
    ) -> None:
        """`outputs`: 1 to 15. `rate_hz`: of ArrayCommand. `taken`: node IDs of others."""
        self.program: Program = program
        first = _NODE_IDS[program]
        self.node_id = next(one for one in range(first, _HIGHEST_ID) if one not in taken)
        """That of its program, or the next free one."""
        self.rate_hz = rate_hz
        self.armed = False
        self.safety_on = program == "ardupilot"
        self.sweep = True
        """Move all outputs slowly between their ends while armed."""
        self.outputs = [AutopilotOutput() for _ in range(max(1, min(MAX_OUTPUTS, outputs)))]
        self.allocated: dict[bytes, int] = {}
        self.sent_commands = 0
        self._port = port
        self._clock = clock
        self._born = clock()
        self._reassembler = Reassembler(self.node_id)
        self._transfer_ids: dict[int, int] = {}
        self._request = b""
        self._request_at: Instant = -math.inf
        self._taken: set[int] = set()
        self._tasks: list[asyncio.Task[None]] = []

    def start(self) -> None:
        """Join the bus."""
        self._born = self._clock()
        self._port.listen(self._receive)
        loop = asyncio.get_running_loop()
        self._tasks = [loop.create_task(self._report()), loop.create_task(self._command())]

    def restart(self) -> None:
        """Restart: it forgets arming and its safety switch, and is silent for two seconds."""
        for task in self._tasks:
            task.cancel()
        self.armed, self.safety_on = False, self.program == "ardupilot"
        self._tasks = [asyncio.get_running_loop().create_task(self._start_later())]

    async def close(self) -> None:
        """Leave the bus. Idempotent."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._tasks = []
        await self._port.close()

    def actuator_id(self, index: int) -> int:
        """Actuator ID of an output, counted from 0."""
        return index + _FIRST_ACTUATOR[self.program]

    async def _start_later(self) -> None:
        await asyncio.sleep(2.0)
        self.start()

    async def _report(self) -> None:
        while True:
            self._broadcast(self._status(), _LOW_PRIORITY)
            tail = START | END | self._next_transfer_id(_ARMING_STATUS)
            status = bytes((_ARMED if self.armed else 0, tail))
            self._send([Frame(_LOW_PRIORITY << 24 | _ARMING_STATUS << 8 | self.node_id, status)])
            await asyncio.sleep(_STATUS_S)

    async def _command(self) -> None:
        due = self._clock()
        while True:
            commands = self.commands()
            if commands:
                self._broadcast(ArrayCommand(tuple(commands)), _PRIORITY)
                self.sent_commands += 1
            due = max(due + 1 / self.rate_hz, self._clock())
            await asyncio.sleep(max(0.0, due - self._clock()))

    def commands(self) -> list[ActuatorCommand]:
        """Entries of the next ArrayCommand.

        ArduPilot sends none while its safety switch is on; PX4 sends the neutral angle while disarmed.
        """
        if self.safety_on:
            return []
        found: list[ActuatorCommand] = []
        for index, one in enumerate(self.outputs):
            if not one.sent:
                continue
            if self.sweep and self.armed:
                one.demand = math.sin(2 * math.pi * 0.2 * (self._clock() - self._born) + index)
            degrees = one.degrees if self.armed or self.program == "ardupilot" else one.neutral_deg
            found.append(ActuatorCommand(self.actuator_id(index), CommandType.UNITLESS, degrees / 180))
        return found

    def _receive(self, frames: list[Frame]) -> None:
        now = self._clock()
        self._taken.update(frame.id & 0x7F for frame in frames)
        for transfer in self._reassembler.feed(frames, now):
            if transfer.kind is Kind.MESSAGE and transfer.type_id == AllocationMessage.TYPE.id:
                message = AllocationMessage.decode(transfer.payload)
                if message is not None and transfer.source == 0:
                    self._allocate(message, now)
            elif transfer.kind is Kind.REQUEST and transfer.type_id == GetNodeInfoRequest.TYPE.id:
                payload = self._info().encode()
                reply = transfer._replace(
                    kind=Kind.RESPONSE, source=self.node_id, destination=transfer.source, payload=payload
                )
                self._send(split(reply, GetNodeInfoResponse.TYPE))

    def _allocate(self, message: AllocationMessage, now: Instant) -> None:
        """Respond to one of the three requests of an allocation."""
        if message.first_part_of_unique_id:
            self._request = b""
        elif now - self._request_at > _FOLLOW_UP_S or not self._request:
            return
        self._request, self._request_at = (self._request + message.unique_id)[:16], now
        node_id = 0
        if len(self._request) == sum(_UID_PARTS):
            node_id = self.allocated.get(self._request, 0) or self._free(message.node_id)
            self.allocated[self._request] = node_id
        self._broadcast(AllocationMessage(node_id, first_part_of_unique_id=False, unique_id=self._request), 30)
        if node_id:
            self._request = b""

    def _free(self, preferred: int) -> int:
        """A node ID that no node uses, from the preferred or the highest one down."""
        used = {*self._taken, *self.allocated.values(), self.node_id}
        first = preferred if 1 <= preferred <= _HIGHEST_ID else _HIGHEST_ID
        return next((one for one in (*range(first, 0, -1), *range(_HIGHEST_ID, first, -1)) if one not in used), 0)

    def _status(self) -> NodeStatus:
        return NodeStatus(int(self._clock() - self._born), NodeHealth.OK, Mode.OPERATIONAL)

    def _info(self) -> GetNodeInfoResponse:
        unique = self.program.encode().ljust(16, b"\0")
        return GetNodeInfoResponse(
            self._status(), SoftwareVersion(4, 6), HardwareVersion(1, 0, unique), _NAMES[self.program]
        )

    def _broadcast(self, message: Structure, priority: int) -> None:
        data_type: DataType = message.TYPE
        number = self._next_transfer_id(data_type.id)
        transfer = Transfer(Kind.MESSAGE, data_type.id, self.node_id, 0, priority, number, message.encode())
        self._send(split(transfer, data_type))

    def _next_transfer_id(self, type_id: int) -> int:
        number = self._transfer_ids.get(type_id, 0)
        self._transfer_ids[type_id] = (number + 1) & 31
        return number

    def _send(self, frames: list[Frame]) -> None:
        try:
            self._port.send(frames)
        except BusDisconnected:
            return  # the bus is back later; the next cycle sends again
