"""GuardedPort: the last place before the wire, where 0x49 and every unlisted write are refused."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from hornbill.errors import ForbiddenParameter, OutOfRange
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ArrayCommand
from hornbill.wire.port import CanPort, FrameSink, PortWrapper
from hornbill.wire.services import GetSetRequest
from hornbill.wire.transfer import END, START, TOGGLE

BOOT_LOADER: Final = 0x49
"""The register whose writing can leave a servo without firmware (section 4.39)."""

ALL_ACTUATORS: Final = 255
"""The actuator id of ArrayCommand that moves every servo on the bus (table 2-20)."""

NEW_ACTUATOR: Final = 0
"""The actuator id of every servo that was given none: senders use 1 to 254 (table 2-20), and the maker's program moves
a new servo by it, so that an entry for it may move all of them together."""

# Service flag, request flag and the low byte of the service id; for a message, three bits of its type. One
# test of these bits lets everything but two data types and a few foreign ones pass at once.
_LOOK: Final = 0x00FF_8080
_GET_SET: Final = GetSetRequest.TYPE.id << 16 | 0x8080
_COMMAND: Final = ArrayCommand.TYPE.id << 8
_SUSPECTS: Final = frozenset({_GET_SET, _COMMAND & _LOOK})
_SESSION: Final = 0x00FF_FFFF

_LONGEST: Final = 256
"""Above the longest legal GetSet request (223 bytes) and ArrayCommand (60): what grows further is refused."""

_VALUE_BYTES: Final = {0: 0, 1: 8, 2: 4, 3: 1}
_REGISTER: Final = re.compile(rb"0x[0-9A-Fa-f]{2}", re.ASCII)


@dataclass(frozen=True, slots=True)
class _Begun:
    """A transfer of which not all frames were handed over: identifier, tail bits due next, bytes so far."""

    id: int
    due: int
    gathered: bytes


class GuardedPort(PortWrapper):
    """A CanPort that refuses what no servo may be sent, before any frame of it leaves.

    Refused with ForbiddenParameter, read or write alike: register 0x49 under its name, under index 73, or
    under any name that is not plainly another register (`0x` and two hex digits), because how a servo's
    firmware reads an odd spelling is not known; a write to a name that is not in `writable` (exactly as
    printed: "0x2A"); and a GetSet request that is malformed or whose frames are not in order. Refused with
    OutOfRange: ArrayCommand for actuator 0, and for 255 unless `allow_broadcast`.

    Either all frames of a call leave or none. A transfer handed over in several calls is followed; the frame
    that would complete it is refused.
    """

    def __init__(self, port: CanPort, *, writable: frozenset[str], allow_broadcast: bool = False) -> None:
        """Raises ValueError when `writable` holds a name that is not a register, or 0x49 itself."""
        for name in writable:
            if not _names_another_register(name.encode()):
                raise ValueError(f"{name!r} cannot be made writable. Give registers as printed, 0x49 excepted.")
        super().__init__(port)
        self._writable = frozenset(name.encode() for name in writable)
        self._allow_broadcast = allow_broadcast
        self._begun: dict[int, _Begun] = {}

    def listen(self, sink: FrameSink) -> None:
        """Received frames pass untouched."""
        self._behind.listen(sink)

    def send(self, frames: Sequence[Frame]) -> None:
        """Hand frames on, all or none.

        Raises ForbiddenParameter and OutOfRange as said above, and what the port behind raises.
        """
        frames = tuple(frames)  # what is looked at is what is sent, even if the caller's list changes
        suspects = [frame for frame in frames if frame.id & _LOOK in _SUSPECTS]
        try:
            for frame in suspects:
                self._follow(frame)
            self._behind.send(frames)
        except Exception:
            # What was begun is cut off: its remaining frames might complete something else.
            for frame in suspects:
                self._begun.pop(frame.id & _SESSION, None)
            raise

    async def close(self) -> None:
        """Close the port behind."""
        self._begun.clear()
        await self._behind.close()

    def _follow(self, frame: Frame) -> None:
        """Take one more frame of a watched type; check the transfer when this completes it."""
        can_id = frame.id
        is_get_set = can_id & _LOOK == _GET_SET
        if not is_get_set and (can_id & 0x00FF_FF80 != _COMMAND or not can_id & 0x7F):
            return
        # Receivers may or may not tell sessions apart by priority: one transfer at a time satisfies both.
        key = can_id & _SESSION
        before = self._begun.pop(key, None)
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
            self._begun[key] = _Begun(can_id, due, gathered)
            return
        payload = gathered if tail & START else gathered[2:]  # several frames begin with two bytes of CRC
        if is_get_set:
            self._check_get_set(payload)
        else:
            self._check_command(payload)

    def _check_get_set(self, payload: bytes) -> None:
        """Table 2-14. Raises ForbiddenParameter."""
        if len(payload) < 2:
            raise _malformed()
        # A firmware may keep only the low byte of the 13-bit index, so that byte alone decides.
        if payload[0] == BOOT_LOADER:
            raise _forbidden(f"Index {payload[0] | payload[1] >> 3 << 8}", "0x49 is the boot loader's register")
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
                raise _forbidden(f"Writing {shown!r}", "only registers of the parameter tables are written")
        elif name and not _names_another_register(name):
            raise _forbidden(f"Reading {shown!r}", "only 0x and two hex digits, 0x49 excepted, name a register here")

    def _check_command(self, payload: bytes) -> None:
        """Table 2-20, without the length of CAN FD. Raises OutOfRange, or ForbiddenParameter."""
        if len(payload) % 4:
            raise _malformed()
        addressed = payload[::4]
        if NEW_ACTUATOR in addressed:
            raise OutOfRange(
                "Actuator id 0 is that of every servo without a servo id: all of them may move together. Give the "
                "servo an id (parameter 0x45), and use that: 1 to 254.",
                minimum=1,
                maximum=254,
                unit="",
                requested=NEW_ACTUATOR,
                cause="id_of_all_new",
            )
        if ALL_ACTUATORS in addressed and not self._allow_broadcast:
            raise OutOfRange(
                "Actuator id 255 would move every servo on the bus. Use 1 to 254.",
                minimum=1,
                maximum=254,
                unit="",
                requested=ALL_ACTUATORS,
                cause="id_of_all",
            )


def _names_another_register(name: bytes) -> bool:
    return _REGISTER.fullmatch(name) is not None and int(name, 16) != BOOT_LOADER


def _forbidden(what: str, why: str) -> ForbiddenParameter:
    return ForbiddenParameter(f"{what} is refused: {why}. Nothing was sent.", cause="guarded")


def _malformed() -> ForbiddenParameter:
    return _forbidden("An incomplete or malformed request", "what a servo would make of it cannot be known")
