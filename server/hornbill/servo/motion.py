"""Owns Motion: commands under a live lease, kept alive while it lives, and torque off the moment it does not."""

import asyncio
from collections.abc import Callable, Collection
from dataclasses import replace

from hornbill.errors import (
    BusDisconnected,
    Busy,
    HornbillError,
    LeaseRequired,
    NoAnswer,
    Refused,
    TorqueOff,
)
from hornbill.schema.parameter import DUMMY, Parameter
from hornbill.servo import cautions, permission
from hornbill.servo.asking import COMMAND, POLL, READ, STOP, TORQUE, Asker, Patience
from hornbill.servo.cautions import Caution
from hornbill.servo.hub import Happened, Hub, LeaseChanged, ServoChanged
from hornbill.servo.keeping_alive import Driven, KeepingAlive
from hornbill.servo.leases import Lease, Leases
from hornbill.servo.owing import TorqueDebts
from hornbill.servo.permission import Target
from hornbill.servo.servo import Servo
from hornbill.servo.stop import MODES, Stop
from hornbill.servo.timebase import TimeBase
from hornbill.units import Raw, Uid

FRESH_S = 1.0
"""How old a reading may be that decides whether a command is let through."""

AGEING_S = 0.4
"""From this age on it is read again beside a command, so that the next one need not wait for it."""

OFF_TRIES = 10
LEAVE_S = 0.3


AT_ONCE = replace(COMMAND, urgent=True)
"""A jog does not wait for the answer to a read of the same servo. One at a time, so that stop never lacks a number."""


