"""A servo model: its identity, its rows after all overlays, and rows missing in a firmware (3.1, 5)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Literal

from pydantic import Field

from hornbill.schema.firmware import from_text, step_of, to_text
from hornbill.schema.parameter import FirmwareText, Parameter, Row, Text


class Overlay(Row):
    """Changes of a row by a series or model: only these three raw numbers."""

    default: int | None = None
    minimum: int | None = None
    maximum: int | None = None

    def over(self, parameter: Parameter) -> Parameter:
        """The row with these numbers applied."""
        return parameter.model_copy(update=self.model_dump(exclude_none=True))


class Series(Row):
    """A file of schemas/series: rows common to a series. `model_number` is its value of 0x50 (4.40)."""

    name: Text
    label: Text
    section: Text
    model_number: int
    rows: dict[str, Overlay] = Field(default_factory=dict)


class ModelTable(Row):
    """A file of schemas/models. `hardware_version` is its value of 0x53 (4.43).

    `firmware` lists the versions it was built with (section 5).
    """

    name: Text
    series: Text
    section: Text
    hardware_version: int
    voltage_class: Literal["7.4 V", "12 V", "28 V"]
    pwm: bool
    firmware: Annotated[tuple[FirmwareText, ...], Field(strict=False, min_length=1)]
    rows: dict[str, Overlay] = Field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class ServoModel:
    """One model. `parameters` contains all 59 rows; `rows()` those a servo of this model has.

    `steps` are the known versions up to the newest it was built with.
    """

    name: str
    series: str
    section: str
    model_number: int
    hardware_version: int
    voltage_class: str
    pwm: bool
    firmware: tuple[str, ...]
    parameters: Mapping[str, Parameter]
    steps: tuple[str, ...]
    _rows: Mapping[str, Mapping[str, Parameter]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        by_step = {step: MappingProxyType(self._offered(step)) for step in self.steps}
        object.__setattr__(self, "_rows", MappingProxyType(by_step))

    @property
    def nominal_v(self) -> float:
        """Nominal supply voltage, V: where the ranges of its two voltage limits meet (section 3.1)."""
        return float(self.voltage_class.removesuffix(" V"))

    def rows(self, firmware: int | None = None) -> Mapping[str, Parameter]:
        """Readable rows of this model with this firmware (the integer of 0x52), by key, in address order.

        Firmware newer than all known versions, or unknown, has the newest rows. The PWM rows of a model without PWM
        input are omitted although their registers exist and are 0: they are never written (4.29).
        """
        return self._rows[step_of(firmware, self.steps)]

    def counts_as(self, firmware: int) -> str | None:
        """The version an unlisted firmware is treated as. None for a known one."""
        return None if to_text(firmware) in self.steps else step_of(firmware, self.steps)

    def _offered(self, step: str) -> dict[str, Parameter]:
        reached = from_text(step)
        return {
            key: row
            for key, row in self.parameters.items()
            if row.readable and from_text(row.since) <= reached and (self.pwm or not row.pwm_only)
        }
