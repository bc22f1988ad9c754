"""Effect rules: parameters without effect, and the reason as a sentence."""

import pytest

from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import Effect, LastCommand, Why, commanded, why_not
from hornbill.schema.parameter import DUMMY

CATALOG = Catalog.load()
PWM = CATALOG.models["BLA21-06U-AB"]
PLAIN = CATALOG.models["BLA15-06U-A0"]

Values = dict[str, int | None]


def fresh(**changes: int | None) -> Values:
    """Values of a servo with PWM input as delivered, with changes."""
    return {key: row.default for key, row in PWM.rows().items()} | changes


def without_effect(values: Values, last: LastCommand | None = None) -> set[str]:
    """Every row known to have no effect."""
    rows = PWM.rows()
    return {key for key in rows if why_not(CATALOG, key, values, last, rows=rows).in_effect is False}


LIMITS = {f"{kind}_limit_{direction}" for kind in ("speed", "torque") for direction in ("cw", "ccw")}
STATED = {"command_speed", "command_torque", "angle_d_gain"} | LIMITS
SPEED_LOOP = {"speed_p_gain", "speed_i_gain", "speed_dead_band", "speed_i_limit"}
INFERRED = {"extended_angle"} | SPEED_LOOP
ALWAYS = ("overcurrent_limit", "smoothing", "reverse", "temperature_limit_upper", "voltage_limit_lower")
ACTS = Effect(True, None)
NOT_READ = "Effect unknown: speed and torque control (0x25) has not been read."
NO_COMMAND = "Effect unknown: the last command is unknown."
ANGLE_LOOP = {"angle_p_gain", "angle_d_gain", "angle_dead_band", "angle_boost", "angle_limit_cw", "angle_limit_ccw"}


def test_speed_and_torque_control_off_marks_exactly_these() -> None:
    assert without_effect(fresh(speed_torque_control=0)) == STATED | INFERRED


def test_speed_and_torque_control_on_clears_them_all() -> None:
    rows = PWM.rows()
    values = fresh(speed_torque_control=1)
    assert {why_not(CATALOG, key, values, rows=rows) for key in rows} == {ACTS}


@pytest.mark.parametrize(
    ("last", "ignored"),
    [
        ("angle", {"extended_angle"}),
        ("speed", ANGLE_LOOP),
        ("torque", ANGLE_LOOP | SPEED_LOOP | {"speed_limit_cw", "speed_limit_ccw"}),
    ],
)
def test_the_last_command_decides(last: LastCommand, ignored: set[str]) -> None:
    assert without_effect(fresh(speed_torque_control=1), last) == ignored


@pytest.mark.parametrize(
    ("key", "values", "sentence"),
    [
        ("command_speed", {"speed_torque_control": 0}, "speed and torque control (0x25) is off"),
        (
            "angle_p_gain",
            {"speed_torque_control": 1, "command_angle": DUMMY, "command_torque": DUMMY},
            "the last command was a speed; this parameter acts only while an angle is held",
        ),
        ("command_angle", {"torque_mode": 1}, "torque (0x20) is off, and turning it on discards this command"),
        ("command_angle", {"torque_mode": 2}, "the servo brakes (0x20), and turning torque on discards this command"),
        (
            "speed_i_limit",
            {"speed_torque_control": 1, "speed_i_gain": 0},
            "the speed I gain (0x31) is 0, so there is nothing to limit",
        ),
        (
            "pwm_neutral",
            {"pwm_mode": 1},
            "PWM commands a speed (0x37), and speed and torque control (0x25) is off",
        ),
    ],
)
def test_the_reason_is_a_sentence(key: str, values: Values, sentence: str) -> None:
    found = why_not(CATALOG, key, fresh(**values), rows=PWM.rows())
    assert found[:2] == (False, f"No effect now: {sentence}.")


