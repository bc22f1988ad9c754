"""Temporary values of rows of a servo's RAM, each written back afterwards."""

from collections.abc import Callable

from hornbill.errors import BusDisconnected, HornbillError, NoResponse, UnexpectedResult
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.servo.device.requests import READ, WRITE, RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw

_RESTORE = RetryPolicy(WRITE.priority, WRITE.timeout_s, READ.tries, kind="write")
"""A row that is left behind changed is worse than a wait of 3 s."""


class TemporaryValues:
    """What is lent to one servo. It is of RAM alone: a restart ends it, and brings back what ROM holds (4.10)."""

    def __init__(self, requests: ServoRequests, servo: Servo) -> None:
        self._requests = requests
        self._servo = servo
        self._boot_count = servo.boot_count
        self._rows: list[tuple[Parameter, Raw]] = []

    async def lend(self, key: str, raw: Raw) -> None:
        """Write a row that was just read, and remember what it held.

        Raises NoResponse, Refused, BusDisconnected, and UnexpectedResult when the servo made another value of it.
        """
        register = self._servo.registers[key]
        row, before = register.parameter, register.raw
        assert before is not None, "read it first"
        if before == raw:
            return
        self._rows.append((row, before))  # before the write: one that is not answered may have arrived
        self._servo.overridden[key] = before
        held = await self._requests.write(self._servo, row, raw, _RESTORE)
        if held != raw:
            raise UnexpectedResult(
                f"{self._servo.title} took {scale.to_text(row, raw)} as {row.label.lower()} and holds "
                f"{scale.to_text(row, held)}.",
                key=key,
                cause="value_changed_by_servo",
                servo=self._servo.title,
            )

    async def give_back(self, before_each: Callable[[], object] = lambda: None) -> list[str]:
        """Write every row's own value back, the last one lent first; the keys that were not found to hold it again.

        The first row that is not answered ends it: the servo is not there. Repeating it goes on with what is left.
        `before_each` is called before every write, of which each may take 3 s.
        """
        failed: list[tuple[Parameter, Raw]] = []
        while self._rows and self._servo.boot_count == self._boot_count:
            row, before = self._rows[-1]
            before_each()
            try:
                held = await self._requests.write(self._servo, row, before, _RESTORE)
            except (NoResponse, BusDisconnected):
                break
            except HornbillError:
                held = None
            self._rows.pop()
            self._servo.overridden.pop(row.key, None)
            if held != before:
                failed.append((row, before))
        if self._servo.boot_count != self._boot_count:
            self._rows.clear()
            return []
        self._rows = failed[::-1] + self._rows
        for row, _ in self._rows:
            self._servo.overridden.pop(row.key, None)  # what is left behind is to be seen
        return [row.key for row, _ in self._rows]
