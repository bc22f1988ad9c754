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


@pytest.mark.parametrize(
    ("raw", "here", "lost_deg", "confirm"),
    [
        (3600, [0], None, []), (3601, [0], None, ["turns"]), (-3601, [3600, 0], None, ["turns"]), (3601, [], None, []),
        (1, [0], None, []), (450, [0], 270.0, []), (451, [0], 270.0, ["turn_count"]), (0, [], 270.0, ["turn_count"]),
    ],
)  # fmt: skip
def test_more_than_a_turn_or_a_far_move_after_lost_turns_is_confirmed(
    raw: int, here: list[int], lost_deg: float | None, confirm: list[str]
) -> None:
    one = servo()
    one.turns_lost_deg = lost_deg
    found = cautions(one, "angle", raw, here, 0.06)
    assert [caution.code for caution in found] == [caution.confirm for caution in found] == confirm


@pytest.mark.parametrize("kind", ["speed", "torque"])
@pytest.mark.parametrize(("raw", "rotates", "small"), [(0, 0, 0), (1, 1, 1), (-9, 1, 1), (10, 1, 0), (-100, 1, 0)])
def test_continuous_rotation_and_a_value_below_the_usable_minimum_are_cautions(
    kind: str, raw: int, rotates: bool, small: bool
) -> None:
    one = servo()
    one.turns_lost_deg = 270.0
    found = {caution.code: caution for caution in cautions(one, kind, raw, [], 0.06)}
    assert list(found) == ["continuous_rotation"] * rotates + ["below_minimum"] * small
    assert not any(caution.confirm for caution in found.values())
    if small:
        assert found["below_minimum"].params == {"value": raw, "smallest": 10}
        assert "at least ±10 " in found["below_minimum"].text


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
    target = permission.Target(servo().registers[f"command_{kind}"].parameter, raw, clamped=False)
    part = bursts._part(servo(), kind, target)  # pyright: ignore[reportPrivateUsage]
    assert part.value == part.command.command_value == raw / target.parameter.per_unit
