"""The unit of positions: only the right one is confirmed, for any angles and rounding, and while the horn moves."""

import math
import struct
from collections.abc import Callable
from random import Random
from typing import Literal, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.domain.servo import PositionUnit
from hornbill.servo.device.position_estimate import DEGREES, LITERAL, PAIRS_AT_ONE_ANGLE, Angle, Estimate

UNITS = st.sampled_from(get_args(PositionUnit.__value__))
Rounding = Literal["nearest", "down", "none"]
ROUNDINGS = st.sampled_from(get_args(Rounding))
Where = Callable[[float], float]


def half(value: float) -> float:
    """As it arrives: float16, at its end where it does not fit (errata A4)."""
    return math.copysign(min(abs(value), 65504.0), value) if abs(value) >= 65504 else struct.unpack(
        "<e", struct.pack("<e", value)
    )[0]  # fmt: skip


def tenths(degrees: float, rounding: Rounding) -> float:
    """0x08 of an angle, as one firmware or another may round it."""
    return (round(degrees * 10) if rounding == "nearest" else math.floor(degrees * 10)) / 10


def watch(
    estimate: Estimate,
    where: Where,
    unit: PositionUnit,
    *,
    seconds: float = 3.0,
    rounding: Rounding = "nearest",
    loss: float = 0.0,
    late_s: float = 0.002,
    seed: int = 0,
    start: float = 0.0,
) -> list[float]:
    """Ten Statuses a second of a horn that is at `where(t)`, and 0x08 read between them; what was shown of it."""
    random, reading, shown = Random(seed), None, list[float]()
    for tick in range(int(seconds * 10)):
        at = start + tick / 10
        degrees = where(at)
        # a firmware may put into Status what it puts into 0x08, or the angle itself
        reported = degrees if rounding == "none" else tenths(degrees, rounding)
        if random.random() >= loss:
            position = half(reported / DEGREES[unit])
            estimate.add_status(position, at, reading)
            angle = estimate.shown(position)
            if angle is not None:
                shown.append(abs(angle - degrees))
        if random.random() >= loss:
            sampled = at + random.uniform(0.0, 0.07)
            reading = Angle(tenths(where(sampled), "down" if rounding == "down" else "nearest"), sampled + late_s)
    return shown


def still(degrees: float) -> Where:
    return lambda _at: degrees


@settings(max_examples=60)
@given(UNITS, st.floats(2.05, 3000).flatmap(lambda a: st.sampled_from((a, -a))), ROUNDINGS)
def test_the_unit_is_measured_at_rest_off_zero(unit: PositionUnit, degrees: float, rounding: Rounding) -> None:
    estimate = Estimate()
    watch(estimate, still(degrees), unit, rounding=rounding)
    assert (estimate.measured, estimate.state) == (unit, "confirmed" if unit == LITERAL else "conflict")
    assert estimate.sure is (unit == LITERAL)
    assert f"{PAIRS_AT_ONE_ANGLE} times" in estimate.evidence.text


@settings(max_examples=60)
@given(UNITS, st.floats(-36_000_000, 36_000_000), ROUNDINGS, st.integers(0, 9))
def test_no_angle_confirms_another_unit(unit: PositionUnit, degrees: float, rounding: Rounding, seed: int) -> None:
    """Beyond float16 and near zero nothing is concluded; everywhere else the right thing."""
    estimate = Estimate()
    watch(estimate, still(degrees), unit, rounding=rounding, loss=0.2, seed=seed)
    assert estimate.measured in (None, unit)
    assert not estimate.clash


@pytest.mark.parametrize("unit", get_args(PositionUnit.__value__))
@pytest.mark.parametrize("degrees", [0.0, 0.1, -0.4, 1.0, -1.9])
def test_near_zero_no_unit_is_measured_and_the_shown_angle_is_close(unit: PositionUnit, degrees: float) -> None:
    estimate = Estimate()
    shown = watch(estimate, still(degrees), unit)
    assert estimate.state == "assumed"
    assert max(shown, default=0.0) <= 0.3


