"""Sections 4.7 and 4.8: temperature and supply as they are read, and how they take the output and give it back."""

from math import exp
from typing import Any

import pytest

from hornbill.schema.parameter import DUMMY
from hornbill.sim.device import ServoStage
from unit.sim.desk import FREE, MODELS, Desk

TEMPERATURE_HIGH, TEMPERATURE_LOW, VOLTAGE_HIGH, VOLTAGE_LOW = 1 << 8, 1 << 9, 1 << 10, 1 << 11
SOFTWARE_WARNING = 1 << 9
HOT: dict[str, Any] = {"temperature_c": 90.0}
COOL: dict[str, Any] = {"temperature_c": 25.0}
HIGH: dict[str, Any] = {"voltage_v": 11.0}
NOMINAL: dict[str, Any] = {"voltage_v": 7.4}


@pytest.mark.states("B107")
def test_both_are_read_in_their_units() -> None:
    desk = Desk()
    desk.servo.conditions.temperature_c = 41.0
    desk.servo.conditions.voltage_v = 6.0
    desk.wait(0.2)
    assert desk.read("0x0B") == 41
    assert desk.read("0x0C") == pytest.approx(60, abs=1)


@pytest.mark.states("B107")
@pytest.mark.parametrize(("error", "celsius", "tenths_of_a_volt"), [(-1.0, 20, 69), (1.0, 30, 79)])
def test_a_sensor_may_err_by_what_the_document_allows(error: float, celsius: int, tenths_of_a_volt: int) -> None:
    desk = Desk()
    desk.servo.conditions.sensor_error = error
    desk.wait(0.2)
    assert desk.read("0x0B") == celsius
    assert desk.read("0x0C") == pytest.approx(tenths_of_a_volt, abs=1)


@pytest.mark.states("B41", "B107")
def test_protection_goes_by_what_the_sensor_reads() -> None:
    desk = Desk(rom=FREE).under(temperature_c=77.0)
    assert desk.servo.output == 0
    desk.under(sensor_error=1.0)
    assert desk.servo.output == 1


@pytest.mark.states("B41", "B43", "B55")
@pytest.mark.parametrize(
    ("field", "value", "bit"),
    [
        ("temperature_c", 81.0, TEMPERATURE_HIGH),
        ("temperature_c", -12.0, TEMPERATURE_LOW),
        ("voltage_v", 10.5, VOLTAGE_HIGH),
        ("voltage_v", 3.6, VOLTAGE_LOW),
    ],
)
def test_beyond_a_limit_output_goes_off_and_the_bit_says_why(field: str, value: float, bit: int) -> None:
    desk = Desk(rom=FREE | {"temperature_limit_lower": -10})
    before = getattr(desk.servo.conditions, field)
    assert desk.servo.output == 0
    setattr(desk.servo.conditions, field, value)
    desk.wait(0.2)
    assert desk.servo.output == 1
    assert desk.read("0x1A") == bit
    assert (desk.read("0x18") or 0) & SOFTWARE_WARNING
    setattr(desk.servo.conditions, field, before)
    desk.wait(0.2)
    assert desk.servo.output == 0
    assert desk.read("0x1A") == 0
    assert desk.read("0x18") == 0


@pytest.mark.states("B41", "B43")
@pytest.mark.parametrize("cause", [HOT, HIGH, {"voltage_v": 3.5}])
def test_without_output_a_load_turns_the_horn(cause: dict[str, float]) -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": 0}).under(load_pct=10.0)
    assert abs(desk.servo.angle_deg) < 2
    desk.under(**cause).wait(1.0)
    assert desk.servo.angle_deg > 30


@pytest.mark.states("B41", "B43")
@pytest.mark.parametrize("model", MODELS)
def test_no_model_protects_itself_at_its_nominal_supply(model: str) -> None:
    desk = Desk(model)
    desk.settle()
    desk.write("0x00", 1_700)
    desk.settle()
    assert desk.read("0x1A") == 0


@pytest.mark.states("B65")
def test_torque_on_does_not_help_against_protection() -> None:
    desk = Desk(rom=FREE)
    desk.servo.conditions.temperature_c = 90.0
    desk.wait(0.2)
    assert desk.write("0x20", 0) == 0
    assert desk.write("0x00", 300) == 300
    desk.wait(0.3)
    assert desk.servo.output == 1
    assert abs(desk.servo.angle_deg) < 1


