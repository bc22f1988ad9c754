"""Owns one row of the parameter table: what a register is called, holds, allows and means (3.1 and 4)."""

from typing import Annotated, Literal, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, computed_field, model_validator

DUMMY = 555_555_555
"""What 0x00 to 0x02 read while another kind of command is in force (4.1 to 4.3): inactive, never a number."""

LAST_ADDRESS = 0x5F

Access: TypeAlias = Literal["rw", "r", "w"]
Kind: TypeAlias = Literal["number", "choice", "switch", "bits"]

Key: TypeAlias = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
Section: TypeAlias = Annotated[str, Field(pattern=r"^[1-9](\.[0-9]+)?$")]
FirmwareText: TypeAlias = Annotated[str, Field(pattern=r"^[0-9]+\.[0-9]{3}$")]
Text: TypeAlias = Annotated[str, Field(min_length=1)]
Scale: TypeAlias = Annotated[int, Field(ge=1)]


class Row(BaseModel):
    """The shape shared by every table row: frozen, strict, and no field that is not known."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class Choice(Row):
    """One named value of a register that is a choice."""

    key: Key
    label: Text
    raw: int


class UnitWhen(Row):
    """Another unit, in force while `parameter` reads `raw` (0x36 follows 0x37, section 4.30)."""

    parameter: Key
    raw: int
    unit: str
    per_unit: Scale


class Group(Row):
    """A chapter of the parameter list, as the document divides it (tables 3-1 to 3-11)."""

    key: Key
    label: Text
    description: Text


class Parameter(Row):
    """One register. `default`, `minimum` and `maximum` are raw; an engineering value is raw / per_unit."""

    key: Key
    address: Annotated[int, Field(ge=0, le=LAST_ADDRESS)]
    group: Key
    label: Text
    description: Text
    section: Section
    access: Access
    kind: Kind = "number"
    unit: str = ""
    per_unit: Scale = 1
    unit_when: UnitWhen | None = None
    choices: Annotated[tuple[Choice, ...], Field(strict=False)] = ()
    default: int | None = None
    minimum: int | None = None
    maximum: int | None = None
    since: FirmwareText = "1.010"
    advice: str = ""
    pwm_only: bool = False
    dummy: bool = False
    expert: bool = False
    identity: bool = False
    after_restart: bool = False
    forbidden: bool = False

    @computed_field
    @property
    def name(self) -> str:
        """The four ASCII characters GetSet knows the register by: `0x2A` (table 2-14)."""
        return f"0x{self.address:02X}"

    @computed_field
    @property
    def rom(self) -> bool:
        """Whether a ROM write keeps it: 0x20 to 0x4F (section 4.11)."""
        return 0x20 <= self.address <= 0x4F and not self.forbidden

    @computed_field
    @property
    def action(self) -> bool:
        """Whether it does something when written and means nothing when read (0x10 to 0x12)."""
        return self.access == "w"

    @property
    def readable(self) -> bool:
        """Whether it may be read: everything but the actions and 0x49."""
        return self.access != "w" and not self.forbidden

    @property
    def writable(self) -> bool:
        """Whether its value may be set by a user; actions are run, not set."""
        return self.access == "rw" and not self.forbidden

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        if (self.kind == "choice") != bool(self.choices):
            raise ValueError("choices belong to kind = 'choice', and such a row needs them")
        raws = [choice.raw for choice in self.choices]
        if len(set(raws)) < len(raws) or len({choice.key for choice in self.choices}) < len(raws):
            raise ValueError("two choices share a key or a raw value")
        if self.expert != bool(self.advice):
            raise ValueError("an expert row needs advice, and only an expert row has it")
        if self.unit_when is not None and self.kind != "number":
            raise ValueError("unit_when belongs to a number")
        return self

    def range_problem(self, *, complete: bool = True) -> str | None:
        """What is wrong with default, minimum and maximum, or None.

        `complete` asks for all three in a row that can be written; a row that awaits an overlay is not.
        """
        low, high, default = self.minimum, self.maximum, self.default
        if complete and self.writable and None in (low, high, default):
            return "a row that can be written needs default, minimum and maximum"
        if low is None or high is None:
            return None if low is high else "minimum and maximum come together"
        if low > high:
            return f"minimum {low} is above maximum {high}"
        if default is not None and not low <= default <= high:
            return f"default {default} is outside {low} to {high}"
        if self.kind == "switch" and (low, high) != (0, 1):
            return "a switch is 0 or 1"
        if self.choices and not {choice.raw for choice in self.choices} >= set(range(low, high + 1)):
            return f"not every value from {low} to {high} has a choice"
        return None
