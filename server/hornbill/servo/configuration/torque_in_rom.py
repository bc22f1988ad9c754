"""The torque mode (0x20) that a save writes to ROM: the staged value, else the present ROM value.

The 0x20 in RAM is session state: each stop and each end of motion control leaves it off.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import Final

from hornbill.errors import BadRequest, NeedsConfirmation
from hornbill.schema import scale
from hornbill.servo.device.output import KEY, MODES, ON
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw

OFF_WORD: Final = "torque_off_in_rom"
"""Confirms that torque off or brake is saved to ROM."""

ON_WORD: Final = "torque_on_in_rom"
"""Chooses torque on for ROM if the ROM value is unknown."""

_NONE: Final = frozenset(MODES.values())


def confirmed(words: Sequence[str], values: Collection[str]) -> tuple[str, ...]:
    """The confirmations for these keys. A profile with torque mode counts as confirmation of its value."""
    return (*words, OFF_WORD) if KEY in values else tuple(words)


def decide(
    servo: Servo,
    confirm: Collection[str],
    values: Mapping[str, object] | None = None,
    *,
    torque_on: bool = False,
    rom_was: Raw | None = None,
) -> Raw | None:
    """The 0x20 that a save writes to ROM, or None for a servo of unknown model. Sends nothing.

    `values` (engineering, by key) are staged before the save, which reports invalid ones. `torque_on` stages ON.
    `rom_was`: the ROM value when the job was requested, used if it is unknown now. With OFF_WORD in `confirm`, off or
    brake in RAM is saved.

    Raises NeedsConfirmation if the ROM value is unknown, and if the save would turn off torque at start for a servo not
    known to start without it.
    """
    register = servo.registers.get(KEY)
    if register is None:
        return None
    row, raw, rom = register.parameter, register.raw, servo.starting_output
    rom = rom_was if rom is None else rom
    wanted = ON if torque_on else servo.output.staged
    if not torque_on and values is not None and KEY in values:
        try:
            wanted = scale.to_raw(row, values[KEY], servo.raws())
        except BadRequest:
            return rom
    if wanted is None and OFF_WORD in confirm and (raw in _NONE or (rom is None and ON_WORD not in confirm)):
        wanted = raw if raw in _NONE else MODES["off"]
    if wanted is None and rom is None and ON_WORD in confirm:
        wanted = ON
    wanted = rom if wanted is None else wanted
    if wanted is None:
        raise NeedsConfirmation(
            f"The torque mode (0x20) in ROM of {servo.title} is unknown, so a save cannot preserve it. Choose: "
            "torque on at each start, or off until it is turned on.",
            confirm=OFF_WORD, choices=[ON_WORD, OFF_WORD], key=KEY, requested=None,
            cause="torque_in_rom_unknown", servo=servo.title,
        )  # fmt: skip
    if wanted in _NONE and rom not in _NONE and OFF_WORD not in confirm:
        present = "whose present value is unknown" if rom is None else "which now contains on"
        raise NeedsConfirmation(
            f"The save would write torque mode {scale.to_text(row, wanted).lower()} to ROM of {servo.title}, {present}"
            ". After each start it would have no torque until torque is turned on.",
            confirm=OFF_WORD, choices=[OFF_WORD], key=KEY, requested=scale.to_value(row, wanted),
            cause="torque_saved_to_rom", servo=servo.title,
        )  # fmt: skip
    return wanted
