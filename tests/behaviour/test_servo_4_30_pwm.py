"""Sections 4.29 and 4.30: the PWM input of the models that have one."""

import pytest

from unit.sim.desk import Desk

BASE = {"soft_start": 0}
MISSING, LOW, HIGH = 1 << 20, 1 << 21, 1 << 22


def desk_with(pulse: float | None, **rom: int) -> Desk:
    desk = Desk("BLA21-06U-AB", rom=BASE | rom)
    desk.servo.conditions.pwm_us = pulse
    desk.wait(1.0)
    return desk


@pytest.mark.parametrize(("pulse", "tenths"), [(1_520, 0), (1_870, 350), (1_170, -350), (2_200, 680)])
def test_a_pulse_asks_for_an_angle(pulse: float, tenths: int) -> None:
    desk = desk_with(pulse)
    assert desk.read("0x00") == tenths
    assert desk.read("0x08") == pytest.approx(tenths, abs=3)


def test_example_2_widens_the_output() -> None:
    assert desk_with(1_870, pwm_output_range=1_400).read("0x00") == 700


def test_example_3_moves_neutral_and_range() -> None:
    assert desk_with(1_250, pwm_neutral=1_000, pwm_range=500).read("0x00") == 350


def test_example_4_asks_for_a_speed() -> None:
    desk = desk_with(1_870, pwm_mode=1, pwm_output_range=150, speed_torque_control=1)
    assert desk.read("0x01") == 75
    assert desk.read("0x09") == pytest.approx(75, abs=1)


@pytest.mark.parametrize(("pulse", "bit"), [(None, MISSING), (800, LOW), (2_300, HIGH), (1_520, 0)])
def test_the_bits_tell_of_pulses_that_are_missing_or_too_wide(pulse: float | None, bit: int) -> None:
    assert desk_with(pulse).read("0x19") == bit


def test_can_comes_first_and_pwm_takes_over_when_can_falls_silent() -> None:
    desk = desk_with(1_870)
    desk.write("0x00", -200)
    desk.wait(0.9)
    assert desk.read("0x08") == pytest.approx(-200, abs=3)
    desk.wait(1.5)
    assert desk.servo.output == 0
    assert desk.read("0x08") == pytest.approx(350, abs=3)


def test_without_a_pulse_the_time_out_does_what_it_says() -> None:
    desk = desk_with(None)
    desk.write("0x00", -200)
    desk.wait(1.1)
    assert desk.servo.output == 1


def test_other_models_take_no_notice() -> None:
    desk = Desk("BLA21-06U-A0", rom=BASE)
    desk.servo.conditions.pwm_us = 2_000
    desk.wait(1.0)
    assert desk.read("0x08") == 0
    assert desk.read("0x19") == 0
