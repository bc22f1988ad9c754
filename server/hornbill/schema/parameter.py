"""One row of the parameter table: name, range, unit and properties of a register (3.1 and 4)."""

from typing import Annotated, Literal, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, computed_field, model_validator

DUMMY = 555_555_555
"""Value of 0x00 to 0x02 while another kind of command is active (4.1 to 4.3): inactive, never a number."""

LAST_ADDRESS = 0x5F

Access: TypeAlias = Literal["rw", "r", "w"]
Kind: TypeAlias = Literal["number", "choice", "switch", "bits"]

Key: TypeAlias = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
Section: TypeAlias = Annotated[str, Field(pattern=r"^[1-9](\.[0-9]+)?$")]
FirmwareText: TypeAlias = Annotated[str, Field(pattern=r"^[0-9]+\.[0-9]{3}$")]
Text: TypeAlias = Annotated[str, Field(min_length=1)]
Scale: TypeAlias = Annotated[int, Field(ge=1)]


class Row(BaseModel):
    """Base of all table rows: immutable, strict, without unknown fields."""

    model_config = ConfigDict(
        frozen=True, strict=True, extra="forbid", json_schema_serialization_defaults_required=True
    )


class Choice(Row):
    """One named value of a choice."""

    key: Key = Field(description="Value that programs write.")
    label: Text = Field(description="Display name.")
    raw: int = Field(description="Integer on the wire.")


class UnitWhen(Row):
    """Another unit while `parameter` is `raw` (0x36 follows 0x37, section 4.30)."""

    parameter: Key = Field(description="Key of the row that decides.")
    raw: int = Field(description="Value of that row for this unit, raw.")
    unit: str = Field(description="Unit of the value. Empty if none.")
    per_unit: Scale = Field(description="Raw steps per unit.")


class Limits(Row):
    """The two rows that limit a command, or a reading outside which torque turns off."""

    lower: Key = Field(description="Parameter with the lower limit.")
    upper: Key = Field(description="Parameter with the upper limit.")
    tolerance: int | None = Field(default=None, ge=0, description="Accuracy of the reading, raw. Null for a command.")
    confirm: Key | None = Field(
        default=None, description="Word that confirms a limit within the tolerance of the reading. Null for a command."
    )

    @model_validator(mode="after")
    def _of_a_reading(self) -> Self:
        if (self.tolerance is None) != (self.confirm is None):
            raise ValueError("tolerance and confirm require each other")
        return self


class UniqueNumber(Row):
    """A number unique to each servo, and the suggested range (raw). 0 means "none yet" and need not be unique."""

    lowest: int = Field(ge=1, description="Lowest suggested number.")
    highest: int = Field(description="Highest suggested number.")


class Group(Row):
    """A group of the parameter list, as in the document (tables 3-1 to 3-11)."""

    key: Key = Field(description="Key of the group.")
    label: Text = Field(description="Display name.")
    description: Text = Field(description="Purpose of its rows.")


