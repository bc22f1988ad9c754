"""Bursts: commands for many servos that leave together, as few ArrayCommands, once, under a lease."""

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

MOST: Final = 60
"""Servos in one burst: four messages, about 5 ms of bus."""

_TYPE: Final = {"angle": CommandType.POSITION, "speed": CommandType.SPEED, "torque": CommandType.FORCE}
_HALF: Final = struct.Struct("<e")


@dataclass(frozen=True, slots=True)
class Setpoint:
    """What one servo is to be commanded: degrees, rpm or % (table 2-21, not the SI units of the public type)."""

    servo: Servo
    kind: str
    value: float


@dataclass(frozen=True, slots=True)
class Part:
    """One servo's part, as it will leave. `value`: degrees, rpm or %, as the 16-bit float really holds it."""

    servo: Servo
    kind: str
    target: Target
    command: ActuatorCommand
    value: float
    boot_count: int


@dataclass(frozen=True, slots=True)
class Prepared:
    """A burst that may be sent, in full: `messages` of at most 15 commands each."""

    parts: tuple[Part, ...]
    messages: tuple[list[ActuatorCommand], ...]

    @property
    def warnings(self) -> list[str]:
        """What to tell who asked, each sentence once."""
        return list(dict.fromkeys(text for part in self.parts for text in part.target.warnings))


@dataclass(frozen=True, slots=True)
class Sent:
    """A burst that has left. `skew_s`: from the first to the last message, by the clock at which they were handed to
    the adapter or by the time the bus needs for all but the last, whichever is longer."""

    messages: int
    skew_s: float


