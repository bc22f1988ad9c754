"""What an adapter says went wrong, coded as in linux/can/error.h.

SocketCAN and candleLight (gs_usb) code it so themselves; what slcan adapters tell is put into this code.
"""

from typing import NamedTuple

from hornbill.wire.port import PortState

# The class, in the identifier.
_LOST_ARBITRATION = 0x002
_CONTROLLER = 0x004
_PROTOCOL = 0x008
_NO_ACK = 0x020
_BUS_OFF = 0x040
_BUS_ERROR = 0x080
_RESTARTED = 0x100

# The controller's state, in byte 1.
_OVERFLOW = 0x01
_WARNING = 0x04 | 0x08
_PASSIVE = 0x10 | 0x20
_ACTIVE = 0x40

_ACK_SLOT = 0x19  # where a protocol error was seen, in byte 3


class ErrorFrame(NamedTuple):
    """One error frame: `classes` are bits, `data` up to 8 bytes. Without any bit it says only that there was one."""

    classes: int = 0
    data: bytes = b""

    @property
    def state(self) -> PortState | None:
        """The controller's state it tells of, or None when it tells of something else."""
        if self.classes & _BUS_OFF:
            return PortState.BUS_OFF
        if self.classes & _RESTARTED:
            return PortState.ACTIVE
        if self._controller & _PASSIVE:
            return PortState.PASSIVE
        if self._controller & (_ACTIVE | _WARNING):  # at the warning level a controller still is error active
            return PortState.ACTIVE
        return None

    @property
    def harmless(self) -> bool:
        """Whether nothing went wrong: arbitration was lost, or the controller has recovered."""
        return self.classes in (_LOST_ARBITRATION, _RESTARTED) or (
            self.classes == _CONTROLLER and self._controller == _ACTIVE
        )

    @property
    def unacknowledged(self) -> bool:
        """Whether nobody acknowledged a frame of ours; some drivers say so by the place of the error alone."""
        at_ack = self.classes & _PROTOCOL and self.data[3:4] == bytes([_ACK_SLOT])
        return bool(self.classes & _NO_ACK or at_ack)

    @property
    def overflow(self) -> bool:
        """Whether the controller lost at least one frame, because the last was not fetched in time."""
        return bool(self._controller & _OVERFLOW)

    @property
    def _controller(self) -> int:
        return self.data[1] if self.classes & _CONTROLLER and len(self.data) > 1 else 0


NOW_ACTIVE = ErrorFrame(_CONTROLLER, bytes([0, _ACTIVE]))
NOW_PASSIVE = ErrorFrame(_CONTROLLER, bytes([0, _PASSIVE]))
NOW_BUS_OFF = ErrorFrame(_BUS_OFF)
BUS_ERROR = ErrorFrame(_PROTOCOL | _BUS_ERROR)
UNACKNOWLEDGED = ErrorFrame(_PROTOCOL | _NO_ACK | _BUS_ERROR, bytes([0, 0, 0, _ACK_SLOT]))
OVERFLOW = ErrorFrame(_CONTROLLER, bytes([0, _OVERFLOW]))
