"""Client messages of one socket: subscriptions, heartbeats of leases, and commands."""

import asyncio
import contextlib

from pydantic import TypeAdapter, ValidationError

from hornbill.api.addressing import address_by
from hornbill.api.live import messages
from hornbill.api.live.socket_queue import SocketQueue
from hornbill.api.security.access import Identity, forbidden
from hornbill.api.security.roles import Role
from hornbill.errors import HornbillError, InvalidValue, Unknown
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.servo.motion.trapezoid import TrapezoidProfile
from hornbill.servo.runtime.actor import signed
from hornbill.units import Uid

_CLIENT: TypeAdapter[messages.ClientMessage] = TypeAdapter(messages.ClientMessage)


class SocketSession:
    """Handler of one socket's client messages: subscriptions, heartbeats of leases, and commands."""

    def __init__(self, host: Host, queue: SocketQueue, who: Identity | None = None) -> None:
        """`who`: identity of the client; None without access control."""
        address_by(host)
        self._host = host
        self._queue = queue
        self._who = who
        self._leases: set[str] = set()
        self._newest: dict[Uid, tuple[str, messages.SocketCommand]] = {}
        self._sending: dict[Uid, asyncio.Task[None]] = {}
        self._braking: set[Uid] = set()

    async def handle(self, text: str) -> None:
        """Handle one client message. Failures are sent as `error` messages, never raised."""
        try:
            message = _CLIENT.validate_json(text)
            self._allow(message)
            match message:
                case messages.Subscribe():
                    uids = message.uids if "uids" in message.model_fields_set else self._queue.uids
                    self._queue.subscribe(message.topics, uids, message.frames)
                case messages.Unsubscribe():
                    self._queue.unsubscribe(message.topics)
                case messages.Heartbeat():
                    self._host.leases.renew(message.lease, self._host.base.now())
                    self._leases.add(message.lease)
                    self._host.lease_changed()
                case messages.CommandMessage():
                    for command in message.commands:
                        self._command(message.lease, command)
                case messages.StreamMessage():
                    limits = message.profile
                    profile = None if limits is None else TrapezoidProfile(limits.speed_deg_s, limits.accel_deg_s2)
                    self._host.streams.put(message.id, message.lease, message.values, profile)
                case messages.StopMessage():
                    self._host.stop.now(message.mode, signed(message.by), message.reason)
        except ValidationError as error:
            self._queue.refuse(_invalid(error))
        except HornbillError as error:
            self._queue.refuse(error)

    def _allow(self, message: messages.ClientMessage) -> None:
        """Subscriptions and stop are open to every role; all else requires operate. Raises ForbiddenRole."""
        for_all = isinstance(message, messages.Subscribe | messages.Unsubscribe | messages.StopMessage)
        if not for_all and self._who is not None and self._who.role < Role.OPERATE:
            raise forbidden(self._who, Role.OPERATE)

    def close(self) -> None:
        """Release the leases that this socket renewed, so that torque goes off on the servos they command."""
        for uid, task in self._sending.items():
            waiting = self._newest.get(uid)
            if waiting is not None and not waiting[1].brakes:
                del self._newest[uid]
                waiting = None
            if waiting is None and uid not in self._braking:  # a pending brake is sent even after disconnecting
                task.cancel()
        for lease_id in self._leases:
            with contextlib.suppress(Unknown):  # already ended
                self._host.motion_control.release(lease_id, "page_closed")
        self._host.motion_control.tick()
        self._queue.close()

    def _command(self, lease_id: str, command: messages.SocketCommand) -> None:
        uid = Uid(command.uid)
        self._host.fleet.get(uid)
        waiting = self._newest.get(uid)
        if waiting is not None and command.renews and not waiting[1].renews:
            return  # a renewal replaces neither the start of its hold nor a brake
        self._newest[uid] = (lease_id, command)
        task = self._sending.get(uid)
        if task is not None and not task.done():
            if not command.brakes or uid in self._braking:
                return
            task.cancel()  # a brake replaces the running command at once
        self._sending[uid] = asyncio.create_task(self._send(uid))

    async def _send(self, uid: Uid) -> None:
        """Send commands one at a time; while one is on the bus, only the newest following command is kept."""
        while uid in self._newest:
            lease_id, command = self._newest.pop(uid)
            if command.brakes:
                self._braking.add(uid)
            else:
                self._braking.discard(uid)
            try:
                await self._one(self._host.fleet.get(uid), lease_id, command)
            except HornbillError as error:
                self._newest.pop(uid, None)
                self._queue.refuse(error, uid)

    async def _one(self, servo: Servo, lease_id: str, command: messages.SocketCommand) -> None:
        if command.hold is not None:
            await self._host.holds.run(
                servo, lease_id, command.type, command.value, command.hold.for_s,
                renew=command.hold.renew, confirm=command.confirm,
            )  # fmt: skip
            return
        if command.profile is None:
            await self._host.motion.command(
                servo, lease_id, command.type, command.value, clamp=False, confirm=command.confirm
            )
            return
        if command.type != "angle":
            raise InvalidValue(
                f"A profile applies to angle commands only, not to {command.type} commands. Remove it.",
                cause="profile_angle_only",
            )
        profile = TrapezoidProfile(command.profile.speed_deg_s, command.profile.accel_deg_s2)
        await self._host.jogs.move(servo, lease_id, command.value, profile, clamp=False, confirm=command.confirm)


def _invalid(error: ValidationError) -> InvalidValue:
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"][1:])  # the first part is the type of the message
    return InvalidValue(f"Invalid message: {where and f'{where}: '}{first['msg']}.", cause="message_invalid")
