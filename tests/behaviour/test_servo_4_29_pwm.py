"""Sections 4.29 and 4.30: the PWM input of the models that have one, with the four examples of the document."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import Desk

MISSING, LOW, HIGH = 1 << 20, 1 << 21, 1 << 22


def desk_with(pulse: float | None, **rom: int) -> Desk:
    desk = Desk("BLA21-06U-AB", rom={"soft_start": 0} | rom)
    desk.servo.conditions.pwm_us = pulse
    desk.wait(1.0)
    return desk


@pytest.mark.states("B84", "B29")
@pytest.mark.parametrize(
    ("rom", "expected"),
    [
        ({}, {820: -700, 1_170: -350, 1_420: -100, 1_520: 0, 1_620: 100, 1_870: 350, 2_200: 680, 2_220: 700}),
        ({"pwm_output_range": 1_400}, {820: -1_400, 1_170: -700, 1_520: 0, 1_870: 700, 2_220: 1_400}),
        ({"pwm_neutral": 1_000, "pwm_range": 500}, {500: -700, 750: -350, 1_000: 0, 1_250: 350, 1_500: 700}),
        ({"reverse": 1}, {1_870: 350}),
    ],
    ids=["example 1", "example 2", "example 3", "reverse"],
)
def test_pulses_command_angles_the_wider_the_more_clockwise(rom: dict[str, int], expected: dict[int, int]) -> None:
    desk = desk_with(None, **rom)
    for pulse, tenths in expected.items():
        desk.under(pwm_us=float(pulse)).settle()
        assert desk.read("0x00") == tenths
        assert desk.read("0x08") == pytest.approx(tenths, abs=3)
        assert desk.servo.angle_deg == pytest.approx(-tenths / 10 if rom.get("reverse") else tenths / 10, abs=0.4)


@pytest.mark.states("B84", "B36")
@pytest.mark.parametrize(("pulse", "rpm"), [(820, -150), (1_170, -75), (1_520, 0), (1_870, 75), (2_220, 150)])
def test_in_example_4_pulses_command_speeds_if_0x25_is_on(pulse: float, rpm: int) -> None:
    desk = desk_with(pulse, pwm_mode=1, pwm_output_range=150, speed_torque_control=1)
    assert desk.reads("0x00", "0x01") == [DUMMY, rpm]
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(rpm, abs=10 if abs(rpm) == 150 else 1)
    assert desk_with(pulse, pwm_mode=1, pwm_output_range=150).reads("0x01", "0x09") == [0, 0]


@pytest.mark.states("B84", "B31")
def test_angle_limits_apply_to_pulses() -> None:
    desk = desk_with(2_100, angle_limit_cw=200)
    assert desk.read("0x08") == pytest.approx(200, abs=3)
    assert desk.read("0x19") == 1 << 8


@pytest.mark.states("B86")
@pytest.mark.parametrize(
    ("rom", "pulse", "bit"),
    [
        ({}, None, MISSING), ({}, 820, LOW), ({}, 821, 0), ({}, 1_520, 0), ({}, 2_219, 0), ({}, 2_220, HIGH),
        ({}, 2_300, HIGH), ({"pwm_neutral": 1_000, "pwm_range": 500}, 1_250, 0),
        ({"pwm_neutral": 1_000, "pwm_range": 200}, 1_250, HIGH),
    ],
)  # fmt: skip
def test_the_bits_report_pulses_that_are_missing_or_at_an_end_of_the_range(
    rom: dict[str, int], pulse: float | None, bit: int
) -> None:
    desk = desk_with(pulse)
    for key, raw in rom.items():
        desk.write({"pwm_neutral": "0x34", "pwm_range": "0x35"}[key], raw)
    assert desk.read("0x19") == bit


@pytest.mark.states("B85")
@pytest.mark.parametrize("timeout_ms", [1_000, 3_000])
def test_can_takes_precedence_immediately_and_pwm_after_0x27_without_can(timeout_ms: int) -> None:
    desk = desk_with(1_870, timeout_time=timeout_ms)
    desk.run("0x00", -200, 0.5)
    desk.run("0x00", -250, timeout_ms / 1000 - 0.1)
    assert desk.read("0x00") == -250
    assert desk.read("0x08") == pytest.approx(-250, abs=3)
    desk.wait(0.2)
    assert desk.read("0x00") == 350
    desk.wait(1.3)
    assert desk.servo.output == 0
    assert desk.read("0x08") == pytest.approx(350, abs=3)


@pytest.mark.states("B85", "B72")
def test_without_a_pulse_the_timeout_applies() -> None:
    desk = desk_with(None)
    desk.run("0x00", -200, 1.1)
    assert desk.servo.output == 1


@pytest.mark.states("B85", "B61")
def test_pulses_do_not_switch_the_output_on() -> None:
    desk = desk_with(1_870, torque_mode=1)
    assert (desk.servo.output, desk.read("0x08")) == (1, 0)


@pytest.mark.states("B86", "B72")
@pytest.mark.parametrize("pulse", [None, 2_300.0, 700.0])
@pytest.mark.parametrize("action", [0, 1, 2])
def test_a_pulse_out_of_range_is_no_signal_and_0x26_and_0x27_apply(pulse: float | None, action: int) -> None:
    desk = desk_with(1_870, timeout_action=action, timeout_time=500)
    desk.under(pwm_us=pulse).wait(0.35)
    assert (desk.servo.output, desk.read("0x00")) == (0, 350)
    desk.wait(0.2)
    assert (desk.servo.output, desk.read("0x00")) == (action, 350)
    desk.under(pwm_us=1_620.0)
    desk.settle()
    assert (desk.servo.output, desk.read("0x08")) == (0, pytest.approx(100, abs=3))


@pytest.mark.states("B86")
def test_a_pulse_out_of_range_since_the_start_commands_nothing() -> None:
    desk = desk_with(2_300)
    desk.wait(0.2)
    assert (desk.reads("0x00", "0x08"), desk.servo.output) == ([0, 0], 1)


@pytest.mark.states("B60", "B83")
def test_other_models_ignore_pulses() -> None:
    desk = Desk("BLA21-06U-A0", rom={"soft_start": 0}).under(pwm_us=2_000)
    desk.wait(1.0)
    assert desk.reads("0x08", "0x19") == [0, 0]
