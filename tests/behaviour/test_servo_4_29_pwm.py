"""Sections 4.29 and 4.30: the PWM input of the models that have one, with the four examples of the document."""

import pytest

from behaviour.servo_story import Rom, Steps, follow, near, stories, under
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
    desk, sign = desk_with(None, **rom), -1 if rom.get("reverse") else 1
    for pulse, tenths in expected.items():
        horn = near(sign * tenths / 10, 0.4)
        follow(desk, under(pwm_us=float(pulse)), Desk.settle, {"0x00": tenths, "0x08": near(tenths), "angle_deg": horn})


@pytest.mark.states("B84", "B36")
@pytest.mark.parametrize(("pulse", "rpm"), [(820, -150), (1_170, -75), (1_520, 0), (1_870, 75), (2_220, 150)])
def test_in_example_4_pulses_command_speeds_if_0x25_is_on(pulse: float, rpm: int) -> None:
    desk = desk_with(pulse, pwm_mode=1, pwm_output_range=150, speed_torque_control=1)
    assert desk.reads("0x00", "0x01") == [DUMMY, rpm]
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(rpm, abs=10 if abs(rpm) == 150 else 1)
    assert desk_with(pulse, pwm_mode=1, pwm_output_range=150).reads("0x01", "0x09") == [0, 0]


@pytest.mark.states("B31", "B61", "B72", "B84", "B85", "B86")
@stories({
    "B31, B84: angle limits apply to pulses": (
        {"angle_limit_cw": 200}, [under(pwm_us=2_100), 1.0, {"0x08": near(200), "0x19": 1 << 8}],
    ),
    **{f"B85: CAN takes precedence immediately, and PWM after {ms} ms without CAN": ({"timeout_time": ms}, [
        under(pwm_us=1_870), 1.0, ("0x00", -200, 0.5), ("0x00", -250, ms / 1000 - 0.1),
        {"0x00": -250, "0x08": near(-250)},
        0.2, {"0x00": 350}, 1.3, {"output": 0, "0x08": near(350)},
    ]) for ms in (1_000, 3_000)},
    "B85, B72: without a pulse the timeout applies": ({}, [("0x00", -200, 1.1), {"output": 1}]),
    "B85, B61: pulses do not switch the output on": (
        {"torque_mode": 1}, [under(pwm_us=1_870), 1.0, {"output": 1, "0x08": 0}],
    ),
    **{f"B86, B72: a pulse out of range is no signal, and 0x26 and 0x27 apply, {pulse}, {action}": (
        {"timeout_action": action, "timeout_time": 500}, [
            under(pwm_us=1_870), 1.0, under(pwm_us=pulse), 0.35, {"output": 0, "0x00": 350},
            0.2, {"output": action, "0x00": 350}, under(pwm_us=1_620.0), Desk.settle, {"output": 0, "0x08": near(100)},
    ]) for pulse in (None, 2_300.0, 700.0) for action in (0, 1, 2)},
})  # fmt: skip
def test_pulses_and_commands(rom: Rom, steps: Steps) -> None:
    follow(Desk("BLA21-06U-AB", rom={"soft_start": 0} | rom), *steps)


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


@pytest.mark.states("B86")
def test_a_pulse_out_of_range_since_the_start_commands_nothing() -> None:
    follow(desk_with(2_300), 0.2, {"0x00": 0, "0x08": 0, "output": 1})


@pytest.mark.states("B60", "B83")
def test_other_models_ignore_pulses() -> None:
    follow(Desk("BLA21-06U-A0", rom={"soft_start": 0}), under(pwm_us=2_000), 1.0, {"0x08": 0, "0x19": 0})
