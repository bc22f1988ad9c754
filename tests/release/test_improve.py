"""Improve at length: every way to abort it in every phase, and 30 random plants."""

from statistics import fmean
from typing import Any

import pytest

from behaviour.rig import Rig
from behaviour.scene import settled
from behaviour.test_improve import GOOD, PHASES, WAYS, abort
from hornbill.servo.device.servo import Servo
from improve_cases import judge


@pytest.mark.parametrize("way", WAYS)
@settled(GOOD)
async def test_an_abort_in_any_phase_leaves_every_register_as_before(
    rig: Rig, servo: Servo, way: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    await abort(rig, servo, way, PHASES, monkeypatch)


def test_thirty_random_plants_end_no_worse_and_most_mistuned_ones_much_better() -> None:
    """`make bench BENCH=improve` has 300."""
    found = [judge(seed) for seed in range(30)]
    assert [one.case.seed for one in found if one.worse] == []
    mistuned = [one for one in found if one.mistuned]
    assert len(mistuned) >= 5
    assert fmean(one.sooner for one in mistuned) >= 0.8
    pairs = [one.predicted for one in found if one.predicted is not None]
    assert fmean(abs(expected - seen) <= 0.15 * seen for expected, seen in pairs) >= 0.8
