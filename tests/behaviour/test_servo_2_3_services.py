"""Section 2.3: GetNodeInfo, RestartNode and ExecuteOpcode (tables 2-5 to 2-13)."""

import pytest

from behaviour.servo_story import follow
from hornbill.sim.device import ServoStage
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.identifier import make_service_id
from hornbill.wire.services import MAGIC
from unit.sim.desk import NODE, TESTER, Desk

SAVE, ERASE = 0, 1


@pytest.mark.states("B19")
def test_node_info_has_unique_id_uptime_and_versions_the_same_after_every_start() -> None:
    desk = Desk("BLA21-28U-AB", "1.200")
    desk.wait(7.0)
    info = desk.node_info()
    assert info is not None
    hardware, software = info.hardware_version, info.software_version
    assert hardware.unique_id == desk.servo.uid
    assert (software.major, software.minor, hardware.major, hardware.minor) == (1, 20, 28, 50)
    assert hardware.certificate_of_authenticity == b""
    assert (software.optional_field_flags, software.vcs_commit, software.image_crc) == (0, 0, 0)
    assert info.name
    assert (info.status.uptime_sec, info.status.vendor_specific_status_code) == (7, 0)
    desk.restart()
    desk.wait(0.2)
    desk.power_cycle()
    after = desk.node_info()
    assert after is not None
    assert (after.hardware_version, after.software_version) == (hardware, software)


@pytest.mark.states("B20")
def test_four_services_are_provided_and_no_others() -> None:
    desk = Desk()
    for type_id in set(range(256)) - {1, 5, 10, 11}:
        request = make_service_id(16, type_id, True, NODE, TESTER)
        for payload in (b"", bytes(7)):
            assert desk.raw_frames([Frame(request, payload + b"\xc0")]) == [], type_id
    desk.wait(0.05)
    assert {each.kind for each in desk.received} == {Kind.MESSAGE}
    assert desk.servo.starts == 1


@pytest.mark.states("B06")
def test_any_other_magic_number_is_refused_and_has_no_effect() -> None:
    desk = Desk()
    assert {desk.restart(magic) for magic in (0, 0xCE551B1E, MAGIC - 1, MAGIC ^ 1 << 39)} == {False}
    follow(desk, {"starts": 1, "0x50": 61})


@pytest.mark.states("B06", "B08", "B18", "B47")
@pytest.mark.parametrize("delay_s", [0.1, 3.0])
def test_the_magic_number_restarts_uptime_and_discards_unsaved_values(delay_s: float) -> None:
    desk = Desk()
    desk.servo.conditions.restart_delay_s = delay_s
    desk.wait(5.0)
    desk.write("0x2C", 77)
    assert desk.restart(MAGIC) is True
    assert desk.wait(delay_s - 0.01) == []
    statuses = desk.node_statuses(desk.wait(0.15))
    assert [status.uptime_sec for status in statuses] == [0]
    assert desk.servo.starts == 2
    assert desk.read("0x2C") == 40


@pytest.mark.states("B07")
def test_unknown_opcodes_and_arguments_fail() -> None:
    desk = Desk()
    desk.write("0x2C", 77)
    assert {desk.opcode(*call) for call in ((2, 0), (255, 0), (SAVE, 1), (ERASE, -1))} == {False}
    follow(desk, {"0x2C": 77, "stage": ServoStage.RUNNING})


@pytest.mark.states("B07", "B48")
def test_save_writes_rom_and_restarts() -> None:
    desk = Desk()
    desk.write("0x2C", 77)
    assert desk.opcode(SAVE) is True
    assert desk.wait(0.14) == []
    assert [status.uptime_sec for status in desk.node_statuses(desk.wait(0.05))] == [0]
    assert desk.read("0x2C") == 77


@pytest.mark.states("B07", "B46")
def test_erase_resets_ram_immediately_and_rom_only_with_the_next_save() -> None:
    desk = Desk(rom={"angle_p_gain": 77})
    assert desk.opcode(ERASE) is True
    follow(desk, {"0x2C": 40, "0x45": 0, "0x46": 0}, Desk.restart, 0.2, {"0x2C": 77, "0x45": 7, "0x46": 42})
