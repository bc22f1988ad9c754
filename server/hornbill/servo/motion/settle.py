"""Waiting for a commanded angle: what "settled" means, and the evidence for it."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from hornbill.errors import NoResponse
from hornbill.servo.device.requests import POLL, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Raw

SAMPLE_S = 0.01

Unmet: TypeAlias = Literal["band", "dwell", "samples"]
"""What a horn did not do: come within the band, stay there for the dwell, or tell where it is."""


@dataclass(frozen=True, slots=True)
class Settled:
    """`time_s` from the command to the first sample of the dwell that held; None when it did not settle in time.

    The evidence: `samples` within the band in a row at the end, the farthest of them from the target in degrees (None
    without any), and for how long it had been there. `unmet`: what was missing at the end, None when it settled.
    """

    settled: bool
    time_s: float | None
    angle_deg: float | None
    samples: int
    max_deviation_deg: float | None
    in_band_s: float
    unmet: Unmet | None


async def wait_settled(
    requests: ServoRequests,
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
    began, inside_since, angle, heard = base.now(), None, None, False
    inside: list[float] = []
    row = servo.registers["current_angle"].parameter
    while base.now() - began <= timeout_s:
        still_allowed()
        try:
            angle = await requests.read(servo, row, POLL) / row.per_unit
        except NoResponse:
            inside_since, heard = None, False
            inside.clear()
            continue
        now, heard = base.now(), True
        deviation = abs(angle - target / row.per_unit)
        if deviation > band_deg:
            inside_since = None
            inside.clear()
        else:
            inside.append(deviation)
            inside_since = now if inside_since is None else inside_since
            if now - inside_since >= dwell_s:
                stayed = round(now - inside_since, 4)
                return Settled(
                    True, round(inside_since - began, 4), angle, len(inside), round(max(inside), 4), stayed, None
                )
        await asyncio.sleep(SAMPLE_S)
    unmet: Unmet = "samples" if not heard else "band" if inside_since is None else "dwell"
    stayed = 0.0 if inside_since is None else round(base.now() - inside_since, 4)
    return Settled(False, None, angle, len(inside), round(max(inside), 4) if inside else None, stayed, unmet)
