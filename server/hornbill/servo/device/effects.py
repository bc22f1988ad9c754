"""Publishes which rows come into effect or cease to have one, whatever the cause."""

from collections.abc import Callable, Iterable

from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import COMMANDS, MODE, Effect, LastCommand, in_force
from hornbill.servo.device.reading import circumstances, verdicts
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Hub, ReadingChanged, ServoChanged
from hornbill.units import Uid


class Effects:
    """Follows the hub. When the cause of a verdict changes, publishes every row whose verdict changed with it."""

    def __init__(self, catalog: Catalog, hub: Hub, find: Callable[[Uid], Servo | None]) -> None:
        self._hub = hub
        self._deciding = catalog.stops_output
        self._find = find
        self._depend_on = _dependents(catalog)
        self._state: dict[Uid, tuple[object, ...]] = {}
        self._verdicts: dict[Uid, dict[str, Effect]] = {}
        self._last: dict[Uid, LastCommand | None] = {}
        """Command for which the rows that depend on it were checked last. Another value of it changes no verdict."""
        hub.subscribe(self._on_servo, ServoChanged)
        hub.subscribe(self._on_reading, ReadingChanged)

    def _on_servo(self, change: ServoChanged) -> None:
        servo = self._find(change.uid)
        if servo is None:
            return
        now = circumstances(servo)
        if self._state.get(servo.uid) != now:
            self._state[servo.uid] = now
            self._check(servo, servo.registers)

    def _on_reading(self, change: ReadingChanged) -> None:
        if change.key in self._deciding:
            self._on_servo(ServoChanged(change.uid))
        rows = self._depend_on.get(change.key)
        servo = None if rows is None else self._find(change.uid)
        if not rows or servo is None:
            return
        if change.key not in COMMANDS:
            self._check(servo, rows)
            return
        last = in_force({key: servo.raw(key) for key in (MODE, *COMMANDS)}, servo.registers)
        if servo.uid not in self._last or self._last[servo.uid] != last:
            self._check(servo, rows)
            self._last[servo.uid] = last

    def _check(self, servo: Servo, rows: Iterable[str]) -> None:
        self._last.pop(servo.uid, None)
        known = self._verdicts.setdefault(servo.uid, {})
        for key, now in verdicts(servo, [key for key in rows if key in servo.registers]).items():
            before = known.get(key)
            known[key] = now
            if before is not None and before != now:
                self._hub.publish(ReadingChanged(servo.uid, key))


def _dependents(catalog: Catalog) -> dict[str, tuple[str, ...]]:
    """The rows that may come into effect, or cease to have one, when a row changes."""
    found: dict[str, dict[str, None]] = {}
    for rule in catalog.effects:
        for condition in rule.when:
            causes = (*COMMANDS, MODE) if condition.parameter is None else (condition.parameter,)
            for cause in causes:
                found.setdefault(cause, {}).update(dict.fromkeys(rule.parameters))
    return {cause: tuple(rows) for cause, rows in found.items()}
