"""What an exchange of IDs puts back when it fails, in which order, and what it must leave."""

from typing import cast

import pytest

import jumping_clock as clock
from hornbill.errors import HornbillError, NoResponse
from hornbill.servo.device.servo import Servo
from hornbill.servo.runs.id_exchange import IdExchange, IdMove
from hornbill.units import Uid


class Named:
    """As much of a servo as an exchange looks at."""

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
    """Make the moves, put them back by `writes`, and answer why some stay."""

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


def test_it_goes_back_last_first_through_the_same_states() -> None:
    writes = Writes()
    assert undone(writes, PARK_A, B_TAKES_1, A_TAKES_2) == []
    assert writes.done == [("a", 0), ("b", 2), ("a", 1)]


def test_a_number_that_its_servo_could_not_leave_is_given_to_no_other() -> None:
    writes = Writes(refusing=B)
    problems = undone(writes, PARK_A, B_TAKES_1)
    assert [one.detail for one in problems] == ["another servo uses it now", "silent"][::-1]
    assert writes.done == []


def test_it_is_tried_again_until_its_time_is_over() -> None:
    writes = Writes(refusing=B, silent=3)
    assert undone(writes, PARK_A, B_TAKES_1, within_s=2.0) == []
    assert writes.done == [("b", 2), ("a", 1)]


def test_what_is_settled_stays() -> None:
    writes = Writes()
    assert undone(writes, PARK_A, B_TAKES_1, settled=A) == []
    assert writes.done == [("b", 2)]


def test_a_write_that_failed_is_put_back_because_it_may_have_arrived() -> None:
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
