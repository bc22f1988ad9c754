"""Sections 4.7, 4.8, 4.34 and 4.35: temperature and supply, their limits, and the protection that takes the output."""

from math import exp
from typing import Any

import pytest

from hornbill.schema.parameter import DUMMY
from hornbill.sim.device import ServoStage
from unit.sim.desk import FREE, MODELS, Desk

TEMPERATURE_HIGH, TEMPERATURE_LOW, VOLTAGE_HIGH, VOLTAGE_LOW = 1 << 8, 1 << 9, 1 << 10, 1 << 11
SOFTWARE_WARNING = 1 << 9
HOT: dict[str, Any] = {"temperature_c": 90.0}
HIGH: dict[str, Any] = {"voltage_v": 11.0}
NORMAL: dict[str, Any] = {"temperature_c": 25.0, "voltage_v": 7.4}
BOUNDARY = {"06U": (35, 74, 120), "12U": (35, 120, 240), "28U": (35, 280, 500)}
"""Least lower limit, the value that both limits share, greatest upper limit, in 0.1 V."""


@pytest.mark.states("B107")
@pytest.mark.parametrize(
    ("conditions", "celsius", "tenths_of_a_volt"),
    [
        ({"temperature_c": 41.0, "voltage_v": 6.0}, 41, 60),
        ({"sensor_error": -1.0}, 20, 69),
        ({"sensor_error": 1.0}, 30, 79),
    ],
)
def test_both_are_read_in_their_units_within_the_tolerance_of_the_document(
    conditions: dict[str, float], celsius: int, tenths_of_a_volt: int
) -> None:
    desk = Desk().under(**conditions)
    desk.wait(0.1)
    assert desk.read("0x0B") == celsius
    assert desk.read("0x0C") == pytest.approx(tenths_of_a_volt, abs=1)


@pytest.mark.states("B41", "B107")
def test_protection_uses_the_reading_of_the_sensor() -> None:
    desk = Desk(rom=FREE).under(temperature_c=77.0)
    assert desk.servo.output == 0
    desk.under(sensor_error=1.0)
    assert desk.servo.output == 1


@pytest.mark.states("B41", "B43", "B55", "B92")
@pytest.mark.parametrize(
    ("limit", "condition", "at", "beyond", "bit"),
    [
        ({"temperature_limit_upper": 60}, "temperature_c", 60.0, 61.0, TEMPERATURE_HIGH),
        ({"temperature_limit_lower": 10}, "temperature_c", 10.0, 9.0, TEMPERATURE_LOW),
        ({"voltage_limit_upper": 90}, "voltage_v", 9.0, 9.2, VOLTAGE_HIGH),
        ({"voltage_limit_lower": 60}, "voltage_v", 6.0, 5.8, VOLTAGE_LOW),
    ],
)
def test_at_a_limit_the_bit_is_set_and_beyond_it_output_goes_off(
    limit: dict[str, int], condition: str, at: float, beyond: float, bit: int
) -> None:
    desk = Desk(rom=FREE | limit)
    assert (desk.reads("0x18", "0x1A"), desk.servo.output) == ([0, 0], 0)
    for value, output in ((at, 0), (beyond, 1), (at, 0)):
        desk.under(**{condition: value})
        assert (desk.read("0x1A"), desk.servo.output) == (bit, output)
        assert desk.value("0x18") & SOFTWARE_WARNING
    desk.under(**NORMAL)
    assert (desk.reads("0x18", "0x1A"), desk.servo.output) == ([0, 0], 0)


@pytest.mark.states("B41", "B92")
@pytest.mark.parametrize(
    ("name", "raw", "celsius", "bit"),
    [
        ("0x3E", 20, 25.0, TEMPERATURE_HIGH), ("0x3E", 50, 52.0, TEMPERATURE_HIGH),
        ("0x3F", 10, 8.0, TEMPERATURE_LOW), ("0x3F", -20, -22.0, TEMPERATURE_LOW),
    ],
)  # fmt: skip
def test_a_limit_written_beyond_the_reading_protects_immediately(name: str, raw: int, celsius: float, bit: int) -> None:
    desk = Desk(rom=FREE).under(temperature_c=celsius)
    assert (desk.read("0x1A"), desk.servo.output) == (0, 0)
    assert desk.write(name, raw) == raw
    desk.wait(0.1)
    assert (desk.read("0x1A"), desk.servo.output) == (bit, 1)


@pytest.mark.states("B92")
def test_the_temperature_limits_meet_at_20_degrees() -> None:
    desk = Desk(rom=FREE)
    assert [desk.write("0x3E", raw) for raw in (19, 20, 80, 81)] == [None, 20, 80, None]
    assert [desk.write("0x3F", raw) for raw in (-41, -40, 20, 21)] == [None, -40, 20, None]


@pytest.mark.states("B93")
@pytest.mark.parametrize("model", MODELS)
def test_the_voltage_limits_of_a_class_share_a_boundary(model: str) -> None:
    least, shared, greatest = BOUNDARY[model[6:9]]
    if model == "BLA34-28U-AB":
        greatest = 400
    desk = Desk(model, rom=FREE)
    assert [desk.write("0x41", raw) for raw in (least - 1, least, shared, shared + 1)] == [None, least, shared, None]
    wanted = [None, shared, greatest, None]
    assert [desk.write("0x40", raw) for raw in (shared - 1, shared, greatest, greatest + 1)] == wanted


