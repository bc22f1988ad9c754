"""Section 2.3, GetSet (tables 2-14 to 2-16): by name or index, integers only, and how a servo refuses."""

import pytest

from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, Value, ValueKind, integer
from unit.sim.desk import TESTER, Desk

REFUSED = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")


@pytest.mark.states("B09", "B11", "B12")
@pytest.mark.parametrize(
    ("name", "index", "value", "expected"),
    [
        ("0x3E", 0, EMPTY, (80, "0x3E")),
        ("0x3E", 0, integer(60), (60, "0x3E")),
        ("", 0x2C, EMPTY, (40, "0x2C")),
        ("", 0x2C, integer(41), (41, "0x2C")),
        ("0x3E", 0x2C, EMPTY, (80, "0x3E")),
    ],
)
def test_a_response_has_the_value_after_the_request_and_the_name_which_takes_precedence_over_the_index(
    name: str, index: int, value: Value, expected: tuple[int, str]
) -> None:
    desk = Desk()
    raw, shown = expected
    assert desk.get_set(name, value, index=index) == GetSetResponse(integer(raw), EMPTY, EMPTY, EMPTY, shown)
    assert desk.read(shown) == raw


@pytest.mark.states("B09", "B10")
@pytest.mark.parametrize(
    ("name", "index"),
    [
        *((name, 0) for name in ("0x2a", "0X2A", "2A", "0x02A", " 0x2A", "0x2A ", "42", "0x", "x" * 92, "\x00")),
        *(("", index) for index in (0x60, 0x7F, 0x100, 0x12C, 0x1FFF)),
        ("nonsense", 0x2C),
    ],
)
def test_other_spellings_and_indices_are_refused(name: str, index: int) -> None:
    assert Desk().get_set(name, index=index) == REFUSED


@pytest.mark.states("B13")
@pytest.mark.parametrize("kind", [ValueKind.REAL, ValueKind.BOOLEAN, ValueKind.STRING])
def test_values_other_than_integers_are_refused(kind: ValueKind) -> None:
    desk = Desk()
    value = Value(kind, "60" if kind is ValueKind.STRING else 60)
    assert desk.get_set("0x3E", value) == REFUSED
    assert desk.read("0x3E") == 80


@pytest.mark.parametrize("priority", [0, 16, 31])
def test_the_response_has_the_priority_of_the_request(priority: int) -> None:
    (response,) = Desk().send(GetSetRequest(0, EMPTY, "0x50"), priority=priority)
    assert (response.priority, response.destination, response.source) == (priority, TESTER, 42)


def test_a_request_to_another_node_has_no_response() -> None:
    desk, other = Desk(), Desk(node_id=43)
    assert other.get_set("0x50") is not None
    assert desk.raw_frames(other.frames_of(GetSetRequest(0, EMPTY, "0x50"))) == []


@pytest.mark.states("B10")
def test_a_refused_key_fails_although_the_servo_has_it() -> None:
    desk = Desk()
    desk.servo.conditions.refuse_keys.add("angle_p_gain")
    assert desk.get_set("0x2C") == desk.get_set("0x2C", integer(50)) == REFUSED
    desk.servo.conditions.refuse_keys.clear()
    assert desk.read("0x2C") == 40


def test_requests_are_executed_although_about_the_given_share_of_responses_is_lost() -> None:
    desk = Desk()
    desk.servo.conditions.drop_responses_pct = 100.0
    assert desk.get_set("0x3E", integer(50)) is None
    desk.servo.conditions.drop_responses_pct = 0.0
    assert desk.read("0x3E") == 50
    desk.servo.conditions.drop_responses_pct = 30.0
    assert 240 < sum(desk.get_set("0x50") is None for _ in range(1000)) < 360
