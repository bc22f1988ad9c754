"""Torque in ROM: the 0x20 that a save writes: what was staged, else what ROM holds.

RAM's 0x20 is session state: every stop and every end of motion control leaves it off.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import Final

from hornbill.errors import BadRequest, NeedsConfirmation
from hornbill.schema import scale
from hornbill.servo.device.output import KEY, MODES, ON
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw

OFF_WORD: Final = "torque_off_in_rom"
"""Confirms that ROM gets torque off, or the brake."""

ON_WORD: Final = "torque_on_in_rom"
"""Answers what ROM is to hold, where nobody knows what it does."""

_NONE: Final = frozenset(MODES.values())


def confirmed(words: Sequence[str], values: Collection[str]) -> tuple[str, ...]:
    """What is confirmed for these keys: who names torque mode in a profile says itself what ROM is to hold."""
    return (*words, OFF_WORD) if KEY in values else tuple(words)


def decide(
    servo: Servo,
    confirm: Collection[str],
    values: Mapping[str, object] | None = None,
    *,
    torque_on: bool = False,
    rom_was: Raw | None = None,
) -> Raw | None:
    """What a save writes to ROM's 0x20; None for a servo of unknown model. Asks nothing of the bus.

    `values` (engineering, by key) are staged before the save, and what is wrong with them is told then. `torque_on`
    stages ON. `rom_was` is what ROM was to hold when a job was asked for, and counts where it is not known now.
    OFF_WORD in `confirm` also takes the off, or the brake, that RAM holds.

    Raises NeedsConfirmation where a servo would lose torque that is not known to start without, and where what ROM
    holds is not known.
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
            f"What ROM of {servo.title} holds as torque mode (0x20) is not known, so a save cannot keep it. Choose: "
            "torque at every start, or none until it is turned on.",
            confirm=OFF_WORD, choices=[ON_WORD, OFF_WORD], key=KEY, requested=None,
            cause="torque_in_rom_unknown", servo=servo.title,
        )  # fmt: skip
    if wanted in _NONE and rom not in _NONE and OFF_WORD not in confirm:
        held = "is not known to hold that" if rom is None else "holds on"
        raise NeedsConfirmation(
            f"A save would write torque mode {scale.to_text(row, wanted).lower()} to {servo.title}, and ROM {held}: "
            "from then on it holds nothing after a start until torque is turned on.",
            confirm=OFF_WORD, choices=[OFF_WORD], key=KEY, requested=scale.to_value(row, wanted),
            cause="torque_into_rom", servo=servo.title,
        )  # fmt: skip
    return wanted
