"""Bursts: commands to many servos, sent together once in as few ArrayCommands as possible, under a lease."""

import asyncio
import struct
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from hornbill.errors import Busy, Conflict, InvalidValue, NeedsConfirmation, PositionUnitUnknown
from hornbill.servo.device import permission, position_unit
from hornbill.servo.device.permission import Target
from hornbill.servo.device.position_estimate import HALF_TURN_DEG
from hornbill.servo.device.requests import COMMAND, READ
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import FRESH_S, Motion
from hornbill.servo.runtime.leases import HeldLease
from hornbill.units import Uid
from hornbill.wire.bittime import frame_bits
from hornbill.wire.datatype import Kind
from hornbill.wire.layout import half
from hornbill.wire.messages import MAX_COMMANDS, ActuatorCommand, ArrayCommand, CommandType
from hornbill.wire.port import line_bytes
from hornbill.wire.transfer import Transfer, split

MAX_SERVOS: Final = 60
"""Maximum servos per burst: four messages, about 5 ms of bus time."""

_TYPE: Final = {"angle": CommandType.POSITION, "speed": CommandType.SPEED, "torque": CommandType.FORCE}
_HALF: Final = struct.Struct("<e")


@dataclass(frozen=True, slots=True)
class Setpoint:
    """Command of one servo in degrees, rpm or % (table 2-21, not the SI units of the public type)."""

    servo: Servo
    kind: str
    value: float


@dataclass(frozen=True, slots=True)
class Part:
    """Part of a burst for one servo, as sent. `value`: degrees, rpm or %, as represented by the float16."""

    servo: Servo
    kind: str
    target: Target
    command: ActuatorCommand
    value: float
    boot_count: int


@dataclass(frozen=True, slots=True)
class Prepared:
    """A checked burst: `messages` of at most 15 commands each."""

    parts: tuple[Part, ...]
    messages: tuple[list[ActuatorCommand], ...]

    @property
    def warnings(self) -> list[str]:
        """Warnings for the client, each once."""
        return list(dict.fromkeys(text for part in self.parts for text in part.target.warnings))


@dataclass(frozen=True, slots=True)
class Sent:
    """A sent burst. `skew_s`: time from the first to the last message, by the clock when they were handed to the
    adapter or by the bus time of all but the last, whichever is longer."""

    messages: int
    skew_s: float


