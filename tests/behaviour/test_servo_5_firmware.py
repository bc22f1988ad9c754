"""Section 5: which firmware step brought which rows, and that a servo without them works without them."""

import pytest

from hornbill.sim.behaviour import Behaviour
from hornbill.wire.services import GetSetResponse
from unit.sim.desk import FIRMWARE, MODELS, Desk, integer
from unit.sim.response import step

BROUGHT = {"1.100": {"0x25", "0x2A"}, "1.200": {"0x2F"}}
WITH_PWM = {"1.100": {"0x34", "0x35", "0x36", "0x37"}}


def missing(model: str, firmware: str) -> set[str]:
    """The rows that a later step brings to this model."""
    later = [names for since, names in BROUGHT.items() if since > firmware]
    if model.endswith("AB"):
        later += [names for since, names in WITH_PWM.items() if since > firmware]
    return {name for names in later for name in names}


@pytest.mark.states("B101", "B75")
@pytest.mark.parametrize("firmware", FIRMWARE)
@pytest.mark.parametrize("model", MODELS)
def test_a_row_is_refused_before_its_step_and_answered_from_then_on(model: str, firmware: str) -> None:
    desk = Desk(model, firmware, rom={"soft_start": 0}, behaviour=Behaviour(later_rows="empty"))
    for name in missing(model, firmware):
        assert desk.read(name) is None
        assert desk.write(name, 1) is None
        empty = desk.get_set(name, integer(1))
        assert isinstance(empty, GetSetResponse)
        assert empty.name == ""
    for name in missing(model, "1.000") - missing(model, firmware):
        assert desk.read(name) is not None


@pytest.mark.states("B101")
def test_the_first_firmware_lacks_what_the_later_ones_brought() -> None:
    assert missing("BLA21-06U-A0", "1.010") == {"0x25", "0x2A", "0x2F"}
    assert len(missing("BLA21-06U-AB", "1.010")) == 7
    assert missing("BLA21-06U-AB", "1.200") == set()


@pytest.mark.states("B101", "B75")
@pytest.mark.parametrize("firmware", FIRMWARE)
@pytest.mark.parametrize("model", MODELS)
def test_every_step_of_every_model_reaches_an_angle_and_keeps_its_settings(model: str, firmware: str) -> None:
    desk = Desk(model, firmware, rom={"soft_start": 0, "timeout_action": 0})
    assert step(desk, 450, 1.5).left <= 3
    assert desk.write("0x3E", 70) == 70
    desk.write("0x12", 1)
    desk.wait(0.3)
    assert (desk.read("0x3E"), desk.read("0x52")) == (70, round(float(firmware) * 1000))
