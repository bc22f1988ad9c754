"""ErrorFrame: the relevant classes and bytes of linux/can/error.h."""

import pytest

from hornbill.bus.ports.errorframe import (
    BUS_ERROR,
    NOW_ACTIVE,
    NOW_BUS_OFF,
    NOW_PASSIVE,
    OVERFLOW,
    UNACKNOWLEDGED,
    ErrorFrame,
)
from hornbill.wire.port import PortState


@pytest.mark.parametrize(
    ("frame", "state", "kind"),
    [
        (ErrorFrame(0x004, b"\0\x20"), PortState.PASSIVE, ""),
        (ErrorFrame(0x204, b"\0\x10\0\0\0\0\x80\0"), PortState.PASSIVE, ""),
        (ErrorFrame(0x004, b"\0\x08"), PortState.ACTIVE, ""),  # down from passive to the warning level
        (ErrorFrame(0x004, b"\0\x40"), PortState.ACTIVE, "harmless"),
        (ErrorFrame(0x040), PortState.BUS_OFF, ""),
        (ErrorFrame(0x100), PortState.ACTIVE, "harmless"),  # recovered
        (ErrorFrame(0x002), None, "harmless"),  # lost arbitration
        (ErrorFrame(0x004, b"\0\x01"), None, "overflow"),
        (ErrorFrame(0x004), None, ""),
        (ErrorFrame(0x020), None, "unacknowledged"),
        (ErrorFrame(0x088, b"\0\0\0\x19"), None, "unacknowledged"),  # at the location of the acknowledgement
        (ErrorFrame(0x088, b"\0\0\0\x08"), None, ""),
        (ErrorFrame(0x088), None, ""),
        (ErrorFrame(), None, ""),
        (NOW_ACTIVE, PortState.ACTIVE, "harmless"),
        (NOW_PASSIVE, PortState.PASSIVE, ""),
        (NOW_BUS_OFF, PortState.BUS_OFF, ""),
        (BUS_ERROR, None, ""),
        (OVERFLOW, None, "overflow"),
        (UNACKNOWLEDGED, None, "unacknowledged"),
    ],
)
def test_the_state_and_kind_of_an_error_frame(frame: ErrorFrame, state: PortState | None, kind: str) -> None:
    assert frame.state is state
    assert [one for one in ("harmless", "unacknowledged", "overflow") if getattr(frame, one)] == [kind][: bool(kind)]
