"""What a restart does to the horn, foretold from what is known (sections 4.1, 4.8, 4.11 to 4.14)."""

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
    """What the restart does that follows a save of RAM, its torque mode included."""
    return forecast(servo, servo.raws())


@pytest.mark.parametrize(("angle", "takes"), [(90.0, 0.5), (-90.0, 0.5), (179.9, 1.0), (-180.0, 1.0), (12.3, 0.1)])
def test_with_torque_and_soft_start_on_the_horn_goes_to_0_at_30_rpm(angle: float, takes: float) -> None:
    told = after_a_save(a_servo(angle))
    assert (told.moves, told.from_deg, told.to_deg, told.takes_s) == (True, angle, 0.0, takes)
    assert not told.turn_count_lost


@pytest.mark.parametrize("angle", [0.0, 1.0, -1.0])
def test_a_horn_at_0_stays_there(angle: float) -> None:
    told = after_a_save(a_servo(angle))
    assert (told.moves, told.from_deg) == (False, angle)


@pytest.mark.parametrize("mode", [1, 2])
def test_torque_saved_off_moves_nothing_and_looks_dead_afterwards(mode: int) -> None:
    servo = a_servo(90.0, torque_mode=mode)
    told = after_a_save(servo)
    assert (told.moves, told.to_deg) == (False, None)
    assert any("does not move until torque is turned on" in one for one in told.warnings)
    assert not any("may drop" in one for one in told.warnings), "there is no torque to lose"
    assert forecast(servo).moves, "ROM has torque on"


def test_without_soft_start_the_horn_is_held_where_it_stands() -> None:
    told = after_a_save(a_servo(90.0, soft_start=0))
    assert (told.moves, told.from_deg, told.to_deg, told.takes_s) == (False, 90.0, 90.0, None)
    assert any("may drop" in one for one in told.warnings)


@pytest.mark.parametrize(("angle", "wrapped"), [(270.0, -90.0), (-270.0, 90.0), (180.0, -180.0), (725.0, 5.0)])
def test_turns_beyond_half_a_turn_are_lost_and_the_next_move_may_go_the_other_way(angle: float, wrapped: float) -> None:
    told = after_a_save(a_servo(angle))
    assert told.turn_count_lost
    assert told.from_deg == wrapped
    assert any("may go in the other direction" in one for one in told.warnings)


def test_of_a_rom_nobody_knows_it_is_said_and_the_horn_is_taken_to_move() -> None:
    servo = a_servo(90.0)
    for one in servo.registers.values():
        one.rom = None
    told = forecast(servo)
    assert told.moves
    assert "unknown" in told.text
    assert after_a_save(servo).takes_s == 0.5, "what RAM holds is known"


def test_an_angle_nobody_knows_still_moves() -> None:
    told = after_a_save(a_servo(None))
    assert (told.moves, told.from_deg, told.takes_s) == (True, None, None)


@pytest.mark.parametrize("key", ["origin", "reverse"])
def test_another_zero_or_direction_in_rom_makes_the_way_to_0_unknown(key: str) -> None:
    servo = a_servo(0.0, **{key: 1})
    told = forecast(servo)
    assert (told.moves, told.from_deg) == (True, None)
    assert after_a_save(servo).from_deg == 0.0


def test_defaults_in_use_for_lost_ones_are_warned_of_either_way() -> None:
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
def test_a_supply_beyond_or_near_a_limit_is_warned_of(volts: float, word: str) -> None:
    told = after_a_save(a_servo(0.0, volts))
    assert any(word in one for one in told.warnings), told.warnings


def test_a_steady_supply_is_not_warned_of_and_an_unread_one_is() -> None:
    assert not any("supply" in one.lower() for one in after_a_save(a_servo()).warnings)
    assert any("has not been read" in one for one in after_a_save(a_servo(volts=None)).warnings)


@pytest.mark.parametrize(("volts", "refused"), [(3.9, True), (4.0, False), (10.0, False), (10.1, True), (None, False)])
def test_rom_is_written_only_inside_the_servo_s_own_limits(volts: float | None, refused: bool) -> None:
    assert (supply_problem(a_servo(volts=volts)) is not None) is refused


def test_limits_that_would_switch_it_off_after_the_restart_are_warned_of() -> None:
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
def test_each_answer_has_a_code(angle: float | None, rows: dict[str, int], code: str) -> None:
    told = after_a_save(a_servo(angle, **rows))
    assert told.code == code
    assert [one.text for one in told.coded_warnings] == told.warnings


def test_it_has_the_shape_the_api_gives_it() -> None:
    shown = asdict(after_a_save(a_servo(270.0)))
    assert (shown["takes_s"], shown["code"]) == (0.5, "moves")
    lost = next(one for one in shown["coded_warnings"] if one["code"] == "turn_count_lost")
    assert lost["params"] == {"before_deg": 270.0, "after_deg": -90.0}
    assert lost["text"] in shown["warnings"]
