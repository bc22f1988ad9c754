"""Section 2.3: GetNodeInfo, RestartNode and ExecuteOpcode (tables 2-5 to 2-13)."""

import pytest

from hornbill.sim.behaviour import Behaviour
from hornbill.sim.device import ServoStage
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.identifier import make_service_id
from hornbill.wire.services import MAGIC
from unit.sim.desk import NODE, TESTER, Desk

SAVE, ERASE = 0, 1


@pytest.mark.states("B19")
def test_node_info_tells_unique_id_uptime_and_versions() -> None:
    desk = Desk("BLA21-28U-AB", "1.200")
    desk.wait(7.0)
    info = desk.node_info()
    assert info is not None
    assert info.hardware_version.unique_id == desk.servo.uid
    assert info.status.uptime_sec == 7
    assert (info.software_version.major, info.software_version.minor) == (1, 20)
    assert (info.hardware_version.major, info.hardware_version.minor) == (28, 50)
    assert info.hardware_version.certificate_of_authenticity == b""
    assert info.name
    assert info.status.vendor_specific_status_code == 0
    software = info.software_version
    assert (software.optional_field_flags, software.vcs_commit, software.image_crc) == (0, 0, 0)


@pytest.mark.states("B19")
def test_unique_id_and_versions_are_the_same_after_every_start() -> None:
    desk = Desk()
    before = desk.node_info()
    desk.restart()
    desk.wait(0.2)
    desk.power_cycle()
    after = desk.node_info()
    assert before is not None
    assert after is not None
    assert (after.hardware_version, after.software_version) == (before.hardware_version, before.software_version)


@pytest.mark.states("B20")
@pytest.mark.parametrize("type_id", sorted(set(range(256)) - {1, 5, 10, 11}))
def test_four_services_are_served_and_no_others(type_id: int) -> None:
    desk = Desk()
    request = make_service_id(16, type_id, True, NODE, TESTER)
    for payload in (b"", bytes(7)):
        assert desk.raw_frames([Frame(request, payload + b"\xc0")]) == []
    desk.wait(0.05)
    assert {each.kind for each in desk.heard} == {Kind.MESSAGE}
    assert desk.servo.starts == 1


@pytest.mark.states("B06")
@pytest.mark.parametrize("magic", [0, 0xCE551B1E, MAGIC - 1, MAGIC ^ 1 << 39])
def test_any_other_magic_number_is_answered_with_fail_and_nothing_restarts(magic: int) -> None:
    desk = Desk()
    assert desk.restart(magic) is False
    assert desk.servo.starts == 1
    assert desk.read("0x50") == 61


@pytest.mark.states("B06", "B18")
def test_the_magic_number_restarts_and_uptime_begins_anew() -> None:
    desk = Desk()
    desk.wait(5.0)
    assert desk.restart(MAGIC) is True
    assert desk.wait(0.09) == []
    statuses = desk.node_statuses(desk.wait(0.05))
    assert [status.uptime_sec for status in statuses] == [0]
    assert desk.servo.starts == 2


@pytest.mark.states("B08", "B47")
def test_a_restart_drops_what_was_not_saved() -> None:
    desk = Desk()
    desk.write("0x2C", 77)
    desk.restart()
    desk.wait(0.2)
    assert desk.read("0x2C") == 40


def test_a_restart_may_be_slow_and_may_go_unanswered() -> None:
    desk = Desk(behaviour=Behaviour(acknowledges_restart=False))
    desk.servo.conditions.restart_delay_s = 3.0
    assert desk.restart() is None
    assert desk.wait(3.05) == []
    assert desk.wait(0.1)


@pytest.mark.states("B07")
@pytest.mark.parametrize(("opcode", "argument"), [(2, 0), (255, 0), (SAVE, 1), (ERASE, -1)])
def test_unknown_opcodes_and_arguments_fail(opcode: int, argument: int) -> None:
    desk = Desk()
    desk.write("0x2C", 77)
    assert desk.opcode(opcode, argument) is False
    assert desk.read("0x2C") == 77
    assert desk.servo.stage is ServoStage.RUNNING


@pytest.mark.states("B07", "B48")
def test_save_writes_rom_and_restarts() -> None:
    desk = Desk()
    desk.write("0x2C", 77)
    assert desk.opcode(SAVE) is True
    assert desk.wait(0.14) == []
    assert [status.uptime_sec for status in desk.node_statuses(desk.wait(0.05))] == [0]
    assert desk.read("0x2C") == 77


@pytest.mark.states("B48")
def test_switches_save_without_an_answer_and_without_a_restart() -> None:
    desk = Desk(behaviour=Behaviour(acknowledges_save=False, save_opcode_restarts=False))
    desk.write("0x2C", 77)
    assert desk.opcode(SAVE) is None
    assert desk.wait(0.049) == []
    assert desk.wait(0.1)
    assert desk.servo.starts == 1
    desk.restart()
    desk.wait(0.2)
    assert desk.read("0x2C") == 77


@pytest.mark.states("B07", "B46")
def test_erase_resets_ram_at_once_and_rom_only_with_the_next_save() -> None:
    desk = Desk(rom={"angle_p_gain": 77})
    assert desk.opcode(ERASE) is True
    assert (desk.read("0x2C"), desk.read("0x45"), desk.read("0x46")) == (40, 0, 0)
    desk.restart()
    desk.wait(0.2)
    assert (desk.read("0x2C"), desk.read("0x45"), desk.read("0x46")) == (77, 7, 42)


@pytest.mark.states("B46")
def test_switches_for_what_erase_reaches() -> None:
    desk = Desk(rom={"angle_p_gain": 77}, behaviour=Behaviour(erase_rom=True, erase_keeps_identity=True))
    desk.opcode(ERASE)
    desk.restart()
    desk.wait(0.2)
    assert (desk.read("0x2C"), desk.read("0x45"), desk.read("0x46")) == (40, 7, 42)
