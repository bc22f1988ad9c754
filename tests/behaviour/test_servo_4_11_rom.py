"""Section 4.11: what a ROM write keeps, how long it takes, and what becomes of it when the supply fails."""

import pytest

from hornbill.sim.behaviour import Behaviour
from hornbill.sim.device import ServoStage
from unit.sim.desk import FREE, NODE, QUIET, Desk

ROM_LOST = 1 << 15


@pytest.mark.states("B08")
def test_ram_is_lost_with_the_power_and_rom_is_not() -> None:
    desk = Desk(rom={"angle_p_gain": 55})
    desk.write("0x2C", 77)
    desk.servo.power_off(desk.now)
    assert desk.wait(1.0) == []
    desk.servo.power_on(desk.now)
    desk.wait(0.2)
    assert desk.read("0x2C") == 55


@pytest.mark.states("B44", "B49")
def test_0x12_keeps_0x20_to_0x46_and_nothing_else() -> None:
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
    assert desk.write("0x12", 1) == 1
    desk.wait(0.3)
    assert desk.servo.node_id == 77
    assert {name: desk.read(name) for name in changed} == changed
    assert (desk.read("0x00"), desk.read("0x01")) == (desk.read("0x08"), 0)
    assert {name: desk.read(name) for name in product} == product


@pytest.mark.states("B48")
def test_writing_rom_is_50_ms_of_silence_then_a_restart() -> None:
    desk = Desk(rom=QUIET)
    desk.write("0x12", 1)
    assert desk.wait(0.04) == []
    assert desk.get_set("0x50") is None
    assert desk.wait(0.1) == []
    assert [status.uptime_sec for status in desk.node_statuses(desk.wait(0.1))] == [0]


@pytest.mark.states("B48")
def test_rom_is_written_for_50_ms() -> None:
    desk = Desk(rom=QUIET)
    desk.write("0x12", 1)
    desk.wait(0.049)
    assert desk.servo.stage is ServoStage.SAVING
    desk.wait(0.002)
    assert desk.servo.stage is ServoStage.STARTING


@pytest.mark.states("B48")
def test_it_may_go_unanswered() -> None:
    desk = Desk(rom=QUIET, behaviour=Behaviour(acknowledges_save=False))
    desk.write("0x2C", 77)
    assert desk.send_write("0x12", 1) == []
    desk.wait(0.3)
    assert desk.read("0x2C") == 77


@pytest.mark.states("B48")
def test_all_motion_stops_while_rom_is_written() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 50)
    desk.wait(0.5)
    desk.write("0x12", 1)
    assert desk.servo.output == 1


@pytest.mark.states("B48")
def test_what_is_sent_meanwhile_is_lost() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x12", 1)
    desk.wait(0.02)
    desk.send_write("0x01", 50)
    desk.array(7, 1, 0.5)
    desk.wait(1.0)
    assert (desk.read("0x00"), desk.read("0x09")) == (0, 0)


@pytest.mark.states("B48", "B56")
def test_power_that_fails_meanwhile_costs_what_was_saved() -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55, "node_id": 42})
    desk.write("0x12", 1)
    desk.wait(0.02)
    desk.servo.power_off(desk.now)
    desk.servo.power_on(desk.now)
    desk.wait(0.2)
    assert desk.servo.register(0x2C) == 40
    assert desk.servo.register(0x1A) == ROM_LOST
    assert desk.servo.node_id == 0


@pytest.mark.states("B48", "B56")
def test_a_supply_that_sinks_meanwhile_does_the_same() -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55})
    desk.write("0x12", 1)
    desk.wait(0.02)
    desk.servo.conditions.voltage_v = 0.0
    desk.wait(1.0)
    desk.servo.conditions.voltage_v = 7.4
    desk.wait(0.2)
    assert (desk.servo.register(0x2C), desk.servo.register(0x1A)) == (40, ROM_LOST)


@pytest.mark.states("B48")
def test_power_that_fails_before_or_after_costs_nothing() -> None:
    desk = Desk(rom=QUIET | {"angle_p_gain": 55})
    desk.power_cycle()
    desk.write("0x2C", 56)
    desk.write("0x12", 1)
    desk.wait(0.06)
    desk.power_cycle()
    assert (desk.read("0x2C"), desk.read("0x1A")) == (56, 0)


@pytest.mark.states("B56", "B59")
def test_a_lost_rom_is_reported_until_it_is_written_again() -> None:
    desk = Desk(rom=QUIET | {"node_id": 42})
    desk.servo.memory.rom_sound = False
    for _ in range(2):
        desk.servo.power_off(desk.now)
        desk.servo.power_on(desk.now)
        desk.wait(0.2)
        assert desk.servo.register(0x1A) == ROM_LOST
    desk.servo.memory.put(0x46, 42)
    desk.servo.memory.save(desk.servo.behaviour)
    desk.servo.memory.rom_sound = True
    desk.servo.power_off(desk.now)
    desk.servo.power_on(desk.now)
    desk.wait(0.2)
    assert desk.read("0x1A") == 0


@pytest.mark.states("B56", "B59")
def test_writing_rom_again_heals_it() -> None:
    desk = Desk(rom=QUIET)
    desk.servo.memory.rom_sound = False
    desk.power_cycle()
    give_node_id(desk)
    assert desk.read("0x1A") == ROM_LOST
    assert desk.write("0x12", 1) == 1
    desk.wait(0.3)
    give_node_id(desk)
    assert desk.read("0x1A") == 0


def give_node_id(desk: Desk) -> None:
    """Answer its three requests, as an allocator does."""
    for known in (6, 12, 16):
        while not desk.wait(0.01):
            pass
        desk.allocation(NODE if known == 16 else 0, desk.servo.uid[:known])
    assert desk.servo.node_id == NODE


@pytest.mark.states("B51")
def test_a_servo_with_a_dynamic_node_id_asks_for_one_again_after_a_save() -> None:
    desk = Desk(node_id=0, rom=QUIET)
    give_node_id(desk)
    assert desk.write("0x12", 1) == 1
    desk.wait(0.3)
    assert desk.servo.node_id == 0
    assert {each.type_id for each in desk.wait(2.0)} == {1}
    give_node_id(desk)


@pytest.mark.states("B50")
@pytest.mark.parametrize("by", ["0x12", "opcode"])
def test_a_save_with_soft_start_on_sends_the_horn_to_0(by: str) -> None:
    desk = Desk(rom={"timeout_action": 0})
    desk.write("0x00", 900)
    desk.settle()
    assert (desk.write("0x12", 1) if by == "0x12" else desk.opcode(0)) == 1
    desk.wait(0.3)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B50")
def test_without_soft_start_the_horn_holds_where_it_stands() -> None:
    desk = Desk(rom=QUIET, angle_deg=33.0)
    desk.wait(1.0)
    assert desk.read("0x08") == 330
    assert desk.read("0x00") == 330
    assert desk.servo.output == 0
