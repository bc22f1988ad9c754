"""Owns the order of commissioning: which servo comes when, and which must step aside first, so that no id clashes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from hornbill.errors import Conflict, InvalidValue
from hornbill.units import Uid

Kind: TypeAlias = Literal["unit", "aside", "away"]


@dataclass(frozen=True, slots=True)
class Wanted:
    """What one servo is to become. None and "" leave as it is; `node_id` 0 is dynamic."""

    uid: Uid
    servo_id: int | None = None
    node_id: int | None = None
    label: str = ""


@dataclass(frozen=True, slots=True)
class Stage:
    """One thing to do. `unit`: all of one servo. Before it, of a servo that comes later and has its id: `aside`, its
    servo id becomes 0 in RAM (section 4.37); `away`, its node id becomes dynamic, which takes a save (section 4.38).
    """

    kind: Kind
    uid: Uid


def check_unique(wanted: Sequence[Wanted]) -> None:
    """Raises InvalidValue for a servo named twice, Conflict for an id asked for twice; the owner is the first."""
    named: set[Uid] = set()
    owners: dict[tuple[str, int], Uid] = {}
    for one in wanted:
        if one.uid in named:
            raise InvalidValue(f"Servo {one.uid} is named twice. Name each once.", uid=one.uid)
        named.add(one.uid)
        for key, number in (("servo_id", one.servo_id), ("node_id", one.node_id)):
            owner = owners.setdefault((key, number or 0), one.uid)
            if number and owner != one.uid:
                raise Conflict(
                    f"{key.replace('_', ' ').capitalize()} {number} is asked for by two servos, {owner[:8]} and "
                    f"{one.uid[:8]}. Give each one of its own.",
                    key=key, requested=number, owner=owner, owner_title=f"servo {owner[:8]}",
                )  # fmt: skip


def stages(
    wanted: Sequence[Wanted], servo_ids: Mapping[Uid, int | None], node_ids: Mapping[Uid, int | None]
) -> list[Stage]:
    """The stages in their order, which is that of `wanted` as far as ids allow.

    `servo_ids` are what RAM holds now, `node_ids` what each is on now. A node id changes at a servo's restart alone,
    so whoever is on one that is wanted comes before who wants it, and one of a cycle goes away first. A servo id
    changes at once, so its holder steps aside. Both kinds are ordered together: that is why this is not
    `ordering.moves`, which orders one.
    """
    waiting = list(wanted)
    servos = {uid: number for uid, number in servo_ids.items() if number}
    nodes = {uid: number for uid, number in node_ids.items() if number}
    found: list[Stage] = []
    while waiting:
        free = [one for one in waiting if _holder(waiting, nodes, one, one.node_id) is None]
        if not free:
            holder = next(uid for one in waiting if (uid := _holder(waiting, nodes, one, one.node_id)) is not None)
            found.append(Stage("away", holder))
            del nodes[holder]
            continue
        chosen = next((one for one in free if _holder(waiting, servos, one, one.servo_id) is None), free[0])
        holder = _holder(waiting, servos, chosen, chosen.servo_id)
        if holder is not None:
            found.append(Stage("aside", holder))
            del servos[holder]
        found.append(Stage("unit", chosen.uid))
        waiting.remove(chosen)
    return found


def _holder(waiting: Sequence[Wanted], held: Mapping[Uid, int], one: Wanted, number: int | None) -> Uid | None:
    """Who of the others that are still to come has this number."""
    if not number:
        return None
    return next((other.uid for other in waiting if other.uid != one.uid and held.get(other.uid) == number), None)
