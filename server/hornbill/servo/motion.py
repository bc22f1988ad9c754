"""Owns Motion: commands under a live lease, kept alive while it lives, and torque off the moment it does not."""

import asyncio
import logging
from collections.abc import Coroutine
from dataclasses import dataclass
from typing import Any

from hornbill.errors import HornbillError, LeaseRequired, NoAnswer, PortError, Refused
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

log = logging.getLogger(__name__)

FRESH_S = 1.0
"""How old a reading may be that decides whether a command is let through."""

QUENCH_LIMIT_S = 10.0
OFF_TRIES = 10


@dataclass(slots=True)
class Driven:
    """A servo under command: whose lease, what was last sent, and the task that keeps repeating it."""

    servo: Servo
    lease_id: str
    target: Target | None = None
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
        self._quenching: set[asyncio.Task[None]] = set()
        self.stop: Stop | None = None

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
        await self._send(servo, target, COMMAND)
        driven.target = target
        self._note_command(servo, target)
        self._keep_alive(driven)
        return target

    async def torque_on(self, servo: Servo, lease_id: str | None) -> Raw:
        """Energise the motor where it stands, under a lease. Raises as `command` does.

        What was commanded before is discarded by the servo (section 4.13); the present angle becomes the command,
        so that the servo's own time-out does not drop it while the lease lives.
        """
        lease = self.may_move(servo, lease_id)
        mode = servo.registers["torque_mode"].parameter
        driven = self._drive(servo, lease)
        raw = await self._send(servo, Target(mode, 0, clamped=False), TORQUE)
        await self._freshen(servo, "angle", max_age_s=0.0)
        angle = await self._asker.read(servo, servo.registers["current_angle"].parameter, READ)
        row = permission.row_for(servo, "angle")
        low, high = permission.bounds(servo, "angle", row)
        if raw == 0 and low <= angle <= high:
            self.may_move(servo, lease_id)
            hold = Target(row, angle, clamped=False)
            await self._send(servo, hold, COMMAND)
            driven.target = hold
            self._note_command(servo, hold)
            self._keep_alive(driven)
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
            self._spawn(self._quench(one.servo))
        names = ", ".join(one.servo.title for one in driven)
        self._hub.tell(LeaseChanged())
        if driven:
            self._hub.tell(Happened("notice", "lease_ended", f"{why} Torque goes off on {names}."))

    def quiet(self) -> None:
        """Drop every command that is waiting or being repeated, at once. Stop calls it before its first frame."""
        for uid in {*self._driven, *self._sending.values()}:
            self._let_go(uid)

    async def released(self, within_s: float) -> None:
        """Answer when every torque-off under way is confirmed, or after that time."""
        if self._quenching:
            await asyncio.wait(set(self._quenching), timeout=within_s)

    async def close(self) -> None:
        """Torque off on what is still under command, then end every task."""
        for one in list(self._driven.values()):
            self._let_go(one.servo.uid)
            self._spawn(self._quench(one.servo))
        await self.released(0.3)
        for task in [*self._sending, *self._quenching]:
            task.cancel()

    def may_move(self, servo: Servo, lease_id: str | None) -> Lease:
        """The lease to move it under. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoAnswer, NotInThisModel."""
        if self.stop is not None:
            self.stop.check()
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

    async def _send(self, servo: Servo, target: Target, patience: Patience) -> Raw:
        task = asyncio.get_running_loop().create_task(self._asker.write(servo, target.parameter, target.raw, patience))
        self._sending[task] = servo.uid
        task.add_done_callback(lambda done: self._sending.pop(done, None))
        try:
            return await task
        except asyncio.CancelledError:
            if asyncio.current_task().cancelling():  # pyright: ignore[reportOptionalMemberAccess]
                raise
            if self.stop is not None:
                self.stop.check()
            raise LeaseRequired("The lease ended while the command was waiting. Torque is off.") from None

    def _note_command(self, servo: Servo, target: Target) -> None:
        now = self._base.now()
        for other in permission.ROW_OF.values():
            if other != target.parameter.key:
                servo.note(other, DUMMY, now)
        self._hub.tell(ServoChanged(servo.uid))

    def _keep_alive(self, driven: Driven) -> None:
        if driven.alive is not None:
            driven.alive.cancel()
        driven.alive = asyncio.get_running_loop().create_task(self._repeat(driven))

    async def _repeat(self, driven: Driven) -> None:
        servo = driven.servo
        if servo.raw("timeout_action") == 0:
            return
        interval = max(0.02, min(60.0, (servo.raw("timeout_time") or 1000) / 1000 / 3))
        while driven.target is not None:
            await asyncio.sleep(interval)
            try:
                self._leases.require(driven.lease_id, self._base.now())
                await self._send(servo, driven.target, COMMAND)
            except (NoAnswer, Refused, PortError) as error:
                log.info("keep-alive: %s", error.detail)
            except HornbillError:
                return

    def _let_go(self, uid: Uid) -> None:
        # an "on" that still waits in a queue must not leave after the "off" that follows
        for task, where in list(self._sending.items()):
            if where == uid:
                task.cancel()
        driven = self._driven.pop(uid, None)
        if driven is not None:
            driven.target = None
            if driven.alive is not None:
                driven.alive.cancel()

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._quenching.add(task)
        task.add_done_callback(self._quenching.discard)

    async def _quench(self, servo: Servo) -> None:
        assert self.stop is not None
        try:
            async with asyncio.timeout(QUENCH_LIMIT_S):
                await self.stop.quench(servo, "off")
        except TimeoutError:
            text = f"{servo.title} did not answer to torque off. If it can move, cut its supply."
            self._hub.tell(Happened("failure", "no_answer", text, servo.uid))
        else:
            self._hub.tell(ServoChanged(servo.uid))
