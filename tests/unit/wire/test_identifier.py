"""Identifiers: the bits of the three forms, and values out of range."""

import re
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.wire.datatype import Kind
from hornbill.wire.identifier import (
    Identifier,
    make_anonymous_id,
    make_message_id,
    make_service_id,
    parse,
)

nodes = st.integers(1, 127)
priorities = st.integers(0, 31)


@given(priorities, st.integers(0, 0xFFFF), nodes)
def test_message_round_trip(priority: int, type_id: int, source: int) -> None:
    made = make_message_id(priority, type_id, source)
    assert parse(made) == Identifier(Kind.MESSAGE, type_id, source, 0, priority, None)


@given(priorities, st.integers(0, 0x3FFF), st.integers(0, 3))
def test_anonymous_round_trip(priority: int, discriminator: int, type_id: int) -> None:
    made = make_anonymous_id(priority, discriminator, type_id)
    assert parse(made) == Identifier(Kind.MESSAGE, type_id, 0, 0, priority, discriminator)


@given(priorities, st.integers(0, 0xFF), st.booleans(), nodes, nodes)
def test_service_round_trip(priority: int, type_id: int, request: bool, to: int, source: int) -> None:
    made = make_service_id(priority, type_id, request, to, source)
    kind = Kind.REQUEST if request else Kind.RESPONSE
    assert parse(made) == Identifier(kind, type_id, source, to, priority, None)


def test_worked_examples() -> None:
    assert make_message_id(24, 1, 127) == 0x1800017F
    assert make_anonymous_id(0, 10683, 1) == 0x00A6ED00
    assert make_service_id(16, 11, True, 52, 127) == 0x100BB4FF


def test_a_lower_number_wins_arbitration() -> None:
    stop = make_service_id(16, 11, True, 1, 127)
    read = make_service_id(24, 11, True, 1, 127)
    assert stop < read


@given(st.integers())
def test_any_number_parses(number: int) -> None:
    found = parse(number)
    assert 0 <= found.priority <= 31
    assert 0 <= found.source <= 127


@pytest.mark.parametrize(
    ("make", "fields", "refusal"),
    [
        (make_message_id, (32, 341, 1), "priority is 32. Enter 0 to 31."),
        (make_message_id, (-1, 341, 1), "priority is -1. Enter 0 to 31."),
        (make_message_id, (0, 65536, 1), "type_id is 65536. Enter 0 to 65535."),
        (make_message_id, (0, 341, 128), "source is 128. Enter a node ID, 1 to 127."),
        (make_message_id, (0, 341, 0), "source is 0. Enter a node ID, 1 to 127."),
        (make_anonymous_id, (32, 0, 1), "priority is 32. Enter 0 to 31."),
        (make_anonymous_id, (0, 0x4000, 1), "discriminator is 16384. Enter 0 to 16383."),
        (make_anonymous_id, (0, -1, 1), "discriminator is -1. Enter 0 to 16383."),
        (make_anonymous_id, (0, 0, 4), "type_id of an anonymous message is 4. Enter 0 to 3."),
        (make_service_id, (32, 1, True, 1, 1), "priority is 32. Enter 0 to 31."),
        (make_service_id, (0, 256, True, 1, 1), "type_id is 256. Enter 0 to 255."),
        (make_service_id, (0, 1, True, 0, 1), "destination is 0. Enter a node ID, 1 to 127."),
        (make_service_id, (0, 1, True, 1, 0), "source is 0. Enter a node ID, 1 to 127."),
        (make_service_id, (0, 1, True, 128, 1), "destination is 128. Enter a node ID, 1 to 127."),
        (make_service_id, (0, 1, True, 1, 128), "source is 128. Enter a node ID, 1 to 127."),
    ],
)
def test_a_refusal_names_field_value_and_limit(make: Callable[..., int], fields: tuple[int, ...], refusal: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(refusal)}$"):
        make(*fields)
