"""Rules over several rows: unique IDs, and limits that would turn torque off."""

from collections.abc import Mapping
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.errors import Conflict, NeedsConfirmation
from hornbill.schema.catalog import Catalog
from hornbill.schema.model import ServoModel
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration import rules
from hornbill.servo.configuration.rules import Claim
from hornbill.units import Raw, Uid

CATALOG: Final = Catalog.load()
ROWS: Final[Mapping[str, Parameter]] = CATALOG.models["BLA21-12U-A0"].rows(1300)

READINGS: Final = [row for row in ROWS.values() if row.limits is not None and row.limits.confirm is not None]
windows = st.sampled_from(READINGS)
raws = st.integers(-60, 600)


@pytest.mark.parametrize("model", CATALOG.models.values(), ids=lambda model: model.name)
def test_the_ranges_of_a_lower_and_an_upper_limit_meet(model: ServoModel) -> None:
    rows = model.rows(1300)
    for reading in READINGS:
        assert reading.limits is not None
        assert rows[reading.limits.lower].maximum == rows[reading.limits.upper].minimum


@given(windows, raws, raws, raws, st.sampled_from(("lower", "upper")))
def test_a_limit_tightened_to_less_than_the_margin_from_the_reading_requires_a_confirmation(
    row: Parameter, before: Raw, after: Raw, reading: Raw, which: str
) -> None:
    limits, side = row.limits, 1 if which == "upper" else -1
    assert limits is not None
    key, margin = getattr(limits, which), limits.tolerance or 0
    now = {key: before, row.key: reading}
    confirms = (after - before) * side < 0 and (after - reading) * side < margin
    rules.check_readings(ROWS, now, {key: after}, (str(limits.confirm),))
    if not confirms:
        rules.check_readings(ROWS, now, {key: after}, ())
        return
    for confirm in ((), ("torque_off_in_rom",)):
        with pytest.raises(NeedsConfirmation) as caught:
            rules.check_readings(ROWS, now, {key: after}, confirm)
        assert (caught.value.facts["confirm"], caught.value.facts["key"]) == (limits.confirm, key)
        assert f"±{margin / row.per_unit:g}" in caught.value.detail
    rules.check_readings(ROWS, now, {key: reading + side * margin}, ())


@pytest.mark.parametrize("row", READINGS, ids=lambda row: row.key)
def test_without_a_reading_a_tightened_limit_requires_a_confirmation(row: Parameter) -> None:
    assert row.limits is not None
    upper = row.limits.upper
    with pytest.raises(NeedsConfirmation, match="is unknown"):
        rules.check_readings(ROWS, {upper: 200, row.key: None}, {upper: 199}, ())


def test_the_readings_to_be_read_for_limits() -> None:
    assert rules.to_read(ROWS, ["angle_p_gain", "servo_id"]) == []
    assert rules.to_read(ROWS, ["voltage_limit_upper"]) == ["current_voltage"]
    both = ["voltage_limit_upper", "voltage_limit_lower", "temperature_limit_lower"]
    assert rules.to_read(ROWS, both) == ["current_temperature", "current_voltage"]


owners = st.one_of(st.none(), st.sampled_from([Uid("aa" * 16), Uid("bb" * 16)]))
claims = st.lists(st.builds(Claim, st.integers(1, 254), owners, st.just("elbow"), st.just("on the bus")), max_size=20)


@given(st.sampled_from(CATALOG.unique), st.integers(0, 254), claims)
def test_an_id_in_use_is_refused_and_a_free_one_suggested(key: str, requested: int, taken: list[Claim]) -> None:
    numbers = {one.number for one in taken}
    if requested not in numbers:
        rules.check_id(ROWS[key], requested, taken)
        return
    with pytest.raises(Conflict) as refused:
        rules.check_id(ROWS[key], requested, taken)
    free, unique = refused.value.facts["free"], ROWS[key].unique
    assert unique is not None
    assert free == min(set(range(unique.lowest, unique.highest + 1)) - numbers)
    assert refused.value.facts["owner"] == next(one.owner for one in taken if one.number == requested)
    assert "elbow" in refused.value.detail


def test_id_zero_is_never_in_use() -> None:
    rules.check_id(ROWS["servo_id"], 0, [Claim(0, Uid("aa" * 16), "elbow", "on the bus")])


def test_no_id_is_suggested_if_none_is_free() -> None:
    taken = [Claim(number, None, f"node {number}", "on the bus") for number in range(1, 128)]
    with pytest.raises(Conflict, match="No number is free") as refused:
        rules.check_id(ROWS["node_id"], 5, taken)
    assert refused.value.facts["free"] is None


@pytest.mark.parametrize(
    ("key", "before", "after", "confirms"),
    [
        ("angle_limit_cw", 1799, 9990, True),
        ("angle_limit_ccw", -1800, -9990, True),
        ("angle_limit_cw", None, 1801, True),
        ("angle_limit_cw", 9990, 36000, True),
        ("angle_limit_cw", 9990, 5000, False),
        ("angle_limit_cw", 9990, 9990, False),
        ("angle_limit_cw", 600, 1800, False),
        ("angle_limit_ccw", -600, -1800, False),
    ],
)
def test_an_angle_limit_beyond_half_a_turn_is_confirmed(
    key: str, before: Raw | None, after: Raw, confirms: bool
) -> None:
    rules.check_turns(ROWS, {key: before}, {key: after}, ["multi_turn"])
    if not confirms:
        rules.check_turns(ROWS, {key: before}, {key: after}, [])
        return
    with pytest.raises(NeedsConfirmation) as caught:
        rules.check_turns(ROWS, {key: before}, {key: after}, ["supply"])
    assert caught.value.facts["confirm"] == "multi_turn"
    assert caught.value.facts["turns"] == round(abs(after) / 3600, 1)
    assert "lost at power-off" in caught.value.detail
