"""Owns the wait for a commanded angle: what "settled" means, and the evidence for it."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from hornbill.errors import NoAnswer
from hornbill.servo.asking import POLL, Asker
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.units import Raw

SAMPLE_S = 0.01


@dataclass(frozen=True, slots=True)
class Settled:
    """`time_s` from the command to the first sample of the dwell that held; None when it did not settle in time.

    The evidence: `samples` within the band in a row at the end, and the farthest of them from the target in degrees
    (None without any).
    """

    settled: bool
    time_s: float | None
    angle_deg: float | None
    samples: int
    max_deviation_deg: float | None


async def wait_settled(
    asker: Asker,
    servo: Servo,
    base: TimeBase,
    target: Raw,
    *,
    band_deg: float,
    dwell_s: float,
    timeout_s: float,
    still_allowed: Callable[[], object],
) -> Settled:
    """Read the angle as fast as every 10 ms until it has stayed within `band_deg` of `target` for `dwell_s`.

    `still_allowed` is asked before every sample and may raise what ends the motion (Stopped, LeaseRequired, Busy, …).
    """
    began, inside_since, angle = base.now(), None, None
    inside: list[float] = []
    row = servo.registers["current_angle"].parameter
    while base.now() - began <= timeout_s:
        still_allowed()
        try:
            angle = await asker.read(servo, row, POLL) / row.per_unit
        except NoAnswer:
            inside_since = None
            inside.clear()
            continue
        now = base.now()
        deviation = abs(angle - target / row.per_unit)
        if deviation > band_deg:
            inside_since = None
            inside.clear()
        else:
            inside.append(deviation)
            inside_since = now if inside_since is None else inside_since
            if now - inside_since >= dwell_s:
                return Settled(True, round(inside_since - began, 4), angle, len(inside), round(max(inside), 4))
        await asyncio.sleep(SAMPLE_S)
    return Settled(False, None, angle, len(inside), round(max(inside), 4) if inside else None)
