"""Section 4.20: less motor current is less torque, and less droop of the supply, with 0x25 on or off."""

import pytest

from unit.sim.desk import FREE, MODELS, Desk
from unit.sim.response import step

LIMITS = {
    "BLA21-06U": (60, 120), "BLA21-12U": (35, 63), "BLA21-28U": (16, 24), "BLA15-06U": (10, 21), "BLA15-12U": (7, 10),
    "BLA34-12U": (35, 63), "BLA34-28U": (16, 24),
}  # fmt: skip
"""The least and the delivered value, in 0.1 A."""


def stalled(cascade: int, limit: int, model: str = "BLA21-06U-A0") -> Desk:
    """A servo that holds against more than it can, pushed back slowly."""
    desk = Desk(model, rom=FREE | {"speed_torque_control": cascade, "overcurrent_limit": limit})
    desk.under(load_pct=-90.0)
    desk.write("0x00", 900)
    desk.wait(1.0)
    return desk


@pytest.mark.states("B77")
@pytest.mark.parametrize("cascade", [0, 1])
def test_the_current_limit_takes_torque_away_with_and_without_0x25(cascade: int) -> None:
    assert stalled(cascade, 60).read("0x0A") == pytest.approx(50, abs=2)
    assert (stalled(cascade, 120).read("0x0A") or 0) > 80


@pytest.mark.states("B77", "B105")
@pytest.mark.parametrize("model", MODELS)
def test_every_model_has_a_range_that_takes_some_and_leaves_some(model: str) -> None:
    least, delivered = LIMITS[model[:9]]
    weak, strong = (stalled(1, limit, model).read("0x0A") or 0 for limit in (least, delivered))
    assert weak == pytest.approx(100 * least / delivered, abs=2)
    assert strong > weak + 10


@pytest.mark.states("B77")
def test_the_supply_droops_less_under_a_lower_limit() -> None:
    assert (stalled(0, 60).read("0x0C") or 0) > (stalled(0, 120).read("0x0C") or 0)


@pytest.mark.states("B77")
def test_a_start_is_slower_and_ends_in_the_same_place() -> None:
    slow, quick = (step(Desk(rom=FREE | {"overcurrent_limit": limit}).under(load_inertia=3.0)) for limit in (60, 120))
    assert slow.first(0.5) > quick.first(0.5)
    assert max(slow.left, quick.left) <= 3


@pytest.mark.states("B77", "B101")
def test_a_firmware_without_the_row_pushes_with_all_it_has() -> None:
    desk = Desk(firmware="1.010", rom={"timeout_action": 0, "soft_start": 0})
    assert desk.read("0x2A") == 0
    desk.under(load_pct=-85.0)
    desk.write("0x00", 900)
    desk.wait(1.0)
    assert (desk.read("0x0A") or 0) > 80
