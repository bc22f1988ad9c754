"""Commands under a lease, kept alive while the lease is valid, and torque off as soon as it is not."""

import asyncio
from collections.abc import Callable, Collection, Generator
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from math import inf

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
from hornbill.servo.monitoring.commanders import Commanders
from hornbill.servo.motion import cautions
from hornbill.servo.motion.keeping_alive import CommandedServo, KeepingAlive
from hornbill.servo.runtime.hub import BusUsable, CommandsBegan, LogEvent, ServoChanged, StopPressed
from hornbill.servo.runtime.leases import HeldLease
from hornbill.servo.torque_off.retries import TorqueOffRetries
from hornbill.servo.torque_off.stop import StopControl
from hornbill.units import Raw, Uid

FRESH_S = 1.0
"""Maximum age of a reading that decides whether a command is permitted."""

AGEING_S = 0.4
"""Age from which it is read again alongside a command, so that the next command need not wait."""

LEAVE_S = 0.3


AT_REST_RPM = 5
"""Maximum measured speed of a horn at rest."""

_REPEATED = replace(TORQUE, tries=READ.tries)
"""Repeated for 1.25 s."""

AT_ONCE = replace(COMMAND, urgent=True)
"""Sent without waiting for a pending read of the same servo. One at a time, so that Stop always has a transfer ID."""


