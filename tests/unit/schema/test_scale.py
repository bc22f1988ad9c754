"""Raw integers and engineering values: round trips for every row, and errors for invalid values."""

from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.errors import ForbiddenParameter, HornbillError, InvalidValue, OutOfRange
from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import DUMMY, Parameter
from hornbill.schema.scale import allowed, to_nearest_raw, to_raw, to_text, to_value, unit_of

CATALOG = Catalog.load()
ROWS = CATALOG.models["BLA21-06U-AB"].rows()
SETTABLE = sorted(key for key, row in ROWS.items() if row.writable)
NUMBERS = [key for key in SETTABLE if ROWS[key].kind == "number"]


@st.composite
def settings(draw: st.DrawFn) -> tuple[Parameter, int, dict[str, int | None]]:
    """A row of any model, a legal raw value of it, and a PWM mode for the row whose unit follows it."""
    model = CATALOG.models[draw(st.sampled_from(sorted(CATALOG.models)))]
    row = model.parameters[draw(st.sampled_from(SETTABLE))]
    assert row.minimum is not None
    assert row.maximum is not None
    return row, draw(st.integers(row.minimum, row.maximum)), {"pwm_mode": draw(st.sampled_from([0, 1, None]))}


@given(settings())
def test_every_legal_value_round_trips(setting: tuple[Parameter, int, dict[str, int | None]]) -> None:
    row, raw, values = setting
    assert to_raw(row, to_value(row, raw, values), values) == raw


def outcome(row: Parameter, value: float) -> int | OutOfRange | InvalidValue:
    """The raw value, or the error instead."""
    try:
        return to_raw(row, value)
    except (OutOfRange, InvalidValue) as error:
        return error


@given(st.sampled_from(NUMBERS), st.floats(allow_nan=False, allow_infinity=False))
def test_any_float_is_a_raw_value_or_refused_with_legal_values(key: str, value: float) -> None:
    row = ROWS[key]
    assert row.minimum is not None
    assert row.maximum is not None
    low, high = row.minimum / row.per_unit, row.maximum / row.per_unit
    found = outcome(row, value)
    if isinstance(found, OutOfRange):
        assert value < low or value > high
        assert (found.facts["minimum"], found.facts["maximum"]) == (low, high)
        assert found.detail.endswith(f"Enter {allowed(row)}.")
    elif isinstance(found, InvalidValue):
        assert low < value < high
        below, above = cast(list[float], found.facts["nearest"])
        assert below < value < above
        assert [to_raw(row, one) for one in (below, above)] == [
            round(below * row.per_unit),
            round(above * row.per_unit),
        ]
    else:
        assert row.minimum <= found <= row.maximum
        assert abs(found / row.per_unit - value) <= 1e-6


@pytest.mark.parametrize(
    ("key", "raw", "value"),
    [
        ("command_angle", 450, 45.0),
        ("command_angle", 3, 0.3),
        ("command_angle", DUMMY, None),
        ("command_speed", DUMMY, None),
        ("command_torque", -100, -100),
        ("angle_limit_ccw", -1800, -180.0),
        ("voltage_limit_lower", 40, 4.0),
        ("angle_boost", 15, 1.5),
        ("overcurrent_limit", 120, 12.0),
        ("timeout_time", 1000, 1000),
        ("torque_mode", 0, "on"),
        ("torque_mode", 1, "off"),
        ("torque_mode", 7, 7),
        ("soft_start", 1, True),
        ("soft_start", 0, False),
        ("soft_start", 2, 2),
        ("fault_overview", -1, 0xFFFF_FFFF),
    ],
)
def test_the_meaning_of_a_raw_value(key: str, raw: int, value: object) -> None:
    found = to_value(ROWS[key], raw)
    assert found == value
    assert type(found) is type(value)


def test_the_dummy_is_a_plain_number_in_other_rows() -> None:
    assert to_value(ROWS["angle_limit_cw"], DUMMY) == 55_555_555.5


