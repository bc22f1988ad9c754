"""Behaviour: a choice for every question the document leaves open, and why each default is what it is.

"The maker's program" is Futaba's own configurator for Windows, which was used with real servos for years: where it
would fail with one reading, the other is the default.
"""

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

PositionUnit: TypeAlias = Literal["hundred_degrees", "radian", "degree", "tenth_degree"]

Absent: TypeAlias = Literal["zero", "empty", "silent"]
"""How a servo answers for a row it does not have: 0, an answer without a value, or not at all."""

TENTHS_PER_UNIT: Final[dict[PositionUnit, float]] = {
    "hundred_degrees": 1000.0,
    "radian": 1800.0 / 3.141592653589793,
    "degree": 10.0,
    "tenth_degree": 1.0,
}
"""Counts of 0.1° in one unit of ArrayCommand POSITION and of Status (tables 2-21 and 2-22)."""


@dataclass(frozen=True, slots=True)
class Behaviour:
    """How a simulated servo decides what the document does not. Change one with `dataclasses.replace`."""

    position_unit: PositionUnit = "hundred_degrees"
    """What position 1.0 means on the bus. The tables print "0.001/0.1°": 0.001 stands for 0.1°, so 1.0 is 100°, and
    the maker's program sends and shows 100° per unit."""

    out_of_range: Literal["refuse", "clamp"] = "refuse"
    """A GetSet write outside the row's range. The document knows a request that passes and one that fails
    (table 2-16) and nowhere says that a value is changed on its way into a register, so the plain reading is
    that such a write fails. Clamping is what the public type allows a server to do. Values in ArrayCommand
    are treated alike: not obeyed, or brought to the nearest end of the range."""

    reserved: Literal["empty", "zero"] = "empty"
    """What a reserved register answers. The list gives it the default 0 but no access right, so nothing may be
    done with it. Either way a write changes nothing."""

    write_only: Literal["empty", "zero"] = "empty"
    """What reading 0x10 to 0x12 answers: their access is W, so a read fails."""

    pwm_rows: Absent = "zero"
    """What 0x34 to 0x37 answer on a model without PWM input, where section 3.1 prints 0/0/0. The maker's program asks
    for them on every model, and waits for ever for a register that is not answered."""

    later_rows: Absent = "zero"
    """What a row that came with a later firmware answers. The maker's program asks for it whatever 0x52 reads, as it
    does for the PWM rows."""

    lower_case_names: bool = False
    """Whether `0x2a` is taken for `0x2A`. The document prints capitals and calls the name an ASCII string."""

    answers_save: bool = True
    """Whether SAVE and 0x12 are answered before the silence of the ROM write (4.11)."""

    save_opcode_restarts: bool = True
    """Whether the opcode SAVE ends in a restart. Section 4.11 promises it for 0x12; both write the same ROM."""

    answers_restart: bool = True
    """Whether 0x11 and RestartNode are answered before the restart. Table 2-10 has a flag for success."""

    erase_rom: bool = False
    """Whether ERASE resets what ROM holds, too. Table 2-12 says "at once" and not where; chapter 3 says ROM,
    4.9 says of the same reset that 0x12 must follow."""

    erase_keeps_identity: bool = False
    """Whether ERASE and 0x10 spare 0x44 to 0x46. Nothing in the document says so."""

    timeout_from: Literal["power_on", "first_command"] = "power_on"
    """When the time of 0x27 begins to run. 4.14 names the time-out among what ends soft start, and every command has
    ended it before: so the time runs without one, from power-on. As delivered, a servo that nobody commands lets go
    after 1,000 ms. 4.19 alone could be read as if it began with the first command."""

    timeout_changes: Literal["output_on", "any_output"] = "output_on"
    """Whether the action of 0x26 takes the place of OFF or BRAKE in 0x20, too, so that a brake is let go after
    0x27. 4.19 names no exception and counts 0x20 among the commands; yet 4.13 says of OFF, in the same words, that
    it holds whatever is commanded, and a time-out that brakes or frees a motor without output protects nothing."""

    array_command_shows: bool = True
    """Whether 0x00 to 0x02 read what ArrayCommand commanded. Chapter 4 knows no command outside these registers,
    so the message must end there; a firmware may as well keep it beside them, and then they read what was written
    last by GetSet."""

    array_command_feeds_timeout: bool = True
    """Whether ArrayCommand counts as a command for 0x27. 4.19 lists registers 0x00 to 0x02; it writes them."""

    limits_follow_origin: bool = True
    """Whether 0x38 and 0x39 count from the zero that 0x44 has moved. 4.31 gives them in the same degrees as the
    command, and 4.36 moves the zero of those; without, they stay where they were on the horn."""

    array_command_id_0: bool = True
    """Whether a servo whose servo id is 0, as delivered, obeys the entries of an ArrayCommand for 0. The document gives
    senders 1 to 254; the maker's program copies the id that Status told, and moves new servos with it."""

    health_of_notifications: bool = False
    """Whether a notification makes NodeStatus say WARNING. The document counts warnings alone; the maker's manuals
    have the lamp of its program yellow for notifications, too."""

    failures_latch: bool = False
    """Whether bits of failure level stay until the next start. 4.12 says that some bits stay until power-off and
    names those of its note 2 only."""

    soft_start_shows: Literal["temporary", "stored"] = "temporary"
    """What 0x25 and 0x3A to 0x3D read (and a ROM write keeps) during soft start. 4.14 says these parameters
    are changed for a time and go back afterwards."""

    cascade_without_switch: bool = True
    """Whether a firmware without 0x25 (1.010) has speed and torque control always on. The maker's program commanded
    speed and torque before there was 0x25, which came with 1.100."""
