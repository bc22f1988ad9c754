"""Settling: waits for a commanded angle, with evidence."""

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
"""Unmet condition: not within the band, not there for the dwell time, or no samples."""


@dataclass(frozen=True, slots=True)
class Settled:
    """Result of settling. `time_s`: from the command to the first sample of the final dwell, None if it did not settle.

    Evidence: consecutive `samples` within the band at the end, their maximum deviation from the target in degrees (None
    without any), and the time within the band. `unmet`: the unmet condition, None if it settled.
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
    sample_s: float = SAMPLE_S,
) -> Settled:
    """Read the angle up to every `sample_s` until it has stayed within `band_deg` of `target` for `dwell_s`.

    `still_allowed` is called before every sample and raises what ends the motion (Stopped, LeaseRequired, Busy, …).
    """
    began, inside_since, angle, received = base.now(), None, None, False
    inside: list[float] = []
    row = servo.registers["current_angle"].parameter
    while base.now() - began <= timeout_s:
        still_allowed()
        try:
            angle = await requests.read(servo, row, POLL) / row.per_unit
        except NoResponse:
            inside_since, received = None, False
            inside.clear()
            continue
        now, received = base.now(), True
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
        await asyncio.sleep(sample_s)
    unmet: Unmet = "samples" if not received else "band" if inside_since is None else "dwell"
    stayed = 0.0 if inside_since is None else round(base.now() - inside_since, 4)
    return Settled(False, None, angle, len(inside), round(max(inside), 4) if inside else None, stayed, unmet)