@pytest.mark.parametrize(
    ("error", "key", "value", "sentence"),
    [
        (OutOfRange, "torque_limit_cw", 120, "120 % is above this model's limit of 100 %. Enter 0 to 100 %."),
        (OutOfRange, "torque_limit_ccw", -101, "−101 % is below this model's limit of −100 %. Enter −100 to 0 %."),
        (OutOfRange, "voltage_limit_lower", 3.0, "3.0 V is below this model's limit of 3.5 V. Enter 3.5 to 7.4 V."),
        (OutOfRange, "origin", 180, "180.0° is above this model's limit of 179.9°. Enter −180.0 to 179.9°."),
        (OutOfRange, "origin", 179.95, "179.95° is above this model's limit of 179.9°. Enter −180.0 to 179.9°."),
        (OutOfRange, "servo_id", 255, "255 is above this model's limit of 254. Enter 0 to 254."),
        (OutOfRange, "servo_id", 10**400, "1.000000000e+400 is above this model's limit of 254. Enter 0 to 254."),
        (InvalidValue, "origin", 12.34, "12.34° is between two steps of 0.1°. Enter 12.3 or 12.4°."),
        (InvalidValue, "origin", -0.05, "−0.05° is between two steps of 0.1°. Enter −0.1 or 0.0°."),
        (InvalidValue, "timeout_time", 99.5, "99.5 ms is between two steps of 1 ms. Enter 99 or 100 ms."),
        (InvalidValue, "angle_p_gain", 1.5, "1.5 is between two steps of 1. Enter 1 or 2."),
        (InvalidValue, "torque_mode", True, "Torque cannot be true. Enter on, off or brake."),
        (InvalidValue, "torque_mode", 0, "Torque cannot be 0. Enter on, off or brake."),
        (InvalidValue, "torque_mode", "On", 'Torque cannot be "On". Enter on, off or brake.'),
        (InvalidValue, "soft_start", 1, "Soft start cannot be 1. Enter true or false."),
        (InvalidValue, "soft_start", "on", 'Soft start cannot be "on". Enter true or false.'),
        (InvalidValue, "servo_id", "3", 'Servo ID cannot be "3". Enter 0 to 254.'),
        (InvalidValue, "servo_id", True, "Servo ID cannot be true. Enter 0 to 254."),
        (InvalidValue, "servo_id", None, "Servo ID cannot be empty. Enter 0 to 254."),
        (InvalidValue, "servo_id", [3], "Servo ID cannot be a list or an object. Enter 0 to 254."),
        (InvalidValue, "servo_id", float("nan"), "Servo ID cannot be NaN. Enter 0 to 254."),
        (InvalidValue, "servo_id", float("-inf"), "Servo ID cannot be infinite. Enter 0 to 254."),
    ],
)
def test_an_invalid_value_is_refused_with_the_valid_ones(
    error: type[HornbillError], key: str, value: object, sentence: str
) -> None:
    with pytest.raises(error) as caught:
        to_raw(ROWS[key], value)
    assert caught.value.detail == sentence


@pytest.mark.parametrize(
    ("row", "requested", "cause", "facts"),
    [
        (
            "voltage_limit_upper", 13, "beyond_model_limit",
            {"minimum": 7.4, "maximum": 12.0, "unit": "V", "key": "voltage_limit_upper"},
        ),
        ("origin", 12.34, "between_steps", {"nearest": [12.3, 12.4], "unit": "°"}),
        ("timeout_time", 99.5, "between_steps", {"nearest": [99, 100], "unit": "ms"}),
        ("pwm_mode", "torque", "wrong_type", {"allowed": ["angle", "speed"], "key": "pwm_mode"}),
    ],
)  # fmt: skip
def test_the_facts_of_a_refusal_are_engineering_values(
    row: str, requested: object, cause: str, facts: dict[str, object]
) -> None:
    with pytest.raises(HornbillError) as caught:
        to_raw(ROWS[row], requested)
    assert caught.value.facts == {**facts, "requested": requested, "cause": cause}


