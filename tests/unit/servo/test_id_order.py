"""The order in which IDs are exchanged: no two servos ever share one."""

from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.errors import Conflict
from hornbill.servo.runs.id_order import moves
from hornbill.units import Uid

Ids = Mapping[Uid, int]
UIDS = [Uid(f"{number:032x}") for number in range(12)]
A, B, C = UIDS[:3]


def follow(current: Ids, found: list[tuple[Uid, int]]) -> dict[Uid, int]:
    """Make the moves; after each, every ID but 0 is unique."""
    now = dict(current)
    for uid, number in found:
        assert now.get(uid, 0) != number, "a move that moves nothing"
        now[uid] = number
        given_ids = [one for one in now.values() if one]
        assert len(given_ids) == len(set(given_ids)), (uid, number, now)
    return now


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
def test_no_two_servos_ever_share_an_id(case: tuple[Ids, Ids]) -> None:
    current, wanted = case
    found = moves(current, wanted)
    assert follow(current, found) == {**current, **wanted}


@given(rearrangements())
def test_there_is_one_additional_move_for_each_cycle(case: tuple[Ids, Ids]) -> None:
    current, wanted = case
    needed = sum(current[uid] != number for uid, number in wanted.items())
    assert len(moves(current, wanted)) == needed + cycles(current, wanted)


@given(st.permutations(range(1, 13)))
def test_any_permutation_of_twelve(target: list[int]) -> None:
    current = {uid: number for number, uid in enumerate(UIDS, 1)}
    wanted = dict(zip(UIDS, target, strict=True))
    assert follow(current, moves(current, wanted)) == wanted


def test_a_chain_is_followed_from_its_free_end() -> None:
    assert moves({A: 1, B: 2, C: 3}, {A: 2, B: 3, C: 4}) == [(C, 4), (B, 3), (A, 2)]


def test_a_swap_is_opened_by_parking_one() -> None:
    assert moves({A: 1, B: 2}, {A: 2, B: 1}) == [(A, 0), (B, 1), (A, 2)]


def test_several_servos_may_have_no_id() -> None:
    assert moves({A: 0, B: 0}, {A: 1, B: 0, C: 2}) == [(A, 1), (C, 2)]


@pytest.mark.parametrize(
    ("current", "wanted"),
    [
        ({A: 1, B: 2}, {A: 5, B: 5}),
        ({A: 1, B: 2}, {A: 2}),
        ({A: 1, B: 2}, {A: 2, B: 2}),
    ],
    ids=["wanted twice", "kept by another", "requested by its owner"],
)
def test_an_id_wanted_twice_is_a_conflict(current: Ids, wanted: Ids) -> None:
    with pytest.raises(Conflict) as caught:
        moves(current, wanted)
    assert caught.value.facts["requested"] in wanted.values()
    assert A in caught.value.facts["uids"]  # pyright: ignore[reportOperatorIssue]
