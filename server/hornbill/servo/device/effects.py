"""Publishes which rows come into effect or cease to have one, whatever the cause."""

from collections.abc import Callable, Iterable

from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import COMMANDS, MODE, Effect
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
        if rows and servo is not None:
            self._check(servo, rows)

    def _check(self, servo: Servo, rows: Iterable[str]) -> None:
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
