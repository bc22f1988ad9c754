"""Step tests: metrics, samples and stored runs."""

from typing import Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from hornbill.domain.fields import STRICT, Model
from hornbill.domain.note import Note
from hornbill.domain.run import RunConditions


@dataclass(frozen=True, slots=True, config=STRICT)
class StepMetrics:
    """Metrics of one step. All times ± `sample_s`. Null if not reached.

    `hunting_hz` is also measured at the end of a step that never settles because the horn oscillates. It is null with
    fewer than 100 samples per second.
    """

    sample_s: float = Field(description="Longest time between two samples, which is the resolution of all times, s.")
    delay_s: float | None = Field(description="Time until the horn starts to move, s.")
    rise_s: float | None = Field(description="Time from 10 % to 90 % of the step, s.")
    crossing_s: float | None = Field(description="Time until the target is first reached, s.")
    peak_deg: float | None = Field(description="Farthest angle, °.")
    overshoot_pct: float | None = Field(description="Overshoot, % of the step.")
    settling_s: float | None = Field(description="Settling time: until the angle stays within the band, s.")
    steady_state_error_deg: float | None = Field(description="Deviation from the target after settling, °.")
    peak_speed_rpm: float | None = Field(description="Greatest speed, rpm.")
    hunting: Literal["none", "slight", "hunting"] = Field(description="Oscillation after settling.")
    hunting_rms_deg: float | None = Field(description="Oscillation amplitude, RMS, °.")
    hunting_hz: float | None = Field(description="Oscillation frequency after settling, Hz.")


class StepTrace(Model):
    """One step, with samples from the command on."""

    direction: Literal["there", "back"] = Field(description="there: to the target. back: to the start angle.")
    from_deg: float = Field(description="Start angle, °.")
    to_deg: float = Field(description="Target angle, °.")
    t: list[float] = Field(description="Time of each sample after the command, s.")
    angle_deg: list[float] = Field(description="Angle of each sample, °.")
    metrics: StepMetrics


class StepRun(RunConditions):
    """A completed step test with its test conditions."""

    step_deg: float = Field(description="Step size, °.")
    band_deg: float = Field(description="Settling band around the target, °.")
    achieved_hz: float = Field(description="Samples per second.")
    steps: list[StepTrace] = Field(description="Steps in order.")


class RunOverlay(Model):
    """Several runs for comparison. `differences`: the rows that differ, in row order."""

    runs: list[StepRun] = Field(description="Runs in the requested order.")
    differences: dict[str, list[bool | int | float | str | None]] = Field(
        description="Rows that differ, one value per run."
    )
    comparable: bool = Field(description="Metrics can be compared: same servo, set-up, procedure and step.")
    not_comparable: Note | None = Field(description="Reason why not. Null if comparable.")
