"""Owns torque in ROM: the question before a save that takes it away, and turning it on before one that keeps it."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Final

from hornbill.errors import BadRequest, NeedsConfirmation, NotAsWanted
from hornbill.schema import scale
from hornbill.servo.asking import READ, TORQUE, Asker
from hornbill.servo.servo import Servo

KEY: Final = "torque_mode"
WORD: Final = "torque_off_in_rom"
"""What confirms it."""

_NONE: Final = (1, 2)
"""Values of 0x20 without torque: off, brake (section 4.13)."""

_ON: Final = replace(TORQUE, tries=READ.tries)
"""Repeated for 1.25 s: unlike a motion command it is the same however often it arrives, and stop ends it at once."""


async def require(
    asker: Asker, servo: Servo, confirm: Collection[str], values: Mapping[str, object] | None = None
) -> None:
    """As `check`, of what RAM holds now: another tool may have turned torque on. Raises NoAnswer, too."""
    try:
        check(servo, confirm, values)
    except NeedsConfirmation:
        await asker.read(servo, servo.registers[KEY].parameter)
        check(servo, confirm, values)


def check(servo: Servo, confirm: Collection[str], values: Mapping[str, object] | None = None) -> None:
    """Raises NeedsConfirmation where a save of what RAM happens to hold puts torque off, or the brake, into ROM.

    Every stop and every end of motion control leaves RAM without torque. Where ROM is known to have none already
    nothing is asked. `values` (engineering, by key) are written before the save; what is wrong with them is told then.
    """
    register = servo.registers.get(KEY)
    if register is None or WORD in confirm:
        return
    row, raw = register.parameter, register.raw
    if values is not None and KEY in values:
        try:
            raw = scale.to_raw(row, values[KEY], servo.raws())
        except BadRequest:
            return
    if raw is None or raw not in _NONE or register.rom in _NONE:
        return
    held = "is not known to have none" if register.rom is None else "has it on"
    raise NeedsConfirmation(
        f"{servo.title} is without torque ({scale.to_text(row, raw).lower()} in RAM), and ROM {held}: "
        "saved like that, it holds nothing after any start. A save of its own with torque_on: true (POST …/save, "
        f'\'hornbill save --torque-on\') puts torque into ROM; or, if no torque is meant, send confirm: ["{WORD}"].',
        confirm=WORD, key=KEY, requested=scale.to_value(row, raw),
    )  # fmt: skip


async def turn_on(asker: Asker, servo: Servo) -> None:
    """Torque on, right before SAVE; the servo holds its horn where it stands (4.13). Raises NotAsWanted, NoAnswer."""
    row = servo.registers[KEY].parameter
    if await asker.write(servo, row, 0, _ON) != 0:
        raise NotAsWanted(
            f"{servo.title} did not take torque on, which ROM was to hold. Nothing was saved.",
            differences=[{"key": row.key, "wanted": "on", "found": None}],
        )
