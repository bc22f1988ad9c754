"""Temporary values of rows in a servo's RAM, restored afterwards."""

from collections.abc import Callable

from hornbill.errors import BusDisconnected, HornbillError, NoResponse, UnexpectedResult
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.servo.device.requests import READ, WRITE, RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw

_RESTORE = RetryPolicy(WRITE.priority, WRITE.timeout_s, READ.tries, kind="write")
"""A row left with a temporary value is worse than a wait of 3 s."""


class TemporaryValues:
    """Temporary values of one servo. They are only in RAM: a restart restores the values from ROM (4.10)."""

    def __init__(self, requests: ServoRequests, servo: Servo) -> None:
        self._requests = requests
        self._servo = servo
        self._boot_count = servo.boot_count
        self._rows: list[tuple[Parameter, Raw]] = []

    async def set(self, key: str, raw: Raw) -> None:
        """Write a temporary value to a row that was just read, and remember its original value.

        Raises NoResponse, Refused, BusDisconnected, and UnexpectedResult if the servo set a different value.
        """
        register = self._servo.registers[key]
        row, before = register.parameter, register.raw
        assert before is not None, "read it first"
        if before == raw:
            return
        self._rows.append((row, before))  # before the write, which may arrive even without a response
        self._servo.overridden[key] = before
        held = await self._requests.write(self._servo, row, raw, _RESTORE)
        if held != raw:
            raise UnexpectedResult(
                f"{self._servo.title} was sent {scale.to_text(row, raw)} as {row.label.lower()} but has "
                f"{scale.to_text(row, held)}.",
                key=key,
                cause="value_changed_by_servo",
                servo=self._servo.title,
            )

    async def restore(self, before_each: Callable[[], object] = lambda: None) -> list[str]:
        """Restore all rows, last one first. Returns the keys of rows that were not restored.

        Ends at the first row without a response, because the servo is not there. Call again to continue with the rest.
        `before_each` is called before every write, each of which may take 3 s.
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
            self._servo.overridden.pop(row.key, None)  # a remaining temporary value must be visible
        return [row.key for row, _ in self._rows]
