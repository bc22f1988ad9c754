"""Section 2.3, GetSet (tables 2-14 to 2-16): by name or index, integers only, and how a servo says no."""

import pytest

from hornbill.sim.behaviour import Behaviour
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, Value, ValueKind, integer
from unit.sim.desk import TESTER, Desk

FAIL = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")


@pytest.mark.states("B09", "B12")
def test_a_read_answers_value_and_name_and_nothing_else() -> None:
    assert Desk().get_set("0x3E") == GetSetResponse(integer(80), EMPTY, EMPTY, EMPTY, "0x3E")


@pytest.mark.states("B11", "B12")
def test_a_write_answers_the_value_after_it() -> None:
    desk = Desk()
    assert desk.get_set("0x3E", integer(60)) == GetSetResponse(integer(60), EMPTY, EMPTY, EMPTY, "0x3E")
    assert desk.read("0x3E") == 60


@pytest.mark.states("B09")
def test_an_index_is_the_number_in_the_name_and_is_answered_with_the_name() -> None:
    desk = Desk()
    assert desk.get_set("", index=0x2C) == GetSetResponse(integer(40), EMPTY, EMPTY, EMPTY, "0x2C")
    assert desk.get_set("", integer(41), index=0x2C) == GetSetResponse(integer(41), EMPTY, EMPTY, EMPTY, "0x2C")


@pytest.mark.states("B09", "B10")
def test_a_name_wins_over_the_index() -> None:
    desk = Desk()
    assert desk.get_set("0x3E", index=0x2C) == GetSetResponse(integer(80), EMPTY, EMPTY, EMPTY, "0x3E")
    assert desk.get_set("nonsense", index=0x2C) == FAIL


@pytest.mark.states("B10")
@pytest.mark.parametrize("name", ["0x2a", "0X2A", "2A", "0x02A", " 0x2A", "0x2A ", "42", "0x", "x" * 92, "\x00"])
def test_only_the_printed_spelling_is_a_name(name: str) -> None:
    assert Desk().get_set(name) == FAIL


def test_a_switch_takes_lower_case_and_answers_the_printed_name() -> None:
    desk = Desk(behaviour=Behaviour(lower_case_names=True))
    answer = desk.get_set("0x2a")
    assert answer is not None
    assert answer.name == "0x2A"


@pytest.mark.states("B10")
@pytest.mark.parametrize("index", [0x60, 0x7F, 0x100, 0x12C, 0x1FFF])
def test_an_index_beyond_the_list_fails(index: int) -> None:
    assert Desk().get_set("", index=index) == FAIL


@pytest.mark.states("B13")
@pytest.mark.parametrize("kind", [ValueKind.REAL, ValueKind.BOOLEAN, ValueKind.STRING])
def test_other_kinds_than_integers_fail_and_change_nothing(kind: ValueKind) -> None:
    desk = Desk()
    value = Value(kind, "60" if kind is ValueKind.STRING else 60)
    assert desk.get_set("0x3E", value) == FAIL
    assert desk.read("0x3E") == 80


def test_the_answer_has_priority_and_transfer_id_of_the_request() -> None:
    desk = Desk()
    for priority in (0, 16, 31):
        (answer,) = desk.send(GetSetRequest(0, EMPTY, "0x50"), priority=priority)
        assert (answer.priority, answer.destination, answer.source) == (priority, TESTER, 42)


def test_a_request_to_another_node_is_not_answered() -> None:
    desk, other = Desk(), Desk(node_id=43)
    assert other.get_set("0x50") is not None
    frames = other.frames_of(GetSetRequest(0, EMPTY, "0x50"))
    assert desk.raw_frames(frames) == []


@pytest.mark.states("B10")
def test_a_refused_key_fails_though_the_servo_has_it() -> None:
    desk = Desk()
    desk.servo.conditions.refuse_keys.add("angle_p_gain")
    assert desk.get_set("0x2C") == FAIL
    assert desk.get_set("0x2C", integer(50)) == FAIL
    desk.servo.conditions.refuse_keys.clear()
    assert desk.read("0x2C") == 40


def test_lost_answers_are_acted_on_all_the_same() -> None:
    desk = Desk()
    desk.servo.conditions.drop_responses_pct = 100.0
    assert desk.get_set("0x3E", integer(50)) is None
    desk.servo.conditions.drop_responses_pct = 0.0
    assert desk.read("0x3E") == 50


def test_about_the_asked_share_of_answers_is_lost() -> None:
    desk = Desk()
    desk.servo.conditions.drop_responses_pct = 30.0
    lost = sum(desk.get_set("0x50") is None for _ in range(1000))
    assert 240 < lost < 360
