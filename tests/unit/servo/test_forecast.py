"""Forecast of what a restart does to the horn (sections 4.1, 4.8, 4.11 to 4.14)."""

import pytest

from hornbill.domain.change import Forecast
from hornbill.schema.catalog import Catalog
from hornbill.servo.configuration.forecast import forecast, forecast_of, supply_problem
from hornbill.servo.device.servo import Servo
from hornbill.units import Uid

CATALOG = Catalog.load()


def a_servo(angle: float | None = 0.0, volts: float | None = 7.4, **ram: int) -> Servo:
    """A 7.4 V servo with the defaults in RAM and in ROM, but for `ram`."""
    servo = Servo(Uid("ab" * 16), CATALOG)
    servo.identify_as(CATALOG.models["BLA21-06U-A0"], 1300)
    for key, one in servo.registers.items():
        if one.parameter.rom:
            assert one.parameter.default is not None
            servo.note(key, one.parameter.default, 1.0)
            one.rom = one.parameter.default
    for key, raw in ram.items():
        servo.note(key, raw, 2.0)
    if angle is not None:
        servo.note("current_angle", round(angle * 10), 2.0)
    if volts is not None:
        servo.note("current_voltage", round(volts * 10), 2.0)
    servo.note("fault_warning", ram.get("fault_warning", 0), 2.0)
    return servo


def after_a_save(servo: Servo) -> Forecast:
    """The forecast of the restart after a save of RAM, its torque mode included."""
    return forecast(servo, servo.raws())


OFF = "does not move until torque is turned on"
DROP = "may drop"
DIRECTION = "may go in the other direction"


@pytest.mark.parametrize(
    ("angle", "rows", "code", "from_deg", "to_deg", "takes_s", "warnings"),
    [
        (90.0, {}, "moves", 90.0, 0.0, 0.5, [DROP]),
        (-90.0, {}, "moves", -90.0, 0.0, 0.5, [DROP]),
        (179.9, {}, "moves", 179.9, 0.0, 1.0, [DROP]),
        (-180.0, {}, "moves", -180.0, 0.0, 1.0, [DROP]),
        (12.3, {}, "moves", 12.3, 0.0, 0.1, [DROP]),
        (270.0, {}, "moves", -90.0, 0.0, 0.5, [DROP, DIRECTION]),
        (-270.0, {}, "moves", 90.0, 0.0, 0.5, [DROP, DIRECTION]),
        (180.0, {}, "moves", -180.0, 0.0, 1.0, [DROP, DIRECTION]),
        (725.0, {}, "moves", 5.0, 0.0, 0.0, [DROP, DIRECTION]),
        (0.0, {}, "stays", 0.0, 0.0, 0.0, [DROP]),
        (1.0, {}, "stays", 1.0, 0.0, 0.0, [DROP]),
        (-1.0, {}, "stays", -1.0, 0.0, 0.0, [DROP]),
        (None, {}, "unknown_start", None, 0.0, None, [DROP]),
        (90.0, {"soft_start": 0}, "holds", 90.0, 90.0, None, [DROP]),
        (90.0, {"torque_mode": 1}, "no_torque", 90.0, None, None, [OFF]),
        (90.0, {"torque_mode": 2}, "brake", 90.0, None, None, [OFF]),
    ],
)
def test_the_forecast_of_the_restart_after_a_save(
    angle: float | None, rows: dict[str, int], code: str, from_deg: float | None, to_deg: float | None,
    takes_s: float | None, warnings: list[str],
) -> None:  # fmt: skip
    servo = a_servo(angle, **rows)
    found = after_a_save(servo)
    assert (found.code, found.moves) == (code, code in ("moves", "unknown_start"))
    assert (found.from_deg, found.to_deg, found.takes_s) == (from_deg, to_deg, takes_s)
    assert found.turn_count_lost == (DIRECTION in warnings)
    texts = " ".join(found.warnings)
    assert [one for one in (DROP, OFF, DIRECTION) if one in texts] == warnings
    assert [one.text for one in found.coded_warnings] == found.warnings
    for one in found.coded_warnings:
        if one.code == "turn_count_lost":
            assert one.params == {"before_deg": angle, "after_deg": from_deg}
    if "torque_mode" in rows:
        assert forecast(servo).moves, "ROM has torque on"


def test_with_an_unknown_rom_the_horn_is_assumed_to_move() -> None:
    servo = a_servo(90.0)
    for one in servo.registers.values():
        one.rom = None
    found = forecast(servo)
    assert found.moves
    assert "unknown" in found.text
    assert after_a_save(servo).takes_s == 0.5, "RAM is known"


@pytest.mark.parametrize("key", ["origin", "reverse"])
def test_another_origin_or_direction_in_rom_makes_the_start_unknown(key: str) -> None:
    servo = a_servo(0.0, **{key: 1})
    found = forecast(servo)
    assert (found.moves, found.from_deg) == (True, None)
    assert after_a_save(servo).from_deg == 0.0


def test_defaults_in_use_for_lost_values_are_a_warning() -> None:
    servo = a_servo(0.0, fault_warning=1 << 15)
    assert "permanent" in after_a_save(servo).warnings[0]
    assert "Restore a snapshot" in forecast(servo).warnings[0]


@pytest.mark.parametrize(
    ("volts", "word"),
    [
        (3.9, "below its minimum of 4.0 V"), (10.1, "above its limit of 10.0 V"), (4.4, "within 0.5 V"),
        (9.6, "within 0.5 V"), (None, "has not been read"),
    ],
)  # fmt: skip
def test_a_supply_beyond_or_near_a_limit_or_not_read_is_a_warning(volts: float | None, word: str) -> None:
    found = after_a_save(a_servo(0.0, volts))
    assert any(word in one for one in found.warnings), found.warnings
    assert not any("supply" in one.lower() for one in after_a_save(a_servo()).warnings)


@pytest.mark.parametrize(("volts", "refused"), [(3.9, True), (4.0, False), (10.0, False), (10.1, True), (None, False)])
def test_rom_is_written_only_within_the_supply_limits(volts: float | None, refused: bool) -> None:
    assert (supply_problem(a_servo(volts=volts)) is not None) is refused


def test_supply_limits_that_would_apply_after_the_restart_are_a_warning() -> None:
    servo = a_servo(volts=7.4)
    loaded = dict(servo.raws()) | {"voltage_limit_lower": 74, "voltage_limit_upper": 74}
    assert forecast_of(servo, loaded | {"voltage_limit_lower": 75}).warnings[-1].startswith("The supply of")