class Parameter(Row):
    """One register. `default`, `minimum` and `maximum` are raw; an engineering value is raw / per_unit."""

    key: Key = Field(description="Parameter key.")
    address: Annotated[int, Field(ge=0, le=LAST_ADDRESS)] = Field(description="Register address, 0x00 to 0x5F.")
    group: Key = Field(description="Group within its table.")
    label: Text = Field(description="Display name.")
    description: Text = Field(description="What it does.")
    section: Section = Field(description="Section of the specification.")
    access: Access = Field(description="Read and write, read only, or executed by writing.")
    kind: Kind = Field(default="number", description="Number, choice, switch or bits.")
    unit: str = Field(default="", description="Unit of the engineering value. Empty if none.")
    per_unit: Scale = Field(default=1, description="Raw steps per unit.")
    unit_when: UnitWhen | None = Field(
        default=None, description="Another unit while another row has a certain value. Null if none."
    )
    choices: Annotated[tuple[Choice, ...], Field(strict=False)] = Field(
        default=(), description="Choices of a row of kind `choice`."
    )
    default: int | None = Field(default=None, description="Default, raw. Null if it depends on the model.")
    minimum: int | None = Field(default=None, description="Minimum, raw. Null if it depends on the model.")
    maximum: int | None = Field(default=None, description="Maximum, raw. Null if it depends on the model.")
    since: FirmwareText = Field(default="1.010", description="First firmware with this row.")
    advice: str = Field(default="", description="What to know before changing an expert row. Empty otherwise.")
    pwm_only: bool = Field(default=False, description="Only on models with PWM input.")
    smallest: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="Smallest usable magnitude other than 0, raw. Null if none is known."
    )
    dummy: bool = Field(default=False, description="May read 555,555,555, which means inactive.")
    expert: bool = Field(default=False, description="Hidden by default.")
    identity: bool = Field(
        default=False, description="Part of the servo's identity: origin, servo ID, node ID (0x44 to 0x46)."
    )
    after_restart: bool = Field(default=False, description="Takes effect after a restart.")
    forbidden: bool = Field(
        default=False, description="Never written or read, because the servo would need factory repair."
    )
    moves_horn: bool = Field(default=False, description="A change moves a held horn, so torque must be off.")
    shapes_output: bool = Field(default=False, description="No effect while the motor has no output.")
    sided: bool = Field(default=False, description="Its sign is a direction, positive is clockwise, and is shown.")
    live: bool = Field(
        default=False, description="Changes without being written, and is read before a save, restart or reset."
    )
    soft_start: int | None = Field(
        default=None, description="Temporary value during soft start, raw. Null if soft start does not change it."
    )
    poll_s: float | None = Field(default=None, gt=0, description="Polling period, s. Null if read only on request.")
    limits: Limits | None = Field(default=None, description="The rows that limit it. Null if none.")
    unique: UniqueNumber | None = Field(
        default=None, description="Suggested range of a number unique to each servo. Null if servos may share it."
    )

    @computed_field
    @property
    def name(self) -> str:
        """Register name in GetSet, four ASCII characters: `0x2A` (table 2-14)."""
        return f"0x{self.address:02X}"

    @computed_field
    @property
    def rom(self) -> bool:
        """Whether a ROM write stores it: 0x20 to 0x4F (section 4.11)."""
        return 0x20 <= self.address <= 0x4F and not self.forbidden

    @computed_field
    @property
    def action(self) -> bool:
        """Whether it is an action, triggered by a write (0x10 to 0x12)."""
        return self.access == "w"

    @property
    def readable(self) -> bool:
        """Whether it may be read: all rows except actions and 0x49."""
        return self.access != "w" and not self.forbidden

    @property
    def writable(self) -> bool:
        """Whether a user may set its value. False for actions."""
        return self.access == "rw" and not self.forbidden

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        if (self.kind == "choice") != bool(self.choices):
            raise ValueError("choices are required for kind = 'choice', and allowed only there")
        raws = [choice.raw for choice in self.choices]
        if len(set(raws)) < len(raws) or len({choice.key for choice in self.choices}) < len(raws):
            raise ValueError("two choices share a key or a raw value")
        if self.expert != bool(self.advice):
            raise ValueError("advice is required for expert rows, and allowed only there")
        if self.unit_when is not None and self.kind != "number":
            raise ValueError("unit_when is allowed only for numbers")
        if self.access != "rw" and (self.moves_horn or self.soft_start is not None or self.unique is not None):
            raise ValueError("moves_horn, soft_start and unique are allowed only for writable rows")
        if not self.readable and (self.live or self.poll_s is not None or self.limits is not None):
            raise ValueError("live, poll_s and limits are allowed only for readable rows")
        return self

    def range_problem(self, *, complete: bool = True) -> str | None:
        """Check default, minimum and maximum. Returns the problem, or None.

        `complete` requires all three in a writable row; rows that await an overlay are not complete.
        """
        low, high, default = self.minimum, self.maximum, self.default
        if complete and self.writable and None in (low, high, default):
            return "a writable row needs default, minimum and maximum"
        if low is None or high is None:
            return None if low is high else "minimum and maximum require each other"
        if low > high:
            return f"minimum {low} is above maximum {high}"
        if default is not None and not low <= default <= high:
            return f"default {default} is outside {low} to {high}"
        if self.kind == "switch" and (low, high) != (0, 1):
            return "a switch must have the range 0 to 1"
        if self.choices and not {choice.raw for choice in self.choices} >= set(range(low, high + 1)):
            return f"not every value from {low} to {high} has a choice"
        return None
