"""Behaviour: a switch for every question the document leaves open, with the reason for each default.

"Futaba's program" is their configurator for Windows, which was used with real servos for years: where it would fail
with one interpretation, the other is the default.
"""

from typing import Final, Literal, TypeAlias

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

PositionUnit: TypeAlias = Literal["hundred_degrees", "radian", "degree", "tenth_degree"]

Absent: TypeAlias = Literal["zero", "empty", "silent"]
"""Response to a request for a row the servo lacks: 0, a response without a value, or none."""

TENTHS_PER_UNIT: Final[dict[PositionUnit, float]] = {
    "hundred_degrees": 1000.0,
    "radian": 1800.0 / 3.141592653589793,
    "degree": 10.0,
    "tenth_degree": 1.0,
}
"""Steps of 0.1° per unit of ArrayCommand POSITION and of Status (tables 2-21 and 2-22)."""


@dataclass(frozen=True, slots=True, config=ConfigDict(extra="forbid"))
class Behaviour:
    """Behaviour of a simulated servo where the specification is silent."""

    position_unit: PositionUnit = Field(
        default="hundred_degrees",
        description='Meaning of position 1.0 on the bus. The tables print "0.001/0.1°": 0.001 stands for 0.1°, so '
        "1.0 is 100°, and Futaba's program sends and displays 100° per unit.",
    )
    out_of_range: Literal["refuse", "clamp"] = Field(
        default="refuse",
        description="Handling of a GetSet write outside the row's range. The document distinguishes successful and "
        "failed requests (table 2-16) and does not mention modified values, so the literal "
        "interpretation is that such a write fails. The public type allows a server to clamp. Values "
        "in ArrayCommand are handled alike: ignored or clamped.",
    )
    reserved: Literal["empty", "zero"] = Field(
        default="empty",
        description="Response of a reserved register. The list gives it the default 0 but no access. A write has "
        "no effect in either case.",
    )
    write_only: Literal["empty", "zero"] = Field(
        default="empty",
        description="Response to reading 0x10 to 0x12. Their access is W, so a read fails.",
    )
    pwm_rows: Absent = Field(
        default="zero",
        description="Response of 0x34 to 0x37 on a model without PWM input, where section 3.1 prints 0/0/0. "
        "Futaba's program requests them on every model and waits indefinitely for a register without a "
        "response.",
    )
    later_rows: Absent = Field(
        default="zero",
        description="Response of a row that was added by a later firmware. Futaba's program requests it regardless "
        "of 0x52, like the PWM rows.",
    )
    lower_case_names: bool = Field(
        default=False,
        description="Whether `0x2a` is accepted as `0x2A`. The document prints capitals and calls the name an "
        "ASCII string.",
    )
    acknowledges_save: bool = Field(
        default=True,
        description="Whether SAVE and 0x12 are acknowledged before the silence of the ROM write (4.11).",
    )
    save_opcode_restarts: bool = Field(
        default=True,
        description="Whether the opcode SAVE restarts the servo. Section 4.11 states this for 0x12; both write the "
        "same ROM.",
    )
    acknowledges_restart: bool = Field(
        default=True,
        description="Whether 0x11 and RestartNode are acknowledged before the restart. Table 2-10 has a flag for "
        "success.",
    )
    erase_rom: bool = Field(
        default=False,
        description='Whether ERASE also resets ROM. Table 2-12 says "at once" but not where; chapter 3 says ROM; '
        "for the same reset, 4.9 says that 0x12 must follow.",
    )
    erase_keeps_identity: bool = Field(
        default=False,
        description="Whether ERASE and 0x10 preserve 0x44 to 0x46. The document does not mention it.",
    )
    timeout_from: Literal["power_on", "first_command"] = Field(
        default="power_on",
        description="When the timeout of 0x27 starts. 4.14 lists the timeout among the events that end soft start, "
        "but every command ends it, too: so the timeout must run without a command, from power-on. "
        "With factory settings, a servo without commands turns torque off after 1,000 ms. 4.19 alone "
        "could mean that it starts with the first command.",
    )
    timeout_changes: Literal["output_on", "any_output"] = Field(
        default="output_on",
        description="Whether the action of 0x26 also replaces OFF or BRAKE in 0x20, so that a brake is released "
        "after 0x27. 4.19 names no exception and counts 0x20 among the commands; but 4.13 says in the "
        "same words that OFF remains whatever is commanded, and a timeout that brakes or frees a motor "
        "without output protects nothing.",
    )
    array_command_shows: bool = Field(
        default=True,
        description="Whether 0x00 to 0x02 read the values of an ArrayCommand. Chapter 4 describes no command "
        "outside these registers, so the message should be stored there; firmware may also store it "
        "separately, and then they read the last value written by GetSet.",
    )
    array_command_feeds_timeout: bool = Field(
        default=True,
        description="Whether ArrayCommand counts as a command for 0x27. 4.19 lists registers 0x00 to 0x02, which "
        "it writes.",
    )
    limits_follow_origin: bool = Field(
        default=True,
        description="Whether 0x38 and 0x39 are relative to the origin of 0x44. 4.31 gives them in the same degrees "
        "as the command, and 4.36 moves the zero of those; otherwise they remain at the same position "
        "of the horn.",
    )
    array_command_id_0: bool = Field(
        default=True,
        description="Whether a servo with servo ID 0, the factory setting, follows ArrayCommand entries for 0. The "
        "document specifies 1 to 254 for senders; Futaba's program copies the ID from Status, and "
        "moves new servos with it.",
    )
    health_of_notifications: bool = Field(
        default=False,
        description="Whether a notification sets the health in NodeStatus to WARNING. The document mentions only "
        "warnings; Futaba's manuals show a yellow indicator in their program for notifications, too.",
    )
    failures_latch: bool = Field(
        default=False,
        description="Whether failure bits remain set until the next start. 4.12 says that some bits remain until "
        "power-off, but names only those of its note 2.",
    )
    soft_start_shows: Literal["temporary", "stored"] = Field(
        default="temporary",
        description="What 0x25 and 0x3A to 0x3D read (and a ROM write stores) during soft start. 4.14 says these "
        "parameters are changed temporarily and restored afterwards.",
    )
    cascade_without_switch: bool = Field(
        default=True,
        description="Whether firmware without 0x25 (1.010) always has speed and torque control on. Futaba's "
        "program commanded speed and torque before 0x25 was added in 1.100.",
    )
