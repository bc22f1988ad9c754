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
from hornbill.servo.permission import Target
from hornbill.servo.servo import Servo
from hornbill.servo.stop import MODES, Stop
from hornbill.servo.timebase import TimeBase
from hornbill.units import Raw, Uid

FRESH_S = 1.0
"""How old a reading may be that decides whether a command is let through."""

QUENCH_LIMIT_S = 10.0
OFF_TRIES = 10


@dataclass(slots=True)
class Driven:
    """A servo under command: whose lease, and the task that keeps repeating the command."""

    servo: Servo
    lease_id: str
    alive: asyncio.Task[None] | None = None


class Motion:
    """Everything that can make a horn move goes through here."""

    def __init__(self, asker: Asker, hub: Hub, base: TimeBase, leases: Leases) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._leases = leases
        self._driven: dict[Uid, Driven] = {}
        self._sending: dict[asyncio.Task[Raw], Uid] = {}
        self._quenching: dict[asyncio.Task[None], Servo] = {}
        self.stop: Stop | None = None
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
        self._let_go(servo.uid)
        row = servo.catalog.by_key["torque_mode"]
        patience = Patience(STOP.priority, STOP.timeout_s * 2, OFF_TRIES, urgent=True)
        raw = await self._asker.write(servo, row, MODES[mode], patience)
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
            self._owe_torque_off(one.servo)
        names = ", ".join(one.servo.title for one in driven)
        self._hub.tell(LeaseChanged())
        if driven:
            self._hub.tell(Happened("notice", "lease_ended", f"{why} Torque goes off on {names}."))

    def quiet(self) -> None:
        """Drop every command that is waiting or being repeated, at once. Stop calls it before its first frame."""
        for uid in {*self._driven, *self._sending.values()}:
            self._let_go(uid)
        for task in self._quenching:  # stop writes to these servos itself, and perhaps the brake
            task.cancel()

    async def released(self, within_s: float) -> None:
        """Answer when every torque-off under way is confirmed, or after that time."""
        if self._quenching:
            await asyncio.wait(set(self._quenching), timeout=within_s)

    async def close(self) -> None:
        """Torque off on what is still under command, then end every task. Set `leaving` before."""
        for one in list(self._driven.values()):
            self._let_go(one.servo.uid)
            self._owe_torque_off(one.servo)
        await self.released(0.3)
        for task, servo in self._quenching.items():
            self._say_unanswered(servo)
            task.cancel()

    def may_move(self, servo: Servo, lease_id: str | None) -> Lease:
        """The lease to move it under. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoAnswer, NotInThisModel."""
        if self.stop is not None:
            self.stop.check()
        if self.leaving:
            raise BusDisconnected("The bus is being disconnected, so nothing is moved any more.")
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
        """Raises Stopped, LeaseRequired or TorqueOff when the servo was let go while something was under way."""
        if self._driven.get(driven.servo.uid) is driven:
            return
        if self.stop is not None:
            self.stop.check()
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
        if self._driven.get(servo.uid) is driven and not isinstance(error, Stopped | LeaseRequired | LeaseHeld):
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

    def _owe_torque_off(self, servo: Servo) -> None:
        task = asyncio.get_running_loop().create_task(self._quench(servo))
        self._quenching[task] = servo
        task.add_done_callback(lambda done: self._quenching.pop(done, None))

    async def _quench(self, servo: Servo) -> None:
        assert self.stop is not None
        try:
            async with asyncio.timeout(QUENCH_LIMIT_S):
                await self.stop.quench(servo, "off")
        except TimeoutError:
            self._say_unanswered(servo)
        else:
            self._hub.tell(ServoChanged(servo.uid))

    def _say_unanswered(self, servo: Servo) -> None:
        text = f"{servo.title} did not answer to torque off. If it can move, cut its supply."
        self._hub.tell(Happened("failure", "no_answer", text, servo.uid))
