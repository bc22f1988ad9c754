"""Commands under a live lease, kept alive while it lives, and torque off the moment it does not."""

import asyncio
from collections.abc import Callable, Collection, Generator
from contextlib import contextmanager
from copy import copy
from dataclasses import replace

from hornbill.domain.motion import Caution
from hornbill.errors import (
    BusDisconnected,
    Busy,
    HornbillError,
    LeaseRequired,
    NoResponse,
    Refused,
    TorqueOff,
    UnexpectedResult,
)
from hornbill.schema.effect import MODE
from hornbill.schema.parameter import DUMMY, Parameter
from hornbill.servo.device import permission
from hornbill.servo.device.output import KEY, MODES, ON, off_mode
from hornbill.servo.device.permission import Target
from hornbill.servo.device.requests import COMMAND, POLL, READ, TORQUE, RetryPolicy
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion import cautions
from hornbill.servo.motion.keeping_alive import CommandedServo, KeepingAlive
from hornbill.servo.runtime.hub import BusUsable, ServoChanged, StopPressed
from hornbill.servo.runtime.leases import HeldLease
from hornbill.servo.torque_off.retries import TorqueOffRetries
from hornbill.servo.torque_off.stop import StopControl
from hornbill.units import Raw, Uid

FRESH_S = 1.0
"""How old a reading may be that decides whether a command is let through."""

AGEING_S = 0.4
"""From this age on it is read again beside a command, so that the next one need not wait for it."""

LEAVE_S = 0.3


AT_REST_RPM = 5
"""A horn at rest is measured no faster."""

_REPEATED = replace(TORQUE, tries=READ.tries)
"""For 1.25 s."""

AT_ONCE = replace(COMMAND, urgent=True)
"""A jog does not wait for the answer to a read of the same servo. One at a time, so that stop never lacks a number."""


