"""Owns Proof: what ROM holds after a restart, read in one life of the servo and held against what was saved (4.11)."""

import asyncio
from collections.abc import Iterable, Mapping

from hornbill.errors import Busy, ConfigurationLost, HornbillError, NoAnswer, NotAsWanted, Stopped
from hornbill.schema import scale
from hornbill.schema.parameter import DUMMY
from hornbill.servo import identification
from hornbill.servo.asking import Asker
from hornbill.servo.configuration.restarting import RESTART_WITHIN_S, Departure, Restarts
from hornbill.servo.configuration.writing import Change
from hornbill.servo.jobs import Job
from hornbill.servo.servo import Servo
from hornbill.servo.stop import Stop
from hornbill.servo.timebase import TimeBase
from hornbill.units import Raw

PROVED_WITHIN_S = 2 * RESTART_WITHIN_S + 5
"""A servo that fails again while it is read back is waited for so long in all."""

TURNS_RPM = 5
"""A horn at rest is measured no faster; one that turns is moved by somebody, and the ROM write would let go of it."""

ANOTHER_STATUS_S = 1.5
"""A NodeStatus comes once a second: when ROM seems wrong, it is waited for, because it would tell of a restart in the
middle of the reading."""


class Proof:
    """Reads back. Writes nothing, so it goes on under a stop."""

    def __init__(self, asker: Asker, base: TimeBase, stop: Stop, restarts: Restarts) -> None:
        self._asker = asker
        self._base = base
        self._stop = stop
        self._restarts = restarts

    async def read_back(
        self, job: Job, servo: Servo, departure: Departure, rows: list[str], wanted: Mapping[str, Raw | None]
    ) -> None:
        """Steps back, soft_start and read_back of a servo that was seen to start anew: then ROM is known.

        Raises NoAnswer, BusDisconnected; ConfigurationLost or NotAsWanted when ROM does not hold `wanted`, and Stopped
        when only stop kept that from being proved.
        """
        until, looked_twice = self._base.now() + PROVED_WITHIN_S, False
        while True:
            if self._base.now() > until:
                raise NoAnswer(
                    f"{servo.title} starts again and again, so what its ROM holds is not known. Check its supply."
                )
            job.begin("back")
            job.done("back", await self._restarts.back(servo, departure))
            boots = servo.boots
            try:
                await self._soft_start_over(job, servo)
                job.begin("read_back")
                await identification.read_rows(self._asker, servo, rows)
            except NoAnswer:
                if self._base.now() > until:
                    raise
                continue  # its power may have failed again: it is followed once more
            if servo.boots != boots or not servo.identified:
                continue
            identification.learn_rom(servo, soft_start=False)
            wrong = [key for key, raw in wanted.items() if servo.registers[key].rom != raw]
            if wrong and not looked_twice:
                looked_twice = True
                await asyncio.sleep(ANOTHER_STATUS_S)
                continue  # read once more, too: soft start may have been at its very end
            break
        if wrong:
            raise self._not_saved(servo, wanted, wrong)
        job.done("read_back", f"{len(wanted)} rows read back, all as saved" if wanted else f"{len(rows)} rows read")

    async def _soft_start_over(self, job: Job, servo: Servo) -> None:
        job.begin("soft_start")
        evidence = await self._restarts.soft_start_over(servo)
        if evidence is None:
            job.skip("soft_start", "no soft start: it is off, or the servo started with torque off")
        else:
            job.done("soft_start", evidence)

    def _not_saved(self, servo: Servo, wanted: Mapping[str, Raw | None], wrong: list[str]) -> HornbillError:
        differences, said = differing(servo, {key: wanted[key] for key in wrong})
        if servo.rom_lost:
            return ConfigurationLost(
                f"{servo.title} started on defaults: its ROM could not be loaded, so what was saved is lost. "
                "Its power failed while it wrote. Restore the snapshot and save again.",
                differences=differences,
            )
        if wrong == ["torque_mode"] and not servo.registers["torque_mode"].tells_rom and self._stop.latched:
            return Stopped(
                f"{servo.title} restarted, and its ROM holds {len(wanted) - 1} of {len(wanted)} rows as saved. Torque "
                "is not proved: stop wrote it since the start. Restart the servo after the stop is cleared to see."
            )
        return NotAsWanted(f"ROM of {servo.title} does not hold what was saved: {said}.", differences=differences)


def check_held(servo: Servo, written: Iterable[Change]) -> None:
    """Raises NotAsWanted where RAM, as just read, does not hold any more what these changes wrote."""
    values, differences, said = servo.raws(), list[dict[str, object]](), list[str]()
    for one in written:
        row, raw = servo.registers[one.key].parameter, servo.raw(one.key)
        found = None if raw is None else scale.to_value(row, raw, values)
        if found != one.after:
            differences.append({"key": one.key, "wanted": one.after, "found": found})
            said.append(f"{row.label} is {'unknown' if raw is None else scale.to_text(row, raw, values)}")
    if said:
        raise NotAsWanted(
            f"{servo.title} does not hold any more what was written: {', '.join(said)}. It restarted, or somebody else "
            "writes to it. Nothing was saved.",
            differences=differences,
        )


def differing(servo: Servo, wanted: Mapping[str, Raw | None]) -> tuple[list[dict[str, object]], str]:
    """Rows whose ROM is not `wanted`: as facts (key, wanted, found in engineering values), and as a sentence."""
    values = servo.raws()
    facts: list[dict[str, object]] = []
    said: list[str] = []
    for key, raw in wanted.items():
        row, held = servo.registers[key].parameter, servo.registers[key].rom
        shown = [None if one is None else scale.to_value(row, one, values) for one in (raw, held)]
        texts = ["unknown" if one is None else scale.to_text(row, one, values) for one in (raw, held)]
        facts.append({"key": key, "wanted": shown[0], "found": shown[1]})
        said.append(f"{row.label} {texts[1]} instead of {texts[0]}")
    return facts, ", ".join(said)


def check_rest(servo: Servo) -> str:
    """A remark on a horn that moves by itself: a trembling one may be what this save puts right. Else nothing.

    Raises Busy where a speed or torque command turns it, whoever gave it (sections 4.2 and 4.3).
    """
    speed = servo.raw("current_speed") or 0
    if abs(speed) <= TURNS_RPM:
        return ""
    commands = (servo.raw("command_speed"), servo.raw("command_torque"))
    if servo.raw("torque_mode") == 0 and any(raw not in (None, 0, DUMMY) for raw in commands):
        raise Busy(f"The horn of {servo.title} turns at {speed} rpm. Nothing was saved. Let it come to rest first.")
    return f" The horn moves at {speed} rpm by itself."
