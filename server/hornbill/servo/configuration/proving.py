"""Verification: values read back, compared with the values written or saved."""

from collections.abc import Iterable, Mapping

from hornbill.domain.change import Change
from hornbill.errors import Busy, ConfigurationLost, HornbillError, Stopped, UnexpectedResult
from hornbill.schema import scale
from hornbill.schema.parameter import DUMMY
from hornbill.servo.device.output import KEY
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw

TURNS_RPM = 5
"""Maximum measured speed of a horn at rest. A faster horn is driven, and the ROM write would turn its torque off."""


def not_saved(servo: Servo, wanted: Mapping[str, Raw | None], wrong: list[str], *, stopped: bool) -> HornbillError:
    """The error for a servo whose ROM, read after its restart, differs from `wanted` in the rows `wrong`."""
    differences, text = differing(servo, {key: wanted[key] for key in wrong})
    if servo.rom_lost:
        return ConfigurationLost(
            f"{servo.title} started on defaults because its ROM could not be loaded. The saved values are lost, "
            "probably because power failed during the write. Restore the snapshot and save again.",
            differences=differences,
            cause="rom_lost_during_save",
            servo=servo.title,
        )
    if wrong == [KEY] and servo.registers[KEY].rom is None:
        verified = f"{servo.title} restarted, and {len(wanted) - 1} of {len(wanted)} rows in ROM are verified. "
        if stopped:
            return Stopped(
                f"{verified}Torque mode is not: a stop has written it since the start. To verify it, clear the stop "
                "and restart the servo.",
                cause="torque_unverified_stop",
                servo=servo.title,
            )
        return UnexpectedResult(
            f"{verified}Torque mode is not: the output was switched after the start. To verify it, restart the servo.",
            differences=differences,
            cause="torque_unverified",
            servo=servo.title,
        )
    if (unread := unverified(servo, wanted, wrong)) is not None:
        return unread
    return UnexpectedResult(
        f"ROM of {servo.title} differs from the saved values: {text}.",
        differences=differences,
        cause="rom_differs",
        servo=servo.title,
        keys=[one["key"] for one in differences],
    )


def unverified(servo: Servo, wanted: Mapping[str, Raw | None], wrong: Iterable[str]) -> UnexpectedResult | None:
    """The error if none of the rows `wrong` is known to differ: the servo refused to read them. None if one is."""
    if any(servo.registers[key].rom is not None for key in wrong):
        return None
    differences, _ = differing(servo, {key: wanted[key] for key in wrong})
    labels = ", ".join(servo.registers[key].parameter.label for key in wrong)
    return UnexpectedResult(
        f"{servo.title} restarted, and {len(wanted) - len(differences)} of {len(wanted)} rows in ROM are verified. "
        f"Not read since: {labels}. To verify them, read the servo after a restart.",
        differences=differences,
        cause="rom_unverified",
        servo=servo.title,
        keys=[one["key"] for one in differences],
    )


def check_held(servo: Servo, written: Iterable[Change]) -> None:
    """Raises UnexpectedResult if a servo, as just read, no longer has the values that these changes wrote."""
    values, differences, texts = servo.configuration(), list[dict[str, object]](), list[str]()
    for one in written:
        row, raw = servo.registers[one.key].parameter, values[one.key]
        found = None if raw is None else scale.to_value(row, raw, values)
        if found != one.after:
            differences.append({"key": one.key, "wanted": one.after, "found": found})
            texts.append(f"{row.label} is {'unknown' if raw is None else scale.to_text(row, raw, values)}")
    if texts:
        raise UnexpectedResult(
            f"{servo.title} no longer has the written values: {', '.join(texts)}. It restarted, or another tool "
            "wrote to it. Nothing was saved.",
            differences=differences,
            cause="values_lost_before_save",
            servo=servo.title,
            keys=[one["key"] for one in differences],
        )


def differing(servo: Servo, wanted: Mapping[str, Raw | None]) -> tuple[list[dict[str, object]], str]:
    """Rows whose ROM value differs from `wanted`, as facts and as text."""
    found = [difference(servo, key, raw, servo.registers[key].rom) for key, raw in wanted.items()]
    return [fact for fact, _ in found], ", ".join(text for _, text in found)


def difference(
    servo: Servo, key: str, wanted: Raw | None, found: Raw | None, verb: str = ""
) -> tuple[dict[str, object], str]:
    """A row that differs, as a fact (key, wanted, found in engineering values) and as text."""
    row, values = servo.registers[key].parameter, servo.raws()
    shown = [None if raw is None else scale.to_value(row, raw, values) for raw in (wanted, found)]
    texts = ["unknown" if raw is None else scale.to_text(row, raw, values) for raw in (wanted, found)]
    return {"key": key, "wanted": shown[0], "found": shown[1]}, f"{row.label} {verb}{texts[1]} instead of {texts[0]}"


AT_REST = ("command_speed", "command_torque", "current_speed")
"""Rows that `check_rest` needs."""


def check_rest(servo: Servo) -> Raw | None:
    """Speed of a horn that moves without a command, rpm, else None. It may be hunting, which this save may fix.

    Raises Busy if a speed or torque command of any node turns it (sections 4.2 and 4.3).
    """
    speed = servo.raw("current_speed") or 0
    if abs(speed) <= TURNS_RPM:
        return None
    commands = (servo.raw("command_speed"), servo.raw("command_torque"))
    if servo.raw("torque_mode") == 0 and any(raw not in (None, 0, DUMMY) for raw in commands):
        raise Busy(
            f"The horn of {servo.title} turns at {speed} rpm. Nothing was saved. Stop the horn first.",
            cause="horn_turning_before_save",
            servo=servo.title,
            speed_rpm=speed,
        )
    return speed
