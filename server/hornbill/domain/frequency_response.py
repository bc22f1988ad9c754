"""Frequency responses: gain, phase and coherence by frequency, with bandwidth, delay and margins."""

from typing import Literal

from pydantic import Field
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.domain.fields import STRICT, Model
from hornbill.domain.note import Note
from hornbill.domain.run import RunConditions

Excitation = TypeAliasType("Excitation", Literal["chirp", "multisine"])
"""chirp: one sine of rising frequency. multisine: many sines at once, with random phases."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Estimate:
    """A measured value with its 95 % interval."""

    value: float = Field(description="Value, in the unit of its field.")
    low: float = Field(description="Lower end of the 95 % interval.")
    high: float = Field(description="Upper end of the 95 % interval.")


class FrequencyMetrics(Model):
    """Metrics of a frequency response, from reliable frequencies only. Null if not within them."""

    bandwidth_3db_hz: Estimate | None = Field(description="Frequency at which the gain falls below −3 dB, Hz.")
    bandwidth_90deg_hz: Estimate | None = Field(description="Frequency at which the phase falls below −90°, Hz.")
    delay_s: Estimate | None = Field(description="Delay between command and angle at low frequencies, s.")
    peak_db: Estimate | None = Field(description="Highest gain, dB.")
    peak_hz: float | None = Field(description="Frequency of the highest gain, Hz.")
    gain_margin_db: Estimate | None = Field(
        description="Factor by which the open-loop gain may rise until the loop hunts, dB."
    )
    gain_margin_hz: float | None = Field(description="Frequency at which the loop would hunt, Hz.")
    phase_margin_deg: Estimate | None = Field(
        description="Phase lag that may be added at an open-loop gain of 1 until the loop hunts, °."
    )
    phase_margin_hz: float | None = Field(description="Frequency of an open-loop gain of 1, Hz.")


class FrequencyCurve(Model):
    """Response at one amplitude. Lists have one value per frequency; empty in lists of runs."""

    amplitude_deg: float = Field(description="Peak amplitude of the command about the start angle, °.")
    peak_deg: float = Field(description="Largest distance of the horn from the start angle, °.")
    frequency_hz: list[float] = Field(description="Frequencies, rising, Hz.")
    gain_db: list[float] = Field(description="Gain from command to angle, dB.")
    gain_error_db: list[float] = Field(description="Half of the 95 % interval of the gain, dB.")
    phase_deg: list[float] = Field(description="Phase from command to angle, not wrapped, °. Negative: the angle lags.")
    phase_error_deg: list[float] = Field(description="Half of the 95 % interval of the phase, °.")
    coherence: list[float] = Field(description="Share of the angle that the command explains, 0 to 1.")
    reliable: list[bool] = Field(
        description="Coherence above 0.9, gain known to ±1 dB, motion above the resolution. Do not use others."
    )
    samples: int = Field(description="Samples of the angle.")
    achieved_hz: float = Field(description="Samples per second.")
    slots: int = Field(description="Commands of the excitation.")
    missed_slots: int = Field(description="Commands that were not sent in time or not acknowledged.")
    metrics: FrequencyMetrics


class FrequencyResponse(RunConditions):
    """A completed frequency response with its test conditions."""

    excitation: Excitation = Field(description="chirp: one sine of rising frequency. multisine: many sines at once.")
    amplitude_deg: float = Field(description="Requested peak amplitude, °.")
    from_hz: float = Field(description="Lowest frequency, Hz.")
    to_hz: float = Field(description="Highest frequency, Hz.")
    duration_s: float = Field(description="Duration of the excitation at one amplitude, s.")
    start_deg: float = Field(description="Angle about which the horn moved, °.")
    curves: list[FrequencyCurve] = Field(
        description="Response at the requested amplitude; with a ladder at half, one and two times it, in this order."
    )
    dependence: Note | None = Field(
        description="How the response depends on the amplitude. Null without a ladder or if it does not."
    )
