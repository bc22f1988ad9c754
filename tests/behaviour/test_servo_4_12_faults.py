"""Section 4.12: the four words of abnormality information. Bit numbers stand here as the document prints them."""

import pytest

from unit.sim.desk import Desk

NOTIFICATION, WARNING, FAILURE = "0x19", "0x1A", "0x1B"
BITS = {
    "sensor_weak": (WARNING, 4), "sensor_strong": (WARNING, 5), "temperature_high": (WARNING, 8),
    "temperature_low": (WARNING, 9), "voltage_high": (WARNING, 10), "voltage_low": (WARNING, 11),
    "rom_lost": (WARNING, 15), "motor_driver": (FAILURE, 0), "motor_signal": (FAILURE, 1),
    "sensor_failure": (FAILURE, 5), "clock_restart": (FAILURE, 8), "watchdog_restart": (FAILURE, 9),
    "ram_restart": (FAILURE, 11), "angle_limit_cw_reached": (NOTIFICATION, 8),
    "angle_limit_ccw_reached": (NOTIFICATION, 9), "speed_limit_cw_reached": (NOTIFICATION, 10),
    "speed_limit_ccw_reached": (NOTIFICATION, 11), "torque_limit_cw_reached": (NOTIFICATION, 12),
    "torque_limit_ccw_reached": (NOTIFICATION, 13), "pwm_missing": (NOTIFICATION, 20),
    "pwm_low": (NOTIFICATION, 21), "pwm_high": (NOTIFICATION, 22),
}  # fmt: skip
LEVEL = {NOTIFICATION: 0, WARNING: 1, FAILURE: 2}


def test_a_healthy_servo_reads_0() -> None:
    desk = Desk()
    desk.settle()
    assert [desk.read(name) for name in ("0x18", "0x19", "0x1A", "0x1B")] == [0, 0, 0, 0]


@pytest.mark.parametrize("key", BITS)
def test_every_bit_shows_in_its_word_and_in_the_overview(key: str) -> None:
    desk = Desk("BLA21-06U-AB")
    desk.servo.conditions.pwm_us = 1_520
    desk.settle()
    desk.servo.faults.inject(key, True)
    name, bit = BITS[key]
    assert desk.read(name) == 1 << bit
    assert desk.read("0x18") == 1 << (bit // 8 * 8 + LEVEL[name])


@pytest.mark.parametrize("key", ["pwm_missing", "pwm_low", "pwm_high"])
def test_a_model_without_pwm_has_no_pwm_bits(key: str) -> None:
    desk = Desk("BLA21-06U-A0")
    with pytest.raises(ValueError, match="no fault bit of this model"):
        desk.servo.faults.inject(key, True)
    desk.wait(1.0)
    assert desk.read("0x19") == 0


def test_a_bit_goes_with_its_cause() -> None:
    desk = Desk()
    desk.servo.faults.inject("sensor_weak", True)
    assert desk.read(WARNING) == 1 << 4
    desk.servo.faults.inject("sensor_weak", False)
    assert desk.read(WARNING) == 0


@pytest.mark.parametrize("key", ["clock_restart", "watchdog_restart", "ram_restart", "rom_lost"])
def test_what_tells_of_the_past_stays_until_the_next_start(key: str) -> None:
    desk = Desk()
    desk.servo.faults.inject(key, True)
    desk.servo.faults.inject(key, False)
    name, bit = BITS[key]
    desk.wait(10.0)
    assert desk.read(name) == 1 << bit
    desk.restart()
    desk.wait(0.2)
    assert desk.read(name) == 0


def test_a_start_clears_them_even_when_nobody_took_the_cause_back() -> None:
    desk = Desk()
    desk.servo.faults.inject("watchdog_restart", True)
    desk.restart()
    desk.wait(0.2)
    assert desk.read(FAILURE) == 0


@pytest.mark.parametrize("key", ["motor_driver", "motor_signal", "sensor_failure"])
def test_with_a_broken_motor_circuit_there_is_no_output(key: str) -> None:
    desk = Desk()
    desk.settle()
    assert desk.servo.output == 0
    desk.servo.faults.inject(key, True)
    desk.wait(0.1)
    assert desk.servo.output == 1
    desk.servo.faults.inject(key, False)
    desk.wait(0.1)
    assert desk.servo.output == 0
