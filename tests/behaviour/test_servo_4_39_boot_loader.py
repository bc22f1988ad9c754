"""Section 4.39: 0x49 must never be written; the simulated servo ignores and records it."""

import pytest

from unit.sim.desk import FREE, MODELS, Desk, integer


@pytest.mark.states("B97")
@pytest.mark.parametrize("model", MODELS)
def test_writes_of_0x49_have_no_effect_and_are_recorded_and_reads_are_not(model: str) -> None:
    desk = Desk(model, rom=FREE)
    names = [f"0x{at:02X}" for at in range(0x20, 0x60)]
    before = desk.reads(*names)
    assert desk.read("0x49") == 0
    assert desk.servo.boot_loader_writes == []
    for raw in (0, 1, -1, 2**62):
        desk.send_write("0x49", raw)
    desk.get_set("", integer(2), index=0x49)
    assert desk.wait(0.5)
    assert [raw for _, raw in desk.servo.boot_loader_writes] == [0, 1, -1, 2**62, 2]
    assert desk.reads(*names) == before
    assert desk.servo.starts == 1
