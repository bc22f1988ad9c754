"""The order of commissioning: no two servos ever share an ID, and every servo gets its turn."""

from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.errors import Conflict, InvalidValue
from hornbill.servo.runs.commission_request import Wanted, check_wanted
from hornbill.servo.runs.id_order import IdTurn, order_ids
from hornbill.units import Uid


def stages(
    wanted: list[Wanted], servo_ids: Mapping[Uid, int | None], node_ids: Mapping[Uid, int | None]
) -> list[IdTurn]:
    return order_ids({one.uid: one.ids for one in wanted}, {"node_id": node_ids, "servo_id": servo_ids})


@st.composite
def scenes(draw: st.DrawFn) -> tuple[list[Wanted], dict[Uid, int | None], dict[Uid, int | None]]:
    """Servos with ids (0: none), and what they are to become; a servo that is not to change an id may keep it only
    when no other is to get it, as Commissioning requires before it plans.
    """
    count = draw(st.integers(1, 7))
    uids = [Uid(f"{place:032x}") for place in range(count)]

    def now() -> dict[Uid, int | None]:
        numbers = draw(st.lists(st.integers(1, 9), min_size=count, max_size=count, unique=True))
        return {uid: draw(st.sampled_from([number, 0])) for uid, number in zip(uids, numbers, strict=True)}

    def goal(held: dict[Uid, int | None]) -> dict[Uid, int | None]:
        numbers = draw(st.lists(st.integers(1, 9), min_size=count, max_size=count, unique=True))
        chosen = {uid: draw(st.sampled_from([number, number, None])) for uid, number in zip(uids, numbers, strict=True)}
        kept = {held[uid] for uid in uids if chosen[uid] is None}
        return {uid: 0 if number in kept else number for uid, number in chosen.items()}

    servo_ids, node_ids = now(), now()
    servos, nodes = goal(servo_ids), goal(node_ids)
    return [Wanted(uid, servos[uid], nodes[uid]) for uid in uids], servo_ids, node_ids


@given(scenes())
def test_no_two_servos_ever_share_an_id(
    scene: tuple[list[Wanted], dict[Uid, int | None], dict[Uid, int | None]],
) -> None:
    wanted, servo_ids, node_ids = scene
    by_uid = {one.uid: one for one in wanted}
    servos, nodes = dict(servo_ids), dict(node_ids)
    found = stages(wanted, servo_ids, node_ids)
    for stage in found:
        one = by_uid[stage.uid]
        if stage.parked == "servo_id":
            servos[stage.uid] = 0
        elif stage.parked == "node_id":
            nodes[stage.uid] = 0
        else:
            servos[stage.uid] = servos[stage.uid] if one.servo_id is None else one.servo_id
            nodes[stage.uid] = nodes[stage.uid] if one.node_id is None else one.node_id
        for held in (servos, nodes):
            given_ids = [number for number in held.values() if number]
            assert len(given_ids) == len(set(given_ids)), (found, stage)
    assert sorted(stage.uid for stage in found if stage.parked is None) == sorted(by_uid)
    assert sum(stage.parked == "node_id" for stage in found) <= len(wanted) // 2


A, B, C = (Uid(letter * 32) for letter in "abc")


def test_new_servos_keep_their_order() -> None:
    wanted = [Wanted(uid, place) for place, uid in enumerate((C, A, B), start=1)]
    no_ids = dict.fromkeys((A, B, C), 0)
    assert stages(wanted, no_ids, {A: 125, B: 124, C: 123}) == [
        IdTurn(C),
        IdTurn(A),
        IdTurn(B),
    ]


def test_a_chain_needs_no_parked_servo_and_a_cycle_one() -> None:
    chain = stages([Wanted(A, 2), Wanted(B, 3)], {A: 1, B: 2}, {})
    assert chain == [IdTurn(B), IdTurn(A)]
    cycle = stages([Wanted(A, 2), Wanted(B, 1)], {A: 1, B: 2}, {})
    assert cycle == [IdTurn(B, "servo_id"), IdTurn(A), IdTurn(B)]


def test_a_cycle_of_node_ids_needs_one_parked_servo() -> None:
    wanted = [Wanted(A, None, 12), Wanted(B, None, 13), Wanted(C, None, 11)]
    assert stages(wanted, {}, {A: 11, B: 12, C: 13}) == [
        IdTurn(B, "node_id"),
        IdTurn(A),
        IdTurn(C),
        IdTurn(B),
    ]


def test_an_id_wanted_twice_is_a_conflict_that_names_the_first_servo() -> None:
    with pytest.raises(Conflict) as caught:
        check_wanted([Wanted(A, 1, 20), Wanted(B, 2, 20)])
    assert (caught.value.facts["key"], caught.value.facts["owner"]) == ("node_id", A)
    with pytest.raises(InvalidValue, match="listed twice"):
        check_wanted([Wanted(A, 1), Wanted(A, 2)])
    check_wanted([Wanted(A, None, 0), Wanted(B, None, 0), Wanted(C)])
