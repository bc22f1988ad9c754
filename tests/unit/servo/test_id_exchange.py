"""An exchange of IDs that fails: what is restored, in which order, and what remains."""

from typing import cast

import pytest

import jumping_clock as clock
from hornbill.errors import HornbillError, NoResponse
from hornbill.servo.device.servo import Servo
from hornbill.servo.runs.id_exchange import IdExchange, IdMove
from hornbill.units import Uid


class Named:
    """The part of a servo that an exchange uses."""

    def __init__(self, name: str) -> None:
        self.uid = Uid(name * 32)


A, B = (cast("Servo", Named(name)) for name in "ab")
PARK_A = IdMove(A, "servo_id", 1, 0)
B_TAKES_1 = IdMove(B, "servo_id", 2, 1)
A_TAKES_2 = IdMove(A, "servo_id", 0, 2)


class Writes:
    """Every write in order; the first `silent` to a servo of `refusing` fail."""

    def __init__(self, refusing: Servo | None = None, silent: int = 99) -> None:
        self.done: list[tuple[str, int]] = []
        self.refusing = refusing
        self.silent = silent

    async def __call__(self, one: IdMove) -> None:
        if one.servo is self.refusing and self.silent > 0:
            self.silent -= 1
            raise NoResponse("silent", cause=None)
        self.done.append((one.servo.uid[:1], one.number))


def undone(writes: Writes, *moves: IdMove, within_s: float = 0.0, settled: Servo | None = None) -> list[HornbillError]:
    """Make the moves, undo them with `writes`, and return why some remain."""

    async def inside() -> list[HornbillError]:
        exchange, well = IdExchange(), Writes()
        for move in moves:
            await exchange.move(move, well)
        if settled is not None:
            exchange.settle(settled.uid)
        found = await exchange.roll_back(writes, within_s)
        assert await exchange.roll_back(writes) == [], "it is put back once"
        return [problem for _, problem in found if problem is not None]

    return clock.run(inside())


def test_moves_are_undone_in_reverse_order() -> None:
    writes = Writes()
    assert undone(writes, PARK_A, B_TAKES_1, A_TAKES_2) == []
    assert writes.done == [("a", 0), ("b", 2), ("a", 1)]


def test_an_id_that_its_servo_still_has_is_not_given_to_another() -> None:
    writes = Writes(refusing=B)
    problems = undone(writes, PARK_A, B_TAKES_1)
    assert [one.detail for one in problems] == ["another servo uses it now", "silent"][::-1]
    assert writes.done == []


def test_undoing_is_retried_until_the_timeout() -> None:
    writes = Writes(refusing=B, silent=3)
    assert undone(writes, PARK_A, B_TAKES_1, within_s=2.0) == []
    assert writes.done == [("b", 2), ("a", 1)]


def test_a_settled_move_remains() -> None:
    writes = Writes()
    assert undone(writes, PARK_A, B_TAKES_1, settled=A) == []
    assert writes.done == [("b", 2)]


def test_a_failed_write_is_undone_as_it_may_have_arrived() -> None:
    async def inside() -> list[tuple[str, int]]:
        exchange, well = IdExchange(), Writes()
        await exchange.move(PARK_A, well)
        with pytest.raises(NoResponse):
            await exchange.move(B_TAKES_1, Writes(refusing=B))
        assert [one.servo for one in exchange.parked("servo_id")] == [A]
        back = Writes()
        await exchange.roll_back(back)
        return back.done

    assert clock.run(inside()) == [("b", 2), ("a", 1)]
