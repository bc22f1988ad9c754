"""Rules of proof: what a servo holds, as read, held against what was written or saved."""

from collections.abc import Iterable, Mapping

from hornbill.domain.change import Change
from hornbill.errors import Busy, ConfigurationLost, HornbillError, NotAsWanted, Stopped
from hornbill.schema import scale
from hornbill.schema.parameter import DUMMY
from hornbill.servo.device.output import KEY
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw

TURNS_RPM = 5
"""A horn at rest is measured no faster; one that turns is moved by somebody, and the ROM write would let go of it."""


def not_saved(servo: Servo, wanted: Mapping[str, Raw | None], wrong: list[str], *, stopped: bool) -> HornbillError:
    """The problem of a servo whose ROM, read after its restart, is not as `wanted` in the rows `wrong`."""
    differences, said = differing(servo, {key: wanted[key] for key in wrong})
    if servo.rom_lost:
        return ConfigurationLost(
            f"{servo.title} started on defaults: its ROM could not be loaded, so what was saved is lost. "
            "Its power failed while it wrote. Restore the snapshot and save again.",
            differences=differences,
            cause="rom_lost_in_save",
            servo=servo.title,
        )
    if wrong == [KEY] and servo.registers[KEY].rom is None:
        proved = f"{servo.title} restarted, and its ROM holds {len(wanted) - 1} of {len(wanted)} rows as saved. "
        if stopped:
            return Stopped(
                f"{proved}Torque is not proved: stop wrote it since the start. Restart the servo after the stop is "
                "cleared to see.",
                cause="torque_unproved_stop",
                servo=servo.title,
            )
        return NotAsWanted(
            f"{proved}Torque is not proved: its output was switched since the start. Restart the servo to see.",
            differences=differences,
            cause="torque_unproved",
            servo=servo.title,
        )
    return NotAsWanted(
        f"ROM of {servo.title} does not hold what was saved: {said}.",
        differences=differences,
        cause="rom_differs",
        servo=servo.title,
        keys=[one["key"] for one in differences],
    )


def check_held(servo: Servo, written: Iterable[Change]) -> None:
    """Raises NotAsWanted where a servo, as just read, is not configured any more to what these changes wrote."""
    values, differences, said = servo.configuration(), list[dict[str, object]](), list[str]()
    for one in written:
        row, raw = servo.registers[one.key].parameter, values[one.key]
        found = None if raw is None else scale.to_value(row, raw, values)
        if found != one.after:
            differences.append({"key": one.key, "wanted": one.after, "found": found})
            said.append(f"{row.label} is {'unknown' if raw is None else scale.to_text(row, raw, values)}")
    if said:
        raise NotAsWanted(
            f"{servo.title} does not hold any more what was written: {', '.join(said)}. It restarted, or somebody else "
            "writes to it. Nothing was saved.",
            differences=differences,
            cause="values_gone",
            servo=servo.title,
            keys=[one["key"] for one in differences],
        )


def differing(servo: Servo, wanted: Mapping[str, Raw | None]) -> tuple[list[dict[str, object]], str]:
    """Rows whose ROM is not `wanted`: as facts, and as a sentence."""
    found = [difference(servo, key, raw, servo.registers[key].rom) for key, raw in wanted.items()]
    return [fact for fact, _ in found], ", ".join(text for _, text in found)


def difference(
    servo: Servo, key: str, wanted: Raw | None, found: Raw | None, verb: str = ""
) -> tuple[dict[str, object], str]:
    """A row that holds something else: as a fact (key, wanted, found in engineering values), and in words."""
    row, values = servo.registers[key].parameter, servo.raws()
    shown = [None if raw is None else scale.to_value(row, raw, values) for raw in (wanted, found)]
    texts = ["unknown" if raw is None else scale.to_text(row, raw, values) for raw in (wanted, found)]
    return {"key": key, "wanted": shown[0], "found": shown[1]}, f"{row.label} {verb}{texts[1]} instead of {texts[0]}"


AT_REST = ("command_speed", "command_torque", "current_speed")
"""The rows by which `check_rest` tells whether a horn turns."""


def check_rest(servo: Servo) -> Raw | None:
    """The speed of a horn that moves by itself, rpm: a trembling one may be what this save puts right. Else None.

    Raises Busy where a speed or torque command turns it, whoever gave it (sections 4.2 and 4.3).
    """
    speed = servo.raw("current_speed") or 0
    if abs(speed) <= TURNS_RPM:
        return None
    commands = (servo.raw("command_speed"), servo.raw("command_torque"))
    if servo.raw("torque_mode") == 0 and any(raw not in (None, 0, DUMMY) for raw in commands):
        raise Busy(
            f"The horn of {servo.title} turns at {speed} rpm. Nothing was saved. Let it come to rest first.",
            cause="horn_turns",
            servo=servo.title,
            speed_rpm=speed,
        )
    return speed
