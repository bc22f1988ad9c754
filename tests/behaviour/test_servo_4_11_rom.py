"""Section 4.11: what a ROM write stores, how long it takes, and its result if the supply fails meanwhile."""

from collections.abc import Callable

import pytest

from behaviour.servo_story import follow, near
from hornbill.sim.device import ServoStage
from unit.sim.desk import FREE, NODE, QUIET, Desk

ROM_LOST = 1 << 15


@pytest.mark.states("B44", "B49")
def test_0x12_stores_0x20_to_0x46_and_nothing_else() -> None:
    desk = Desk("BLA21-06U-AB", rom=QUIET)
    changed = {
        "0x20": 2, "0x21": 1, "0x22": 0, "0x23": 1, "0x24": 1, "0x25": 1, "0x26": 2, "0x27": 60_000, "0x2A": 90,
        "0x2C": 50, "0x2D": 51, "0x2E": 5, "0x2F": 7, "0x30": 60, "0x31": 2, "0x32": 500, "0x33": 3_000,
        "0x34": 1_500, "0x35": 600, "0x36": 800, "0x37": 1, "0x38": 1_000, "0x39": -900, "0x3A": 200, "0x3B": -210,
        "0x3C": 90, "0x3D": -80, "0x3E": 70, "0x3F": -30, "0x40": 110, "0x41": 50, "0x44": 20, "0x45": 9, "0x46": 77,
    }  # fmt: skip
    desk.write("0x00", 100)
    for name, raw in changed.items():
        assert desk.write(name, raw) == raw, name
    product = {f"0x{at:02X}": desk.read(f"0x{at:02X}") for at in range(0x50, 0x5D)}
    desk.save()
    assert desk.servo.node_id == 77
    assert {name: desk.read(name) for name in changed} == changed
    assert desk.reads("0x00", "0x01") == [desk.read("0x08"), 0]
    assert {name: desk.read(name) for name in product} == product


@pytest.mark.states("B48")
def test_writing_rom_is_50_ms_of_silence_without_output_then_a_restart() -> None:
    desk = Desk(rom=FREE)
    desk.run("0x01", 50, 0.5)
    desk.write("0x12", 1)
    assert desk.servo.output == 1
    assert desk.wait(0.02) == []
    assert desk.get_set("0x50") is None
    desk.send_write("0x01", 50)
    desk.array(7, 1, 0.5)
    assert desk.wait(0.029) == []
    assert desk.servo.stage is ServoStage.SAVING
    assert desk.wait(0.002) == []
    assert desk.servo.stage is ServoStage.STARTING
    assert desk.wait(0.089) == []
    assert [status.uptime_sec for status in desk.node_statuses(desk.wait(0.1))] == [0]
    desk.wait(1.0)
    assert (desk.read("0x00"), desk.read("0x09")) == (desk.read("0x08"), 0)


def power_cut(desk: Desk) -> None:
    desk.servo.power_off(desk.now)
    desk.servo.power_on(desk.now)
    desk.wait(0.2)


def brownout(desk: Desk) -> None:
    desk.servo.conditions.voltage_v = 0.0
    desk.wait(1.0)
    desk.servo.conditions.voltage_v = 7.4
    desk.wait(0.2)


@pytest.mark.states("B48", "B56")
@pytest.mark.parametrize("fail", [power_cut, brownout])
def test_a_supply_that_fails_while_rom_is_written_loses_the_saved_values(fail: Callable[[Desk], None]) -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55, "node_id": 42})
    desk.run("0x12", 1, 0.02)
    fail(desk)
    assert (desk.servo.register(0x2C), desk.servo.register(0x1A), desk.servo.node_id) == (40, ROM_LOST, 0)


@pytest.mark.states("B08", "B48")
def test_a_supply_that_fails_before_or_after_a_save_loses_only_ram() -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55})
    follow(desk, ("0x2C", 77, 0), Desk.power_cycle, {"0x2C": 55})
    follow(desk, ("0x2C", 56, 0), ("0x12", 1, 0.06), Desk.power_cycle, {"0x2C": 56, "0x1A": 0})


def give_node_id(desk: Desk) -> None:
    """Respond to its three requests as an allocator."""
    for known in (6, 12, 16):
        while not desk.wait(0.01):
            pass
        desk.allocation(NODE if known == 16 else 0, desk.servo.uid[:known])
    assert desk.servo.node_id == NODE


@pytest.mark.states("B56", "B59")
def test_a_lost_rom_is_reported_until_it_is_written_again() -> None:
    desk = Desk(rom=QUIET)
    desk.servo.memory.rom_sound = False
    for _ in range(2):
        desk.power_cycle()
        assert desk.servo.register(0x1A) == ROM_LOST
    give_node_id(desk)
    assert desk.read("0x1A") == ROM_LOST
    desk.save()
    give_node_id(desk)
    assert desk.read("0x1A") == 0


@pytest.mark.states("B50")
@pytest.mark.parametrize("by", ["0x12", "opcode"])
@pytest.mark.parametrize(("soft_start", "ends_at"), [(1, 0), (0, 900)])
def test_a_save_moves_the_horn_to_0_by_soft_start_and_holds_it_otherwise(
    by: str, soft_start: int, ends_at: int
) -> None:
    desk = Desk(rom={"timeout_action": 0, "soft_start": soft_start})
    desk.go(900)
    desk.save(by)
    follow(desk, Desk.settle, {"0x08": near(ends_at), "output": 0}, *([] if soft_start else [{"0x00": near(ends_at)}]))
