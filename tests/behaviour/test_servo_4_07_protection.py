"""Sections 4.7, 4.8, 4.34 and 4.35: temperature and supply, their limits, and the protection that takes the output."""

from math import exp
from typing import Any

import pytest

from behaviour.servo_story import Rom, Steps, between, follow, go, near, stories, turned, under
from hornbill.schema.parameter import DUMMY
from hornbill.sim.device import ServoStage
from unit.sim.desk import FREE, MODELS, Desk

TEMPERATURE_HIGH, TEMPERATURE_LOW, VOLTAGE_HIGH, VOLTAGE_LOW = 1 << 8, 1 << 9, 1 << 10, 1 << 11
SOFTWARE_WARNING = 1 << 9
HOT: dict[str, Any] = {"temperature_c": 90.0}
HIGH: dict[str, Any] = {"voltage_v": 11.0}
NORMAL: dict[str, Any] = {"temperature_c": 25.0, "voltage_v": 7.4}


@pytest.mark.states("B41", "B42", "B43", "B61", "B92", "B107")
@stories({
    **{f"B107: both are read in their units within the tolerance of the document, {conditions}": ({}, [
        under(**conditions), 0.1, {"0x0B": celsius, "0x0C": near(tenths_of_a_volt, 1)},
    ]) for conditions, celsius, tenths_of_a_volt in (
        ({"temperature_c": 41.0, "voltage_v": 6.0}, 41, 60), ({"sensor_error": -1.0}, 20, 69),
        ({"sensor_error": 1.0}, 30, 79),
    )},
    "B41, B107: protection uses the reading of the sensor": ({}, [
        under(temperature_c=77.0), {"output": 0}, under(sensor_error=1.0), {"output": 1},
    ]),
    **{f"B41, B92: a limit written beyond the reading protects immediately, {name} = {raw}": ({}, [
        under(temperature_c=celsius), {"0x1A": 0, "output": 0}, (name, raw, 0.1), {"0x1A": bit, "output": 1},
    ]) for name, raw, celsius, bit in (
        ("0x3E", 20, 25.0, TEMPERATURE_HIGH), ("0x3E", 50, 52.0, TEMPERATURE_HIGH),
        ("0x3F", 10, 8.0, TEMPERATURE_LOW), ("0x3F", -20, -22.0, TEMPERATURE_LOW),
    )},
    **{f"B41, B43: without output a load turns the horn, {cause}": ({"speed_torque_control": 0}, [
        under(load_pct=10.0), {"angle_deg": near(0, 2)}, under(**cause), 1.0, {"angle_deg": between(30, 1_000)},
    ]) for cause in (HOT, HIGH, {"voltage_v": 3.5})},
    "B41, B42: after an angle command it holds the present angle, which 0x00 reads": ({}, [
        go(900), under(**HOT), turned(-20.0), ("0x00", 900, 0),  # dropped, too
        under(**NORMAL), 0.5, {"0x00": -200, "0x08": near(-200)},
    ]),
    **{f"B42, B43: after a speed or torque it stands still and the command is 0, {name}, {cause}": ({}, [
        (name, 40, 0.5), under(**cause), 1.0, under(**NORMAL), 0.5, {name: 0, "0x00": DUMMY, "0x09": 0, "output": 0},
    ]) for name in ("0x01", "0x02") for cause in (HOT, HIGH)},
    "B42, B61: brake remains after protection": ({}, [
        ("0x20", 2, 0), under(**HOT), {"output": 1}, under(**NORMAL), {"output": 2},
    ]),
})  # fmt: skip
def test_protection(rom: Rom, steps: Steps) -> None:
    follow(Desk(rom=FREE | rom), *steps)


@pytest.mark.states("B41", "B43", "B55", "B92")
@pytest.mark.parametrize(
    ("key", "raw", "condition", "at", "beyond", "bit"),
    [
        ("temperature_limit_upper", 60, "temperature_c", 60.0, 61.0, TEMPERATURE_HIGH),
        ("temperature_limit_lower", 10, "temperature_c", 10.0, 9.0, TEMPERATURE_LOW),
        ("voltage_limit_upper", 90, "voltage_v", 9.0, 9.2, VOLTAGE_HIGH),
        ("voltage_limit_lower", 60, "voltage_v", 6.0, 5.8, VOLTAGE_LOW),
    ],
)
def test_at_a_limit_the_bit_is_set_and_beyond_it_output_goes_off(
    key: str, raw: int, condition: str, at: float, beyond: float, bit: int
) -> None:
    desk = Desk(rom=FREE | {key: raw})
    follow(desk, {"0x18": 0, "0x1A": 0, "output": 0})
    for value, output in ((at, 0), (beyond, 1), (at, 0)):
        follow(desk, under(**{condition: value}), {"0x1A": bit, "output": output})
        assert desk.value("0x18") & SOFTWARE_WARNING
    follow(desk, under(**NORMAL), {"0x18": 0, "0x1A": 0, "output": 0})


@pytest.mark.states("B41", "B43", "B93")
@pytest.mark.parametrize("model", MODELS)
def test_by_default_every_model_is_protected_on_both_sides_and_not_at_its_nominal_supply(model: str) -> None:
    upper = {"06U": 10.0, "12U": 20.0, "28U": 40.0}[model[6:9]]
    desk = Desk(model)
    follow(desk, Desk.settle, go(1_700), {"0x1A": 0})
    for volts, word in ((upper - 0.3, 0), (upper + 0.3, VOLTAGE_HIGH), (3.7, VOLTAGE_LOW), (4.3, 0)):
        follow(desk, ("0x00", 1_700, 0), under(voltage_v=volts), {"0x1A": word, "output": int(word != 0)})


@pytest.mark.states("B65")
@pytest.mark.parametrize("cause", [{"voltage_v": 3.5}, HIGH, {"temperature_c": 85.0}])
def test_torque_on_has_no_effect_until_the_cause_ends(cause: dict[str, float]) -> None:
    desk = Desk(rom=FREE)
    follow(desk, under(**cause), ("0x20", 1, 0), {"output": 1}, ("0x20", 0, 0), {"output": 1})
    follow(desk, ("0x00", 300, 0.3), {"output": 1, "angle_deg": near(0, 1)}, under(**NORMAL), {"output": 0})


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
