"""One simulated BLA servo on a bus, as a pure function of frames and time."""

from collections.abc import Sequence
from dataclasses import replace
from random import Random

from hornbill.sim import address
from hornbill.sim.array_command import accepted_commands, addresses
from hornbill.sim.behaviour import TENTHS_PER_UNIT, Behaviour, PositionUnit
from hornbill.sim.broadcast import Broadcast, actuator_status, node_status
from hornbill.sim.device import ServoBuild, ServoStage, SimDevice
from hornbill.sim.faults import SimFaults
from hornbill.sim.link import SimNode
from hornbill.sim.mechanics.conditions import Conditions
from hornbill.sim.mechanics.motion import HornMotion
from hornbill.sim.memory import Memory
from hornbill.sim.services import REFUSED, RESPONDS_FIRST, Response, Services
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
    """A servo without a bus: frames and times in, frames out.

    Start it with `power_on`, pass received frames to `on_frames`, call `advance` no later than `next_due`, and send the
    frames of `take_outbox`. It reads no clock, and equal seeds give equal servos.
    """

    def __init__(self, build: ServoBuild) -> None:
        """Raises ValueError for a unique ID that does not have 16 bytes, and for values invalid in ROM."""
        if len(build.uid) != 16:
            raise ValueError(f"The unique ID is {len(build.uid)} bytes long. It must have 16.")
        self.model = build.model
        self.firmware = build.firmware
        self.uid = uid = build.uid
        random = Random(build.seed)
        self._device = SimDevice(build, random, self._up, self._down)
        self._services = Services(
            build.model, build.firmware, uid, self._device.registers, self.memory, self.conditions.refuse_keys
        )  # fmt: skip
        self._link = SimNode(uid, random, self.conditions)
        self._broadcast = Broadcast(self._link.broadcast)

    # For tests and benches.

    @property
    def conditions(self) -> Conditions:
        """Conditions set by the bench. Its fields may be set at any time."""
        return self._device.conditions

    @property
    def faults(self) -> SimFaults:
        """Fault bits, which a bench may `inject`."""
        return self._device.faults

    @property
    def memory(self) -> Memory:
        """RAM and ROM."""
        return self._device.memory

    @property
    def behaviour(self) -> Behaviour:
        """Behaviour where the document is open. May be assigned at any time."""
        return self._device.commander.behaviour

    @behaviour.setter
    def behaviour(self, behaviour: Behaviour) -> None:
        self._device.commander.behaviour = behaviour
        self.faults.failures_latch = behaviour.failures_latch

    @property
    def position_unit(self) -> PositionUnit:
        """Unit of positions on the bus. May be assigned at any time."""
        return self.behaviour.position_unit

    @position_unit.setter
    def position_unit(self, unit: PositionUnit) -> None:
        self.behaviour = replace(self.behaviour, position_unit=unit)

    @property
    def serial(self) -> int:
        """Product number (0x51)."""
        return self.memory.get(address.PRODUCT_NUMBER)

    @property
    def servo_id(self) -> int:
        """Servo ID for ArrayCommand (0x45). Factory setting 0."""
        return self.memory.get(address.SERVO_ID)

    @property
    def stage(self) -> ServoStage:
        """Stage of the servo."""
        return self._device.stage

    @property
    def starts(self) -> int:
        """Number of starts."""
        return self._device.starts

    @property
    def started_at(self) -> Instant:
        """Time of its last start."""
        return self._device.started_at

    @property
    def node_id(self) -> NodeId:
        """Current node ID. 0 if none."""
        return self._link.node_id

    @property
    def powered(self) -> bool:
        """Whether its supply is switched on, regardless of voltage."""
        return self._device.powered

    @property
    def angle_deg(self) -> float:
        """Angle of the horn in degrees clockwise from the notch, including turns, as of the last advance."""
        return self._device.motion.angle

    @property
    def speed_rpm(self) -> float:
        """Speed of the horn, + clockwise, as of the last advance."""
        return self._device.motion.speed / 6.0

    @property
    def motion(self) -> HornMotion:
        """The horn, as of the last advance. To read only: its orders come from registers, its constants from
        `conditions`."""
        return self._device.motion

    @property
    def board_c(self) -> float:
        """Temperature of the board, °C, without error of the sensor."""
        return self._device.protection.board_c

    @property
    def supply_v(self) -> float:
        """Supply at the motor, V, without error of the sensor."""
        return self._device.protection.supply * self.model.nominal_v

    @property
    def reported_angle_deg(self) -> float:
        """Angle that 0x08 reads, with origin, reverse and turns, without noise of the sensor."""
        return self._device.commander.angle / 10.0

    @property
    def asleep(self) -> bool:
        """Whether the horn is at rest and needs no simulation."""
        return self._device.motion.asleep

    @property
    def commanded(self) -> bool:
        """Whether a command has arrived since the start. Torque mode counts, as for the timeout (4.19)."""
        return self._device.commander.commanded

    @property
    def output(self) -> int:
        """Motor output: 0 on, 1 off, 2 brake, as in 0x20 but after timeout and protection."""
        return self._device.commander.output

    @property
    def soft_starting(self) -> bool:
        """Whether soft start is moving the horn to 0° (4.14)."""
        return self._device.commander.soft_starting

    @property
    def boot_loader_writes(self) -> list[tuple[Instant, Raw]]:
        """All writes to 0x49, as (time, value). There must be none (4.39)."""
        return self._device.registers.boot_loader_writes

    def stored(self) -> dict[str, Raw]:
        """Values in ROM by key, raw. They are used at the next start only if ROM is sound."""
        memory = self._device.memory
        values = {row.key: memory.stored(at) for at, row in memory.rows.items()}
        return {key: raw for key, raw in values.items() if raw is not None}

    def in_use(self) -> dict[str, Raw]:
        """Values of writable rows in RAM as a read returns them, by key, raw. During soft start some are temporary."""
        memory = self._device.memory
        return {row.key: memory.shown(at, self.behaviour) for at, row in memory.rows.items() if row.writable}

    def register(self, at: int) -> Raw | None:
        """Value that a read of register `at` would return now."""
        return self._device.registers.read(at)

    def turn_manually(self, angle_deg: float, now: Instant) -> bool:
        """Turn the horn manually until 0x08 reads this angle. False: the motor has torque and resists."""
        self.advance(now)
        motion, commander = self._device.motion, self._device.commander
        motion.advance(now)
        if commander.output == 0:
            return False
        motion.turn(commander.plant_angle(round(angle_deg * 10.0)))
        return True

    def power_on(self, now: Instant) -> None:
        """Switch the supply on."""
        self.advance(now)
        self._device.power_on(now)

    def power_off(self, now: Instant) -> None:
        """Switch the supply off. During a ROM write this corrupts ROM (4.11)."""
        self.advance(now)
        self._device.power_off(now)

    # For the bus.

    def on_frames(self, frames: Sequence[Frame], now: Instant) -> bool:
        """Process received frames; False: none was for this servo. Never raises, whatever their content."""
        accepted = self._link.accept(frames)
        if not accepted:
            return False
        self.advance(now)
        if not self._device.running:
            return True
        self._device.motion.advance(now)
        for transfer in self._link.reassemble(accepted, now):
            if transfer.type_id == ArrayCommand.TYPE.id and not addresses(transfer.payload, self.memory):
                continue
            structure = decode(transfer)
            if structure is not None and self._device.running:
                self._take(transfer, structure, now)
        return True

    def next_due(self) -> Instant:
        """Time of the next required `advance`. Infinity once its supply is off and its horn is at rest."""
        device = self._device
        due = device.due
        if device.stage is not ServoStage.RUNNING:
            return due
        link, broadcast = self._link.due, self._broadcast.due
        if link < due:
            due = link
        return broadcast if broadcast < due else due

    def next_message(self) -> Instant:
        """Time of the next frame it sends on its own. What happens before may be simulated then, as of its own time.

        While it does not run, the time of the next required `advance`.
        """
        if self._device.stage is not ServoStage.RUNNING:
            return self._device.due
        return min(self._link.due, self._broadcast.due)

    def advance(self, now: Instant) -> None:
        """Simulate up to `now`."""
        while (at := self.next_due()) <= now:
            self._device.run_due(at)
            if not self._device.running:
                continue
            if self._link.due <= at:
                self._link.run_due(at)
            if self._broadcast.due <= at:
                self._broadcast.fire(at, self._node_status, self._status)

    def take_outbox(self) -> list[Frame]:
        """Remove and return the frames to send, in order."""
        return self._link.take_outbox()

    def _up(self, now: Instant) -> None:
        self._link.join(NodeId(self.memory.get(address.NODE_ID)), now)
        if self._link.node_id:
            self._broadcast.begin(now)

    def _down(self) -> None:
        self._link.leave()
        self._broadcast.stop()

    def _take(self, transfer: Transfer, structure: AnyStructure, now: Instant) -> None:
        services = self._services
        match structure:
            case AllocationMessage():
                if self._link.receive(structure, transfer.source, now):
                    self._broadcast.begin(now)
            case ArrayCommand() if not self.conditions.software_update:
                counts, shown = self.behaviour.array_command_feeds_timeout, self.behaviour.array_command_shows
                for at, raw in accepted_commands(structure, self.memory, self.behaviour):
                    self._device.commander.command(at, raw, now, counts=counts, shown=shown)
            case GetSetRequest():
                refused = self.conditions.software_update
                response = REFUSED if refused else services.get_set(structure, self.behaviour, now)
                if response is not None:
                    self._respond(transfer, response, now)
            case GetNodeInfoRequest():
                self._respond(transfer, services.node_info(self._node_status(now)), now)
            case ExecuteOpcodeRequest():
                refused = self.conditions.software_update
                outcome = ExecuteOpcodeResponse(0, False) if refused else services.opcode(structure, self.behaviour)
                self._respond(transfer, outcome, now)
            case RestartNodeRequest():
                self._respond(transfer, services.restart(structure), now)
            case _:
                pass

    def _respond(self, request: Transfer, response: Response, now: Instant) -> None:
        registers = self._device.registers
        pending, registers.pending = registers.pending, None
        if pending is None or RESPONDS_FIRST[pending](self.behaviour):
            self._link.respond(request, response, now)
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
        return actuator_status(self.memory.get(address.SERVO_ID), self._device.commander.noisy_angle(), unit)