class Bursts:
    """Prepares bursts, with all checks and missing reads, and sends each in one go, never twice.

    ArrayCommand has no response. A servo that missed it gets the command from its keep-alive through 0x00 to 0x02,
    which according to the document reset the timeout (4.19) and whose response shows that the servo is there; see
    KeepingAlive.
    """

    def __init__(self, services: HostServices, motion: Motion, live: Callable[[], Collection[Servo]]) -> None:
        """`live` returns all servos that may be on the bus."""
        self._requests = services.requests
        self._base = services.base
        self._motion = motion
        self._live = live
        self._full_bits: int | None = None

    async def prepare(
        self, lease_id: str | None, setpoints: Sequence[Setpoint], *, clamp: bool = False, confirm: Collection[str] = ()
    ) -> Prepared:
        """Prepare a burst for up to 60 servos, each once, all or none. Sends no command.

        Raises what Motion.command raises, Conflict for a servo ID that is 0 or not unique, PositionUnitUnknown for an
        angle to a servo whose position unit is in conflict, and InvalidValue for more than 60 servos, a servo named
        twice, and an angle beyond ±180°.
        """
        if not 1 <= len(setpoints) <= MAX_SERVOS:
            raise InvalidValue(
                f"A burst has 1 to {MAX_SERVOS} commands, not {len(setpoints)}. Send several bursts.",
                cause="too_many_commands",
                most=MAX_SERVOS,
            )
        if len({setpoint.servo.uid for setpoint in setpoints}) < len(setpoints):
            raise InvalidValue("A servo has two commands in one burst. Send one per servo.", cause="duplicate_command")
        for setpoint in setpoints:
            self._motion.may_move(setpoint.servo, lease_id)
        outcomes = await asyncio.gather(*(self._freshen(setpoint) for setpoint in setpoints), return_exceptions=True)
        for outcome in outcomes:
            if isinstance(outcome, BaseException):
                raise outcome
        parts: list[Part] = []
        needed: list[NeedsConfirmation] = []
        for setpoint in setpoints:
            lease = self._motion.may_move(setpoint.servo, lease_id)
            self.check_id(setpoint.servo)
            try:
                target = self._motion.permit(
                    setpoint.servo, lease, setpoint.kind, setpoint.value, clamp=clamp, confirm=confirm
                )
            except NeedsConfirmation as error:
                needed.append(error)
                continue
            parts.append(_part(setpoint.servo, setpoint.kind, target))
        if needed:
            raise _together(needed)
        return _packed(parts)

    def renewed(self, prepared: Prepared, values: Mapping[Uid, float], *, clamp: bool = False) -> Prepared:
        """The same servos with new values (others keep theirs), for a stream. Sends nothing.

        Raises OutOfRange, InvalidValue.
        """
        parts: list[Part] = []
        for part in prepared.parts:
            value = values.get(part.servo.uid)
            if value is None:
                parts.append(part)
                continue
            target = permission.target(part.servo, part.kind, value, clamp=clamp)
            parts.append(replace(_part(part.servo, part.kind, target), boot_count=part.boot_count))
        return _packed(parts)

    def send(self, lease_id: str | None, prepared: Prepared) -> Sent:
        """Hand all messages to the bus in one go and take the servos under command. May be called at 50 Hz.

        Checks again, from known values, what may have changed: stop, lease, bus, and each servo's readiness, restarts
        and torque. Raises Stopped, LeaseRequired, LeaseHeld, BusDisconnected, Busy, NoResponse, ConfigurationLost,
        TorqueOff, Conflict, PositionUnitUnknown; nothing was sent then.
        """
        lease = self._check(lease_id, prepared)
        began, handed, left = self._base.now(), 0.0, 0
        try:
            for message in prepared.messages:
                handed = self._base.now() - began
                self._requests.burst(message)
                left += len(message)
        finally:  # if the bus is lost in between, the servos already commanded stay under command
            self._motion.note_burst(lease, [(part.servo, part.target) for part in prepared.parts[:left]])
        return Sent(len(prepared.messages), max(handed, self._wire_s(prepared)))

    def bus_s(self, prepared: Prepared) -> float:
        """Bus time of all messages, s, including bit stuffing, or time on a slower serial line.

        Raises BusDisconnected.
        """
        participant = self._requests.connected()
        line = participant.port.details.serial_line
        rate = None if line is None else line.slcan_bytes_per_s
        bits = size = 0
        for message in prepared.messages:
            whole = ArrayCommand(tuple(message))
            sent = Transfer(Kind.MESSAGE, whole.TYPE.id, participant.node_id, 0, COMMAND.priority, 0, whole.encode())
            frames = split(sent, whole.TYPE)
            bits += sum(map(frame_bits, frames))
            size += sum(map(line_bytes, frames))
        return max(bits / participant.port.bitrate, 0.0 if rate is None else size / rate)

    def check_id(self, servo: Servo) -> None:
        """Raises Conflict unless the servo ID lets ArrayCommand reach this servo and no other (table 2-20)."""
        own = servo.servo_id
        if own is None or not 1 <= own <= 254:
            raise Conflict(
                f"{servo.title} has servo ID {own}, which ArrayCommand cannot address. Assign a unique ID from 1 to "
                "254, or command it alone.",
                key="servo_id", requested=own, owner=None, owner_title=None,
                cause="id_not_addressable", servo=servo.title, uid=servo.uid,
            )  # fmt: skip
        for other in self._live():
            if other is not servo and other.online and other.servo_id == own:
                raise Conflict(
                    f"{servo.title} and {other.title} share servo ID {own}: both would move. Assign unique IDs, "
                    "or command it alone.",
                    key="servo_id", requested=own, owner=other.uid, owner_title=other.title,
                    cause="shared_servo_id", servo=servo.title, uid=servo.uid,
                )  # fmt: skip

    def _check(self, lease_id: str | None, prepared: Prepared) -> HeldLease:
        lease = None
        for part in prepared.parts:
            lease = self._motion.may_move(part.servo, lease_id)
            if part.servo.boot_count != part.boot_count:
                raise Busy(
                    f"{part.servo.title} restarted since the burst was prepared. Prepare it again.",
                    cause="restarted_since_prepared",
                    servo=part.servo.title,
                )
            permission.check_mode(part.servo, part.kind)
            if part.servo.servo_id != part.command.actuator_id:
                raise Busy(
                    f"{part.servo.title} changed its servo ID since the burst was prepared. Prepare it again.",
                    cause="id_changed_since_prepared",
                    servo=part.servo.title,
                )
            if part.kind == "angle":
                _check_unit(part.servo)
        assert lease is not None
        return lease

    async def _freshen(self, setpoint: Setpoint) -> None:
        servo = setpoint.servo
        await self._motion.freshen(servo, setpoint.kind)
        identity = servo.registers["servo_id"]
        if identity.at is None or self._base.now() - identity.at >= FRESH_S:
            await self._requests.read(servo, identity.parameter, READ)

    def _wire_s(self, prepared: Prepared) -> float:
        """Bus time of all messages but the last, s. Bit stuffing varies with the values by a few percent only, so it is
        computed once."""
        participant = self._requests.participant
        if participant is None or len(prepared.messages) < 2:
            return 0.0
        # every message but the last is full
        if self._full_bits is None:
            full = ArrayCommand(tuple(prepared.messages[0]))
            sent = Transfer(Kind.MESSAGE, full.TYPE.id, participant.node_id, 0, COMMAND.priority, 0, full.encode())
            self._full_bits = sum(map(frame_bits, split(sent, full.TYPE)))
        return (len(prepared.messages) - 1) * self._full_bits / participant.port.bitrate


