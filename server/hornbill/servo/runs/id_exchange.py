"""Exchange of IDs among servos: the writes of a plan, and their way back when it fails."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

from hornbill.errors import Conflict, HornbillError
from hornbill.servo.device.servo import Servo
from hornbill.units import Uid

AGAIN_S = 0.25
"""Interval of retries when IDs are put back: the other servos wait for the number."""


@dataclass(frozen=True, slots=True)
class IdMove:
    """One write of an ID row: its value before and after. 0 after: the servo is parked, another gets its number."""

    servo: Servo
    key: str
    before: int
    number: int

    @property
    def back(self) -> "IdMove":
        """The write that undoes it."""
        return replace(self, before=self.number, number=self.before)


WriteId: TypeAlias = Callable[[IdMove], Awaitable[None]]
"""One write, proved by a read-back: in RAM, or saved. Raises HornbillError when the servo does not hold the number."""


class IdExchange:
    """The ID writes of one run, one after the other as planned, and which of them are to be put back when it fails."""

    def __init__(self) -> None:
        self._made: list[IdMove] = []

    async def move(self, one: IdMove, write: WriteId) -> None:
        """Write one ID. Raises the problem of `write`.

        It counts as made before it is written: a write that failed may have arrived, and one that was cancelled ends.
        """
        self._made.append(one)
        await write(one)

    def settle(self, uid: Uid, key: str | None = None) -> None:
        """What a servo holds now, in this row or in all, stays and is not put back."""
        self._made = [one for one in self._made if one.servo.uid != uid or key not in (None, one.key)]

    def parked(self, key: str) -> list[IdMove]:
        """The writes that parked an ID of this row and may be put back."""
        return [one for one in self._made if one.key == key and one.number == 0]

    async def put_back(self, write: WriteId, within_s: float = 0.0) -> list[tuple[IdMove, HornbillError | None]]:
        """Put back, last first, through the same states: each write, and why it could not be undone.

        A number that its servo could not leave is given to no other. Each is tried until `within_s` is over, once at
        least.
        """
        until = asyncio.get_running_loop().time() + within_s
        held: set[tuple[str, int]] = set()
        found: list[tuple[IdMove, HornbillError | None]] = []
        for one in reversed(self._made):
            problem: HornbillError | None = Conflict(
                "another servo has it now", cause="servo_id_taken_meanwhile", servo_id=one.before
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
