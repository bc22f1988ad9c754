"""A rig's acceptance test of one servo: limits, motion, supply, and that it says no where it should."""

import pytest

from hornbill.client import Hornbill, Lease, Servo
from hornbill.errors import LeaseRequired, OutOfRange


@pytest.mark.parametrize("angle_deg", [-20.0, 0.0, 20.0])
def test_it_gets_where_it_is_told(hornbill_servo: Servo, hornbill_lease: Lease, angle_deg: float) -> None:
    hornbill_servo.torque("on")
    moved = hornbill_servo.move(angle_deg, band_deg=0.7, timeout_s=3)
    assert moved["settled"]
    assert hornbill_servo.read("current_angle") == pytest.approx(angle_deg, abs=0.7)


def test_the_supply_is_within_its_limits(hornbill_servo: Servo) -> None:
    parameters = hornbill_servo.read_all()["parameters"]
    low, now, high = (
        parameters[key]["value"] for key in ("voltage_limit_lower", "current_voltage", "voltage_limit_upper")
    )
    assert isinstance(low, float | int)
    assert isinstance(now, float | int)
    assert isinstance(high, float | int)
    assert low < now < high


def test_it_has_no_fault(hornbill_servo: Servo) -> None:
    assert [fault["label"] for fault in hornbill_servo.faults() if fault["level"] != "notification"] == []


def test_an_angle_beyond_its_limit_is_refused_with_the_limit(hornbill_servo: Servo, hornbill_lease: Lease) -> None:
    limit = hornbill_servo.read("angle_limit_cw")
    hornbill_servo.torque("on")
    with pytest.raises(OutOfRange) as refused:
        hornbill_servo.move(170)
    assert refused.value.facts["maximum"] == limit


def test_nothing_moves_without_motion_control(hornbill_servo: Servo) -> None:
    with pytest.raises(LeaseRequired):
        hornbill_servo.move(10)


def test_a_stop_of_the_test_is_cleared_for_the_next(
    hornbill: Hornbill, hornbill_servo: Servo, hornbill_lease: Lease
) -> None:
    hornbill_servo.torque("on")
    hornbill.stop(reason="the test wants it")
    assert hornbill_servo.read("torque_mode") == "off"