class Motion:
    """Everything that can make a horn move goes through here.

    A servo whose command ended is pending torque off, until it answers or is commanded again under a lease.
    """

    def __init__(
        self, services: HostServices, stop: StopControl, torque_off: TorqueOffRetries, streamed: Callable[[Uid], bool]
    ) -> None:
        """`streamed`: whether a stream commands a servo. A command of its own would be overruled by the next burst."""
        self._requests = requests = services.requests
        self._hub = hub = services.hub
        self._base = base = services.base
        self._leases = services.leases
        self.stop = stop
        self.torque_off = torque_off
        self._streamed = streamed
        self._commanded: dict[Uid, CommandedServo] = {}
        self._energised: dict[Uid, tuple[Servo, str]] = {}
        """Servos that a lease energised and its ID, also by a save or a restart: off when it ends, commanded or not."""
        self._sending: dict[asyncio.Task[Raw], Uid] = {}
        self._ageing: dict[Uid, asyncio.Task[None]] = {}
        self.keeping_alive = KeepingAlive(requests, hub, base, self._gate, self._send, self._commanded.get)
        self._bus_gone = False
        self.leaving = False
        """The bus is being left: nothing may be put under command any more."""
        hub.subscribe(lambda _pressed: self.cancel_commands(), StopPressed)
        hub.subscribe(self._on_bus, BusUsable)

    def is_commanded(self, uid: Uid) -> bool:
        """Whether somebody has this servo under command."""
        return uid in self._commanded

    def last_command(self, uid: Uid) -> Target | None:
        """What this servo was commanded last, as far as it is under command."""
        commanded = self._commanded.get(uid)
        return None if commanded is None else commanded.target

    async def command(
        self, servo: Servo, lease_id: str | None, kind: str, value: float, *, clamp: bool, confirm: Collection[str] = ()
    ) -> Target:
        """Send one angle (degrees), speed (rpm) or torque (%) command and keep it alive while the lease lives.

        `confirm`: words of NeedsConfirmation that were answered. Raises Stopped, LeaseRequired, LeaseHeld, Busy,
        NoResponse, ConfigurationLost, NotInThisModel, ModeOff, TorqueOff, OutOfRange, InvalidValue, NeedsConfirmation,
        Refused.
        """
        self.may_move(servo, lease_id)
        await self.freshen(servo, kind)
        lease = self.may_move(servo, lease_id)
        if self._streamed(servo.uid):
            raise Busy(
                f"{servo.title} is commanded by a stream. Give the stream its value, or end it first.",
                cause="commanded_by_stream",
                servo=servo.title,
            )
        target = self.permit(servo, lease, kind, value, clamp=clamp, confirm=confirm)
        commanded = self._take_command(servo, lease)
        self.keeping_alive.pause(commanded)  # or the old target could leave after the new one
        try:
            # beside a read that is under way, but never before a command that is
            waits = servo.uid in self._sending.values()
            holds = await self._send(commanded, target, COMMAND if waits else AT_ONCE)
        except NoResponse:
            if not await self._arrived(commanded, target):
                raise
            holds = target.raw
        self._note_confirmed(commanded, target)
        self._note_command(servo, target)
        self.keeping_alive.begin(commanded, target, holds)
        return target

    def permit(
        self, servo: Servo, lease: HeldLease, kind: str, value: float, *, clamp: bool, confirm: Collection[str]
    ) -> Target:
        """What may be sent, by what has just been read; its `warnings` are what to say. Asks nothing of the bus.

        Raises ModeOff, TorqueOff, NotInThisModel, OutOfRange, InvalidValue, NeedsConfirmation.
        """
        permission.check_mode(servo, kind)
        target = permission.target(servo, kind, value, clamp=clamp)
        said = self.cautions(servo, kind, target.raw)
        cautions.require(servo, said, confirm)
        if not said:
            return target
        words = frozenset(one.confirm for one in said if one.confirm is not None)
        return replace(target, warnings=tuple(one.text for one in said), confirmed=words)

    def cautions(self, servo: Servo, kind: str, raw: Raw) -> list[Caution]:
        """What there is to say before `kind` is commanded to `raw`, by what was read last."""
        keys = ("current_angle", "command_angle")  # on the way the horn is somewhere between them
        known = (servo.registers[key] for key in keys if key in servo.registers)
        here = [one.raw for one in known if one.raw is not None and one.at is not None and one.raw != DUMMY]
        return cautions.cautions(servo, kind, raw, here, self.keeping_alive.shortest_s)

    def note_burst(self, lease: HeldLease, parts: Collection[tuple[Servo, Target]]) -> None:
        """Take servos under command to which a burst has just been handed, and keep them alive."""
        now = self._base.now()
        for servo, target in parts:
            commanded = self._take_command(servo, lease)
            self._note_confirmed(commanded, target)
            servo.output.commanded(now)
            before = servo.raw(target.parameter.key)
            self._note_command(servo, target, tell=before is None or before == DUMMY)
            servo.note(target.parameter.key, target.raw, now)
            for key in permission.ROW_OF.values():
                servo.forget(key)  # whether ArrayCommand shows in them is not documented
            self.keeping_alive.begin_unacknowledged(commanded, target)

    def check_command(self, servo: Servo, lease_id: str | None, target: Target) -> None:
        """Whether it is still under this command, for whoever waits for its end.

        Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoResponse, TorqueOff, BusDisconnected; and what ended the
        feeding of its time-out, if that ended by itself.
        """
        self.may_move(servo, lease_id)
        commanded = self._commanded.get(servo.uid)
        if commanded is None:
            raise TorqueOff(
                f"Torque was taken from {servo.title} before it settled.",
                cause="torque_switched_off",
                servo=servo.title,
            )
        if commanded.target is None or (commanded.target.parameter, commanded.target.raw) != (
            target.parameter,
            target.raw,
        ):
            raise Busy(
                f"{servo.title} was given another command before it settled.",
                cause="command_superseded",
                servo=servo.title,
            )
        if (why := commanded.end_reason) is not None:
            error = copy(why)
            error.extend(
                before=f"{servo.title} was let go before it settled: ",
                also="released_before_settling",
                servo=servo.title,
            )
            raise error
        if commanded.alive is None or commanded.alive.done():
            raise Busy(
                f"{servo.title} was let go before it settled.", cause="released_before_settling", servo=servo.title
            )

    async def switch(self, servo: Servo, torque: Raw, lease_id: str | None, *, by: str | None = None) -> Raw:
        """Write 0x20: what it holds then. On needs a lease (`torque_on`), off and brake do not (`torque_away`)."""
        if torque == ON:
            return await self.torque_on(servo, lease_id)
        return await self.disable_torque(servo, off_mode(torque), by=by)

    async def torque_on(self, servo: Servo, lease_id: str | None) -> Raw:
        """Energise the motor where it stands, under a lease. Raises as `command` does.

        The present angle becomes the command before and after. Before, because an output that the servo's own time-out
        took comes back with what was commanded last (section 4.19); after, because one that was off comes back without
        a command (section 4.13), and so that the time-out does not take it while the lease lives.
        """
        lease = self.may_move(servo, lease_id)
        mode = servo.registers["torque_mode"].parameter
        commanded = self._take_command(servo, lease)
        self.keeping_alive.pause(commanded)
        here = await self._present_angle(servo)
        self.may_move(servo, lease_id)
        if here is not None:
            await self._send(commanded, here, TORQUE)
        servo.output.switch(ON, "command", lease.holder)
        raw = await self._send(commanded, Target(mode, ON, clamped=False), TORQUE)
        hold = await self._present_angle(servo)
        if raw == ON and hold is not None:
            self.may_move(servo, lease_id)
            try:
                holds = await self._send(commanded, hold, COMMAND)
            except NoResponse:
                if not await self._arrived(commanded, hold):
                    raise
                holds = hold.raw
            self._note_command(servo, hold)
            self.keeping_alive.begin(commanded, hold, holds)
            return raw
        for key in permission.ROW_OF.values():  # the servo has set them anew (section 4.13)
            await self._requests.read(servo, servo.registers[key].parameter, READ)
        return raw

    def check_energise(self, servo: Servo) -> None:
        """What `energise` raises before it sends anything.

        Raises Stopped, BusDisconnected, BusReadOnly, NoResponse, Busy, ConfigurationLost, NotInThisModel.
        """
        self._check_open()
        permission.check_energise(servo)

    async def energise(self, servo: Servo, by: str) -> None:
        """Output on where the horn stands, for the moment before ROM is written. Nobody commands it afterwards.

        No lease: the caller is a job that has this servo, and takes the output again if ROM is not written. The present
        angle becomes the command first (see `torque_on`). Both writes are repeated until they are answered: the one
        moves nothing, the other is the same however often it arrives.

        Raises as `check_energise`; Busy for a horn that turns, TorqueOff when somebody takes the output meanwhile,
        UnexpectedResult, NoResponse, Refused.
        """
        self.check_energise(servo)
        taken = servo.output.disable_count
        speed = await self._requests.read(servo, servo.registers["current_speed"].parameter, READ)
        if abs(speed) > AT_REST_RPM:
            raise Busy(
                f"The horn of {servo.title} turns at {speed} rpm with its output off. Let it come to rest.",
                cause="horn_turning_output_off",
                servo=servo.title,
                speed_rpm=speed,
            )
        angle = await self._requests.read(servo, servo.registers["current_angle"].parameter, READ)
        await self._write_until_acknowledged(
            servo, Target(permission.row_for(servo, "angle"), angle, clamped=False), taken
        )
        servo.output.switch(ON, "command", by)
        mode = servo.registers["torque_mode"].parameter
        if await self._write_until_acknowledged(servo, Target(mode, ON, clamped=False), taken) != ON:
            raise UnexpectedResult(
                f"{servo.title} did not take torque on, which ROM was to hold.",
                differences=[{"key": mode.key, "wanted": "on", "found": None}],
                cause="torque_on_not_accepted",
                servo=servo.title,
            )

    async def disable_torque(self, servo: Servo, mode: str, *, by: str | None = None) -> Raw:
        """Torque off or brake: needs no lease and overtakes everything. Raises NoResponse, Refused, BusDisconnected.

        `by`: who asks for it, the holder of the lease it is under unless given.
        """
        by = by or self._holder(servo)
        pending = self.is_commanded(servo.uid) or self.torque_off.pending(servo.uid)
        self._end_command(servo.uid)
        self.torque_off.cancel_for_command(servo.uid)  # or an "off" of before could follow the brake
        if mode == "off":
            self.torque_off.release_brake(servo.uid)
        raw = await self.torque_off.write(servo, mode, "command", by, retry=pending)
        self._hub.publish(ServoChanged(servo.uid))
        return raw

    def stop_commanding(self, servo: Servo) -> None:
        """Command it no more, and leave torque as it is: for a horn that holds its place as it did before we came."""
        commanded = self._commanded.get(servo.uid)
        if commanded is not None and not commanded.found:
            self._energised.pop(servo.uid, None)
        self._end_command(servo.uid)

    def claim(self, servo: Servo, lease_id: str | None) -> None:
        """A save or a restart under this lease is about to give a servo its output: the end of the lease takes it."""
        lease = self._leases.current(self._base.now())
        if lease is not None and lease.id == lease_id and servo.raw(KEY) != ON:
            self._energised[servo.uid] = servo, lease.id

    def end_lease(self, lease: HeldLease) -> list[Servo]:
        """Torque off on everything that was energised under this lease: the servos that were."""
        servos = self._release(lease.id)
        for servo in servos:
            self.torque_off.require(servo, "lease", lease.holder)
        return servos

    def cancel_commands(self) -> None:
        """Drop every command that is waiting or being repeated, at once: before a stop writes its first frame."""
        for uid in {*self._commanded, *self._sending.values()}:
            self._end_command(uid)

    def bus_lost(self) -> list[Servo]:
        """End every command; the servos that were under one, to which torque off is pending from now on."""
        commanded = [one.servo for one in self._commanded.values()]
        for servo in commanded:
            holder = self._holder(servo)
            self._end_command(servo.uid)
            self.torque_off.require(servo, "lease", holder)
        return commanded

    @contextmanager
    def leaving_bus(self) -> Generator[None]:
        """Within it the bus is being left: nothing may be put under command any more."""
        self.leaving = True
        try:
            yield
        finally:
            self.leaving = False

    async def leave(self) -> None:
        """Torque off on what is still under command, before the bus is left; a stop is repeated until then, too.

        Call it within `barred`.
        """
        lease = self._leases.current(self._base.now())
        self.bus_lost()
        for servo in self._release():
            self.torque_off.require(servo, "lease", None if lease is None else lease.holder)
        if not self._bus_gone:
            await self.torque_off.acknowledged(LEAVE_S)
        self.torque_off.report_pending()

    def may_move(self, servo: Servo, lease_id: str | None) -> HeldLease:
        """The lease to move it under.

        Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoResponse, ConfigurationLost, NotInThisModel.
        """
        self._check_open()
        lease = self._leases.require(lease_id, self._base.now())
        permission.check_movable(servo)
        permission.row_for(servo, "angle")
        return lease

    def _check_open(self) -> None:
        self.stop.check()
        if self.leaving:
            raise BusDisconnected(
                "The bus is being disconnected, so nothing is moved any more.", cause="bus_disconnecting"
            )
        if self._bus_gone:
            raise BusDisconnected("The bus is lost. Command again when it is back.", cause="bus_lost")

    async def _present_angle(self, servo: Servo) -> Target | None:
        """The present angle, as just read, as a command; None where the angle limits do not let the horn stay."""
        await self.freshen(servo, "angle", max_age_s=0.0)
        angle = await self._requests.read(servo, servo.registers["current_angle"].parameter, READ)
        row = permission.row_for(servo, "angle")
        low, high = permission.bounds(servo, row)
        return Target(row, angle, clamped=False) if low <= angle <= high else None

    async def freshen(self, servo: Servo, kind: str, max_age_s: float = FRESH_S) -> None:
        """Read again what decides about a command of that kind, where it is older than that.

        Raises NoResponse, Refused, BusDisconnected.
        """
        limits = servo.catalog.by_key[permission.ROW_OF[kind]].limits
        keys = ["torque_mode", *(() if limits is None else (limits.upper, limits.lower)), "current_angle"]
        if kind != "angle":
            keys[-1] = MODE
        elif servo.raw("command_angle") in (None, DUMMY):  # under speed or torque it may be turns away by now
            servo.forget("current_angle")
        rows = [servo.registers[key] for key in keys if key in servo.registers]
        now = self._base.now()
        for register in rows:
            if register.at is None or now - register.at >= max_age_s:
                await self._requests.read(servo, register.parameter, READ)
        ageing = [one.parameter for one in rows if one.at is not None and now - one.at >= AGEING_S]
        if ageing and servo.uid not in self._ageing:
            task = self._ageing[servo.uid] = asyncio.get_running_loop().create_task(self._renew(servo, ageing))
            task.add_done_callback(lambda _done: self._ageing.pop(servo.uid, None))

    async def _renew(self, servo: Servo, rows: list[Parameter]) -> None:
        for row in rows:
            try:
                await self._requests.read(servo, row, POLL)
            except HornbillError:
                return  # it grows older, and the next command reads it itself

    def _release(self, lease_id: str | None = None) -> list[Servo]:
        """Let go of what a lease (None: any) energised. The servos whose output is not known to be off already."""
        left: list[Servo] = []
        for uid, (servo, of) in list(self._energised.items()):
            if lease_id not in (None, of):
                continue
            del self._energised[uid]
            commanded = uid in self._commanded
            self._end_command(uid)
            if commanded or servo.busy is not None or servo.output_state.state not in MODES:
                left.append(servo)
        return left

    def _holder(self, servo: Servo) -> str | None:
        """Whose lease a servo is under."""
        commanded, lease = self._commanded.get(servo.uid), self._leases.current(self._base.now())
        return lease.holder if commanded is not None and lease is not None and lease.id == commanded.lease_id else None

    def _take_command(self, servo: Servo, lease: HeldLease) -> CommandedServo:
        self.torque_off.cancel_for_command(servo.uid)
        commanded = self._commanded.get(servo.uid)
        if commanded is None or commanded.lease_id != lease.id:
            found = self._energised.get(servo.uid, (servo, None))[1] == lease.id
            commanded = self._commanded[servo.uid] = CommandedServo(servo, lease.id, found=found)
            self._energised[servo.uid] = servo, lease.id
        return commanded

    async def _send(self, commanded: CommandedServo, target: Target, policy: RetryPolicy) -> Raw:
        try:
            raw = await self._deliver(commanded.servo, target, policy)
        except asyncio.CancelledError:
            if asyncio.current_task().cancelling():  # pyright: ignore[reportOptionalMemberAccess]
                raise
            self._check(commanded)
            raise
        self._check(commanded)
        return raw

    async def _write_until_acknowledged(self, servo: Servo, target: Target, taken: int) -> Raw:
        """Write until it is answered, or somebody takes the output: raises Stopped, TorqueOff then."""
        gone = f"Somebody switched the output of {servo.title} off meanwhile, so it was not switched on."
        try:
            raw = await self._deliver(servo, target, _REPEATED)
        except asyncio.CancelledError:
            if asyncio.current_task().cancelling():  # pyright: ignore[reportOptionalMemberAccess]
                raise
            self._check_open()
            raise TorqueOff(gone, cause="switched_off_during_command", servo=servo.title) from None
        self._check_open()
        if servo.output.disable_count != taken:
            raise TorqueOff(gone, cause="switched_off_during_command", servo=servo.title)
        return raw

    async def _deliver(self, servo: Servo, target: Target, policy: RetryPolicy) -> Raw:
        """Write in a task of its own, which whoever lets the servo go cancels before it leaves."""
        task = asyncio.get_running_loop().create_task(self._requests.write(servo, target.parameter, target.raw, policy))
        self._sending[task] = servo.uid
        task.add_done_callback(lambda done: self._sending.pop(done, None))
        return await task

    def _check(self, commanded: CommandedServo) -> None:
        """Raises when the servo was let go while something was under way.

        Raises Stopped, BusDisconnected, LeaseRequired or TorqueOff.
        """
        if self._is_current(commanded):
            return
        self.stop.check()
        if self._bus_gone or self.leaving:
            raise BusDisconnected(
                "The bus went away while the command was under way. Torque goes off.", cause="bus_lost_during_command"
            )
        lease = self._leases.current(self._base.now())
        if lease is None or lease.id != commanded.lease_id:
            raise LeaseRequired(
                "The lease ended while the command was under way. Torque goes off.", cause="lease_ended_during_command"
            )
        raise TorqueOff(
            f"Torque was taken from {commanded.servo.title} while the command was under way.",
            cause="torque_switched_off",
            servo=commanded.servo.title,
        )

    async def _arrived(self, commanded: CommandedServo, target: Target) -> bool:
        """Whether a command that was not answered arrived: a read may be repeated where the command may not."""
        try:
            held = await self._requests.read(commanded.servo, target.parameter, READ)
        except (NoResponse, Refused):
            return False
        self._check(commanded)
        return held == target.raw

    def _note_confirmed(self, commanded: CommandedServo, target: Target) -> None:
        """It was commanded by somebody who knew what there was to say about it."""
        if "turn_count" in target.confirmed:
            commanded.servo.turns_lost_deg = None

    def _note_command(self, servo: Servo, target: Target, *, tell: bool = True) -> None:
        now = self._base.now()
        for other in permission.ROW_OF.values():
            if other != target.parameter.key:
                servo.note(other, DUMMY, now)
        if tell:
            self._hub.publish(ServoChanged(servo.uid))

    def _on_bus(self, change: BusUsable) -> None:
        self._bus_gone = not change.usable

    def _is_current(self, commanded: CommandedServo) -> bool:
        return self._commanded.get(commanded.servo.uid) is commanded

    def _gate(self, commanded: CommandedServo) -> None:
        self._check(commanded)
        self.may_move(commanded.servo, commanded.lease_id)

    def _end_command(self, uid: Uid) -> None:
        # an "on" that still waits in a queue must not leave after the "off" that follows
        for task, where in list(self._sending.items()):
            if where == uid:
                task.cancel()
        commanded = self._commanded.pop(uid, None)
        if commanded is not None:
            self.keeping_alive.pause(commanded)
