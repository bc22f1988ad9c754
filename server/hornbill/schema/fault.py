"""Fault bits, and conversion between 32-bit registers and bits (section 4.12)."""

from collections.abc import Iterable, Mapping
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, model_validator
from typing_extensions import TypeAliasType

from hornbill.schema.parameter import Key, Row, Section, Text

FaultLevel = TypeAliasType("FaultLevel", Literal["notification", "warning", "failure"])
FaultGroup: TypeAlias = Literal["hardware", "software", "communication", "other"]

LEVELS: tuple[FaultLevel, ...] = ("notification", "warning", "failure")
GROUPS: tuple[FaultGroup, ...] = ("hardware", "software", "communication", "other")
REGISTERS: Mapping[str, FaultLevel] = {
    "fault_notification": "notification",
    "fault_warning": "warning",
    "fault_failure": "failure",
}
OVERVIEW = "fault_overview"
WORD = 0xFFFF_FFFF


class FaultBit(Row):
    """One documented bit of `parameter`. In the overview, `level` is the level the bit summarizes."""

    parameter: Key = Field(description="Key of its register.")
    level: FaultLevel = Field(description="Severity.")
    group: FaultGroup = Field(description="Group within its table.")
    bit: Annotated[int, Field(ge=0, le=31)] = Field(description="Bit number in the 32-bit register, from 0.")
    key: Key = Field(description="Key of the bit.")
    label: Text = Field(description="Display name.")
    advice: Text = Field(description="What to do about it.")
    section: Section = Field(description="Section of the specification.")
    latching: bool = Field(default=False, description="Stays set until the servo restarts, regardless of its cause.")
    past_event: bool = Field(default=False, description="Describes something before the servo's last start.")
    pwm_only: bool = Field(default=False, description="Always 0 on models without PWM input.")
    output_off: bool = Field(default=False, description="The motor has no output while it is set.")
    limit: Key | None = Field(default=None, description="Parameter that sets its threshold. Null if none.")
    older_firmware: bool = Field(
        default=False, description="Reported by older firmware only, and not in the specification."
    )

    @model_validator(mode="after")
    def _in_its_place(self) -> Self:
        if GROUPS[self.bit // 8] != self.group:
            raise ValueError(f"bit {self.bit} belongs to {GROUPS[self.bit // 8]}, not {self.group}")
        if self.parameter == OVERVIEW:
            if self.bit % 8 != LEVELS.index(self.level):
                raise ValueError(f"overview bit {self.bit} does not summarize {self.level} bits")
        elif REGISTERS.get(self.parameter) != self.level:
            raise ValueError(f"{self.parameter} does not contain {self.level} bits")
        return self

    @property
    def mask(self) -> int:
        """Mask of the bit."""
        return 1 << self.bit


def bits_of(raw: int) -> frozenset[int]:
    """Numbers of the set bits. Only the low 32 count, because the sign of bit 31 is not specified."""
    word = raw & WORD
    return frozenset(bit for bit in range(32) if word >> bit & 1)


def word_of(bits: Iterable[int]) -> int:
    """Register value with these bits set, 0 to 0xFFFFFFFF. Raises ValueError for a bit outside 0 to 31."""
    word = 0
    for bit in bits:
        if not 0 <= bit <= 31:
            raise ValueError(f"bit {bit} is outside 0 to 31")
        word |= 1 << bit
    return word


def overview_of(words: Mapping[str, int]) -> int:
    """Value of 0x18 if the three detail registers (by key) are `words`."""
    bits: set[int] = set()
    for register, level in REGISTERS.items():
        bits |= {bit // 8 * 8 + LEVELS.index(level) for bit in bits_of(words.get(register, 0))}
    return word_of(bits)
