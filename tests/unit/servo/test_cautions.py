"""Moves that need a confirmation, and angles as float16 (features B25, B34, B71, B88)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.domain.motion import Caution
from hornbill.domain.servo import PositionUnit
from hornbill.errors import InvalidValue, NeedsConfirmation
from hornbill.schema.catalog import Catalog
from hornbill.servo.device import permission
from hornbill.servo.device.position_estimate import DEGREES
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion import bursts
from hornbill.servo.motion.cautions import cautions, require
from hornbill.units import Uid

CATALOG = Catalog.load()


def servo(model: str = "BLA21-06U-A0") -> Servo:
    made = Servo(Uid("0" * 32), CATALOG)
    made.identify_as(CATALOG.models[model], 1300)
    made.note("servo_id", 5, 0.0)
    return made


def confirmations(found: list[Caution]) -> list[str]:
    return [one.confirm for one in found if one.confirm is not None]


@given(raw=st.integers(-36000, 36000), here=st.lists(st.integers(-36000, 36000), max_size=3))
def test_a_move_beyond_one_turn_requires_a_confirmation(raw: int, here: list[int]) -> None:
    far = max((abs(raw - angle) for angle in here), default=0)
    assert ("turns" in confirmations(cautions(servo(), "angle", raw, here, 0.06))) == (far > 3600)


@given(raw=st.integers(-300, 300), kind=st.sampled_from(["speed", "torque"]))
def test_continuous_rotation_is_a_caution_without_a_confirmation(raw: int, kind: str) -> None:
    found = cautions(servo(), kind, raw, [], 0.06)
    assert any("rotates continuously" in one.text for one in found) == (raw != 0)
    assert confirmations(found) == []


@pytest.mark.parametrize("kind", ["speed", "torque"])
@pytest.mark.parametrize(
    ("raw", "warned"), [(0, False), (1, True), (-9, True), (10, False), (-10, False), (100, False)]
)
def test_a_value_below_the_usable_minimum_is_a_caution(kind: str, raw: int, warned: bool) -> None:
    found = [one for one in cautions(servo(), kind, raw, [], 0.06) if one.code == "below_minimum"]
    assert bool(found) is warned
    for one in found:
        assert "at least ±10 " in one.text
        assert one.params == {"value": raw, "smallest": 10}
        assert one.confirm is None


def test_no_angle_is_below_the_usable_minimum() -> None:
    assert [one.code for one in cautions(servo(), "angle", 1, [0], 0.06)] == []


def test_with_lost_turns_only_a_short_move_from_a_known_angle_needs_no_confirmation() -> None:
    lost = servo()
    lost.turns_lost_deg = 270.0
    assert confirmations(cautions(lost, "angle", 450, [0], 0.06)) == []
    assert confirmations(cautions(lost, "angle", 451, [0], 0.06)) == ["turn_count"]
    assert confirmations(cautions(lost, "angle", 0, [], 0.06)) == ["turn_count"], "its angle is unknown"
    assert confirmations(cautions(lost, "speed", 0, [], 0.06)) == []


def test_all_missing_confirmations_are_listed_at_once() -> None:
    found = [
        Caution("warning", "turns", "One.", "turns", {"turns": 2.0, "to_deg": 720.0}),
        Caution("failure", "timeout_hold", "Two.", None, {}),
        Caution("warning", "turn_count", "Three.", "turn_count", {"before_deg": 10.5}),
    ]
    one = servo()
    with pytest.raises(NeedsConfirmation) as caught:
        require(one, found, ())
    assert caught.value.facts == {
        "confirm": "turns", "words": ["turns", "turn_count"], "cause": "turns", "also": ["turn_count"],
        "servo": one.title, "turns": 2.0, "to_deg": 720.0, "before_deg": 10.5,
    }  # fmt: skip
    with pytest.raises(NeedsConfirmation) as caught:
        require(one, found, ["turns"])
    assert (caught.value.facts["words"], caught.value.facts["cause"]) == (["turn_count"], "turn_count")
    require(one, found, ["turn_count", "turns"])


@given(raw=st.integers(-36000, 36000) | st.integers(-1810, 1810), unit=st.sampled_from(list(DEGREES)))
def test_no_angle_beyond_half_a_turn_is_sent_and_float16_rounds_by_a_step(raw: int, unit: PositionUnit) -> None:
    one = servo()
    one.position_unit.forced = unit
    target = permission.Target(one.registers["command_angle"].parameter, raw, clamped=False)
    exact = raw / 10
    try:
        part = bursts._part(one, "angle", target)  # pyright: ignore[reportPrivateUsage]
    except InvalidValue:
        assert abs(exact) > 180
    else:
        assert abs(exact) <= 180
        assert abs(part.value - exact) <= 0.1 + 1e-6
        assert abs(part.command.command_value * DEGREES[unit] - part.value) < 1e-9


@given(raw=st.integers(-2048, 2048), kind=st.sampled_from(["speed", "torque"]))
def test_whole_rpm_and_percent_are_exact(raw: int, kind: str) -> None:
    one = servo()
    target = permission.Target(one.registers[f"command_{kind}"].parameter, raw, clamped=False)
    part = bursts._part(one, kind, target)  # pyright: ignore[reportPrivateUsage]
    assert part.value == part.command.command_value == raw / target.parameter.per_unit
