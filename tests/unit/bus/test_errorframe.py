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
    ("frame", "state"),
    [
        (ErrorFrame(0x004, b"\0\x20"), PortState.PASSIVE),
        (ErrorFrame(0x204, b"\0\x10\0\0\0\0\x80\0"), PortState.PASSIVE),
        (ErrorFrame(0x004, b"\0\x08"), PortState.ACTIVE),  # down from passive to the warning level
        (ErrorFrame(0x004, b"\0\x40"), PortState.ACTIVE),
        (ErrorFrame(0x040), PortState.BUS_OFF),
        (ErrorFrame(0x100), PortState.ACTIVE),
        (ErrorFrame(0x004, b"\0\x01"), None),
        (ErrorFrame(0x004), None),
        (ErrorFrame(0x020), None),
        (ErrorFrame(), None),
        (NOW_ACTIVE, PortState.ACTIVE),
        (NOW_PASSIVE, PortState.PASSIVE),
        (NOW_BUS_OFF, PortState.BUS_OFF),
    ],
)
def test_the_state_of_an_error_frame(frame: ErrorFrame, state: PortState | None) -> None:
    assert frame.state is state


def test_lost_arbitration_and_recovery_are_not_errors() -> None:
    assert all(each.harmless for each in (ErrorFrame(0x002), ErrorFrame(0x100), NOW_ACTIVE))
    harmful = (ErrorFrame(), BUS_ERROR, NOW_PASSIVE, NOW_BUS_OFF, ErrorFrame(0x004, b"\0\x08"), OVERFLOW)
    assert not any(each.harmless for each in harmful)


def test_a_missing_acknowledgement_is_recognised_by_class_or_location() -> None:
    assert all(each.unacknowledged for each in (ErrorFrame(0x020), ErrorFrame(0x088, b"\0\0\0\x19"), UNACKNOWLEDGED))
    assert not any(each.unacknowledged for each in (ErrorFrame(0x088, b"\0\0\0\x08"), ErrorFrame(0x088), NOW_BUS_OFF))


def test_an_overflow_is_recognised() -> None:
    assert OVERFLOW.overflow
    assert not NOW_PASSIVE.overflow