@pytest.mark.parametrize(
    ("key", "value", "raw"),
    [
        ("command_angle", 8.660254, 87),
        ("command_angle", -0.05, 0),
        ("command_angle", 0.15, 2),
        ("command_angle", -8.66, -87),
        ("command_torque", 99.6, 100),
        ("command_torque", 100.4, 100),
    ],
)
def test_a_command_is_rounded_to_the_nearest_step(key: str, value: float, raw: int) -> None:
    assert to_nearest_raw(ROWS[key], value) == raw


def test_a_command_that_rounds_out_of_range_is_refused() -> None:
    with pytest.raises(OutOfRange):
        to_nearest_raw(ROWS["command_torque"], 100.6)
    for wrong in (True, "5", None, float("nan")):
        with pytest.raises(InvalidValue):
            to_nearest_raw(ROWS["command_torque"], wrong)


def test_sums_of_tenths_count_as_the_nearest_step() -> None:
    assert to_raw(ROWS["origin"], 0.1 + 0.2) == 3
    assert to_raw(ROWS["command_angle"], 35_999_999.9) == 359_999_999


def test_a_choice_outside_the_range_of_a_model_is_refused() -> None:
    row = CATALOG.models["BLA15-06U-A0"].parameters["pwm_mode"]
    with pytest.raises(InvalidValue, match=r'^PWM mode cannot be "speed"\. Enter angle\.$'):
        to_raw(row, "speed")


def test_the_dummy_can_never_be_written() -> None:
    for key in ("command_angle", "command_speed", "command_torque"):
        with pytest.raises(OutOfRange):
            to_raw(ROWS[key], DUMMY / ROWS[key].per_unit)


def test_the_boot_loader_has_no_value_to_write() -> None:
    with pytest.raises(ForbiddenParameter):
        to_raw(CATALOG.parameters["boot_loader"], 0)


@pytest.mark.parametrize(
    ("values", "unit", "value"),
    [({"pwm_mode": 1}, ("rpm", 1), 150)]
    + [(values, ("°", 10), 15.0) for values in ({"pwm_mode": 0}, {"pwm_mode": None}, {}, None)],
)
def test_the_unit_of_the_pwm_output_range_follows_the_mode(
    values: dict[str, int | None] | None, unit: object, value: float
) -> None:
    """0x36 is tenths of a degree or rpm, as 0x37 says (section 4.30)."""
    row = ROWS["pwm_output_range"]
    assert unit_of(row, values) == unit
    assert to_value(row, 150, values) == value
    assert to_raw(row, value, values) == 150


def test_the_limit_of_the_pwm_output_range_is_in_its_unit() -> None:
    row = ROWS["pwm_output_range"]
    with pytest.raises(OutOfRange, match=r"^400\.0° is above this model's limit of 360\.0°"):
        to_raw(row, 400, {"pwm_mode": 0})
    assert to_raw(row, 400, {"pwm_mode": 1}) == 400
    with pytest.raises(OutOfRange, match="Enter 0 to 3600 rpm"):
        to_raw(row, 4000, {"pwm_mode": 1})


@pytest.mark.parametrize(
    ("key", "raw", "text"),
    [
        ("current_angle", -900, "−90.0°"),
        ("voltage_limit_lower", 40, "4.0 V"),
        ("command_speed", DUMMY, "inactive"),
        ("torque_mode", 2, "Brake"),
        ("torque_mode", 9, "9"),
        ("reverse", 1, "On"),
        ("fault_overview", 0x100, "0x00000100"),
        ("servo_id", 7, "7"),
    ],
)
def test_text_for_users(key: str, raw: int, text: str) -> None:
    assert to_text(ROWS[key], raw) == text


def test_a_row_without_a_range_accepts_any_number() -> None:
    row = ROWS["product_number"]
    assert allowed(row) == "a number"
    assert to_raw(row, 123_456) == 123_456
