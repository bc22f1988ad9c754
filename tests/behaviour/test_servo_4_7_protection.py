"""Sections 4.7, 4.8, 4.34 and 4.35: temperature and voltage turn the output off, and on again by themselves."""

import pytest

from hornbill.sim.device import Stage
from unit.sim.desk import MODELS, Desk

FREE = {"speed_torque_control": 1, "timeout_action": 0, "soft_start": 0}
TEMPERATURE_HIGH, TEMPERATURE_LOW, VOLTAGE_HIGH, VOLTAGE_LOW = 1 << 8, 1 << 9, 1 << 10, 1 << 11
SOFTWARE_WARNING = 1 << 9


def test_both_are_read_in_their_units() -> None:
    desk = Desk()
    desk.servo.conditions.temperature_c = 41.0
    desk.servo.conditions.voltage_v = 6.0
    desk.wait(0.2)
    assert desk.read("0x0B") == 41
    assert desk.read("0x0C") == pytest.approx(60, abs=1)


def test_a_sensor_may_err_by_what_the_document_allows() -> None:
    desk = Desk()
    desk.servo.conditions.sensor_error = -1.0
    desk.wait(0.2)
    assert desk.read("0x0B") == 20
    assert desk.read("0x0C") == pytest.approx(69, abs=1)


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


@pytest.mark.parametrize("model", MODELS)
def test_no_model_protects_itself_at_its_nominal_supply(model: str) -> None:
    desk = Desk(model)
    desk.settle()
    desk.write("0x00", 1_700)
    desk.settle()
    assert desk.read("0x1A") == 0


def test_at_the_limit_itself_nothing_happens() -> None:
    desk = Desk(rom=FREE)
    desk.servo.conditions.temperature_c = 80.0
    desk.wait(0.2)
    assert desk.servo.output == 0


def test_torque_on_does_not_help_against_protection() -> None:
    desk = Desk(rom=FREE)
    desk.servo.conditions.temperature_c = 90.0
    desk.wait(0.2)
    assert desk.write("0x20", 0) == 0
    assert desk.write("0x00", 300) == 300
    desk.wait(0.3)
    assert desk.servo.output == 1
    assert abs(desk.servo.angle_deg) < 1


def test_after_an_angle_command_it_holds_where_it_is_and_0x00_says_so() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 900)
    desk.settle()
    desk.servo.conditions.temperature_c = 90.0
    desk.wait(0.2)
    assert desk.servo.turn_by_hand(-20.0, desk.now)
    desk.servo.conditions.temperature_c = 25.0
    desk.wait(0.5)
    assert desk.read("0x00") == -200
    assert desk.read("0x08") == pytest.approx(-200, abs=3)


@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_after_speed_or_torque_it_stands_still_and_the_command_is_0(name: str) -> None:
    desk = Desk(rom=FREE)
    desk.write(name, 40)
    desk.wait(0.5)
    desk.servo.conditions.voltage_v = 11.0
    desk.wait(1.0)
    desk.servo.conditions.voltage_v = 7.4
    desk.wait(0.5)
    assert desk.read(name) == 0
    assert desk.read("0x09") == 0


def test_a_limit_set_below_the_present_reading_protects_at_once() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x3E", 20)
    assert desk.read("0x1A") == TEMPERATURE_HIGH
    assert desk.servo.output == 1


def test_at_3_v_it_is_dead_and_above_it_starts_anew() -> None:
    desk = Desk()
    desk.wait(3.0)
    desk.servo.conditions.voltage_v = 2.9
    desk.wait(0.2)
    assert desk.wait(5.0) == []
    assert desk.get_set("0x0C") is None
    assert desk.servo.stage is not Stage.RUNNING
    desk.servo.conditions.voltage_v = 7.4
    assert [status.uptime_sec for status in desk.node_statuses(desk.wait(0.5))] == [0]


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


def test_the_supply_droops_under_load() -> None:
    desk = Desk(rom=FREE)
    idle = desk.read("0x0C") or 0
    desk.servo.conditions.load_pct = -100.0
    desk.write("0x02", 100)
    desk.wait(0.5)
    assert (desk.read("0x0C") or 0) < idle - 2
