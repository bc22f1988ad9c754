"""Owns the order in which ids are given, so that no two servos share one on the way."""

from collections import Counter
from collections.abc import Collection, Mapping

from hornbill.errors import Conflict
from hornbill.units import Uid


def moves(
    current: Mapping[Uid, int], wanted: Mapping[Uid, int], *, taken: Collection[int] = (), parking: int = 0
) -> list[tuple[Uid, int]]:
    """The ids to give, one after the other, so that at no moment two servos share one other than `parking`.

    `current` are the ids there are now, of servos that move and of those that stay; one that is in `wanted` alone
    has `parking`. `taken` are ids of others. `parking` is what any number may have: 0, unprovisioned in 0x45
    (section 4.37), dynamic in 0x46 (section 4.38). Chains are followed from their free end; a cycle is opened by
    parking one of its servos, which is its one extra move.

    Raises Conflict when two want the same id, or one wants what stays with somebody else; facts: requested, owner,
    uids (who wants it).
    """
    _check(current, wanted, taken, parking)
    now = {uid: current.get(uid, parking) for uid in {**current, **wanted}}
    held = Counter(now.values())
    waiting = {uid: number for uid, number in wanted.items() if now[uid] != number}
    found: list[tuple[Uid, int]] = []

    def give(uid: Uid, number: int) -> None:
        held[now[uid]] -= 1
        held[number] += 1
        now[uid] = number
        found.append((uid, number))

    while waiting:
        free = [uid for uid, number in waiting.items() if number == parking or not held[number]]
        for uid in free:
            give(uid, waiting.pop(uid))
        if not free:  # what is left are cycles
            give(next(uid for uid in waiting if now[uid] != parking), parking)
    return found


def _check(current: Mapping[Uid, int], wanted: Mapping[Uid, int], taken: Collection[int], parking: int) -> None:
    stays = {number: uid for uid, number in current.items() if uid not in wanted}
    wanting: dict[int, Uid] = {}
    for uid, number in wanted.items():
        if number == parking:
            continue
        if number in wanting:
            raise Conflict(
                f"Id {number} was asked for twice. Give each servo one of its own.",
                requested=number, owner=wanting[number], uids=[wanting[number], uid],
            )  # fmt: skip
        wanting[number] = uid
        if number in stays or number in taken:
            raise Conflict(
                f"Id {number} belongs to another servo, which keeps it. Choose another, or change that one as well.",
                requested=number, owner=stays.get(number), uids=[uid],
            )  # fmt: skip
