"""Stories of one simulated servo as rows of a table: what is written and done to it, and what it reads then."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pytest

from hornbill.units import Raw
from unit.sim.desk import Desk

Step = tuple[str, Raw, float] | dict[str, Any] | float | Callable[[Desk], object]
"""A register, the value to write and the time to wait then, s; expected readings; a time to wait; or an action."""
Rom = dict[str, Raw]
Steps = Sequence[Step]
Stories = Mapping[str, tuple[Rom, Steps]]
"""By the statement that it proves: values in ROM, and steps."""


def stories(table: Stories) -> pytest.MarkDecorator:
    """Parametrize a test with the `rom` and `steps` of each row, named by its statement."""
    return pytest.mark.parametrize(("rom", "steps"), table.values(), ids=table.keys())


def follow(desk: Desk, *steps: Step) -> None:
    """Take these steps; writes must be accepted.

    Readings are of registers (by name, "0x08") or of the servo itself (`output`, `angle_deg`, `speed_rpm`, `starts`).
    """
    for step in steps:
        match step:
            case (str(name), int(raw), int(seconds) | float(seconds)):
                assert desk.write(name, raw) == raw, step
                desk.wait(seconds)
            case int(seconds) | float(seconds):
                desk.wait(seconds)
            case dict():
                read = {name: desk.read(name) if "0x" in name else getattr(desk.servo, name) for name in step}
                assert read == step, read
            case _:
                step(desk)


def near(value: float, tolerance: float = 3) -> Any:
    """By default as close as an angle comes with the default deadband, in 0.1°."""
    return pytest.approx(value, abs=tolerance)


def between(low: float, high: float) -> Any:
    """From `low` to `high`, both included."""
    return near((low + high) / 2, (high - low) / 2)


def go(raw: Raw) -> Callable[[Desk], object]:
    """Command an angle (0.1°) and wait until the horn rests."""
    return lambda desk: desk.go(raw)


def under(**conditions: float | None) -> Callable[[Desk], object]:
    """Put these conditions into effect."""
    return lambda desk: desk.under(**conditions)


def turned(degrees: float) -> Callable[[Desk], object]:
    """Turn the horn manually, which no motor may hold."""

    def turn(desk: Desk) -> None:
        assert desk.turn(degrees)

    return turn


def held(degrees: float) -> Callable[[Desk], object]:
    """Try to turn the horn manually, which the motor must hold."""

    def turn(desk: Desk) -> None:
        assert not desk.turn(degrees)

    return turn


def refused(name: str, *values: Raw) -> Callable[[Desk], object]:
    """Write values that must be refused."""

    def write(desk: Desk) -> None:
        assert [desk.write(name, raw) for raw in values] == [None] * len(values)

    return write
