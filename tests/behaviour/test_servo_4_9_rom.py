"""Sections 4.9 to 4.11: initialisation, restart and ROM; what survives which."""

import pytest

from hornbill.sim.behaviour import Behaviour
from unit.sim.desk import Desk

FREE = {"timeout_action": 0, "soft_start": 0}
ROM_LOST = 1 << 15


def test_ram_is_lost_with_the_power_and_rom_is_not() -> None:
    desk = Desk(rom={"angle_p_gain": 55})
    desk.write("0x2C", 77)
    desk.servo.power_off(desk.now)
    assert desk.wait(1.0) == []
    desk.servo.power_on(desk.now)
    desk.wait(0.2)
    assert desk.read("0x2C") == 55


def test_0x12_keeps_0x20_to_0x46_and_nothing_else() -> None:
    desk = Desk("BLA21-06U-AB", rom=FREE)
    changed = {
        "0x20": 2, "0x21": 1, "0x22": 0, "0x23": 1, "0x24": 1, "0x25": 1, "0x26": 2, "0x27": 60_000, "0x2A": 90,
        "0x2C": 50, "0x2D": 51, "0x2E": 5, "0x2F": 7, "0x30": 60, "0x31": 2, "0x32": 500, "0x33": 3_000,
        "0x34": 1_500, "0x35": 600, "0x36": 800, "0x37": 1, "0x38": 1_000, "0x39": -900, "0x3A": 200, "0x3B": -210,
        "0x3C": 90, "0x3D": -80, "0x3E": 70, "0x3F": -30, "0x40": 110, "0x41": 50, "0x44": 20, "0x45": 9, "0x46": 77,
    }  # fmt: skip
    desk.write("0x00", 100)
    for name, raw in changed.items():
        assert desk.write(name, raw) == raw, name
    assert desk.write("0x12", 1) == 1
    desk.wait(0.3)
    assert desk.servo.node_id == 77
    assert {name: desk.read(name) for name in changed} == changed
    assert desk.read("0x01") == 0


def test_writing_rom_is_50_ms_of_silence_then_a_restart() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x12", 1)
    assert desk.wait(0.04) == []
    assert desk.get_set("0x50") is None
    assert desk.wait(0.1) == []
    assert [status.uptime_sec for status in desk.node_statuses(desk.wait(0.1))] == [0]


def test_it_may_go_unanswered() -> None:
    desk = Desk(rom=FREE, behaviour=Behaviour(answers_save=False))
    desk.write("0x2C", 77)
    assert desk.send_write("0x12", 1) == []
    desk.wait(0.3)
    assert desk.read("0x2C") == 77


def test_all_motion_stops_while_rom_is_written() -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": 1})
    desk.write("0x01", 50)
    desk.wait(0.5)
    desk.write("0x12", 1)
    assert desk.servo.output == 1


def test_power_that_fails_meanwhile_costs_what_was_saved() -> None:
    desk = Desk(rom=FREE | {"angle_p_gain": 55, "node_id": 42})
    desk.write("0x12", 1)
    desk.wait(0.02)
    desk.servo.power_off(desk.now)
    desk.servo.power_on(desk.now)
    desk.wait(0.2)
    assert desk.servo.register(0x2C) == 40
    assert desk.servo.register(0x1A) == ROM_LOST
    assert desk.servo.node_id == 0


def test_a_lost_rom_is_reported_until_it_is_written_again() -> None:
    desk = Desk(rom=FREE | {"node_id": 42})
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


def test_initialise_resets_ram_and_commands_so_that_the_horn_moves() -> None:
    desk = Desk(rom=FREE | {"angle_p_gain": 55})
    desk.write("0x00", 900)
    desk.settle()
    assert desk.write("0x10", 1) == 1
    assert (desk.read("0x2C"), desk.read("0x00"), desk.read("0x01")) == (40, 0, 0)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)
    desk.restart()
    desk.wait(0.2)
    assert desk.read("0x2C") == 55


def test_initialise_and_0x12_reset_rom_too() -> None:
    desk = Desk(rom=FREE | {"angle_p_gain": 55})
    desk.write("0x10", 1)
    desk.write("0x12", 1)
    desk.wait(0.3)
    assert desk.servo.register(0x2C) == 40
    assert desk.servo.node_id == 0


def test_0x11_is_a_power_cycle() -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 9_000})
    desk.write("0x00", 2_700)
    desk.settle()
    assert desk.write("0x11", 1) == 1
    assert desk.wait(0.09) == []
    desk.wait(0.1)
    assert desk.servo.starts == 2
    assert desk.read("0x08") == pytest.approx(-900, abs=3)


def test_a_new_node_id_is_used_from_the_next_start_on() -> None:
    desk = Desk(rom=FREE)
    assert desk.write("0x46", 50) == 50
    assert desk.servo.node_id == 42
    desk.opcode(0)
    desk.wait(0.3)
    assert desk.servo.node_id == 50


def test_without_soft_start_the_horn_holds_where_it_stands() -> None:
    desk = Desk(rom=FREE, angle_deg=33.0)
    desk.wait(1.0)
    assert desk.read("0x08") == 330
    assert desk.read("0x00") == 330
    assert desk.servo.output == 0
