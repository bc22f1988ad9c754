"""Order in which servos get new IDs, so that no two share one in between. 0 may be shared."""

from collections.abc import Mapping
from dataclasses import dataclass

from hornbill.errors import Conflict
from hornbill.units import Uid


@dataclass(frozen=True, slots=True)
class IdTurn:
    """One servo's turn. `parked` None: all its rows get their new values. Otherwise only that row is set to 0, because
    another servo gets its number first.
    """

    uid: Uid
    parked: str | None = None


def order_ids(
    wanted: Mapping[Uid, Mapping[str, int | None]],
    held: Mapping[str, Mapping[Uid, int | None]],
    *,
    first_yields: bool = False,
) -> list[IdTurn]:
    """The turns, in the order of `wanted` as far as IDs allow.

    `wanted`: by servo, the number of each row; None leaves it unchanged. `held`: by row, the present number of each
    servo; the row that takes longest to park comes first. A servo waits while a later one has its number. If all wait,
    the servo that the first waits for is parked, or with `first_yields` the first itself: an extra turn. No number may
    be requested twice, or belong to a servo that is not in `wanted`.
    """
    now = {row: {uid: number for uid, number in numbers.items() if number} for row, numbers in held.items()}
    waiting = list(wanted)
    found: list[IdTurn] = []
    while waiting:
        turn = _next_turn(waiting, wanted, now, first_yields=first_yields)
        found.append(turn)
        if turn.parked is None:
            waiting.remove(turn.uid)
        else:
            del now[turn.parked][turn.uid]
    return found


def _next_turn(
    waiting: list[Uid],
    wanted: Mapping[Uid, Mapping[str, int | None]],
    now: Mapping[str, Mapping[Uid, int]],
    *,
    first_yields: bool,
) -> IdTurn:
    def blocker(uid: Uid, row: str) -> Uid | None:
        number = wanted[uid].get(row)
        others = (other for other in waiting if other != uid and now[row].get(other) == number)
        return next(others, None) if number else None

    ready = waiting
    for row in now:
        free = [uid for uid in ready if blocker(uid, row) is None]
        if not free:
            yielding = ready[0] if first_yields else blocker(ready[0], row)
            assert yielding is not None
            return IdTurn(yielding, row)
        ready = free
    return IdTurn(ready[0])


def moves(current: Mapping[Uid, int], wanted: Mapping[Uid, int]) -> list[tuple[Uid, int]]:
    """The writes of one row, in an order in which no two servos ever share a number other than 0.

    `current`: present numbers of all servos, changing or not; a servo only in `wanted` has 0. Raises the errors of
    `check_ids`.
    """
    check_ids(current, wanted)
    changing = {uid: {"id": number} for uid, number in wanted.items() if number != current.get(uid, 0)}
    turns = order_ids(changing, {"id": current}, first_yields=True)
    return [(turn.uid, wanted[turn.uid] if turn.parked is None else 0) for turn in turns]


def check_ids(current: Mapping[Uid, int], wanted: Mapping[Uid, int]) -> None:
    """Raises Conflict if two servos request the same number of a row, or one that another servo retains.

    Facts: requested, owner, uids (the requesting servos).
    """
    stays = {number: uid for uid, number in current.items() if uid not in wanted}
    wanting: dict[int, Uid] = {}
    for uid, number in wanted.items():
        if number == 0:
            continue
        if number in wanting:
            raise Conflict(
                f"ID {number} was requested twice. Assign a different ID to each servo.",
                requested=number, owner=wanting[number], uids=[wanting[number], uid], cause="duplicate_id",
            )  # fmt: skip
        wanting[number] = uid
        if number in stays:
            raise Conflict(
                f"ID {number} is in use by a servo that is not changed. Choose another ID, or change that servo too.",
                requested=number, owner=stays[number], uids=[uid], cause="id_used_by_other_servo",
            )  # fmt: skip
