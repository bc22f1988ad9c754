"""Sections 4.34 and 4.35: the limits of temperature and supply: what they take, and that they are what protects."""

import pytest

from unit.sim.desk import FREE, MODELS, Desk

TEMPERATURE_HIGH, TEMPERATURE_LOW, VOLTAGE_HIGH, VOLTAGE_LOW = 1 << 8, 1 << 9, 1 << 10, 1 << 11
BOUNDARY = {"06U": (35, 74, 120), "12U": (35, 120, 240), "28U": (35, 280, 500)}
"""Least lower limit, what both limits share, greatest upper limit, in 0.1 V."""


@pytest.mark.states("B41", "B92")
def test_at_the_limit_itself_nothing_happens() -> None:
    desk = Desk(rom=FREE)
    desk.servo.conditions.temperature_c = 80.0
    desk.wait(0.2)
    assert desk.servo.output == 0


@pytest.mark.states("B92")
@pytest.mark.parametrize(
    ("name", "raw", "celsius", "bit"),
    [("0x3E", 50, 52.0, TEMPERATURE_HIGH), ("0x3F", 10, 8.0, TEMPERATURE_LOW), ("0x3F", -20, -22.0, TEMPERATURE_LOW)],
)
def test_a_limit_that_is_set_is_the_one_that_counts(name: str, raw: int, celsius: float, bit: int) -> None:
    desk = Desk(rom=FREE).under(temperature_c=celsius)
    assert (desk.read("0x1A"), desk.servo.output) == (0, 0)
    assert desk.write(name, raw) == raw
    desk.wait(0.1)
    assert (desk.read("0x1A"), desk.servo.output) == (bit, 1)


@pytest.mark.states("B41", "B92")
def test_a_limit_set_below_the_present_reading_protects_at_once() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x3E", 20)
    assert desk.read("0x1A") == TEMPERATURE_HIGH
    assert desk.servo.output == 1


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


@pytest.mark.states("B93")
@pytest.mark.parametrize("model", MODELS)
def test_every_class_protects_itself_on_both_sides_as_delivered(model: str) -> None:
    upper = {"06U": 10.0, "12U": 20.0, "28U": 40.0}[model[6:9]]
    desk = Desk(model, rom=FREE)
    for volts, word in ((upper - 0.3, 0), (upper + 0.3, VOLTAGE_HIGH), (3.7, VOLTAGE_LOW), (4.3, 0)):
        desk.under(voltage_v=volts)
        assert (desk.read("0x1A"), desk.servo.output) == (word, int(word != 0))
