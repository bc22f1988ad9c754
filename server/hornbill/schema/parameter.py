"""One row of the parameter table: what a register is called, holds, allows and means (3.1 and 4)."""

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

    model_config = ConfigDict(
        frozen=True, strict=True, extra="forbid", json_schema_serialization_defaults_required=True
    )


class Choice(Row):
    """One named value of a register that is a choice."""

    key: Key = Field(description="Value that programs write.")
    label: Text = Field(description="Display name.")
    raw: int = Field(description="Integer on the wire.")


class UnitWhen(Row):
    """Another unit, in force while `parameter` reads `raw` (0x36 follows 0x37, section 4.30)."""

    parameter: Key = Field(description="Key of the row that decides.")
    raw: int = Field(description="Value of that row for this unit, raw.")
    unit: str = Field(description="Unit of the value. Empty if none.")
    per_unit: Scale = Field(description="Raw steps per unit.")


class Limits(Row):
    """The two rows that bound a command, or a reading outside which output goes off."""

    lower: Key = Field(description="Parameter that holds the lower limit.")
    upper: Key = Field(description="Parameter that holds the upper limit.")
    tolerance: int | None = Field(default=None, ge=0, description="Error of the reading, raw. Null for a command.")
    confirm: Key | None = Field(
        default=None, description="Word that confirms a limit within the tolerance of the reading. Null for a command."
    )

    @model_validator(mode="after")
    def _of_a_reading(self) -> Self:
        if (self.tolerance is None) != (self.confirm is None):
            raise ValueError("tolerance and confirm come together")
        return self


class UniqueNumber(Row):
    """A number that no two servos share, and the range that is proposed (raw). 0 is "none yet" and may be shared."""

    lowest: int = Field(ge=1, description="Lowest number that is proposed.")
    highest: int = Field(description="Highest number that is proposed.")


class Group(Row):
    """A chapter of the parameter list, as the document divides it (tables 3-1 to 3-11)."""

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
        default=None, description="Another unit, in force while another row has a certain value. Null if none."
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
    sided: bool = Field(default=False, description="Its sign is a side: plus is clockwise. Shown with its sign.")
    live: bool = Field(
        default=False, description="Changes without being written, and is read before a save, restart or reset."
    )
    soft_start: int | None = Field(
        default=None, description="Temporary value during soft start, raw. Null: soft start leaves it alone."
    )
    poll_s: float | None = Field(
        default=None, gt=0, description="Period at which every servo is asked for it, s. Null: only on request."
    )
    limits: Limits | None = Field(default=None, description="The rows that bound it. Null where none do.")
    unique: UniqueNumber | None = Field(
        default=None, description="The number is that of one servo alone. Null where servos may share it."
    )

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
        if self.access != "rw" and (self.moves_horn or self.soft_start is not None or self.unique is not None):
            raise ValueError("moves_horn, soft_start and unique belong to a row that can be written")
        if not self.readable and (self.live or self.poll_s is not None or self.limits is not None):
            raise ValueError("live, poll_s and limits belong to a row that can be read")
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
