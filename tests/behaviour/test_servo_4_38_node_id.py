"""Section 4.38: the node id of 0x46: used as it is, or asked for where it is 0; from the next start on."""

import pytest

from unit.sim.desk import QUIET, START, Desk

ALLOCATION = 1


@pytest.mark.states("B02")
@pytest.mark.parametrize("node_id", [1, 42, 127])
def test_an_id_from_1_to_127_is_its_own(node_id: int) -> None:
    desk = Desk(node_id=node_id, up=False)
    desk.servo.power_on(START)
    heard = desk.wait(2.0)
    assert {each.source for each in heard} == {node_id}
    assert ALLOCATION not in {each.type_id for each in heard}
    assert desk.read("0x46") == node_id


@pytest.mark.states("B02")
def test_0_is_what_it_is_delivered_with_and_asks_for_one() -> None:
    desk = Desk(node_id=0)
    assert desk.servo.register(0x46) == 0
    assert {each.type_id for each in desk.wait(3.0)} == {ALLOCATION}


@pytest.mark.states("B96")
def test_a_new_node_id_is_used_from_the_next_start_on() -> None:
    desk = Desk(rom=QUIET)
    assert desk.write("0x46", 50) == 50
    assert desk.servo.node_id == 42
    desk.wait(5.0)
    assert {each.source for each in desk.heard} == {42}
    desk.opcode(0)
    desk.wait(0.3)
    assert desk.servo.node_id == 50


@pytest.mark.states("B96")
def test_without_a_save_a_start_brings_the_old_one_back() -> None:
    desk = Desk(rom=QUIET)
    desk.write("0x46", 50)
    desk.power_cycle()
    assert (desk.servo.node_id, desk.read("0x46")) == (42, 42)


@pytest.mark.states("B96", "B02")
def test_0_saved_makes_it_ask_from_the_next_start_on() -> None:
    desk = Desk(rom=QUIET)
    desk.write("0x46", 0)
    desk.write("0x12", 1)
    desk.wait(0.2)
    assert desk.servo.node_id == 0
    assert {each.type_id for each in desk.wait(3.0)} == {ALLOCATION}


@pytest.mark.states("B02")
@pytest.mark.parametrize("node_id", [-1, 128, 255])
def test_no_other_is_taken(node_id: int) -> None:
    desk = Desk(rom=QUIET)
    assert desk.write("0x46", node_id) is None
    assert desk.read("0x46") == 42
