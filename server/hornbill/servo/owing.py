"""Owns TorqueDebts: servos whose command ended, to which torque off or the brake is written until they answer."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from hornbill.servo.hub import Happened, Hub, ServoChanged
from hornbill.servo.servo import Servo
from hornbill.units import Uid

UNANSWERED_S = 10.0
"""A torque-off that is owed for so long is told as a failure, once; it stays owed."""


@dataclass(slots=True)
class _Debt:
    """`told`: somebody was told that the servo does not answer."""

    servo: Servo
    mode: str
    told: bool = False
    task: asyncio.Task[None] | None = None


class TorqueDebts:
    """What is owed is written for as long as it takes: through a lost bus, and over a change of buses.

    It ends when the servo answers, when somebody commands the servo again under a lease, or when a stop, which
    writes the same or the brake, takes over.
    """

    def __init__(self, quench: Callable[[Servo, str], Awaitable[None]], hub: Hub) -> None:
        """`quench` writes a torque mode, off or brake, until the servo answers."""
        self._quench = quench
        self._hub = hub
        self._debts: dict[Uid, _Debt] = {}

    def servos(self) -> list[Servo]:
        """Who has not answered yet."""
        return [debt.servo for debt in self._debts.values()]

    def owes(self, uid: Uid) -> bool:
        """Whether a servo has not answered yet."""
        return uid in self._debts

    def owe(self, servo: Servo, mode: str = "off") -> None:
        """Write torque off, or brake, to a servo, beginning on the next turn of the event loop.

        What is owed already stays: the brake holds what off would drop.
        """
        if servo.uid in self._debts:
            return
        debt = self._debts[servo.uid] = _Debt(servo, mode)
        debt.task = asyncio.get_running_loop().create_task(self._write_off(debt))
        debt.task.add_done_callback(lambda _done: self._settle(debt))

    def forgive(self, uid: Uid) -> None:
        """Write to that servo no more."""
        debt = self._debts.pop(uid, None)
        if debt is not None and debt.task is not None:
            debt.task.cancel()

    async def paid(self, within_s: float) -> None:
        """Answer when every servo has answered, or after that time."""
        tasks = self._tasks()
        if tasks:
            await asyncio.wait(tasks, timeout=within_s)

    def say_unanswered(self) -> None:
        """Name the servos that have not answered, each once."""
        for debt in self._debts.values():
            self._say(debt)

    async def close(self) -> None:
        """Write no more."""
        tasks = self._tasks()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _tasks(self) -> list[asyncio.Task[None]]:
        return [debt.task for debt in self._debts.values() if debt.task is not None]

    def _say(self, debt: _Debt) -> None:
        if debt.told:
            return
        debt.told = True
        text = f"{debt.servo.title} did not answer to torque {debt.mode}; it is written until it does."
        self._hub.tell(Happened("failure", "no_answer", f"{text} If it can move, cut its supply.", debt.servo.uid))

    def _settle(self, debt: _Debt) -> None:
        if self._debts.get(debt.servo.uid) is debt:
            del self._debts[debt.servo.uid]

    async def _write_off(self, debt: _Debt) -> None:
        servo = debt.servo
        try:
            async with asyncio.timeout(UNANSWERED_S):
                await self._quench(servo, debt.mode)
        except TimeoutError:
            self._say(debt)
            await self._quench(servo, debt.mode)
        if debt.told:
            where = "off" if debt.mode == "off" else "on the brake"
            self._hub.tell(Happened("notice", "torque_off", f"Torque is {where} on {servo.title} now.", servo.uid))
        self._hub.tell(ServoChanged(servo.uid))
