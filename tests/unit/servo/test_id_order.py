"""The order in which servos get new IDs: no two ever share one, and no more are parked than needed."""

from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.errors import Conflict, InvalidValue
from hornbill.servo.runs.commission_request import Wanted, check_wanted
from hornbill.servo.runs.id_order import IdTurn, moves, order_ids
from hornbill.units import Uid

Ids = Mapping[Uid, int]
UIDS = [Uid(f"{number:032x}") for number in range(12)]
A, B, C = UIDS[:3]


def assert_unique(held: Ids, *shown: object) -> None:
    """Every ID but 0 is unique."""
    numbers = [number for number in held.values() if number]
    assert len(numbers) == len(set(numbers)), shown


def cycles(current: Ids, wanted: Ids) -> int:
    """The number of cycles of servos in which each is to get the ID of the next."""
    owner = {number: uid for uid, number in current.items() if number}
    count, seen = 0, set[Uid]()
    for start in wanted:
        path: list[Uid] = []
        uid: Uid | None = start
        while uid is not None and uid not in seen and wanted.get(uid, current.get(uid)) != current.get(uid):
            seen.add(uid)
            path.append(uid)
            uid = owner.get(wanted[uid])
        count += uid in path
    return count


@st.composite
def rearrangements(draw: st.DrawFn) -> tuple[Ids, Ids]:
    """Present IDs, some 0, and valid new IDs of any of the servos."""
    uids = UIDS[: draw(st.integers(1, len(UIDS)))]
    places = draw(st.permutations(range(1, 16)))
    current = {uid: draw(st.sampled_from((0, place, place, place))) for uid, place in zip(uids, places, strict=False)}
    movers = draw(st.lists(st.sampled_from(uids), unique=True))
    stay = {number for uid, number in current.items() if uid not in movers}
    free = draw(st.permutations([number for number in range(1, 16) if number not in stay]))
    own = draw(st.booleans())  # a pure exchange among themselves makes the most cycles
    pool = draw(st.permutations([current[uid] for uid in movers])) if own else free
    return current, dict(zip(movers, pool, strict=False))


@given(rearrangements())
def test_no_two_servos_share_an_id_and_each_cycle_takes_one_more_move(case: tuple[Ids, Ids]) -> None:
    current, wanted = case
    found, now = moves(current, wanted), dict(current)
    for uid, number in found:
        assert now.get(uid, 0) != number, "a move that moves nothing"
        now[uid] = number
        assert_unique(now, uid, number)
    assert now == {**current, **wanted}
    needed = sum(current[uid] != number for uid, number in wanted.items())
    assert len(found) == needed + cycles(current, wanted)


@pytest.mark.parametrize(
    ("current", "wanted", "found"),
    [
        ({A: 1, B: 2, C: 3}, {A: 2, B: 3, C: 4}, [(C, 4), (B, 3), (A, 2)]),
        ({A: 1, B: 2}, {A: 2, B: 1}, [(A, 0), (B, 1), (A, 2)]),
        ({A: 0, B: 0}, {A: 1, B: 0, C: 2}, [(A, 1), (C, 2)]),
    ],
    ids=["a chain from its free end", "a swap parks one", "several have none"],
)
def test_moves_of_one_row(current: Ids, wanted: Ids, found: list[tuple[Uid, int]]) -> None:
    assert moves(current, wanted) == found


@pytest.mark.parametrize(
    "wanted", [{A: 5, B: 5}, {A: 2}, {A: 2, B: 2}], ids=["wanted twice", "kept by another", "requested by its owner"]
)
def test_an_id_wanted_twice_is_a_conflict(wanted: Ids) -> None:
    with pytest.raises(Conflict) as caught:
        moves({A: 1, B: 2}, wanted)
    assert caught.value.facts["requested"] in wanted.values()
    assert A in caught.value.facts["uids"]  # pyright: ignore[reportOperatorIssue]


# Commissioning changes two rows of a servo in one turn.


