"""Firmware versions: the integer of 0x52, the text people read, the steps that brought rows (5)."""

import re
from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from hornbill.errors import InvalidValue
from hornbill.schema.parameter import FirmwareText, Row, Text

_TEXT = re.compile(r"([0-9]{1,6})\.([0-9]{3})")


class FirmwareStep(Row):
    """One version. `first` and `last` are the months in which every model that lists it was built with it;
    without `last` it still is. `note` is what its users should know.
    """

    version: FirmwareText
    first: Annotated[str, Field(pattern=r"^20[0-9]{2}-(0[1-9]|1[0-2])$")]
    last: Annotated[str, Field(pattern=r"^20[0-9]{2}-(0[1-9]|1[0-2])$")] | None = None
    note: Text


def to_text(firmware: int) -> str:
    """The version as people write it: 1300 is "1.300" (the scale is inferred from sections 4.42 and 5)."""
    return f"{firmware // 1000}.{firmware % 1000:03d}"


def from_text(text: str) -> int:
    """The integer 0x52 holds for a version such as "1.300".

    Raises InvalidValue for any other form.
    """
    found = _TEXT.fullmatch(text)
    if found is None:
        raise InvalidValue(
            f'"{text}" is not a firmware version. Write it as 1.300.', requested=text, cause="no_firmware"
        )
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
