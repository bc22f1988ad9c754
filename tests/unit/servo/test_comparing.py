"""Comparison of two sides, and the choice of the values to restore, for every pair of models."""

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.domain.note import Note
from hornbill.errors import BadRequest, InvalidValue, OutOfRange
from hornbill.schema import scale
from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter
from hornbill.servo.device.output import KEY as TORQUE
from hornbill.servo.profiles.comparing import Side, compare, side_of
from hornbill.servo.profiles.restoring import choose
from hornbill.units import Raw

NOT_IN_SERVO = Note("The servo does not have it.", "not_in_servo")

CATALOG = Catalog.load()
PWM = next(model for model in CATALOG.models.values() if model.pwm and "1.300" in model.firmware)
Held = tuple[Mapping[str, Parameter], dict[str, Raw]]


def raw_of(row: Parameter) -> st.SearchStrategy[Raw]:
    assert row.minimum is not None
    assert row.maximum is not None
    return st.integers(row.minimum, row.maximum)


@st.composite
def servos(draw: st.DrawFn) -> Held:
    """The rows of a model at a firmware, and a legal value for each that ROM keeps."""
    model = CATALOG.models[draw(st.sampled_from(sorted(CATALOG.models)))]
    rows = model.rows(draw(st.sampled_from((1010, 1100, 1200, 1300))))
    return rows, {key: draw(raw_of(row)) for key, row in rows.items() if row.rom}


def side(held: Held, name: str = "snapshot:1") -> Side:
    return side_of(name, name, *held)


@given(servos())
def test_a_side_equals_itself(held: Held) -> None:
    found = compare(CATALOG, side(held), side(held), identity=True)
    assert found.differences == []
    assert found.same == len(held[1])


@settings(max_examples=50)
@given(servos(), servos())
def test_a_comparison_with_exchanged_sides_is_its_mirror(left: Held, right: Held) -> None:
    one = compare(CATALOG, side(left), side(right), identity=True)
    other = compare(CATALOG, side(right), side(left), identity=True)
    assert other.same == one.same
    assert one.differences == [
        replace(
            each, left=each.right, right=each.left, left_unit=each.right_unit, right_unit=each.left_unit,
            left_has=each.right_has, right_has=each.left_has,
        )
        for each in other.differences
    ]  # fmt: skip
    rows = {key for held in (left, right) for key in held[1]}
    assert one.same + len(one.differences) == len(rows)


@settings(max_examples=50)
@given(servos(), servos())
def test_restored_rows_do_not_differ(there: Held, here: Held) -> None:
    rows, raws = here
    try:
        values, left_out = choose(rows, raws, side(there), NOT_IN_SERVO, identity=True)
    except BadRequest as error:
        problems = error.facts["problems"]
        assert isinstance(problems, list)
        assert problems
        return
    after = dict(raws)
    for key, value in sorted(values.items(), key=lambda item: rows[item[0]].unit_when is not None):
        after[key] = scale.to_raw(rows[key], value, after)
    found = compare(CATALOG, side(there), side((rows, after)), identity=True)
    stayed = {one.key for one in left_out} | {key for key in rows if key not in side(there).values}
    assert {one.key for one in found.differences} <= stayed
    assert TORQUE in {one.key for one in left_out}


@given(servos(), st.data())
def test_an_unknown_value_differs_and_is_not_restored(held: Held, data: st.DataObject) -> None:
    rows, raws = held
    gone = data.draw(st.sampled_from(sorted(set(raws) - {TORQUE, "pwm_mode"})))
    known = side_of("snapshot:2", "snapshot 2", rows, {key: raw for key, raw in raws.items() if key != gone})
    for left, right in ((known, side(held)), (known, known)):
        found = compare(CATALOG, left, right, identity=True).differences
        assert [one.key for one in found] == [gone]
        assert (found[0].left, found[0].left_has, found[0].right_has) == (None, True, True)
    values, left_out = choose(rows, raws, known, NOT_IN_SERVO, identity=True)
    assert gone not in values
    assert [one.why for one in left_out if one.key == gone] == ["The value in snapshot 2 is unknown."]


def pwm(mode: Raw | None, travel: Raw) -> Held:
    rows = PWM.rows(1300)
    return rows, {"pwm_output_range": travel} if mode is None else {"pwm_mode": mode, "pwm_output_range": travel}


def test_the_same_number_in_another_unit_is_a_difference_and_of_unknown_unit_unknown() -> None:
    found = {one.key: one for one in compare(CATALOG, side(pwm(0, 900)), side(pwm(1, 90))).differences}
    one = found["pwm_output_range"]
    assert (one.left, one.left_unit, one.right, one.right_unit) == (90.0, "°", 90, "rpm")
    assert side(pwm(None, 900)).values["pwm_output_range"] is None


def test_a_number_is_restored_only_in_its_unit() -> None:
    rows = PWM.rows(1300)
    with pytest.raises(InvalidValue, match="Restore pwm_mode together with it"):
        choose(rows, {"pwm_mode": 1}, side(pwm(0, 900)), NOT_IN_SERVO, keys=["pwm_output_range"])
    values, _ = choose(rows, {"pwm_mode": 1}, side(pwm(0, 900)), NOT_IN_SERVO, keys=["pwm_output_range", "pwm_mode"])
    assert values == {"pwm_output_range": 90.0, "pwm_mode": "angle"}


def test_identity_is_compared_and_restored_only_if_requested() -> None:
    rows = PWM.rows(1300)
    there, here = {"servo_id": 3, "angle_p_gain": 40}, {"servo_id": 4, "angle_p_gain": 40}
    left, right = side((rows, there)), side((rows, here))
    assert "servo_id" not in {one.key for one in compare(CATALOG, left, right).differences}
    assert "servo_id" in {one.key for one in compare(CATALOG, left, right, identity=True).differences}
    assert choose(rows, here, left, NOT_IN_SERVO)[0] == {"angle_p_gain": 40}
    assert choose(rows, here, left, NOT_IN_SERVO, keys=["servo_id"])[0] == {"servo_id": 3}


def test_torque_mode_is_restored_only_if_requested_and_never_to_on() -> None:
    rows = PWM.rows(1300)
    assert choose(rows, {TORQUE: 0}, side((rows, {TORQUE: 1})), NOT_IN_SERVO)[0] == {}
    assert choose(rows, {TORQUE: 0}, side((rows, {TORQUE: 1})), NOT_IN_SERVO, keys=[TORQUE])[0] == {TORQUE: "off"}
    values, left_out = choose(rows, {TORQUE: 1}, side((rows, {TORQUE: 0})), NOT_IN_SERVO, keys=[TORQUE])
    assert values == {}
    assert "never turns torque on" in left_out[0].why


def test_all_invalid_values_are_listed_at_once() -> None:
    rows = dict(PWM.rows(1300))
    for key in ("angle_p_gain", "angle_d_gain"):
        rows[key] = rows[key].model_copy(update={"maximum": 10})
    there = side((PWM.rows(1300), {"angle_p_gain": 50, "angle_d_gain": 30, "smoothing": 0}))
    with pytest.raises(OutOfRange, match="2 rows of snapshot:1 are not valid for this servo") as caught:
        choose(rows, {}, there, NOT_IN_SERVO)
    problems = cast("list[dict[str, str]]", caught.value.facts["problems"])
    assert [(one["key"], one["code"]) for one in problems] == [
        ("angle_p_gain", "out_of_range"), ("angle_d_gain", "out_of_range"),
    ]  # fmt: skip
