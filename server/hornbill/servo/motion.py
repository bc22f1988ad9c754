"""Owns Motion: commands under a live lease, kept alive while it lives, and torque off the moment it does not."""

import asyncio
from dataclasses import dataclass

from hornbill.errors import (
    BusDisconnected,
    Busy,
    HornbillError,
    LeaseHeld,
    LeaseRequired,
    NoAnswer,
    Refused,
    Stopped,
    TorqueOff,
)
from hornbill.schema.parameter import DUMMY
from hornbill.servo import permission
from hornbill.servo.asking import COMMAND, READ, STOP, TORQUE, Asker, Patience
from hornbill.servo.hub import Happened, Hub, LeaseChanged, ServoChanged
from hornbill.servo.leases import Lease, Leases
from hornbill.servo.owing import TorqueDebts
from hornbill.servo.permission import Target
from hornbill.servo.servo import Servo
from hornbill.servo.stop import MODES, Stop
from hornbill.servo.timebase import TimeBase
from hornbill.units import Raw, Uid

FRESH_S = 1.0
"""How old a reading may be that decides whether a command is let through."""

OFF_TRIES = 10
LEAVE_S = 0.3


@dataclass(slots=True)
class Driven:
    """A servo under command: whose lease, and the task that keeps repeating the command."""

    servo: Servo
    lease_id: str
    alive: asyncio.Task[None] | None = None


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
        self.debts = TorqueDebts(self._quench, hub)
        self.stop: Stop | None = None
        self.bus_gone = False
        """The bus is lost: nothing may be put under command until it is back."""
        self.leaving = False
        """The bus is being left: nothing may be put under command any more."""

    def driven(self, uid: Uid) -> bool:
        """Whether somebody has this servo under command."""
        return uid in self._driven

    async def command(self, servo: Servo, lease_id: str | None, kind: str, value: float, *, clamp: bool) -> Target:
        """Send one angle (degrees), speed (rpm) or torque (%) command and keep it alive while the lease lives.

        Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoAnswer, NotInThisModel, ModeOff, TorqueOff, OutOfRange,
        InvalidValue, Refused.
        """
        lease = self.may_move(servo, lease_id)
        await self._freshen(servo, kind)
        permission.check_mode(servo, kind)
        target = permission.target(servo, kind, value, clamp=clamp)
        lease = self.may_move(servo, lease_id)
        driven = self._drive(servo, lease)
        self._pause(driven)  # or the old target could leave after the new one
        try:
            await self._send(driven, target, COMMAND)
        except NoAnswer:
            if not await self._holds(driven, target):
                raise
        self._keep_alive(driven, target)
        return target

    async def torque_on(self, servo: Servo, lease_id: str | None) -> Raw:
        """Energise the motor where it stands, under a lease. Raises as `command` does.

        What was commanded before is discarded by the servo (section 4.13); the present angle becomes the command,
        so that the servo's own time-out does not drop it while the lease lives.
        """
        lease = self.may_move(servo, lease_id)
        mode = servo.registers["torque_mode"].parameter
        driven = self._drive(servo, lease)
        self._pause(driven)
        raw = await self._send(driven, Target(mode, 0, clamped=False), TORQUE)
        await self._freshen(servo, "angle", max_age_s=0.0)
        angle = await self._asker.read(servo, servo.registers["current_angle"].parameter, READ)
        row = permission.row_for(servo, "angle")
        low, high = permission.bounds(servo, "angle", row)
        if raw == 0 and low <= angle <= high:
            self.may_move(servo, lease_id)
            hold = Target(row, angle, clamped=False)
            await self._send(driven, hold, COMMAND)
            self._keep_alive(driven, hold)
        return raw

    async def torque_away(self, servo: Servo, mode: str) -> Raw:
        """Torque off or brake: needs no lease and overtakes everything. Raises NoAnswer, Refused, BusDisconnected."""
        owed = self.driven(servo.uid) or self.debts.owes(servo.uid)
        self._let_go(servo.uid)
        self.debts.forgive(servo.uid)  # or an "off" of before could follow the brake
        row = servo.catalog.by_key["torque_mode"]
        patience = Patience(STOP.priority, STOP.timeout_s * 2, OFF_TRIES, urgent=True)
        try:
            raw = await self._asker.write(servo, row, MODES[mode], patience)
        except HornbillError:
            if owed:
                self.debts.owe(servo, mode)
            raise
        self._hub.tell(ServoChanged(servo.uid))
        return raw

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
        """The lease to move it under. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoAnswer, NotInThisModel."""
        if self.stop is not None:
            self.stop.check()
        if self.leaving:
            raise BusDisconnected("The bus is being disconnected, so nothing is moved any more.")
        if self.bus_gone:
            raise BusDisconnected("The bus is lost. Command again when it is back.")
        lease = self._leases.require(lease_id, self._base.now())
        permission.check_ready(servo)
        permission.row_for(servo, "angle")
        return lease

    async def _freshen(self, servo: Servo, kind: str, max_age_s: float = FRESH_S) -> None:
        keys = ["torque_mode", "angle_limit_cw", "angle_limit_ccw"]
        if kind != "angle":
            keys += ["speed_torque_control", f"{kind}_limit_cw", f"{kind}_limit_ccw"]
        now = self._base.now()
        for key in keys:
            register = servo.registers.get(key)
            if register is not None and (register.at is None or now - register.at >= max_age_s):
                await self._asker.read(servo, register.parameter, READ)

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
        if self._driven.get(driven.servo.uid) is driven:
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

    def _note_command(self, servo: Servo, target: Target) -> None:
        now = self._base.now()
        for other in permission.ROW_OF.values():
            if other != target.parameter.key:
                servo.note(other, DUMMY, now)
        self._hub.tell(ServoChanged(servo.uid))

    def _keep_alive(self, driven: Driven, target: Target) -> None:
        self._note_command(driven.servo, target)
        self._pause(driven)
        driven.alive = asyncio.get_running_loop().create_task(self._repeat(driven, target))

    @staticmethod
    def _pause(driven: Driven) -> None:
        if driven.alive is not None:
            driven.alive.cancel()
            driven.alive = None

    async def _repeat(self, driven: Driven, target: Target) -> None:
        """Feed the servo's own time-out (0x26, 0x27) with its command, but never give back what was taken.

        After a restart, in protection, and when the time-out may have struck, the horn would jump to where it was
        commanded before: then the servo is left alone until somebody commands it again.
        """
        servo, boots, fed, pause = driven.servo, driven.servo.boots, self._base.now(), True
        while True:
            time_out = (servo.raw("timeout_time") or 1000) / 1000
            interval = max(0.02, min(60.0, time_out / 3))
            if pause:
                await asyncio.sleep(interval)
            if servo.raw("timeout_action") == 0:
                fed = self._base.now()
                continue
            try:
                self._check(driven)
                self.may_move(servo, driven.lease_id)
                if servo.boots != boots:
                    raise Busy(f"{servo.title} restarted.")
                if self._base.now() - fed > max(time_out, 3 * interval):
                    raise Busy(f"{servo.title} did not answer for longer than its time-out (0x27).")
                await self._send(driven, target, Patience(COMMAND.priority, min(COMMAND.timeout_s, interval / 2), 1))
                fed, pause = self._base.now(), True
            except NoAnswer as error:
                if not await self._runs_on(servo, boots):
                    self._say_let_go(driven, error)
                    return
                pause = False
            except HornbillError as error:
                self._say_let_go(driven, error)
                return

    async def _runs_on(self, servo: Servo, boots: int) -> bool:
        """Whether a servo that missed a command has not restarted, by its uptime."""
        before, at, node = servo.status, servo.status_at, servo.node_id
        if before is None or at is None or node is None:
            return False
        try:
            uptime = (await self._asker.node_info(node)).status.uptime_sec
        except HornbillError:
            return False
        expected = before.uptime_sec + self._base.now() - at
        return servo.boots == boots and 0 < before.uptime_sec <= uptime and uptime > expected - 1.5

    def _say_let_go(self, driven: Driven, error: HornbillError) -> None:
        servo = driven.servo
        if self._driven.get(servo.uid) is driven and not isinstance(
            error, Stopped | LeaseRequired | LeaseHeld | BusDisconnected
        ):
            text = f"{error.detail} {servo.title} is not kept under its last command any more. Command it again."
            self._hub.tell(Happened("warning", "let_go", text, servo.uid))

    def _let_go(self, uid: Uid) -> None:
        # an "on" that still waits in a queue must not leave after the "off" that follows
        for task, where in list(self._sending.items()):
            if where == uid:
                task.cancel()
        driven = self._driven.pop(uid, None)
        if driven is not None:
            self._pause(driven)

    async def _quench(self, servo: Servo, mode: str) -> None:
        assert self.stop is not None
        await self.stop.quench(servo, mode)
