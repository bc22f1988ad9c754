"""Section 4.20: a lower current limit reduces torque and the droop of the supply, with 0x25 on or off."""

import pytest

from behaviour.servo_story import between, follow, under
from unit.sim.desk import FREE, MODELS, QUIET, Desk, catalog
from unit.sim.response import step


def stalled(cascade: int, limit: int, model: str = "BLA21-06U-A0") -> Desk:
    """A servo under a load greater than it can hold."""
    desk = Desk(model, rom=FREE | {"speed_torque_control": cascade, "overcurrent_limit": limit}).under(load_pct=-90.0)
    desk.run("0x00", 900, 1.0)
    return desk


@pytest.mark.states("B77")
@pytest.mark.parametrize("cascade", [0, 1])
def test_a_lower_limit_reduces_torque_and_the_droop_of_the_supply(cascade: int) -> None:
    low, high = (stalled(cascade, limit) for limit in (60, 120))
    assert low.read("0x0A") == pytest.approx(50, abs=2)
    assert high.value("0x0A") > 80
    assert low.value("0x0C") > high.value("0x0C")


@pytest.mark.states("B77", "B105")
@pytest.mark.parametrize("model", MODELS)
def test_the_range_of_every_model_reduces_torque(model: str) -> None:
    row = catalog().models[model].parameters["overcurrent_limit"]
    assert row.minimum is not None
    assert row.default is not None
    weak, strong = (stalled(1, limit, model).value("0x0A") for limit in (row.minimum, row.default))
    assert weak == pytest.approx(100 * row.minimum / row.default, abs=2)
    assert strong > weak + 10


@pytest.mark.states("B77")
def test_with_a_lower_limit_the_same_angle_is_reached_later() -> None:
    slow, quick = (step(Desk(rom=FREE | {"overcurrent_limit": limit}).under(load_inertia=3.0)) for limit in (60, 120))
    assert slow.first(0.5) > quick.first(0.5)
    assert max(slow.left, quick.left) <= 3


@pytest.mark.states("B77", "B101")
def test_firmware_without_the_row_uses_full_torque() -> None:
    desk = Desk(firmware="1.010", rom=QUIET)
    follow(desk, {"0x2A": 0}, under(load_pct=-85.0), ("0x00", 900, 1.0), {"0x0A": between(80, 150)})
