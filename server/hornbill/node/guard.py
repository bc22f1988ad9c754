"""GuardedPort: the last check before the wire. Refuses 0x49, every unlisted write, and what the role forbids."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from hornbill.errors import BusReadOnly, ForbiddenParameter, OutOfRange
from hornbill.node.role import ConnectionRole
from hornbill.wire.frame import Frame
from hornbill.wire.messages import AllocationMessage, ArrayCommand
from hornbill.wire.port import CanPort, FrameSink, PortWrapper
from hornbill.wire.services import GetSetRequest
from hornbill.wire.transfer import END, START, TOGGLE

BOOT_LOADER: Final = 0x49
"""The boot loader register. Writing it can leave a servo without firmware (section 4.39)."""

ALL_ACTUATORS: Final = 255
"""The actuator ID of ArrayCommand that moves every servo on the bus (table 2-20)."""

NEW_ACTUATOR: Final = 0
"""The actuator ID of every servo without a servo ID: senders use 1 to 254 (table 2-20), and Futaba's program addresses
new servos by it. A command for it may move all of them together."""

# Service flag, request flag and the low byte of the service ID; for a message, three bits of its type. One
# test of these bits passes everything except two data types and a few foreign ones.
_FILTER: Final = 0x00FF_8080
_GET_SET: Final = GetSetRequest.TYPE.id << 16 | 0x8080
_COMMAND: Final = ArrayCommand.TYPE.id << 8
_ALLOCATION: Final = AllocationMessage.TYPE.id << 8
_SUSPECTS: Final = frozenset({_GET_SET, _COMMAND & _FILTER})
_SESSION: Final = 0x00FF_FFFF

_LONGEST: Final = 256
"""More than the longest legal GetSet request (223 bytes) and ArrayCommand (60). Longer transfers are refused."""

_VALUE_BYTES: Final = {0: 0, 1: 8, 2: 4, 3: 1}
_REGISTER: Final = re.compile(rb"0x[0-9A-Fa-f]{2}", re.ASCII)


@dataclass(frozen=True, slots=True)
class _Partial:
    """An incomplete transfer: identifier, tail bits expected next, bytes so far."""

    id: int
    due: int
    gathered: bytes


class GuardedPort(PortWrapper):
    """A CanPort that refuses forbidden transfers before any of their frames leave.

    Raises ForbiddenParameter for a read or write of register 0x49 by its name, by index 73, or by any name that is
    not clearly another register (`0x` and two hex digits), because it is unknown how firmware parses other
    spellings; for a write to a name that is not in `writable` (exactly as printed: "0x2A"); and for a GetSet request
    that is malformed or whose frames are out of order. Raises OutOfRange for an ArrayCommand for actuator 0, and for
    255 unless `allow_broadcast`.

    As observer, raises BusReadOnly for every frame. As guest, raises it for node ID allocation.

    A call sends all of its frames or none. A transfer sent in several calls is tracked, and the frame that would
    complete it is refused.
    """

    def __init__(
        self,
        port: CanPort,
        *,
        writable: frozenset[str],
        allow_broadcast: bool = False,
        role: ConnectionRole = ConnectionRole.HOST,
    ) -> None:
        """Raises ValueError if `writable` contains a name that is not a register, or 0x49 itself."""
        for name in writable:
            if not _names_another_register(name.encode()):
                raise ValueError(f"{name!r} cannot be made writable. Give registers as printed, 0x49 excepted.")
        super().__init__(port)
        self._writable = frozenset(name.encode() for name in writable)
        self._allow_broadcast = allow_broadcast
        self._role = role
        self._partial: dict[int, _Partial] = {}
        self._check_payload = lru_cache(maxsize=4096)(self._check_get_set)  # it depends on nothing else

    def listen(self, sink: FrameSink) -> None:
        """Received frames pass unchanged."""
        self._behind.listen(sink)

    def send(self, frames: Sequence[Frame]) -> None:
        """Send all frames or none.

        Raises ForbiddenParameter, OutOfRange and BusReadOnly as described for the class, and the errors of the port
        behind.
        """
        if self._role is not ConnectionRole.HOST:
            self._check_role(frames)
        frames = tuple(frames)  # a copy: the checked frames are sent, even if the caller's list changes
        suspects = [frame for frame in frames if frame.id & _FILTER in _SUSPECTS]
        try:
            for frame in suspects:
                self._follow(frame)
            self._behind.send(frames)
        except Exception:
            # Discard partial transfers: their remaining frames might complete another one.
            for frame in suspects:
                self._partial.pop(frame.id & _SESSION, None)
            raise

    async def close(self) -> None:
        """Close the port behind."""
        self._partial.clear()
        await self._behind.close()

    def _check_role(self, frames: Sequence[Frame]) -> None:
        """Raises BusReadOnly for what the role of a guest or observer forbids."""
        if self._role is ConnectionRole.OBSERVER:
            raise BusReadOnly(
                "hornbill is connected as observer, so nothing is sent. To send, change the role to guest or host.",
                cause="observer_sends_nothing",
            )
        if any(frame.id & 0x00FF_FF80 == _ALLOCATION for frame in frames):
            raise BusReadOnly(
                "hornbill is connected as guest, so it allocates no node IDs. To allocate, change the role to host.",
                cause="guest_allocates_nothing",
            )

    def _follow(self, frame: Frame) -> None:
        """Track one frame of a checked type, and check the transfer it completes."""
        can_id = frame.id
        is_get_set = can_id & _FILTER == _GET_SET
        if not is_get_set and (can_id & 0x00FF_FF80 != _COMMAND or not can_id & 0x7F):
            return
        # Receivers may or may not distinguish sessions by priority. One transfer at a time is safe for both.
        key = can_id & _SESSION
        before = self._partial.pop(key, None)
        data = bytes(frame.data)
        tail = data[-1] if data else 0
        if tail & START:
            if tail & TOGGLE or not data:
                raise _malformed()
            due, gathered = (tail & 0x1F) | TOGGLE, data[:-1]
        else:
            if before is None or before.id != can_id or tail & 0x3F != before.due:
                raise _malformed()
            due, gathered = before.due ^ TOGGLE, before.gathered + data[:-1]
        if not tail & END:
            if len(gathered) > _LONGEST:
                raise _malformed()
            self._partial[key] = _Partial(can_id, due, gathered)
            return
        payload = gathered if tail & START else gathered[2:]  # multi-frame transfers start with two bytes of CRC
        if is_get_set:
            self._check_payload(payload)
        else:
            self._check_command(payload)

    def _check_get_set(self, payload: bytes) -> None:
        """Table 2-14. Raises ForbiddenParameter."""
        if len(payload) < 2:
            raise _malformed()
        # Firmware may use only the low byte of the 13-bit index, so that byte alone decides.
        if payload[0] == BOOT_LOADER:
            raise _forbidden(f"Index {payload[0] | payload[1] >> 3 << 8}", "0x49 is the boot loader register")
        tag = payload[1] & 7
        length = _VALUE_BYTES.get(tag, -1)
        if tag == 4 and len(payload) > 2:
            length = 1 + payload[2]
        if length < 0 or len(payload) < 2 + length:
            raise _malformed()
        name = payload[2 + length :]
        shown = name.decode("latin-1")
        if tag:
            if name not in self._writable:
                raise _forbidden(f"Writing {shown!r}", "only registers of the parameter tables can be written")
        elif name and not _names_another_register(name):
            raise _forbidden(f"Reading {shown!r}", "a register name is 0x and two hex digits, except 0x49")

    def _check_command(self, payload: bytes) -> None:
        """Table 2-20, without the length field of CAN FD. Raises OutOfRange and ForbiddenParameter."""
        if len(payload) % 4:
            raise _malformed()
        addressed = payload[::4]
        if NEW_ACTUATOR in addressed:
            raise OutOfRange(
                "Actuator ID 0 addresses every servo without a servo ID: all of them may move together. "
                "Set a servo ID of 1 to 254 (parameter 0x45) and use that.",
                minimum=1,
                maximum=254,
                unit="",
                requested=NEW_ACTUATOR,
                cause="unassigned_id",
            )
        if ALL_ACTUATORS in addressed and not self._allow_broadcast:
            raise OutOfRange(
                "Actuator ID 255 would move every servo on the bus. Use 1 to 254.",
                minimum=1,
                maximum=254,
                unit="",
                requested=ALL_ACTUATORS,
                cause="broadcast_id",
            )


def _names_another_register(name: bytes) -> bool:
    return _REGISTER.fullmatch(name) is not None and int(name, 16) != BOOT_LOADER


def _forbidden(what: str, why: str) -> ForbiddenParameter:
    return ForbiddenParameter(f"{what} is refused: {why}. Nothing was sent.", cause="write_forbidden")


def _malformed() -> ForbiddenParameter:
    return _forbidden("An incomplete or malformed request", "its effect on a servo is unknown")