def as_float16(value: float) -> float:
    """A number rounded to float16."""
    return _HALF.unpack(_HALF.pack(half(value)))[0]


def _part(servo: Servo, kind: str, target: Target) -> Part:
    """Raises InvalidValue for multi-turn angles, which need 0x00 (exact at any distance, B25)."""
    number = target.raw / target.parameter.per_unit
    if kind == "angle":
        _check_unit(servo)
        if abs(number) > HALF_TURN_DEG:
            raise InvalidValue(
                f"{number:g}° is beyond ±{HALF_TURN_DEG:g}°, the range of an ArrayCommand. Command {servo.title} "
                "alone.",
                requested=number, minimum=-HALF_TURN_DEG, maximum=HALF_TURN_DEG, uid=servo.uid,
                cause="beyond_array_command_range", servo=servo.title,
            )  # fmt: skip
        wire = as_float16(position_unit.to_position(servo, number))
        value = position_unit.to_degrees(servo, wire)
    else:
        wire = value = as_float16(number)
    assert servo.servo_id is not None
    return Part(servo, kind, target, ActuatorCommand(servo.servo_id, _TYPE[kind], wire), value, servo.boot_count)


def _check_unit(servo: Servo) -> None:
    if not servo.position_unit.sure:
        raise PositionUnitUnknown(
            f"Status and register 0x08 of {servo.title} disagree about the position unit. Command it alone, or force "
            "the position unit.",
            uid=servo.uid, state=servo.position_unit.state, cause="position_unit_conflict", servo=servo.title,
        )  # fmt: skip


def _packed(parts: Sequence[Part]) -> Prepared:
    commands = [part.command for part in parts]
    chunks = tuple(commands[at : at + MAX_COMMANDS] for at in range(0, len(commands), MAX_COMMANDS))
    return Prepared(tuple(parts), chunks)


def _together(needed: Sequence[NeedsConfirmation]) -> NeedsConfirmation:
    """Combine several required confirmations into one error."""
    if len(needed) == 1:
        return needed[0]
    words: list[str] = []
    for error in needed:
        found = error.facts["words"]
        assert isinstance(found, list)
        words += [str(word) for word in found if word not in words]  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    detail = " ".join(error.detail for error in needed[:3])
    servos = [str(error.facts["servo"]) for error in needed]
    return NeedsConfirmation(detail, cause="multi_turn_moves", confirm=words[0], words=words, servos=servos)
