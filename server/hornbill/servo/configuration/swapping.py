"""Owns Swap: ids passed round among servos, one write after the other, and back again when one fails."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass

from hornbill.errors import HornbillError
from hornbill.servo.configuration.ordering import moves
from hornbill.servo.configuration.writing import UNDO_WITHIN_S, Outcome
from hornbill.servo.hub import Happened, Hub
from hornbill.servo.servo import Servo
from hornbill.units import Uid

IDS = ("servo_id", "node_id")
"""Rows that hold one number a servo (sections 4.37, 4.38)."""

AGAIN_S = 0.25
"""A servo that fell silent, or says no for a while, is asked again: the others wait for the number it has."""

Ids = Mapping[Uid, int]


@dataclass(frozen=True, slots=True)
class Moved:
    """One write: what the row held before, and what it is to hold."""

    servo: Servo
    key: str
    before: int
    number: int


class Swap:
    """Writes ids in an order in which no two servos share one; `move` is one write, proved by a read-back."""

    def __init__(self, hub: Hub, move: Callable[[Moved], Awaitable[Outcome]]) -> None:
        self._hub = hub
        self._move = move

    async def run(self, servos: Mapping[Uid, Servo], ids: Mapping[str, tuple[Ids, Ids]]) -> HornbillError | None:
        """`ids`: by row, what the servos have now and what they want. None, or why everything was put back."""
        made: list[Moved] = []
        for key, (current, wanted) in ids.items():
            now = dict(current)
            for uid, number in moves(current, wanted):
                one = Moved(servos[uid], key, now[uid], number)
                made.append(one)
                failure = await self._try(one)
                if failure is not None:
                    await self._back(made)
                    return failure
                now[uid] = number
        return None

    async def _back(self, made: list[Moved]) -> None:
        """Last first, through the same states; the one that failed, too: whether it arrived is not known."""
        held: set[tuple[str, int]] = set()  # numbers that could not be left, and so not be given
        stuck: list[str] = []
        until = asyncio.get_running_loop().time() + UNDO_WITHIN_S
        for one in reversed(made):
            taken = one.before != 0 and (one.key, one.before) in held
            if taken or not await self._put_back(Moved(one.servo, one.key, one.number, one.before), until):
                held.add((one.key, one.number))
                stuck.append(f"{one.servo.title} ({one.key} {one.number} instead of {one.before})")
        if stuck:
            text = f"Ids that could not be put back: {', '.join(stuck)}. Read these servos, and write their ids anew."
            self._hub.tell(Happened("failure", "not_rolled_back", text))

    async def _put_back(self, one: Moved, until: float) -> bool:
        while await self._try(one) is not None:
            if asyncio.get_running_loop().time() >= until:
                return False
            await asyncio.sleep(AGAIN_S)
        return True

    async def _try(self, one: Moved) -> HornbillError | None:
        try:
            return (await self._move(one)).failure
        except HornbillError as error:
            return error