class Motion:
    """Everything that can make a horn move goes through here.

    A servo whose command ended is owed torque off, until it answers or is commanded again under a lease.
    """

    def __init__(self, asker: Asker, hub: Hub, base: TimeBase, leases: Leases) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._leases = leases
        self._driven: dict[Uid, Driven] = {}
        self._sending: dict[asyncio.Task[Raw], Uid] = {}
        self._ageing: dict[Uid, asyncio.Task[None]] = {}
        self._keeping = KeepingAlive(asker, hub, base, self._gate, self._send, self._has)
        self.debts = TorqueDebts(self._quench, hub)
        self.stop: Stop | None = None
        self.bus_gone = False
        """The bus is lost: nothing may be put under command until it is back."""
        self.leaving = False
        """The bus is being left: nothing may be put under command any more."""
        self.streamed: Callable[[Uid], bool] = lambda _uid: False
        """Whether a stream commands a servo: a command of its own would be overruled by the next burst."""
        self.on_lease_ended: Callable[[Lease, str], None] = lambda _lease, _why: None
        """Called last, with a lease that was given back or lapsed, and why. Must return at once."""

    def driven(self, uid: Uid) -> bool:
        """Whether somebody has this servo under command."""
        return uid in self._driven

    def told(self, uid: Uid) -> Target | None:
        """What this servo was commanded last, as far as it is under command."""
        driven = self._driven.get(uid)
        return None if driven is None else driven.target

    async def command(
        self, servo: Servo, lease_id: str | None, kind: str, value: float, *, clamp: bool, confirm: Collection[str] = ()
    ) -> Target:
        """Send one angle (degrees), speed (rpm) or torque (%) command and keep it alive while the lease lives.

        `confirm`: words of NeedsConfirmation that were answered. Raises Stopped, LeaseRequired, LeaseHeld, Busy,
        NoAnswer, ConfigurationLost, NotInThisModel, ModeOff, TorqueOff, OutOfRange, InvalidValue, NeedsConfirmation,
        Refused.
        """
        self.may_move(servo, lease_id)
        await self.freshen(servo, kind)
        lease = self.may_move(servo, lease_id)
        if self.streamed(servo.uid):
            raise Busy(f"{servo.title} is commanded by a stream. Give the stream its value, or end it first.")
        target = self.permit(servo, lease, kind, value, clamp=clamp, confirm=confirm)
        driven = self._drive(servo, lease)
        self._keeping.pause(driven)  # or the old target could leave after the new one
        try:
            # beside a read that is under way, but never before a command that is
            waits = servo.uid in self._sending.values()
            holds = await self._send(driven, target, COMMAND if waits else AT_ONCE)
        except NoAnswer:
            if not await self._holds(driven, target):
                raise
            holds = target.raw
        self._moved(driven, target)
        self._note_command(servo, target)
        self._keeping.begin(driven, target, holds)
        return target

    def permit(
        self, servo: Servo, lease: Lease, kind: str, value: float, *, clamp: bool, confirm: Collection[str]
    ) -> Target:
        """What may be sent, by what has just been read; its `warnings` are what to say. Asks nothing of the bus.

        Raises ModeOff, TorqueOff, NotInThisModel, OutOfRange, InvalidValue, NeedsConfirmation.
        """
        permission.check_mode(servo, kind)
        target = permission.target(servo, kind, value, clamp=clamp)
        said = self.cautions(servo, kind, target.raw)
        cautions.require(said, confirm)
        if not said:
            return target
        words = frozenset(one.confirm for one in said if one.confirm is not None)
        return replace(target, warnings=tuple(one.text for one in said), confirmed=words)

    def cautions(self, servo: Servo, kind: str, raw: Raw) -> list[Caution]:
        """What there is to say before `kind` is commanded to `raw`, by what was read last."""
        keys = ("current_angle", "command_angle")  # on the way the horn is somewhere between them
        known = (servo.registers[key] for key in keys if key in servo.registers)
        here = [one.raw for one in known if one.raw is not None and one.at is not None and one.raw != DUMMY]
        return cautions.cautions(servo, kind, raw, here)

    def drive_by_burst(self, lease: Lease, parts: Collection[tuple[Servo, Target]]) -> None:
        """Take servos under command to which a burst has just been handed, and keep them alive."""
        now = self._base.now()
        for servo, target in parts:
            driven = self._drive(servo, lease)
            self._moved(driven, target)
            before = servo.raw(target.parameter.key)
            self._note_command(servo, target, tell=before is None or before == DUMMY)
            servo.note(target.parameter.key, target.raw, now)
            for key in permission.ROW_OF.values():
                servo.forget(key)  # whether ArrayCommand shows in them is not documented
            self._keeping.told(driven, target)

    def still_holds(self, servo: Servo, lease_id: str | None, target: Target) -> None:
        """Whether it is still under this command, for whoever waits for its end.

        Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoAnswer, TorqueOff, BusDisconnected; and what ended the
        feeding of its time-out, if that ended by itself.
        """
        self.may_move(servo, lease_id)
        driven = self._driven.get(servo.uid)
        if driven is None:
            raise TorqueOff(f"Torque was taken from {servo.title} before it settled.")
        if driven.target is None or (driven.target.parameter, driven.target.raw) != (target.parameter, target.raw):
            raise Busy(f"{servo.title} was given another command before it settled.")
        if (why := driven.let_go) is not None:
            raise type(why)(f"{servo.title} was let go before it settled: {why.detail}", **why.facts)
        if driven.alive is None or driven.alive.done():
            raise Busy(f"{servo.title} was let go before it settled.")

    async def torque_on(self, servo: Servo, lease_id: str | None) -> Raw:
        """Energise the motor where it stands, under a lease. Raises as `command` does.

        What was commanded before is discarded by the servo (section 4.13); the present angle becomes the command,
        so that the servo's own time-out does not drop it while the lease lives.
        """
        lease = self.may_move(servo, lease_id)
        mode = servo.registers["torque_mode"].parameter
        driven = self._drive(servo, lease)
        self._keeping.pause(driven)
        raw = await self._send(driven, Target(mode, 0, clamped=False), TORQUE)
        await self.freshen(servo, "angle", max_age_s=0.0)
        angle = await self._asker.read(servo, servo.registers["current_angle"].parameter, READ)
        row = permission.row_for(servo, "angle")
        low, high = permission.bounds(servo, "angle", row)
        if raw == 0 and low <= angle <= high:
            self.may_move(servo, lease_id)
            hold = Target(row, angle, clamped=False)
            holds = await self._send(driven, hold, COMMAND)
            self._note_command(servo, hold)
            self._keeping.begin(driven, hold, holds)
            return raw
        for key in permission.ROW_OF.values():  # the servo has set them anew (section 4.13)
            await self._asker.read(servo, servo.registers[key].parameter, READ)
        return raw

    async def torque_away(self, servo: Servo, mode: str) -> Raw:
        """Torque off or brake: needs no lease and overtakes everything. Raises NoAnswer, Refused, BusDisconnected."""
        owed = self.driven(servo.uid) or self.debts.owes(servo.uid)
        self._let_go(servo.uid)
        self.debts.forgive(servo.uid)  # or an "off" of before could follow the brake
        if self.stop is not None and mode == "off":
            self.stop.let_go(servo)
        row = servo.catalog.by_key["torque_mode"]
        patience = Patience(STOP.priority, STOP.timeout_s * 2, OFF_TRIES, urgent=True, kind="stop")
        try:
            raw = await self._asker.write(servo, row, MODES[mode], patience)
        except HornbillError:
            if owed:
                self.debts.owe(servo, mode)
            raise
        self._hub.tell(ServoChanged(servo.uid))
        return raw

    def hand_back(self, servo: Servo) -> None:
        """Command it no more, and leave torque as it is: for a horn that holds its place as it did before we came."""
        self._let_go(servo.uid)

    def tick(self) -> None:
        """Notice a lease that ran out; call it at least every 50 ms."""
        while (lease := self._leases.lapsed(self._base.now())) is not None:
            self.lease_ended(lease, f"The lease of {lease.holder} ran out.")

    def lease_ended(self, lease: Lease, why: str) -> None:
        """Torque off on everything that was commanded under this lease."""
        driven = [one for one in self._driven.values() if one.lease_id == lease.id]
        for one in driven:
            self._let_go(one.servo.uid)
            self.debts.owe(one.servo)
        names = ", ".join(one.servo.title for one in driven)
        self._hub.tell(LeaseChanged())
        if driven:
            self._hub.tell(Happened("notice", "lease_ended", f"{why} Torque goes off on {names}."))
        self.on_lease_ended(lease, why)

    def quiet(self) -> list[Servo]:
        """Drop every command that is waiting or being repeated, at once. Stop calls it before its first frame.

        The answer is who was owed torque off. It is stop's to write now: an "off" of before could follow its brake.
        """
        for uid in {*self._driven, *self._sending.values()}:
            self._let_go(uid)
        owed = self.debts.servos()
        for servo in owed:
            self.debts.forgive(servo.uid)
        return owed

    def bus_lost(self) -> list[Servo]:
        """End every command; the servos that were under one, to which torque off is owed from now on."""
        driven = [one.servo for one in self._driven.values()]
        for servo in driven:
            self._let_go(servo.uid)
            self.debts.owe(servo)
        return driven

    async def leave(self) -> None:
        """Torque off on what is still under command, before the bus is left; a stop is repeated until then, too.

        Set `leaving` before.
        """
        assert self.stop is not None
        self.bus_lost()
        if not self.bus_gone:
            await asyncio.gather(self.debts.paid(LEAVE_S), self.stop.confirmed(LEAVE_S))
        self.debts.say_unanswered()

    def may_move(self, servo: Servo, lease_id: str | None) -> Lease:
        """The lease to move it under.

        Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoAnswer, ConfigurationLost, NotInThisModel.
        """
        if self.stop is not None:
            self.stop.check()
        if self.leaving:
            raise BusDisconnected("The bus is being disconnected, so nothing is moved any more.")
        if self.bus_gone:
            raise BusDisconnected("The bus is lost. Command again when it is back.")
        lease = self._leases.require(lease_id, self._base.now())
        permission.check_movable(servo)
        permission.row_for(servo, "angle")
        return lease

    async def freshen(self, servo: Servo, kind: str, max_age_s: float = FRESH_S) -> None:
        """Read again what decides about a command of that kind, where it is older than that.

        Raises NoAnswer, Refused, BusDisconnected.
        """
        keys = ["torque_mode", "angle_limit_cw", "angle_limit_ccw", "current_angle"]
        if kind != "angle":
            keys[3:] = ["speed_torque_control", f"{kind}_limit_cw", f"{kind}_limit_ccw"]
        elif servo.raw("command_angle") in (None, DUMMY):  # under speed or torque it may be turns away by now
            servo.forget("current_angle")
        rows = [servo.registers[key] for key in keys if key in servo.registers]
        now = self._base.now()
        for register in rows:
            if register.at is None or now - register.at >= max_age_s:
                await self._asker.read(servo, register.parameter, READ)
        ageing = [one.parameter for one in rows if one.at is not None and now - one.at >= AGEING_S]
        if ageing and servo.uid not in self._ageing:
            task = self._ageing[servo.uid] = asyncio.get_running_loop().create_task(self._renew(servo, ageing))
            task.add_done_callback(lambda _done: self._ageing.pop(servo.uid, None))

    async def _renew(self, servo: Servo, rows: list[Parameter]) -> None:
        for row in rows:
            try:
                await self._asker.read(servo, row, POLL)
            except HornbillError:
                return  # it grows older, and the next command reads it itself

    def _drive(self, servo: Servo, lease: Lease) -> Driven:
        self.debts.forgive(servo.uid)
        driven = self._driven.get(servo.uid)
        if driven is None or driven.lease_id != lease.id:
            driven = self._driven[servo.uid] = Driven(servo, lease.id)
        return driven

    async def _send(self, driven: Driven, target: Target, patience: Patience) -> Raw:
        servo = driven.servo
        task = asyncio.get_running_loop().create_task(self._asker.write(servo, target.parameter, target.raw, patience))
        self._sending[task] = servo.uid
        task.add_done_callback(lambda done: self._sending.pop(done, None))
        try:
            raw = await task
        except asyncio.CancelledError:
            if asyncio.current_task().cancelling():  # pyright: ignore[reportOptionalMemberAccess]
                raise
            self._check(driven)
            raise
        self._check(driven)
        return raw

    def _check(self, driven: Driven) -> None:
        """Raises when the servo was let go while something was under way.

        Raises Stopped, BusDisconnected, LeaseRequired or TorqueOff.
        """
        if self._has(driven):
            return
        if self.stop is not None:
            self.stop.check()
        if self.bus_gone or self.leaving:
            raise BusDisconnected("The bus went away while the command was under way. Torque goes off.")
        lease = self._leases.current(self._base.now())
        if lease is None or lease.id != driven.lease_id:
            raise LeaseRequired("The lease ended while the command was under way. Torque goes off.")
        raise TorqueOff(f"Torque was taken from {driven.servo.title} while the command was under way.")

    async def _holds(self, driven: Driven, target: Target) -> bool:
        """Whether a command that was not answered arrived: a read may be repeated where the command may not."""
        try:
            held = await self._asker.read(driven.servo, target.parameter, READ)
        except (NoAnswer, Refused):
            return False
        self._check(driven)
        return held == target.raw

    def _moved(self, driven: Driven, target: Target) -> None:
        """It was commanded by somebody who knew what there was to say about it."""
        if "turn_count" in target.confirmed:
            driven.servo.turns_lost_deg = None

    def _note_command(self, servo: Servo, target: Target, *, tell: bool = True) -> None:
        now = self._base.now()
        for other in permission.ROW_OF.values():
            if other != target.parameter.key:
                servo.note(other, DUMMY, now)
        if tell:
            self._hub.tell(ServoChanged(servo.uid))

    def _has(self, driven: Driven) -> bool:
        return self._driven.get(driven.servo.uid) is driven

    def _gate(self, driven: Driven) -> None:
        self._check(driven)
        self.may_move(driven.servo, driven.lease_id)

    def _let_go(self, uid: Uid) -> None:
        # an "on" that still waits in a queue must not leave after the "off" that follows
        for task, where in list(self._sending.items()):
            if where == uid:
                task.cancel()
        driven = self._driven.pop(uid, None)
        if driven is not None:
            self._keeping.pause(driven)

    async def _quench(self, servo: Servo, mode: str) -> None:
        assert self.stop is not None
        await self.stop.quench(servo, mode)
