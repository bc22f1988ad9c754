"""One simulated BLA servo on a bus, as a pure function of frames and time."""

from collections.abc import Sequence
from dataclasses import replace
from random import Random

from hornbill.sim import address
from hornbill.sim.array_command import taken
from hornbill.sim.behaviour import TENTHS_PER_UNIT, Behaviour, PositionUnit
from hornbill.sim.broadcast import Broadcast, actuator_status, node_status
from hornbill.sim.device import ServoBuild, ServoStage, SimDevice
from hornbill.sim.faults import SimFaults
from hornbill.sim.link import SimNode
from hornbill.sim.mechanics.conditions import Conditions
from hornbill.sim.memory import Memory
from hornbill.sim.services import ANSWERED_BEFORE, REFUSED, Answer, Services
from hornbill.units import Instant, NodeId, Raw
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, AllocationMessage, ArrayCommand, Mode, NodeStatus
from hornbill.wire.services import (
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetNodeInfoRequest,
    GetSetRequest,
    RestartNodeRequest,
)
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import AnyStructure, decode


class SimulatedServo:
    """A servo on a bus, without the bus: frames and instants in, frames out.

    Bring it up with `power_on`, give it frames with `on_frames`, call `advance` no later than `next_due`,
    and send what `take_outbox` returns. Nothing here reads a clock, and equal seeds give equal servos.
    """

    def __init__(self, build: ServoBuild) -> None:
        """Raises ValueError for a unique id of another length than 16 bytes and for values ROM cannot hold."""
        if len(build.uid) != 16:
            raise ValueError(f"The unique id is {len(build.uid)} bytes long. Give 16.")
        self.model = build.model
        self.firmware = build.firmware
        self.uid = uid = build.uid
        random = Random(build.seed)
        self._device = SimDevice(build, random, self._up, self._dark)
        self._services = Services(
            build.model, build.firmware, uid, self._device.registers, self.memory, self.conditions.refuse_keys
        )  # fmt: skip
        self._link = SimNode(uid, random, self.conditions)
        self._broadcast = Broadcast(self._link.broadcast)

    # What a test or a bench may know and do.

    @property
    def conditions(self) -> Conditions:
        """What the bench does to it; set its fields at any time."""
        return self._device.conditions

    @property
    def faults(self) -> SimFaults:
        """Its fault bits, which a bench may `inject`."""
        return self._device.faults

    @property
    def memory(self) -> Memory:
        """Its RAM and ROM."""
        return self._device.memory

    @property
    def behaviour(self) -> Behaviour:
        """The choices where the document is silent; assign another to change them at any time."""
        return self._device.commander.behaviour

    @behaviour.setter
    def behaviour(self, behaviour: Behaviour) -> None:
        self._device.commander.behaviour = behaviour
        self.faults.failures_latch = behaviour.failures_latch

    @property
    def position_unit(self) -> PositionUnit:
        """The unit of positions on the bus; assign another at any time."""
        return self.behaviour.position_unit

    @position_unit.setter
    def position_unit(self, unit: PositionUnit) -> None:
        self.behaviour = replace(self.behaviour, position_unit=unit)

    @property
    def serial(self) -> int:
        """Its production number (0x51)."""
        return self.memory.get(address.PRODUCT_NUMBER)

    @property
    def servo_id(self) -> int:
        """The id ArrayCommand knows it by (0x45); 0 as delivered."""
        return self.memory.get(address.SERVO_ID)

    @property
    def stage(self) -> ServoStage:
        """Where it is in its life."""
        return self._device.stage

    @property
    def starts(self) -> int:
        """How many times it came up."""
        return self._device.starts

    @property
    def node_id(self) -> NodeId:
        """Its number on the bus now, 0 while it has none."""
        return self._link.node_id

    @property
    def powered(self) -> bool:
        """Whether its supply is switched on, however low it may be."""
        return self._device.powered

    @property
    def angle_deg(self) -> float:
        """Where the horn stands, in degrees clockwise from the notch, every turn counted; as of the last advance."""
        return self._device.motion.angle

    @property
    def speed_rpm(self) -> float:
        """How fast the horn turns, + clockwise; as of the last advance."""
        return self._device.motion.speed / 6.0

    @property
    def asleep(self) -> bool:
        """Whether the horn rests and costs nothing to simulate."""
        return self._device.motion.asleep

    @property
    def output(self) -> int:
        """What the motor gets now: 0 on, 1 off, 2 brake, as in 0x20 but after time-out and protection."""
        return self._device.commander.output

    @property
    def soft_starting(self) -> bool:
        """Whether the horn is on its slow way to 0° after a start (4.14)."""
        return self._device.commander.soft_starting

    @property
    def boot_loader_writes(self) -> list[tuple[Instant, Raw]]:
        """Every write to 0x49, as (instant, value): there must be none (4.39)."""
        return self._device.registers.boot_loader_writes

    def register(self, at: int) -> Raw | None:
        """What a read of register `at` would answer now."""
        return self._device.registers.read(at)

    def turn_by_hand(self, angle_deg: float, now: Instant) -> bool:
        """Turn the horn until 0x08 would read this angle. False: the motor has its output on and holds against it."""
        self.advance(now)
        motion, commander = self._device.motion, self._device.commander
        motion.advance(now)
        if commander.output == 0:
            return False
        motion.turn(commander.plant_angle(round(angle_deg * 10.0)))
        return True

    def power_on(self, now: Instant) -> None:
        """Switch its supply on."""
        self.advance(now)
        self._device.power_on(now)

    def power_off(self, now: Instant) -> None:
        """Switch its supply off. In the middle of a ROM write this spoils what ROM holds (4.11)."""
        self.advance(now)
        self._device.power_off(now)

    # What a bus does.

    def on_frames(self, frames: Sequence[Frame], now: Instant) -> None:
        """Take frames from the bus. Never raises for what is in them."""
        wanted = self._link.mine(frames)
        if not wanted:
            return
        self.advance(now)
        if not self._device.running:
            return
        self._device.motion.advance(now)
        for transfer in self._link.reassemble(wanted, now):
            structure = decode(transfer)
            if structure is not None and self._device.running:
                self._take(transfer, structure, now)

    def next_due(self) -> Instant:
        """When `advance` is needed next; infinity once its supply is off and its horn rests."""
        due = self._device.due
        return min(due, self._link.due, self._broadcast.due) if self._device.running else due

    def advance(self, now: Instant) -> None:
        """Live up to `now`."""
        while (at := self.next_due()) <= now:
            self._device.live(at)
            if not self._device.running:
                continue
            if self._link.due <= at:
                self._link.live(at)
            if self._broadcast.due <= at:
                self._broadcast.fire(at, self._node_status, self._status)

    def take_outbox(self) -> list[Frame]:
        """The frames to send, in order; they are forgotten here."""
        return self._link.take_outbox()

    def _up(self, now: Instant) -> None:
        self._link.join(NodeId(self.memory.get(address.NODE_ID)), now)
        if self._link.node_id:
            self._broadcast.begin(now)

    def _dark(self) -> None:
        self._link.leave()
        self._broadcast.stop()

    def _take(self, transfer: Transfer, structure: AnyStructure, now: Instant) -> None:
        services = self._services
        match structure:
            case AllocationMessage():
                if self._link.hear(structure, transfer.source, now):
                    self._broadcast.begin(now)
            case ArrayCommand() if not self.conditions.software_update:
                counts, shown = self.behaviour.array_command_feeds_timeout, self.behaviour.array_command_shows
                for at, raw in taken(structure, self.memory, self.behaviour):
                    self._device.commander.command(at, raw, now, counts=counts, shown=shown)
            case GetSetRequest():
                refused = self.conditions.software_update
                answer = REFUSED if refused else services.get_set(structure, self.behaviour, now)
                if answer is not None:
                    self._answer(transfer, answer, now)
            case GetNodeInfoRequest():
                self._answer(transfer, services.node_info(self._node_status(now)), now)
            case ExecuteOpcodeRequest():
                refused = self.conditions.software_update
                outcome = ExecuteOpcodeResponse(0, False) if refused else services.opcode(structure, self.behaviour)
                self._answer(transfer, outcome, now)
            case RestartNodeRequest():
                self._answer(transfer, services.restart(structure), now)
            case _:
                pass

    def _answer(self, request: Transfer, answer: Answer, now: Instant) -> None:
        registers = self._device.registers
        pending, registers.pending = registers.pending, None
        if pending is None or ANSWERED_BEFORE[pending](self.behaviour):
            self._link.answer(request, answer, now)
        if pending is not None:
            self._device.carry_out(pending, now)

    def _node_status(self, now: Instant) -> NodeStatus:
        notifications, warnings, failures = self.faults.words
        if self.behaviour.health_of_notifications:
            warnings |= notifications
        mode = Mode.SOFTWARE_UPDATE if self.conditions.software_update else Mode.OPERATIONAL
        return node_status(now - self._device.started_at, warnings, failures, mode)

    def _status(self) -> ActuatorStatus:
        unit = TENTHS_PER_UNIT[self.position_unit]
        return actuator_status(self.memory.get(address.SERVO_ID), self._device.commander.angle, unit)