@pytest.mark.parametrize(
    ("key", "values", "last", "effect"),
    [
        ("torque_limit_cw", {}, None, Effect(None, NOT_READ, Why("not_read", {"parameter": "speed_torque_control"}))),
        ("angle_p_gain", {"speed_torque_control": 1}, None, Effect(None, NO_COMMAND, Why("last_command_unknown"))),
        ("pwm_range", {"pwm_mode": 0, "speed_torque_control": None}, None, ACTS),
        ("timeout_time", {"timeout_action": 0}, None, ACTS),
        *((key, {}, None, ACTS) for key in ALWAYS),
        *(("torque_limit_cw", fresh(speed_torque_control=1), last, ACTS) for last in ("angle", "speed", "torque")),
    ],
)
def test_the_effect_from_what_was_read(key: str, values: Values, last: LastCommand | None, effect: Effect) -> None:
    """One false condition decides a rule of two. With PWM input, the timeout also matters under hold."""
    assert why_not(CATALOG, key, values, last, rows=PWM.rows()) == effect


def test_a_rule_that_applies_outweighs_an_unknown_one() -> None:
    rows = PWM.rows()
    assert why_not(CATALOG, "speed_limit_cw", {"speed_torque_control": 0}, rows=rows).in_effect is False
    assert why_not(CATALOG, "speed_limit_cw", {"speed_torque_control": None}, "torque", rows=rows).in_effect is False


@pytest.mark.parametrize("mode", [1, 2])
def test_without_torque_commands_gains_and_limits_have_no_effect(mode: int) -> None:
    found = without_effect(fresh(speed_torque_control=1, torque_mode=mode), "angle")
    shaping = {key for key in PWM.rows() if key.startswith(("angle_", "speed_")) or "_limit_c" in key}
    assert found == (shaping - {"speed_torque_control"}) | {
        "command_angle", "command_speed", "command_torque", "extended_angle",
    }  # fmt: skip
    why = why_not(CATALOG, "speed_limit_cw", fresh(torque_mode=mode), rows=PWM.rows()).why_not
    assert why == "No effect now: speed and torque control (0x25) is off."  # also with torque on


def test_firmware_without_0x25_counts_as_off() -> None:
    rows = PLAIN.rows(1010)
    assert "speed_torque_control" not in rows
    ignored = {key for key in rows if why_not(CATALOG, key, {"torque_mode": 0}, rows=rows).in_effect is False}
    assert ignored == STATED | INFERRED
    found = why_not(CATALOG, "torque_limit_cw", {}, rows=rows)
    assert found.why_not == "No effect now: this firmware has no speed and torque control (0x25)."
    assert why_not(CATALOG, "angle_p_gain", {"torque_mode": 0}, rows=rows) == ACTS


def test_the_timeout_time_has_no_effect_under_hold_without_pwm_input() -> None:
    assert why_not(CATALOG, "timeout_time", {"timeout_action": 0}, rows=PLAIN.rows()) == Effect(
        False,
        "No effect now: the timeout action (0x26) is hold.",
        Why("timeout_holds", {"parameter": "timeout_action"}),
    )
    assert why_not(CATALOG, "timeout_time", {"timeout_action": 1}, rows=PLAIN.rows()) == ACTS


@pytest.mark.parametrize(
    ("angle", "speed", "torque", "kind"),
    [
        (0, 0, 0, "none"),
        (450, DUMMY, DUMMY, "angle"),
        (DUMMY, 100, DUMMY, "speed"),
        (DUMMY, DUMMY, -20, "torque"),
        (450, DUMMY, None, "angle"),
        (DUMMY, DUMMY, None, "torque"),
        (450, None, None, None),
        (DUMMY, None, None, None),
        (None, None, None, None),
        (DUMMY, DUMMY, DUMMY, None),
    ],
)
def test_the_active_command_is_the_one_that_is_not_dummy(
    angle: int | None, speed: int | None, torque: int | None, kind: str | None
) -> None:
    values: Values = {"command_angle": angle, "command_speed": speed, "command_torque": torque}
    assert commanded(values) == kind


def test_only_an_angle_can_be_active_while_control_is_off() -> None:
    assert commanded({"speed_torque_control": 0}) == "angle"
