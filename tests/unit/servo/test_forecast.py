"""Forecast of what a restart does to the horn (sections 4.1, 4.8, 4.11 to 4.14)."""

from dataclasses import asdict

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


@pytest.mark.parametrize(
    ("angle", "takes"), [(90.0, 0.5), (-90.0, 0.5), (179.9, 1.0), (-180.0, 1.0), (12.3, 0.1), (1.0, None), (0.0, None)]
)
def test_with_torque_and_soft_start_the_horn_moves_to_0_at_30_rpm(angle: float, takes: float | None) -> None:
    found = after_a_save(a_servo(angle))
    assert (found.moves, found.from_deg) == (takes is not None, angle)
    if takes is not None:
        assert (found.to_deg, found.takes_s) == (0.0, takes)
    assert not found.turn_count_lost


@pytest.mark.parametrize("mode", [1, 2])
def test_torque_saved_off_moves_nothing_and_is_a_warning(mode: int) -> None:
    servo = a_servo(90.0, torque_mode=mode)
    found = after_a_save(servo)
    assert (found.moves, found.to_deg) == (False, None)
    assert any("does not move until torque is turned on" in one for one in found.warnings)
    assert not any("may drop" in one for one in found.warnings), "there is no torque to lose"
    assert forecast(servo).moves, "ROM has torque on"


def test_without_soft_start_the_horn_holds_its_angle() -> None:
    found = after_a_save(a_servo(90.0, soft_start=0))
    assert (found.moves, found.from_deg, found.to_deg, found.takes_s) == (False, 90.0, 90.0, None)
    assert any("may drop" in one for one in found.warnings)


@pytest.mark.parametrize(("angle", "wrapped"), [(270.0, -90.0), (-270.0, 90.0), (180.0, -180.0), (725.0, 5.0)])
def test_turns_are_lost_beyond_half_a_turn(angle: float, wrapped: float) -> None:
    found = after_a_save(a_servo(angle))
    assert found.turn_count_lost
    assert found.from_deg == wrapped
    assert any("may go in the other direction" in one for one in found.warnings)


def test_with_an_unknown_rom_the_horn_is_assumed_to_move() -> None:
    servo = a_servo(90.0)
    for one in servo.registers.values():
        one.rom = None
    found = forecast(servo)
    assert found.moves
    assert "unknown" in found.text
    assert after_a_save(servo).takes_s == 0.5, "RAM is known"


def test_with_an_unknown_angle_the_horn_is_assumed_to_move() -> None:
    found = after_a_save(a_servo(None))
    assert (found.moves, found.from_deg, found.takes_s) == (True, None, None)


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
        (3.9, "below its minimum of 4.0 V"),
        (10.1, "above its limit of 10.0 V"),
        (4.4, "within 0.5 V"),
        (9.6, "within 0.5 V"),
    ],
)
def test_a_supply_beyond_or_near_a_limit_is_a_warning(volts: float, word: str) -> None:
    found = after_a_save(a_servo(0.0, volts))
    assert any(word in one for one in found.warnings), found.warnings


def test_only_a_supply_that_has_not_been_read_is_a_warning() -> None:
    assert not any("supply" in one.lower() for one in after_a_save(a_servo()).warnings)
    assert any("has not been read" in one for one in after_a_save(a_servo(volts=None)).warnings)


@pytest.mark.parametrize(("volts", "refused"), [(3.9, True), (4.0, False), (10.0, False), (10.1, True), (None, False)])
def test_rom_is_written_only_within_the_supply_limits(volts: float | None, refused: bool) -> None:
    assert (supply_problem(a_servo(volts=volts)) is not None) is refused


def test_supply_limits_that_would_apply_after_the_restart_are_a_warning() -> None:
    servo = a_servo(volts=7.4)
    loaded = dict(servo.raws()) | {"voltage_limit_lower": 74, "voltage_limit_upper": 74}
    assert forecast_of(servo, loaded | {"voltage_limit_lower": 75}).warnings[-1].startswith("The supply of")


@pytest.mark.parametrize(
    ("angle", "rows", "code"),
    [
        (90.0, {}, "moves"),
        (0.3, {}, "stays"),
        (None, {}, "unknown_start"),
        (90.0, {"soft_start": 0}, "holds"),
        (90.0, {"torque_mode": 1}, "no_torque"),
        (90.0, {"torque_mode": 2}, "brake"),
    ],
)
def test_each_forecast_has_a_code(angle: float | None, rows: dict[str, int], code: str) -> None:
    found = after_a_save(a_servo(angle, **rows))
    assert found.code == code
    assert [one.text for one in found.coded_warnings] == found.warnings


def test_a_coded_warning_has_parameters() -> None:
    shown = asdict(after_a_save(a_servo(270.0)))
    assert (shown["takes_s"], shown["code"]) == (0.5, "moves")
    lost = next(one for one in shown["coded_warnings"] if one["code"] == "turn_count_lost")
    assert lost["params"] == {"before_deg": 270.0, "after_deg": -90.0}
    assert lost["text"] in shown["warnings"]