@pytest.mark.states("B41", "B43", "B93")
@pytest.mark.parametrize("model", MODELS)
def test_by_default_every_model_is_protected_on_both_sides_and_not_at_its_nominal_supply(model: str) -> None:
    upper = {"06U": 10.0, "12U": 20.0, "28U": 40.0}[model[6:9]]
    desk = Desk(model)
    desk.settle()
    desk.go(1_700)
    assert desk.read("0x1A") == 0
    for volts, word in ((upper - 0.3, 0), (upper + 0.3, VOLTAGE_HIGH), (3.7, VOLTAGE_LOW), (4.3, 0)):
        desk.write("0x00", 1_700)
        desk.under(voltage_v=volts)
        assert (desk.read("0x1A"), desk.servo.output) == (word, int(word != 0))


@pytest.mark.states("B41", "B43")
@pytest.mark.parametrize("cause", [HOT, HIGH, {"voltage_v": 3.5}])
def test_without_output_a_load_turns_the_horn(cause: dict[str, float]) -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": 0}).under(load_pct=10.0)
    assert abs(desk.servo.angle_deg) < 2
    desk.under(**cause).wait(1.0)
    assert desk.servo.angle_deg > 30


@pytest.mark.states("B65")
@pytest.mark.parametrize("cause", [{"voltage_v": 3.5}, HIGH, {"temperature_c": 85.0}])
def test_torque_on_has_no_effect_until_the_cause_ends(cause: dict[str, float]) -> None:
    desk = Desk(rom=FREE).under(**cause)
    for mode in (1, 0):
        assert desk.write("0x20", mode) == mode
        assert desk.servo.output == 1
    assert desk.write("0x00", 300) == 300
    desk.wait(0.3)
    assert desk.servo.output == 1
    assert abs(desk.servo.angle_deg) < 1
    desk.under(**NORMAL)
    assert desk.servo.output == 0


@pytest.mark.states("B41", "B42")
def test_after_an_angle_command_it_holds_the_present_angle_which_0x00_reads() -> None:
    desk = Desk(rom=FREE)
    desk.go(900)
    desk.under(**HOT)
    assert desk.turn(-20.0)
    desk.write("0x00", 900)  # dropped, too
    desk.under(**NORMAL).wait(0.5)
    assert desk.read("0x00") == -200
    assert desk.read("0x08") == pytest.approx(-200, abs=3)


@pytest.mark.states("B42", "B43")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
@pytest.mark.parametrize("cause", [HOT, HIGH])
def test_after_speed_or_torque_it_stands_still_and_the_command_is_0(name: str, cause: dict[str, float]) -> None:
    desk = Desk(rom=FREE)
    desk.run(name, 40, 0.5)
    desk.under(**cause).wait(1.0)
    desk.under(**NORMAL).wait(0.5)
    assert desk.reads(name, "0x00", "0x09") == [0, DUMMY, 0]
    assert desk.servo.output == 0


@pytest.mark.states("B42", "B61")
def test_brake_remains_after_protection() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x20", 2)
    assert desk.under(**HOT).servo.output == 1
    assert desk.under(**NORMAL).servo.output == 2


@pytest.mark.states("B43")
def test_between_3_v_and_its_limit_it_responds_without_output_and_below_3_v_it_is_off() -> None:
    desk = Desk(rom=FREE).under(voltage_v=3.2)
    assert desk.read("0x0C") == pytest.approx(32, abs=1)
    assert desk.servo.output == 1
    desk.wait(3.0)
    desk.under(voltage_v=2.9).wait(0.1)
    assert desk.wait(5.0) == []
    assert desk.get_set("0x0C") is None
    assert desk.servo.stage is not ServoStage.RUNNING
    desk.servo.conditions.voltage_v = 7.4
    assert [status.uptime_sec for status in desk.node_statuses(desk.wait(0.5))] == [0]


@pytest.mark.states("B41")
def test_work_warms_the_board_and_rest_cools_it() -> None:
    desk = Desk(rom=FREE)
    start = desk.value("0x0B")
    desk.servo.conditions.load_pct = -60.0
    desk.run("0x02", 60, 120.0)
    warm = desk.value("0x0B")
    assert warm > start + 5
    desk.servo.conditions.load_pct = 0.0
    desk.run("0x20", 1, 240.0)
    assert desk.value("0x0B") < warm - 5


@pytest.mark.states("B43")
def test_the_supply_droops_under_load() -> None:
    desk = Desk(rom=FREE)
    idle = desk.value("0x0C")
    desk.servo.conditions.load_pct = -100.0
    desk.run("0x02", 100, 0.5)
    assert desk.value("0x0C") < idle - 2


@pytest.mark.states("B41")
@pytest.mark.parametrize("off_s", [120.0, 3600.0])
def test_a_board_cools_without_supply_too(off_s: float) -> None:
    desk = Desk(rom=FREE).under(load_pct=-100.0)
    desk.run("0x02", 100, 100)
    hot = desk.value("0x0B")
    assert hot > 50
    desk.under(load_pct=0.0).power_cycle(off_s)
    assert desk.read("0x0B") == pytest.approx(25 + (hot - 25) * exp(-off_s / 120), abs=1.5)


@pytest.mark.states("B43")
def test_a_load_turns_a_horn_without_supply_and_nothing_is_scheduled_in_the_past() -> None:
    desk = Desk(rom=FREE).under(load_pct=50.0)
    desk.run("0x20", 1, 1.0)
    desk.servo.power_off(desk.now)
    before = desk.servo.angle_deg
    desk.wait(1.0)
    assert desk.servo.angle_deg > before + 90
    assert desk.servo.next_due() <= desk.now + 0.05
