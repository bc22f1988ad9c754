"""Acceptance test of one servo: limits, motion, supply, and refusals."""

import pytest

from hornbill.client import Hornbill, Lease, Servo
from hornbill.errors import LeaseRequired, OutOfRange


@pytest.mark.parametrize("angle_deg", [-20.0, 0.0, 20.0])
def test_it_reaches_the_commanded_angle(hornbill_servo: Servo, hornbill_lease: Lease, angle_deg: float) -> None:
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
    assert isinstance(limit, float | int)
    hornbill_servo.torque("on")
    with pytest.raises(OutOfRange) as refused:
        hornbill_servo.move(limit + 1)
    assert refused.value.facts["maximum"] == limit


def test_motion_without_motion_control_is_refused(hornbill_servo: Servo) -> None:
    with pytest.raises(LeaseRequired):
        hornbill_servo.move(10)


def test_a_stop_by_the_test_is_cleared_before_the_next_one(
    hornbill: Hornbill, hornbill_servo: Servo, hornbill_lease: Lease
) -> None:
    hornbill_servo.torque("on")
    hornbill.stop(reason="end of the test")
    assert hornbill_servo.read("torque_mode") == "off"
