"""Improve at length: every way to abort it in every phase, and 30 random plants."""

from typing import Any

import pytest

from behaviour.rig import Rig
from behaviour.scene import settled
from behaviour.test_improve import GOOD, PHASES, WAYS, abort
from hornbill.servo.device.servo import Servo
from unit.lab.test_improvement import improve_plants


@pytest.mark.parametrize("way", WAYS)
@settled(GOOD)
async def test_an_abort_in_any_phase_leaves_every_register_as_before(
    rig: Rig, servo: Servo, way: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    await abort(rig, servo, way, PHASES, monkeypatch)


def test_thirty_random_plants_end_no_worse_and_most_mistuned_ones_much_better() -> None:
    improve_plants(30, mistuned_at_least=5)