def turns(wanted: list[Wanted], servo_ids: Ids, node_ids: Ids) -> list[IdTurn]:
    return order_ids({one.uid: one.ids for one in wanted}, {"node_id": node_ids, "servo_id": servo_ids})


@st.composite
def commissionings(draw: st.DrawFn) -> tuple[list[Wanted], Ids, Ids]:
    """Servos with ids (0: none), and what they are to become; a servo that is not to change an id may keep it only
    when no other is to get it, as Commissioning requires before it plans.
    """
    uids = UIDS[: draw(st.integers(1, 7))]
    numbers = st.lists(st.integers(1, 9), min_size=len(uids), max_size=len(uids), unique=True)

    def now() -> Ids:
        return {uid: draw(st.sampled_from([number, 0])) for uid, number in zip(uids, draw(numbers), strict=True)}

    def goal(held: Ids) -> Mapping[Uid, int | None]:
        chosen = {uid: draw(st.sampled_from([one, one, None])) for uid, one in zip(uids, draw(numbers), strict=True)}
        kept = {held[uid] for uid in uids if chosen[uid] is None}
        return {uid: 0 if number in kept else number for uid, number in chosen.items()}

    servo_ids, node_ids = now(), now()
    servos, nodes = goal(servo_ids), goal(node_ids)
    return [Wanted(uid, servos[uid], nodes[uid]) for uid in uids], servo_ids, node_ids


@given(commissionings())
def test_no_two_commissioned_servos_share_an_id(scene: tuple[list[Wanted], Ids, Ids]) -> None:
    wanted, *rows = scene
    by_uid = {one.uid: one for one in wanted}
    held = {"servo_id": dict(rows[0]), "node_id": dict(rows[1])}
    found = turns(wanted, *rows)
    for turn in found:
        for key, now in held.items():
            number = by_uid[turn.uid].ids.get(key)
            if turn.parked == key:
                now[turn.uid] = 0
            elif turn.parked is None and number is not None:
                now[turn.uid] = number
            assert_unique(now, found, turn)
    assert sorted(turn.uid for turn in found if turn.parked is None) == sorted(by_uid)
    assert sum(turn.parked == "node_id" for turn in found) <= len(wanted) // 2


@pytest.mark.parametrize(
    ("wanted", "servo_ids", "node_ids", "expected"),
    [
        (
            [Wanted(C, 1), Wanted(A, 2), Wanted(B, 3)], {A: 0, B: 0, C: 0}, {A: 125, B: 124, C: 123},
            [IdTurn(C), IdTurn(A), IdTurn(B)],
        ),
        ([Wanted(A, 2), Wanted(B, 3)], {A: 1, B: 2}, {}, [IdTurn(B), IdTurn(A)]),
        ([Wanted(A, 2), Wanted(B, 1)], {A: 1, B: 2}, {}, [IdTurn(B, "servo_id"), IdTurn(A), IdTurn(B)]),
        (
            [Wanted(A, None, 12), Wanted(B, None, 13), Wanted(C, None, 11)], {}, {A: 11, B: 12, C: 13},
            [IdTurn(B, "node_id"), IdTurn(A), IdTurn(C), IdTurn(B)],
        ),
    ],
    ids=["new servos keep their order", "a chain parks none", "a cycle parks one", "a cycle of node IDs parks one"],
)  # fmt: skip
def test_the_order_of_commissioning(
    wanted: list[Wanted], servo_ids: Ids, node_ids: Ids, expected: list[IdTurn]
) -> None:
    assert turns(wanted, servo_ids, node_ids) == expected


def test_an_id_wanted_twice_in_a_commissioning_is_a_conflict_that_names_the_first_servo() -> None:
    with pytest.raises(Conflict) as caught:
        check_wanted([Wanted(A, 1, 20), Wanted(B, 2, 20)])
    assert (caught.value.facts["key"], caught.value.facts["owner"]) == ("node_id", A)
    with pytest.raises(InvalidValue, match="listed twice"):
        check_wanted([Wanted(A, 1), Wanted(A, 2)])
    check_wanted([Wanted(A, None, 0), Wanted(B, None, 0), Wanted(C)])
