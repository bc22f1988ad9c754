"""Exchange of IDs among servos: the writes of a plan, and their rollback."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

from hornbill.errors import Conflict, HornbillError
from hornbill.servo.device.servo import Servo
from hornbill.units import Uid

AGAIN_S = 0.25
"""Interval of retries in a rollback, while other servos wait for the number."""


@dataclass(frozen=True, slots=True)
class IdMove:
    """One write of an ID row, with its previous value. `number` 0: the servo is parked, and another gets its number."""

    servo: Servo
    key: str
    before: int
    number: int

    @property
    def back(self) -> "IdMove":
        """The write that undoes it."""
        return replace(self, before=self.number, number=self.before)


WriteId: TypeAlias = Callable[[IdMove], Awaitable[None]]
"""One write, verified by a read-back, in RAM only or saved. Raises HornbillError if the number was not accepted."""


class IdExchange:
    """The ID writes of one run, in the planned order, and those to roll back after a failure."""

    def __init__(self) -> None:
        self._made: list[IdMove] = []

    async def move(self, one: IdMove, write: WriteId) -> None:
        """Write one ID. Raises the error of `write`.

        It is recorded before the write, because a failed or cancelled write may have arrived.
        """
        self._made.append(one)
        await write(one)

    def settle(self, uid: Uid, key: str | None = None) -> None:
        """Exclude a servo's ID, in this row or in all, from a rollback."""
        self._made = [one for one in self._made if one.servo.uid != uid or key not in (None, one.key)]

    def parked(self, key: str) -> list[IdMove]:
        """The writes that parked an ID of this row and would be rolled back."""
        return [one for one in self._made if one.key == key and one.number == 0]

    async def roll_back(self, write: WriteId, within_s: float = 0.0) -> list[tuple[IdMove, HornbillError | None]]:
        """Undo all writes in reverse order. Returns each write, with its problem if it could not be undone.

        A number that its servo could not free is not given to another. Each write is tried for `within_s`, at least
        once.
        """
        until = asyncio.get_running_loop().time() + within_s
        held: set[tuple[str, int]] = set()
        found: list[tuple[IdMove, HornbillError | None]] = []
        for one in reversed(self._made):
            problem: HornbillError | None = Conflict(
                "another servo uses it now", cause="servo_id_in_use", servo_id=one.before
            )
            if one.before == 0 or (one.key, one.before) not in held:
                problem = await _until_written(one.back, write, until)
            if problem is not None:
                held.add((one.key, one.number))
            found.append((one, problem))
        self._made = []
        return found


async def _until_written(one: IdMove, write: WriteId, until: float) -> HornbillError | None:
    while True:
        try:
            await write(one)
        except HornbillError as problem:
            if asyncio.get_running_loop().time() >= until:
                return problem
        else:
            return None
        await asyncio.sleep(AGAIN_S)