class Bursts:
    """Prepares, checking everything and reading what is not known, and sends, in one go and never twice.

    Nobody answers an ArrayCommand. A servo that did not hear it is told by its keep-alive, through 0x00 to 0x02, which
    by the document feed the time-out (4.19) and whose answer shows that the servo is there; see KeepingAlive.
    """

    def __init__(self, services: HostServices, motion: Motion, live: Callable[[], Collection[Servo]]) -> None:
        """`live` gives every servo that may be on the bus."""
        self._requests = services.requests
        self._base = services.base
        self._motion = motion
        self._live = live
        self._full_bits: int | None = None

    async def prepare(
        self, lease_id: str | None, setpoints: Sequence[Setpoint], *, clamp: bool = False, confirm: Collection[str] = ()
    ) -> Prepared:
        """All of it or nothing: up to 60 servos, each once. Sends no command.

        Raises what Motion.command raises, Conflict for a servo id that is 0 or not one servo's alone,
        PositionUnitUnknown for an angle to a servo whose position unit is in conflict, and
        InvalidValue for more than 60, one servo twice, and an angle beyond ±180°.
        """
        if not 1 <= len(setpoints) <= MOST:
            raise InvalidValue(
                f"{len(setpoints)} commands are not 1 to {MOST}. Send several bursts.",
                cause="too_many_commands",
                most=MOST,
            )
        if len({setpoint.servo.uid for setpoint in setpoints}) < len(setpoints):
            raise InvalidValue("A servo has two commands in one burst. Give it one.", cause="duplicate_command")
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
        """The same servos with new values (the others keep theirs), for a stream: asks nothing of the bus.

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
        """Hand all messages to the bus in one go, and take the servos under command. May be called at 50 Hz.

        Checks again what may have changed since: stop, lease, bus, and every servo's readiness, starts and torque, by
        what is known; asks nothing. Raises Stopped, LeaseRequired, LeaseHeld, BusDisconnected, Busy, NoResponse,
        ConfigurationLost, TorqueOff, Conflict, PositionUnitUnknown; then nothing was sent.
        """
        lease = self._check(lease_id, prepared)
        began, handed, left = self._base.now(), 0.0, 0
        try:
            for message in prepared.messages:
                handed = self._base.now() - began
                self._requests.burst(message)
                left += len(message)
        finally:  # a bus that is lost in the middle leaves those under command that were told
            self._motion.note_burst(lease, [(part.servo, part.target) for part in prepared.parts[:left]])
        return Sent(len(prepared.messages), max(handed, self._wire_s(prepared)))

    def bus_s(self, prepared: Prepared) -> float:
        """Seconds of the bus all its messages take, stuffing counted, or of the serial line where that is slower.

        Raises BusDisconnected.
        """
        participant = self._requests.connected()
        line = participant.port.details.serial_line
        rate = None if line is None else line.bytes_per_s
        bits = size = 0
        for message in prepared.messages:
            whole = ArrayCommand(tuple(message))
            sent = Transfer(Kind.MESSAGE, whole.TYPE.id, participant.node_id, 0, COMMAND.priority, 0, whole.encode())
            frames = split(sent, whole.TYPE)
            bits += sum(map(frame_bits, frames))
            size += sum(map(line_bytes, frames))
        return max(bits / participant.port.bitrate, 0.0 if rate is None else size / rate)

    def check_id(self, servo: Servo) -> None:
        """Raises Conflict unless ArrayCommand reaches this servo by its servo id, and nobody else (table 2-20)."""
        own = servo.servo_id
        if own is None or not 1 <= own <= 254:
            raise Conflict(
                f"{servo.title} has servo id {own}, which ArrayCommand cannot address. Give it one of its own, 1 to "
                "254, or command it alone.",
                key="servo_id", requested=own, owner=None, owner_title=None,
                cause="id_not_addressable", servo=servo.title, uid=servo.uid,
            )  # fmt: skip
        for other in self._live():
            if other is not servo and other.online and other.servo_id == own:
                raise Conflict(
                    f"{servo.title} and {other.title} share servo id {own}: both would move. Give each its own, "
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
                    f"{part.servo.title} restarted since the burst was prepared. Prepare it anew.",
                    cause="restarted_since_prepared",
                    servo=part.servo.title,
                )
            permission.check_mode(part.servo, part.kind)
            if part.servo.servo_id != part.command.actuator_id:
                raise Busy(
                    f"{part.servo.title} has another servo id since the burst was prepared. Prepare it anew.",
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
        """Seconds the bus needs for all messages but the last. Stuffing differs from value to value by a few percent:
        what was counted once for a size stands for all of it."""
        participant = self._requests.participant
        if participant is None or len(prepared.messages) < 2:
            return 0.0
        # every message but the last is full
        if self._full_bits is None:
            full = ArrayCommand(tuple(prepared.messages[0]))
            sent = Transfer(Kind.MESSAGE, full.TYPE.id, participant.node_id, 0, COMMAND.priority, 0, full.encode())
            self._full_bits = sum(map(frame_bits, split(sent, full.TYPE)))
        return (len(prepared.messages) - 1) * self._full_bits / participant.port.bitrate


def held(value: float) -> float:
    """What a float16 keeps of a number."""
    return _HALF.unpack(_HALF.pack(half(value)))[0]


def _part(servo: Servo, kind: str, target: Target) -> Part:
    """Raises InvalidValue for angles that count turns: those go by 0x00, which is exact at any distance (B25)."""
    number = target.raw / target.parameter.per_unit
    if kind == "angle":
        _check_unit(servo)
        if abs(number) > HALF_TURN_DEG:
            raise InvalidValue(
                f"{number:g}° is beyond ±{HALF_TURN_DEG:g}°: an ArrayCommand carries no turns. Command {servo.title} "
                "alone.",
                requested=number, minimum=-HALF_TURN_DEG, maximum=HALF_TURN_DEG, uid=servo.uid,
                cause="beyond_array_command_range", servo=servo.title,
            )  # fmt: skip
        wire = held(position_unit.to_position(servo, number))
        value = position_unit.to_degrees(servo, wire)
    else:
        wire = value = held(number)
    assert servo.servo_id is not None
    return Part(servo, kind, target, ActuatorCommand(servo.servo_id, _TYPE[kind], wire), value, servo.boot_count)


def _check_unit(servo: Servo) -> None:
    if not servo.position_unit.sure:
        raise PositionUnitUnknown(
            f"Status of {servo.title} disagrees with register 0x08 about the unit of a position. Command it alone, "
            "or force the unit.",
            uid=servo.uid, state=servo.position_unit.state, cause="position_unit_conflict", servo=servo.title,
        )  # fmt: skip


def _packed(parts: Sequence[Part]) -> Prepared:
    commands = [part.command for part in parts]
    chunks = tuple(commands[at : at + MAX_COMMANDS] for at in range(0, len(commands), MAX_COMMANDS))
    return Prepared(tuple(parts), chunks)


def _together(needed: Sequence[NeedsConfirmation]) -> NeedsConfirmation:
    """One question for all that there is to confirm."""
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
