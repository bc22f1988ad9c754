"""Error frames of adapters, coded as in linux/can/error.h.

SocketCAN and candleLight (gs_usb) use this code; reports of slcan adapters are converted to it.
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

_ACK_SLOT = 0x19  # location of a protocol error, in byte 3


class ErrorFrame(NamedTuple):
    """One error frame: `classes` are bits, `data` up to 8 bytes. Without any bit, an unspecified error."""

    classes: int = 0
    data: bytes = b""

    @property
    def state(self) -> PortState | None:
        """Controller state in the error frame. None if it contains none."""
        if self.classes & _BUS_OFF:
            return PortState.BUS_OFF
        if self.classes & _RESTARTED:
            return PortState.ACTIVE
        if self._controller & _PASSIVE:
            return PortState.PASSIVE
        if self._controller & (_ACTIVE | _WARNING):  # at the warning level a controller is still error active
            return PortState.ACTIVE
        return None

    @property
    def harmless(self) -> bool:
        """Whether it is no error: arbitration was lost, or the controller has recovered."""
        return self.classes in (_LOST_ARBITRATION, _RESTARTED) or (
            self.classes == _CONTROLLER and self._controller == _ACTIVE
        )

    @property
    def unacknowledged(self) -> bool:
        """Whether one of our frames was not acknowledged. Some drivers report this only by the error location."""
        at_ack = self.classes & _PROTOCOL and self.data[3:4] == bytes([_ACK_SLOT])
        return bool(self.classes & _NO_ACK or at_ack)

    @property
    def overflow(self) -> bool:
        """Whether the controller lost at least one frame because of an RX overrun."""
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