@settings(max_examples=60)
@given(UNITS, ROUNDINGS, st.floats(-300, 300), st.floats(0, 300), st.floats(0.05, 2), st.integers(0, 999))
def test_an_oscillating_horn_confirms_no_other_unit(
    unit: PositionUnit, rounding: Rounding, middle: float, size: float, hz: float, seed: int
) -> None:
    def swing(at: float) -> float:
        return middle + size * math.sin(2 * math.pi * hz * at + seed)

    estimate = Estimate()
    watch(estimate, swing, unit, seconds=12, rounding=rounding, loss=0.2, late_s=0.01, seed=seed)
    assert estimate.measured in (None, unit)
    assert not estimate.clash


@settings(max_examples=60)
@given(UNITS, st.lists(st.floats(-300, 300), min_size=2, max_size=12), st.floats(20, 600), st.integers(0, 999))
def test_a_moving_horn_confirms_no_other_unit(unit: PositionUnit, places: list[float], speed: float, seed: int) -> None:
    """At a servo's speed, with stops too short for five readings, and late responses."""

    def where(at: float) -> float:
        here, left = places[0], at
        for there in places[1:]:
            takes = abs(there - here) / speed
            if left < takes:
                return here + (there - here) * left / takes
            here, left = there, left - takes - 0.35
            if left < 0:
                return here
        return here

    estimate = Estimate()
    watch(estimate, where, unit, seconds=15, loss=0.2, late_s=0.12, seed=seed)
    assert estimate.measured in (None, unit)
    assert not estimate.clash


@pytest.mark.parametrize("unit", get_args(PositionUnit.__value__))
def test_two_angles_need_fewer_readings_than_one(unit: PositionUnit) -> None:
    estimate = Estimate()
    watch(estimate, still(20.0), unit, seconds=0.4)
    assert estimate.measured is None
    watch(estimate, still(30.0), unit, seconds=0.5, start=1.0)
    assert estimate.measured == unit


def test_five_readings_are_needed_at_one_angle() -> None:
    def after(pairs: int) -> Estimate:
        estimate = Estimate()
        for tick in range(pairs + 2):
            reading = Angle(50.0, tick * 0.2 - 0.1) if tick > 1 else None
            estimate.add_status(half(50.0 / DEGREES["radian"]), tick * 0.2, reading)
        return estimate

    assert after(PAIRS_AT_ONE_ANGLE - 1).measured is None
    assert after(PAIRS_AT_ONE_ANGLE).measured == "radian"


def test_pairs_that_fit_another_unit_restart_the_count() -> None:
    estimate = Estimate()
    for tick in range(40):
        degrees = 50.0 if tick % 5 else 50.0 * DEGREES["radian"] / 100
        estimate.add_status(0.5, tick * 0.2, Angle(degrees, tick * 0.2 - 0.1))
    assert estimate.state == "assumed"


@pytest.mark.parametrize("position", [0.0, 0.7, 30.0])
def test_pairs_that_fit_no_unit_are_a_conflict_and_status_is_not_shown(position: float) -> None:
    estimate = Estimate()
    for tick in range(20):
        estimate.add_status(position, tick * 0.2, Angle(50.0, tick * 0.2 - 0.1))
    assert estimate.state == "conflict"
    assert estimate.shown(position) is None
    assert not estimate.sure
    assert "no known unit" in estimate.evidence.text


@pytest.mark.parametrize("unit", ["radian", "degree", "tenth_degree"])
def test_a_wrong_assumption_is_never_shown(unit: PositionUnit) -> None:
    """Not even before the first reading: the first thing shown of a horn at 40 degrees is not 4000."""
    shown = watch(Estimate(), still(40.0), unit)
    assert shown
    assert max(shown) < 0.1


def test_the_documented_unit_is_shown_after_one_matching_reading_even_while_the_horn_turns() -> None:
    estimate = Estimate()
    shown = watch(estimate, lambda at: 60.0 * at, "hundred_degrees", seconds=1.0)
    assert len(shown) >= 7
    assert max(shown) < 0.2
    assert estimate.state == "assumed"


def test_a_forced_unit_is_used_and_the_measured_one_is_kept_too() -> None:
    estimate = Estimate(forced="degree")
    watch(estimate, still(40.0), "radian")
    assert (estimate.unit, estimate.state, estimate.measured) == ("degree", "forced", "radian")
    assert estimate.sure
    assert estimate.shown(0.5) == 0.5
