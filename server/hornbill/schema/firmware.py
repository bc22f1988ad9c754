"""Firmware versions: the integer of 0x52, its text, and the versions that added rows (5)."""

import re
from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from hornbill.errors import InvalidValue
from hornbill.schema.parameter import FirmwareText, Row, Text

_TEXT = re.compile(r"([0-9]{1,6})\.([0-9]{3})")


class FirmwareStep(Row):
    """One version. `first` and `last` are the first and last month in which models that list it were built with it;
    without `last` it is current. `note` is for its users.
    """

    version: FirmwareText
    first: Annotated[str, Field(pattern=r"^20[0-9]{2}-(0[1-9]|1[0-2])$")]
    last: Annotated[str, Field(pattern=r"^20[0-9]{2}-(0[1-9]|1[0-2])$")] | None = None
    note: Text


def to_text(firmware: int) -> str:
    """Version as text: 1300 is "1.300" (the scale is inferred from sections 4.42 and 5)."""
    return f"{firmware // 1000}.{firmware % 1000:03d}"


def from_text(text: str) -> int:
    """Value of 0x52 for a version such as "1.300".

    Raises InvalidValue for other forms.
    """
    found = _TEXT.fullmatch(text)
    if found is None:
        raise InvalidValue(
            f'"{text}" is not a firmware version. Enter it as 1.300.', requested=text, cause="firmware_invalid"
        )
    return int(found[1]) * 1000 + int(found[2])


def step_of(firmware: int | None, steps: Sequence[str]) -> str:
    """The newest of `steps` (oldest first) that is not newer than `firmware`.

    The first if `firmware` is older than all. The newest if unknown (None): an extra row responds with an empty value,
    whereas a missing row would be hidden.
    """
    if firmware is None:
        return steps[-1]
    reached = [step for step in steps if from_text(step) <= firmware]
    return reached[-1] if reached else steps[0]
