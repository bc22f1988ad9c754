"""Sections 4.29 and 4.30: the PWM input of the models that have one, with the four examples of the document."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FIRMWARE, FREE, MODELS, Desk

BASE = {"soft_start": 0}
MISSING, LOW, HIGH = 1 << 20, 1 << 21, 1 << 22
ROWS = ("0x34", "0x35", "0x36", "0x37")


def desk_with(pulse: float | None, **rom: int) -> Desk:
    desk = Desk("BLA21-06U-AB", rom=BASE | rom)
    desk.servo.conditions.pwm_us = pulse
    desk.wait(1.0)
    return desk


@pytest.mark.states("B83", "B101")
@pytest.mark.parametrize("firmware", FIRMWARE)
@pytest.mark.parametrize("model", MODELS)
def test_the_rows_are_there_on_models_with_the_input_from_1_100_on(model: str, firmware: str) -> None:
    desk = Desk(model, firmware)
    there = model.endswith("AB") and firmware >= "1.100"
    width = 1_100 if model.startswith("BLA34") else 700
    assert [desk.read(name) for name in ROWS] == ([1_520, width, width, 0] if there else [0] * 4)


@pytest.mark.states("B84")
@pytest.mark.parametrize(("pulse", "tenths"), [(1_520, 0), (1_870, 350), (1_170, -350), (2_200, 680)])
def test_a_pulse_asks_for_an_angle(pulse: float, tenths: int) -> None:
    desk = desk_with(pulse)
    assert desk.read("0x00") == tenths
    assert desk.read("0x08") == pytest.approx(tenths, abs=3)


@pytest.mark.states("B84", "B29")
@pytest.mark.parametrize(("pulse", "degrees"), [(1_620.0, 10.0), (1_420.0, -10.0)])
def test_a_wider_pulse_than_neutral_is_clockwise(pulse: float, degrees: float) -> None:
    assert desk_with(pulse).servo.angle_deg == pytest.approx(degrees, abs=0.4)


EXAMPLES: dict[str, tuple[dict[str, int], dict[int, int]]] = {
    "1 as delivered": ({}, {820: -700, 1_170: -350, 1_520: 0, 1_870: 350, 2_220: 700}),
    "2 wider output": ({"pwm_output_range": 1_400}, {820: -1_400, 1_170: -700, 1_520: 0, 1_870: 700, 2_220: 1_400}),
    "3 other pulses": (
        {"pwm_neutral": 1_000, "pwm_range": 500}, {500: -700, 750: -350, 1_000: 0, 1_250: 350, 1_500: 700},
    ),
}  # fmt: skip


@pytest.mark.states("B84")
@pytest.mark.parametrize("example", EXAMPLES)
def test_examples_1_to_3_map_pulses_to_angles(example: str) -> None:
    rom, expected = EXAMPLES[example]
    desk = desk_with(None, **rom)
    for pulse, tenths in expected.items():
        desk.under(pwm_us=float(pulse)).settle()
        assert desk.read("0x00") == tenths
        assert desk.read("0x08") == pytest.approx(tenths, abs=3)


@pytest.mark.states("B84")
@pytest.mark.parametrize(("pulse", "rpm"), [(820, -150), (1_170, -75), (1_520, 0), (1_870, 75), (2_220, 150)])
def test_example_4_maps_pulses_to_speeds(pulse: float, rpm: int) -> None:
    desk = desk_with(pulse, pwm_mode=1, pwm_output_range=150, speed_torque_control=1)
    assert (desk.read("0x00"), desk.read("0x01")) == (DUMMY, rpm)
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(rpm, abs=10 if abs(rpm) == 150 else 1)


@pytest.mark.states("B84", "B36")
def test_speeds_by_pulse_need_0x25_like_any_other() -> None:
    desk = desk_with(1_870, pwm_mode=1, pwm_output_range=150)
    assert (desk.read("0x01"), desk.read("0x09")) == (0, 0)


@pytest.mark.states("B84", "B31")
def test_limits_hold_for_pulses_too() -> None:
    desk = desk_with(2_100, angle_limit_cw=200)
    assert desk.read("0x08") == pytest.approx(200, abs=3)
    assert desk.read("0x19") == 1 << 8


@pytest.mark.states("B84", "B70")
def test_reverse_holds_for_pulses_too() -> None:
    assert desk_with(1_870, reverse=1).servo.angle_deg == pytest.approx(-35.0, abs=0.4)


@pytest.mark.states("B86")
@pytest.mark.parametrize(
    ("pulse", "bit"), [(None, MISSING), (820, LOW), (821, 0), (1_520, 0), (2_219, 0), (2_220, HIGH), (2_300, HIGH)]
)
def test_the_bits_tell_of_pulses_that_are_missing_or_at_the_ends(pulse: float | None, bit: int) -> None:
    assert desk_with(pulse).read("0x19") == bit


@pytest.mark.states("B86")
def test_the_bits_follow_the_range_that_is_set() -> None:
    desk = desk_with(1_250, pwm_neutral=1_000, pwm_range=500)
    assert desk.read("0x19") == 0
    desk.write("0x35", 200)
    assert desk.read("0x19") == HIGH


@pytest.mark.states("B85")
def test_can_comes_first_and_pwm_takes_over_when_can_falls_silent() -> None:
    desk = desk_with(1_870)
    desk.write("0x00", -200)
    desk.wait(0.9)
    assert desk.read("0x08") == pytest.approx(-200, abs=3)
    desk.wait(1.5)
    assert desk.servo.output == 0
    assert desk.read("0x08") == pytest.approx(350, abs=3)


@pytest.mark.states("B85")
def test_0x27_is_how_long_can_has_to_be_silent() -> None:
    desk = desk_with(1_870, timeout_time=3_000)
    desk.write("0x00", -200)
    desk.wait(2.9)
    assert desk.read("0x00") == -200
    desk.wait(0.2)
    assert desk.read("0x00") == 350


@pytest.mark.states("B85")
def test_can_takes_it_back_at_once() -> None:
    desk = desk_with(1_870)
    desk.write("0x00", -200)
    desk.wait(0.5)
    desk.write("0x00", -250)
    desk.wait(0.9)
    assert desk.read("0x00") == -250


@pytest.mark.states("B85", "B72")
def test_without_a_pulse_the_time_out_does_what_it_says() -> None:
    desk = desk_with(None)
    desk.write("0x00", -200)
    desk.wait(1.1)
    assert desk.servo.output == 1


@pytest.mark.states("B85", "B61")
def test_pulses_do_not_switch_the_output_on() -> None:
    desk = desk_with(1_870, torque_mode=1)
    assert (desk.servo.output, desk.read("0x08")) == (1, 0)


@pytest.mark.states("B86", "B72")
@pytest.mark.parametrize("pulse", [None, 2_300.0, 700.0])
@pytest.mark.parametrize(("action", "output"), [(0, 0), (1, 1), (2, 2)])
def test_a_pulse_out_of_range_is_no_signal_and_0x26_and_0x27_apply(
    pulse: float | None, action: int, output: int
) -> None:
    desk = desk_with(1_870, timeout_action=action, timeout_time=500)
    desk.under(pwm_us=pulse)
    desk.wait(0.35)
    assert (desk.servo.output, desk.read("0x00")) == (0, 350)
    desk.wait(0.2)
    assert (desk.servo.output, desk.read("0x00")) == (output, 350)
    desk.under(pwm_us=1_620.0)
    desk.settle()
    assert (desk.servo.output, desk.read("0x08")) == (0, pytest.approx(100, abs=3))


@pytest.mark.states("B86")
def test_a_pulse_out_of_range_from_the_start_commands_nothing() -> None:
    desk = desk_with(2_300)
    desk.wait(0.2)
    assert (desk.read("0x00"), desk.read("0x08"), desk.servo.output) == (0, 0, 1)


@pytest.mark.states("B60", "B83")
def test_other_models_take_no_notice() -> None:
    desk = Desk("BLA21-06U-A0", rom=BASE)
    desk.servo.conditions.pwm_us = 2_000
    desk.wait(1.0)
    assert desk.read("0x08") == 0
    assert desk.read("0x19") == 0


@pytest.mark.states("B83")
@pytest.mark.parametrize("name", ROWS)
def test_other_models_take_no_setting_of_it(name: str) -> None:
    desk = Desk("BLA15-06U-A0", rom=FREE)
    assert (desk.write(name, 5), desk.read(name)) == (0, 0)