@pytest.mark.states("B41", "B42")
def test_after_an_angle_command_it_holds_where_it_is_and_0x00_says_so() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 900)
    desk.settle()
    desk.servo.conditions.temperature_c = 90.0
    desk.wait(0.2)
    assert desk.servo.turn_manually(-20.0, desk.now)
    desk.servo.conditions.temperature_c = 25.0
    desk.wait(0.5)
    assert desk.read("0x00") == -200
    assert desk.read("0x08") == pytest.approx(-200, abs=3)


@pytest.mark.states("B42", "B43")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
@pytest.mark.parametrize(("cause", "cure"), [(HOT, COOL), (HIGH, NOMINAL)])
def test_after_speed_or_torque_it_stands_still_and_the_command_is_0(
    name: str, cause: dict[str, float], cure: dict[str, float]
) -> None:
    desk = Desk(rom=FREE)
    desk.write(name, 40)
    desk.wait(0.5)
    desk.under(**cause).wait(1.0)
    desk.under(**cure).wait(0.5)
    assert desk.read(name) == 0
    assert desk.read("0x00") == DUMMY
    assert desk.read("0x09") == 0
    assert desk.servo.output == 0


@pytest.mark.states("B42")
def test_a_command_given_meanwhile_is_dropped_too() -> None:
    desk = Desk(rom=FREE).under(**HOT)
    desk.write("0x00", 900)
    desk.under(**COOL).wait(0.5)
    assert desk.read("0x00") == 0
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B42", "B61")
def test_a_motor_that_was_switched_off_stays_so_after_protection() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x20", 2)
    assert desk.under(**HOT).servo.output == 1
    assert desk.under(**COOL).servo.output == 2


@pytest.mark.states("B43")
def test_at_3_v_it_is_dead_and_above_it_starts_anew() -> None:
    desk = Desk()
    desk.wait(3.0)
    desk.servo.conditions.voltage_v = 2.9
    desk.wait(0.2)
    assert desk.wait(5.0) == []
    assert desk.get_set("0x0C") is None
    assert desk.servo.stage is not ServoStage.RUNNING
    desk.servo.conditions.voltage_v = 7.4
    assert [status.uptime_sec for status in desk.node_statuses(desk.wait(0.5))] == [0]


@pytest.mark.states("B43")
def test_between_3_v_and_its_limit_it_answers_without_output() -> None:
    desk = Desk(rom=FREE).under(voltage_v=3.2)
    assert desk.read("0x0C") == pytest.approx(32, abs=1)
    assert desk.servo.output == 1


@pytest.mark.states("B41")
def test_work_warms_the_board_and_rest_cools_it() -> None:
    desk = Desk(rom=FREE)
    start = desk.read("0x0B") or 0
    desk.servo.conditions.load_pct = -60.0
    desk.write("0x02", 60)
    desk.wait(120.0)
    warm = desk.read("0x0B") or 0
    assert warm > start + 5
    desk.servo.conditions.load_pct = 0.0
    desk.write("0x20", 1)
    desk.wait(240.0)
    assert (desk.read("0x0B") or 0) < warm - 5


@pytest.mark.states("B43")
def test_the_supply_droops_under_load() -> None:
    desk = Desk(rom=FREE)
    idle = desk.read("0x0C") or 0
    desk.servo.conditions.load_pct = -100.0
    desk.write("0x02", 100)
    desk.wait(0.5)
    assert (desk.read("0x0C") or 0) < idle - 2


@pytest.mark.states("B41")
@pytest.mark.parametrize("off_s", [120.0, 3600.0])
def test_a_board_cools_without_supply_too(off_s: float) -> None:
    desk = Desk(rom=FREE).under(load_pct=-100.0)
    desk.write("0x02", 100)
    desk.wait(100)
    hot = desk.read("0x0B")
    assert hot is not None
    assert hot > 50
    desk.under(load_pct=0.0).power_cycle(off_s)
    left = (hot - 25) * exp(-off_s / 120)
    assert desk.read("0x0B") == pytest.approx(25 + left, abs=1.5)


@pytest.mark.states("B43")
def test_a_load_turns_a_horn_without_supply_and_catching_up_costs_nothing() -> None:
    desk = Desk(rom=FREE).under(load_pct=50.0)
    desk.write("0x20", 1)
    desk.wait(1.0)
    desk.servo.power_off(desk.now)
    before = desk.servo.angle_deg
    desk.wait(1.0)
    assert desk.servo.angle_deg > before + 90
    assert desk.servo.next_due() <= desk.now + 0.05