class Motion:
    """The only class that moves horns.

    When the command of a servo ends, torque off is pending until it acknowledges or is commanded again under a lease.
    """

    def __init__(
        self,
        services: HostServices,
        stop: StopControl,
        torque_off: TorqueOffRetries,
        commanders: Commanders,
        streamed: Callable[[Uid], bool],
    ) -> None:
        """`streamed`: whether a stream commands a servo. The next burst would override a separate command."""
        self._requests = requests = services.requests
        self._hub = hub = services.hub
        self._base = base = services.base
        self._leases = services.leases
        self.stop = stop
        self.torque_off = torque_off
        self._commanders = commanders
        self._streamed = streamed
        self._commanded: dict[Uid, CommandedServo] = {}
        self._energised: dict[Uid, tuple[Servo, str]] = {}
        """Servos energised under a lease (also by a save or restart), with its ID. Torque goes off when it ends."""
        self._sending: dict[asyncio.Task[Raw], Uid] = {}
        self._ageing: dict[Uid, asyncio.Task[None]] = {}
        self.keeping_alive = KeepingAlive(requests, hub, base, self._gate, self._send, self._commanded.get)
        self._bus_gone = False
        self.leaving = False
        """Whether the bus is being left, so that no new commands are accepted."""
        hub.subscribe(lambda _pressed: self.cancel_commands(), StopPressed)
        hub.subscribe(self._on_bus, BusUsable)
        hub.subscribe(self._yield_to, CommandsBegan)

    def is_commanded(self, uid: Uid) -> bool:
        """Whether a servo is under command."""
        return uid in self._commanded

    def own(self) -> set[Uid]:
        """Servos commanded or energised under a lease, which Stop reaches as guest."""
        return {*self._commanded, *self._energised, *self._sending.values()}

    def last_command(self, uid: Uid) -> Target | None:
        """Last command of a servo under command, or None."""
        commanded = self._commanded.get(uid)
        return None if commanded is None else commanded.target

    async def command(
        self, servo: Servo, lease_id: str | None, kind: str, value: float, *, clamp: bool, confirm: Collection[str] = ()
    ) -> Target:
        """Send one angle (degrees), speed (rpm) or torque (%) command and keep it alive while the lease is valid.

        `confirm`: confirmed codes of NeedsConfirmation. Raises Stopped, LeaseRequired, LeaseHeld, Busy,
        NoResponse, ConfigurationLost, NotInThisModel, ModeOff, TorqueOff, OutOfRange, InvalidValue, NeedsConfirmation,
        Refused.
        """
        self.may_move(servo, lease_id)
        # a brake is within all limits, so it does not wait for readings that are only old
        await self.freshen(servo, kind, max_age_s=inf if self._brakes(servo, kind, value) else FRESH_S)
        lease = self.may_move(servo, lease_id)
        if self._streamed(servo.uid):
            raise Busy(
                f"{servo.title} is commanded by a stream. Set its value in the stream, or end the stream first.",
                cause="commanded_by_stream",
                servo=servo.title,
            )
        target = self.permit(servo, lease, kind, value, clamp=clamp, confirm=confirm)
        commanded = self._take_command(servo, lease)
        self.keeping_alive.pause(commanded)  # or the old target could leave after the new one
        try:
            # alongside a pending read, but never ahead of a pending command
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

    def _brakes(self, servo: Servo, kind: str, value: float) -> bool:
        """Whether this command ends the speed or torque that the servo is commanded now (4.2, 4.3)."""
        last = self.last_command(servo.uid)
        return value == 0 and kind != "angle" and last is not None and last.parameter.key == permission.ROW_OF[kind]

    def permit(
        self, servo: Servo, lease: HeldLease, kind: str, value: float, *, clamp: bool, confirm: Collection[str]
    ) -> Target:
        """Check a command against the last readings. Returns the permitted target with its warnings. Sends nothing.

        Raises ModeOff, TorqueOff, NotInThisModel, OutOfRange, InvalidValue, NeedsConfirmation.
        """
        permission.check_mode(servo, kind)
        target = permission.target(servo, kind, value, clamp=clamp)
        found = self.cautions(servo, kind, target.raw)
        cautions.require(servo, found, confirm)
        if not found:
            return target
        words = frozenset(one.confirm for one in found if one.confirm is not None)
        return replace(target, warnings=tuple(one.text for one in found), confirmed=words)

    def cautions(self, servo: Servo, kind: str, raw: Raw) -> list[Caution]:
        """Cautions before commanding `kind` to `raw`, from the last readings."""
        keys = ("current_angle", "command_angle")  # while moving, the horn is between the two
        known = (servo.registers[key] for key in keys if key in servo.registers)
        here = [one.raw for one in known if one.raw is not None and one.at is not None and one.raw != DUMMY]
        return cautions.cautions(servo, kind, raw, here, self.keeping_alive.shortest_s)

    def note_burst(self, lease: HeldLease, parts: Collection[tuple[Servo, Target]]) -> None:
        """Take the servos of a burst that was just sent under command, and keep them alive."""
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
        """Check that a servo is still under this command, for callers that wait for it to finish.

        Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoResponse, TorqueOff, BusDisconnected, and whatever ended its
        keep-alive.
        """
        self.may_move(servo, lease_id)
        commanded = self._commanded.get(servo.uid)
        if commanded is None:
            raise TorqueOff(
                f"Torque of {servo.title} was switched off before it settled.",
                cause="torque_switched_off",
                servo=servo.title,
            )
        if commanded.target is None or (commanded.target.parameter, commanded.target.raw) != (
            target.parameter,
            target.raw,
        ):
            raise Busy(
                f"{servo.title} received another command before it settled.",
                cause="command_superseded",
                servo=servo.title,
            )
        if (why := commanded.end_reason) is not None:
            error = copy(why)
            error.extend(
                before=f"The command of {servo.title} ended before it settled: ",
                also="released_before_settling",
                servo=servo.title,
            )
            raise error
        if commanded.alive is None or commanded.alive.done():
            raise Busy(
                f"The command of {servo.title} ended before it settled.",
                cause="released_before_settling",
                servo=servo.title,
            )

    async def switch(self, servo: Servo, torque: Raw, lease_id: str | None, *, by: str | None = None) -> Raw:
        """Write 0x20 and return its new value. On needs a lease (`torque_on`), off and brake do not."""
        if torque == ON:
            return await self.torque_on(servo, lease_id)
        return await self.disable_torque(servo, off_mode(torque), by=by)

    async def torque_on(self, servo: Servo, lease_id: str | None) -> Raw:
        """Turn torque on at the present angle, under a lease. Raises as `command` does.

        The present angle is commanded before and after: before, because an output disabled by the servo's timeout
        returns with the last command (section 4.19); after, because one that was off returns without a command (section
        4.13), and so that the timeout does not disable it while the lease is valid.
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
        for key in permission.ROW_OF.values():  # the servo has reset them (section 4.13)
            await self._requests.read(servo, servo.registers[key].parameter, READ)
        return raw

    def check_energise(self, servo: Servo) -> None:
        """Raise what `energise` raises before it sends anything.

        Raises Stopped, BusDisconnected, BusReadOnly, NoResponse, Busy, ConfigurationLost, NotInThisModel,
        CommandedElsewhere.
        """
        self._check_open()
        permission.check_energise(servo)
        self._commanders.check(servo)

    async def energise(self, servo: Servo, by: str) -> None:
        """Turn torque on at the present angle, just before ROM is written. The servo is not under command afterwards.

        Needs no lease: the caller is a job that works on this servo and switches the output off again if ROM is not
        written. The present angle is commanded first (see `torque_on`). Both writes are repeated until acknowledged:
        the first moves nothing, the second is idempotent.

        Raises as `check_energise`; Busy if the horn is turning, TorqueOff if the output is switched off meanwhile,
        UnexpectedResult, NoResponse, Refused.
        """
        self.check_energise(servo)
        taken = servo.output.disable_count
        speed = await self._requests.read(servo, servo.registers["current_speed"].parameter, READ)
        if abs(speed) > AT_REST_RPM:
            raise Busy(
                f"The horn of {servo.title} is turning at {speed} rpm with its output off. Wait until it is at rest.",
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
                f"{servo.title} did not accept torque on, which was to be saved to ROM.",
                differences=[{"key": mode.key, "wanted": "on", "found": None}],
                cause="torque_on_not_accepted",
                servo=servo.title,
            )

    async def disable_torque(self, servo: Servo, mode: str, *, by: str | None = None) -> Raw:
        """Switch torque off or brake. Needs no lease and precedes all other traffic.

        `by`: author, by default the holder of the lease it is under. Raises NoResponse, Refused, BusDisconnected.
        """
        by = by or self._holder(servo)
        pending = self.is_commanded(servo.uid) or self.torque_off.pending(servo.uid)
        self._end_command(servo.uid)
        self.torque_off.cancel_for_command(servo.uid)  # otherwise an earlier "off" could follow the brake
        if mode == "off":
            self.torque_off.release_brake(servo.uid)
        raw = await self.torque_off.write(servo, mode, "command", by, retry=pending)
        self._hub.publish(ServoChanged(servo.uid))
        return raw

    def stop_commanding(self, servo: Servo) -> None:
        """Stop commanding a servo but leave torque as it is, for a horn that held its position before."""
        commanded = self._commanded.get(servo.uid)
        if commanded is not None and not commanded.found:
            self._energised.pop(servo.uid, None)
        self._end_command(servo.uid)

    def claim(self, servo: Servo, lease_id: str | None) -> None:
        """Note that a save or restart under this lease will energise a servo: torque goes off when the lease ends."""
        lease = self._leases.find(lease_id, self._base.now())
        if lease is not None and lease.covers([servo.uid]) and servo.raw(KEY) != ON:
            self._energised[servo.uid] = servo, lease.id

    def end_lease(self, lease: HeldLease) -> list[Servo]:
        """Switch torque off on all servos energised under this lease. Returns them."""
        servos = self._release(lease.id)
        for servo in servos:
            self.torque_off.require(servo, "lease", lease.holder)
        return servos

    def cancel_commands(self) -> None:
        """Cancel all queued and repeated commands immediately, before a stop writes its first frame."""
        for uid in {*self._commanded, *self._sending.values()}:
            self._end_command(uid)

    def bus_lost(self) -> list[Servo]:
        """End all commands. Returns the servos that were under command; torque off is pending on them from now on."""
        commanded = [one.servo for one in self._commanded.values()]
        for servo in commanded:
            holder = self._holder(servo)
            self._end_command(servo.uid)
            self.torque_off.require(servo, "lease", holder)
        return commanded

    @contextmanager
    def leaving_bus(self) -> Generator[None]:
        """Context in which the bus is being left: no new commands are accepted."""
        self.leaving = True
        try:
            yield
        finally:
            self.leaving = False

    async def leave(self) -> None:
        """Switch torque off on all servos under command before leaving the bus. Stops are repeated until then.

        Call within `leaving_bus`.
        """
        now = self._base.now()
        holders = {uid: self._leases.find(lease_id, now) for uid, (_, lease_id) in self._energised.items()}
        self.bus_lost()
        for servo in self._release():
            lease = holders.get(servo.uid)
            self.torque_off.require(servo, "lease", None if lease is None else lease.holder)
        if not self._bus_gone:
            await self.torque_off.acknowledged(LEAVE_S)
        self.torque_off.report_pending()

    def may_move(self, servo: Servo, lease_id: str | None) -> HeldLease:
        """Check that a servo may be moved, and return the lease.

        Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoResponse, ConfigurationLost, NotInThisModel,
        CommandedElsewhere.
        """
        self._check_open()
        lease = self._leases.require(lease_id, self._base.now(), servo.uid)
        permission.check_movable(servo)
        self._commanders.check(servo)
        permission.row_for(servo, "angle")
        return lease

    def _check_open(self) -> None:
        self.stop.check()
        if self.leaving:
            raise BusDisconnected("The bus is being disconnected. Motion is refused.", cause="bus_disconnecting")
        if self._bus_gone:
            raise BusDisconnected("The bus is lost. Send the command again when it is back.", cause="bus_lost")

    async def _present_angle(self, servo: Servo) -> Target | None:
        """Command for the present angle, just read. None if it is outside the angle limits."""
        await self.freshen(servo, "angle", max_age_s=0.0)
        angle = await self._requests.read(servo, servo.registers["current_angle"].parameter, READ)
        row = permission.row_for(servo, "angle")
        low, high = permission.bounds(servo, row)
        return Target(row, angle, clamped=False) if low <= angle <= high else None

    async def freshen(self, servo: Servo, kind: str, max_age_s: float = FRESH_S) -> None:
        """Read the rows that decide about a command of this kind again if older than `max_age_s`.

        Raises NoResponse, Refused, BusDisconnected.
        """
        limits = servo.catalog.by_key[permission.ROW_OF[kind]].limits
        keys = ["torque_mode", *(() if limits is None else (limits.upper, limits.lower)), "current_angle"]
        if kind != "angle":
            keys[-1] = MODE
        elif servo.raw("command_angle") in (None, DUMMY):  # under a speed or torque command it may be turns away by now
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
                return  # the next command reads it itself

    def _release(self, lease_id: str | None = None) -> list[Servo]:
        """End commands under a lease (None: any). Returns the energised servos whose output is not known to be off."""
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
        """Holder of the lease a servo is under, or None."""
        commanded = self._commanded.get(servo.uid)
        lease = None if commanded is None else self._leases.find(commanded.lease_id, self._base.now())
        return None if lease is None else lease.holder

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
        """Write until acknowledged. Raises Stopped or TorqueOff if the output is switched off meanwhile."""
        gone = f"The output of {servo.title} was switched off meanwhile, so it was not switched on."
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
        """Write in a separate task, so that ending the command can cancel it before it is sent."""
        task = asyncio.get_running_loop().create_task(self._requests.write(servo, target.parameter, target.raw, policy))
        self._sending[task] = servo.uid
        task.add_done_callback(lambda done: self._sending.pop(done, None))
        return await task

    def _check(self, commanded: CommandedServo) -> None:
        """Raises Stopped, BusDisconnected, LeaseRequired or TorqueOff if the command was ended meanwhile."""
        if self._is_current(commanded):
            return
        self.stop.check()
        if self._bus_gone or self.leaving:
            raise BusDisconnected(
                "The bus was lost while the command was being sent. Torque goes off.", cause="bus_lost_during_command"
            )
        if self._leases.find(commanded.lease_id, self._base.now()) is None:
            raise LeaseRequired(
                "The lease ended while the command was being sent. Torque goes off.", cause="lease_ended_during_command"
            )
        raise TorqueOff(
            f"Torque of {commanded.servo.title} was switched off while the command was being sent.",
            cause="torque_switched_off",
            servo=commanded.servo.title,
        )

    async def _arrived(self, commanded: CommandedServo, target: Target) -> bool:
        """Whether a command without a response arrived. Unlike the command, the read may be repeated."""
        try:
            held = await self._requests.read(commanded.servo, target.parameter, READ)
        except (NoResponse, Refused):
            return False
        self._check(commanded)
        return held == target.raw

    def _note_confirmed(self, commanded: CommandedServo, target: Target) -> None:
        """Note that the cautions of a command were confirmed."""
        if "turn_count" in target.confirmed:
            commanded.servo.turns_lost_deg = None

    def _note_command(self, servo: Servo, target: Target, *, tell: bool = True) -> None:
        now = self._base.now()
        for other in permission.ROW_OF.values():
            if other != target.parameter.key:
                servo.note(other, DUMMY, now)
        if tell:
            self._hub.publish(ServoChanged(servo.uid))

    def _yield_to(self, began: CommandsBegan) -> None:
        """Stop commanding a servo that another node commands now.

        Its torque stays as it is: the other node relies on it, and switching it off would take the servo from it.
        """
        commanded = self._commanded.get(began.uid)
        if commanded is None:
            return
        servo = commanded.servo
        self._energised.pop(began.uid, None)
        self._end_command(began.uid)
        text = f"{servo.title} is now commanded by node {began.node_id}. hornbill no longer commands it."
        params: dict[str, object] = {"servo": servo.title, "node_id": began.node_id}
        self._hub.publish(LogEvent("warning", "motion_yielded", text, servo.uid, params))
        self._hub.publish(ServoChanged(servo.uid))

    def _on_bus(self, change: BusUsable) -> None:
        self._bus_gone = not change.usable

    def _is_current(self, commanded: CommandedServo) -> bool:
        return self._commanded.get(commanded.servo.uid) is commanded

    def _gate(self, commanded: CommandedServo) -> None:
        self._check(commanded)
        self.may_move(commanded.servo, commanded.lease_id)

    def _end_command(self, uid: Uid) -> None:
        # a queued "on" must not leave after the "off" that follows
        for task, where in list(self._sending.items()):
            if where == uid:
                task.cancel()
        commanded = self._commanded.pop(uid, None)
        if commanded is not None:
            self.keeping_alive.pause(commanded)
