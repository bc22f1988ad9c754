"""What an exchange of IDs that fails does not roll back. What it does is tested in tests/behaviour/test_matrix.py."""

from typing import cast

import pytest

from hornbill.errors import NoResponse
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


class Writes:
    """The successful writes, in order."""

    def __init__(self) -> None:
        self.done: list[tuple[str, int]] = []

    async def __call__(self, one: IdMove) -> None:
        self.done.append((one.servo.uid[:1], one.number))


async def silent(one: IdMove) -> None:
    raise NoResponse("silent", cause=None)


async def test_a_settled_move_remains_and_each_other_one_is_undone_once() -> None:
    exchange, back = IdExchange(), Writes()
    for move in (PARK_A, B_TAKES_1):
        await exchange.move(move, Writes())
    exchange.settle(A.uid)
    assert [problem for _, problem in await exchange.roll_back(back)] == [None]
    assert await exchange.roll_back(back) == []
    assert back.done == [("b", 2)]


async def test_a_failed_write_is_undone_as_it_may_have_arrived() -> None:
    exchange, back = IdExchange(), Writes()
    await exchange.move(PARK_A, Writes())
    with pytest.raises(NoResponse):
        await exchange.move(B_TAKES_1, silent)
    assert [one.servo for one in exchange.parked("servo_id")] == [A]
    await exchange.roll_back(back)
    assert back.done == [("b", 2), ("a", 1)]
