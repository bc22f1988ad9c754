"""Owns firmware versions: the integer of 0x52, the text people read, the steps that brought rows (5)."""

import re
from collections.abc import Sequence

from hornbill.errors import InvalidValue

_TEXT = re.compile(r"([0-9]{1,6})\.([0-9]{3})")


def to_text(firmware: int) -> str:
    """The version as people write it: 1300 is "1.300" (the scale is inferred from sections 4.42 and 5)."""
    return f"{firmware // 1000}.{firmware % 1000:03d}"


def from_text(text: str) -> int:
    """The integer 0x52 holds for a version such as "1.300".

    Raises InvalidValue for any other form.
    """
    found = _TEXT.fullmatch(text)
    if found is None:
        raise InvalidValue(f'"{text}" is not a firmware version. Write it as 1.300.', requested=text)
    return int(found[1]) * 1000 + int(found[2])


def step_of(firmware: int | None, steps: Sequence[str]) -> str:
    """The newest of `steps` (oldest first) that `firmware` has reached.

    Older than all of them counts as the first. Unknown (None) counts as the newest: a row too many is
    answered with an empty value, a row too few would be hidden.
    """
    if firmware is None:
        return steps[-1]
    reached = [step for step in steps if from_text(step) <= firmware]
    return reached[-1] if reached else steps[0]
