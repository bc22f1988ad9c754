"""Section 4.39: 0x49 is never to be written; the simulated servo does nothing and tells the test."""

import pytest

from unit.sim.desk import FREE, MODELS, Desk, integer


@pytest.mark.states("B97")
def test_0x49_reads_and_never_acts_but_every_write_to_it_is_recorded() -> None:
    desk = Desk()
    before = desk.read("0x49")
    assert desk.servo.boot_loader_writes == []
    desk.write("0x49", 1)
    desk.get_set("", integer(2), index=0x49)
    assert [raw for _, raw in desk.servo.boot_loader_writes] == [1, 2]
    assert desk.read("0x49") == before
    assert desk.wait(0.5)
    assert desk.servo.starts == 1


@pytest.mark.states("B97")
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("raw", [0, 1, -1, 2**62])
def test_no_value_of_it_changes_anything_on_any_model(model: str, raw: int) -> None:
    desk = Desk(model, rom=FREE)
    before = [desk.read(f"0x{at:02X}") for at in range(0x20, 0x60)]
    desk.send_write("0x49", raw)
    desk.wait(0.5)
    assert [desk.read(f"0x{at:02X}") for at in range(0x20, 0x60)] == before
    assert [value for _, value in desk.servo.boot_loader_writes] == [raw]


@pytest.mark.states("B97")
def test_reading_it_is_not_writing_it() -> None:
    desk = Desk()
    assert desk.read("0x49") == 0
    assert desk.servo.boot_loader_writes == []
