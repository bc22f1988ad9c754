"""The rules over several rows: limits in order, ids with one owner each, and no output switched off unasked."""

from collections.abc import Mapping
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.errors import Conflict, InvalidValue, NeedsConfirmation
from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration import rules
from hornbill.servo.configuration.rules import WINDOWS, Claim
from hornbill.units import Raw, Uid

CATALOG: Final = Catalog.load()
ROWS: Final[Mapping[str, Parameter]] = CATALOG.models["BLA21-12U-A0"].rows(1300)

windows = st.sampled_from(WINDOWS)
raws = st.integers(-60, 600)
sides = st.sets(st.sampled_from(("lower", "upper")))


@given(windows, raws, raws, raws, raws, sides)
def test_limits_are_refused_exactly_when_a_change_leaves_lower_not_below_upper(
    window: rules.Window, low: Raw, high: Raw, new_low: Raw, new_high: Raw, written: set[str]
) -> None:
    now = {window.lower: low, window.upper: high}
    wanted: dict[str, Raw] = {}
    if "lower" in written:
        wanted[window.lower] = new_low
    if "upper" in written:
        wanted[window.upper] = new_high
    after = now | wanted
    bad = after != now and after[window.lower] >= after[window.upper]
    if not bad:
        rules.check_order(ROWS, now, wanted)
        return
    with pytest.raises(InvalidValue) as refused:
        rules.check_order(ROWS, now, wanted)
    assert refused.value.facts["keys"] == [window.lower, window.upper]
    assert refused.value.facts["key"] in wanted
    for key in (window.lower, window.upper):
        assert ROWS[key].label.casefold() in refused.value.detail.casefold()


@given(windows, raws, raws)
def test_a_limit_whose_fellow_is_not_known_is_let_through(window: rules.Window, low: Raw, high: Raw) -> None:
    rules.check_order(ROWS, {window.upper: None}, {window.lower: low})
    rules.check_order(ROWS, {}, {window.upper: high})


@given(windows, raws, raws, raws, st.sampled_from(("lower", "upper")))
def test_a_limit_is_asked_about_exactly_when_it_is_drawn_in_to_within_the_margin_of_the_reading(
    window: rules.Window, before: Raw, after: Raw, reading: Raw, which: str
) -> None:
    side = 1 if which == "upper" else -1
    key = window.upper if which == "upper" else window.lower
    margin = window.margin * ROWS[window.reading].per_unit
    drawn_in = (after - before) * side < 0
    too_near = (after - reading) * side < margin
    now = {key: before, window.reading: reading}
    for confirm in ((), ("torque_off_in_rom",)):
        if not (drawn_in and too_near):
            rules.check_readings(ROWS, now, {key: after}, confirm)
            continue
        with pytest.raises(NeedsConfirmation) as asks:
            rules.check_readings(ROWS, now, {key: after}, confirm)
        assert (asks.value.facts["confirm"], asks.value.facts["key"]) == (window.word, key)
        assert f"±{window.margin:g}" in asks.value.detail
    rules.check_readings(ROWS, now, {key: after}, (window.word,))


@given(windows, raws, raws, raws, st.sampled_from(("lower", "upper")))
def test_the_remedy_of_a_question_is_a_limit_that_is_not_asked_about(
    window: rules.Window, before: Raw, after: Raw, reading: Raw, which: str
) -> None:
    side = 1 if which == "upper" else -1
    key = window.upper if which == "upper" else window.lower
    per_unit = ROWS[window.reading].per_unit
    now = {key: before, window.reading: reading}
    try:
        rules.check_readings(ROWS, now, {key: after}, ())
    except NeedsConfirmation:
        remedy = round(reading + side * window.margin * per_unit)
        rules.check_readings(ROWS, now, {key: remedy}, ())
        with pytest.raises(NeedsConfirmation):
            rules.check_readings(ROWS, now | {key: remedy + side}, {key: remedy - side}, ())


@pytest.mark.parametrize("window", WINDOWS)
def test_without_a_reading_a_limit_that_is_drawn_in_is_asked_about(window: rules.Window) -> None:
    with pytest.raises(NeedsConfirmation, match="is not known"):
        rules.check_readings(ROWS, {window.upper: 200, window.reading: None}, {window.upper: 199}, ())


def test_the_other_limit_and_the_reading_are_to_be_read_and_nothing_twice() -> None:
    assert rules.to_read(["angle_p_gain", "servo_id"]) == []
    assert rules.to_read(["voltage_limit_upper"]) == ["voltage_limit_lower", "current_voltage"]
    both = ["voltage_limit_upper", "voltage_limit_lower", "temperature_limit_lower"]
    assert rules.to_read(both) == ["current_voltage", "temperature_limit_upper", "current_temperature"]


owners = st.one_of(st.none(), st.sampled_from([Uid("aa" * 16), Uid("bb" * 16)]))
claims = st.lists(st.builds(Claim, st.integers(1, 254), owners, st.just("elbow"), st.just("on the bus")), max_size=20)


@given(st.sampled_from(sorted(rules.GIVEN_IDS)), st.integers(0, 254), claims)
def test_an_id_is_refused_exactly_when_somebody_has_it_and_the_one_offered_is_free(
    key: str, requested: int, taken: list[Claim]
) -> None:
    numbers = {one.number for one in taken}
    if requested not in numbers:
        rules.check_id(ROWS[key], requested, taken)
        return
    with pytest.raises(Conflict) as refused:
        rules.check_id(ROWS[key], requested, taken)
    facts = refused.value.facts
    low, high = rules.GIVEN_IDS[key]
    free = facts["free"]
    assert isinstance(free, int)
    assert low <= free <= high
    assert free not in numbers
    assert facts["owner"] == next(one.owner for one in taken if one.number == requested)
    assert "elbow" in refused.value.detail
    rules.check_id(ROWS[key], free, taken)


def test_zero_is_nobodys_id() -> None:
    rules.check_id(ROWS["servo_id"], 0, [Claim(0, Uid("aa" * 16), "elbow", "on the bus")])


def test_when_every_id_is_taken_none_is_offered() -> None:
    taken = [Claim(number, None, f"node {number}", "on the bus") for number in range(1, 128)]
    with pytest.raises(Conflict, match="None is free") as refused:
        rules.check_id(ROWS["node_id"], 5, taken)
    assert refused.value.facts["free"] is None
