"""Verdicts on runs: one sentence on what a servo did, with the decisive figures, and what to try next. Pure functions.

All thresholds are in THRESHOLDS, which `docs/explanation/tuning.md` lists. Each function checks its cases in order of
severity, and the first that applies is the verdict.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, log, pi, sqrt
from typing import Final

import numpy as np

from hornbill.domain.fields import Param, known
from hornbill.domain.frequency_response import Estimate, FrequencyCurve, FrequencyMetrics
from hornbill.domain.note import Note, NoteCode
from hornbill.domain.step_test import StepTrace
from hornbill.domain.verdict import Verdict
from hornbill.schema.scale import Value


@dataclass(frozen=True, slots=True)
class Threshold:
    """A limit between two verdicts, in `unit`, and what it decides."""

    value: float
    unit: str
    decides: str


THRESHOLDS: Final[Mapping[str, Threshold]] = {
    "moved": Threshold(0.2, "of the step", "less travel is *did not move*"),
    "low_supply": Threshold(0.9, "of the nominal voltage", "a lower supply is *limited by the supply*"),
    "at_speed_limit": Threshold(0.95, "of the speed limit", "a faster horn is *limit reached* (0x25 on)"),
    "rest": Threshold(0.2, "°", "a horn that moves less in the last 0.2 s is at rest"),
    "off_target": Threshold(0.5, "°", "a larger error at rest is *off its target*"),
    "deadband_slack": Threshold(0.2, "°", "an error at rest up to this much above the deadband is due to the deadband"),
    "swings": Threshold(3, "half swings", "as many beyond half of the settling band before it settles are *ringing*"),
    "overshoot": Threshold(10, "% of the step", "more is *overshoots*, if it is also beyond the settling band"),
    "slow": Threshold(0.25, "s", "settling later than this plus the travel at *slow_speed* is *slow*"),
    "slow_speed": Threshold(50, "rpm", "see *slow*"),
    "hunting_share": Threshold(0.8, "of the P gain", "advised for a horn that hunts"),
    "damping": Threshold(0.6, "damping ratio", "aim of the advised P gain for a horn that rings or overshoots"),
    "least_share": Threshold(0.5, "of the P gain", "lowest advised P gain: change it in steps"),
    "resonance": Threshold(6, "dB", "a higher peak of the gain is *resonant*"),
    "phase_margin": Threshold(35, "°", "a smaller phase margin is a *low margin*"),
    "gain_margin": Threshold(6, "dB", "a smaller gain margin is a *low margin*; aim of the advised P gain"),
    "missed": Threshold(0.05, "of the commands", "with more missed, a poor coherence is blamed on the bus"),
    "raise_share": Threshold(1.25, "of the P gain", "advised for a slow horn"),
}  # fmt: skip
"""By name. The only place of these figures."""


def threshold(name: str) -> float:
    """Value of a threshold."""
    return THRESHOLDS[name].value


@dataclass(frozen=True, slots=True)
class RunFacts:
    """Conditions that verdicts depend on. `parameters` as displayed, by key; `nominal_v` None if unknown."""

    parameters: Mapping[str, Value]
    smoothing: bool = False
    limits: tuple[str, ...] = ()
    """Rows of the limits that were reached."""
    voltage_v: float | None = None
    nominal_v: float | None = None

    @property
    def cascade(self) -> bool:
        """Whether speed and torque control (0x25) is on, so that D gain, speed and torque limits have an effect."""
        return self.parameters.get("speed_torque_control") is True

    def number(self, key: str) -> float | None:
        """A value as a number. None if unknown or inactive."""
        value = self.parameters.get(key)
        return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


@dataclass(frozen=True, slots=True)
class _Step:
    """One step with what its metrics do not say."""

    trace: StepTrace
    travel: float
    """Farthest from the start angle towards or away from the target, share of the step."""
    swings: int
    """Half swings beyond half of the band, from the first crossing on."""
    ring_hz: float | None
    damping: float | None
    """Damping ratio from the decay of the swings, or from the overshoot. None if neither."""
    rest_error_deg: float | None
    """Deviation from the target at the end. None if still moving."""


def of_steps(steps: Sequence[StepTrace], band_deg: float, facts: RunFacts) -> Verdict:
    """Verdict on a step test: that of its worst step. Never raises for finite samples."""
    seen = [_look(one, band_deg) for one in steps]
    for case in _CASES:
        found = [verdict for one in seen if (verdict := case(one, band_deg, facts)) is not None]
        if found:
            return found[0]
    return _settles(seen)


def _look(trace: StepTrace, band_deg: float) -> _Step:
    t, angle = np.asarray(trace.t, dtype=float), np.asarray(trace.angle_deg, dtype=float)
    step = trace.to_deg - trace.from_deg
    if not len(t) or not step:
        return _Step(trace, 0.0, 0, None, None, None)
    sign = 1.0 if step > 0 else -1.0
    error = (angle - trace.to_deg) * sign
    crossed = trace.metrics.crossing_s
    after = t >= crossed if crossed is not None else np.zeros(len(t), dtype=bool)
    peaks = _peaks(t[after], error[after], band_deg / 2)
    late = t >= t[-1] - 0.2
    still = float(np.ptp(angle[late])) <= threshold("rest")
    return _Step(
        trace,
        travel=float(np.abs(angle - trace.from_deg).max() / abs(step)),
        swings=len(peaks),
        ring_hz=_rate(peaks),
        damping=_damping(peaks, trace.metrics.overshoot_pct),
        rest_error_deg=float(error[late].mean()) if still else None,
    )


def _peaks(t: np.ndarray, error: np.ndarray, least: float) -> list[tuple[float, float]]:
    """Extremes (time, error) of alternating sign, each beyond `least`."""
    found: list[tuple[float, float]] = []
    for at, value in zip(t.tolist(), error.tolist(), strict=True):
        if abs(value) <= least:
            continue
        if found and (found[-1][1] > 0) == (value > 0):
            if abs(value) > abs(found[-1][1]):
                found[-1] = (at, value)
        else:
            found.append((at, value))
    return found


def _rate(peaks: Sequence[tuple[float, float]]) -> float | None:
    """Frequency of a swing from its extremes, Hz."""
    if len(peaks) < 2 or peaks[-1][0] <= peaks[0][0]:
        return None
    return (len(peaks) - 1) / 2 / (peaks[-1][0] - peaks[0][0])


def _damping(peaks: Sequence[tuple[float, float]], overshoot_pct: float | None) -> float | None:
    """Damping ratio of a linear second-order loop with the same decay from one half swing to the next."""
    ratios = [abs(after / before) for (_, before), (_, after) in pairwise(peaks) if before]
    if ratios:
        ratio = float(np.exp(np.mean(np.log(np.maximum(ratios, 1e-6)))))
    elif overshoot_pct:
        ratio = overshoot_pct / 100
    else:
        return None
    if not 0 < ratio < 1:
        return 0.0
    decay = -log(ratio)
    return decay / sqrt(pi**2 + decay**2)


def _moved_not(one: _Step, _band: float, facts: RunFacts) -> Verdict | None:
    if one.travel >= threshold("moved"):
        return None
    step = abs(one.trace.to_deg - one.trace.from_deg)
    moved = one.travel * step
    text = f"Did not move: {moved:.1f}° of {step:.1f}°."
    torque = facts.number("torque_limit_cw") if facts.cascade else None
    advice = _note(
        "try_check_free",
        "Check whether the horn is blocked or overloaded"
        + (
            f", and whether the torque limit of {torque:g} % is too low."
            if torque is not None and torque < 100
            else "."
        ),
        **known(torque_limit_pct=torque if torque is not None and torque < 100 else None),
    )
    return Verdict("failure", "did_not_move", text, advice, {"moved_deg": round(moved, 2), "step_deg": round(step, 2)})


def _hunts(one: _Step, band: float, facts: RunFacts) -> Verdict | None:
    measured = one.trace.metrics
    settled = measured.settling_s is not None
    if measured.hunting == "none" or (settled and measured.hunting != "hunting"):
        return None
    swing = (measured.hunting_rms_deg or 0.0) * sqrt(2)
    rate = "" if measured.hunting_hz is None else f" at {measured.hunting_hz:.0f} Hz"
    gain = facts.number("angle_p_gain")
    boost = facts.number("angle_boost") or 0.0
    params = known(rate_hz=_rounded(measured.hunting_hz, 1), swing_deg=round(swing, 2), p_gain=gain)
    text = f"Hunts{rate}, ±{swing:.1f}°: P gain{'' if gain is None else f' {gain:g}'} is too high for this load."
    if boost > 0 and swing < band:
        advice = _note("try_lower_boost", f"Lower the boost of {boost:g} %, or widen the deadband.", boost_pct=boost)
        text = f"Hunts{rate}, ±{swing:.1f}°, with a boost of {boost:g} %."
        return Verdict("warning", "hunts", text, advice, {**params, "boost_pct": boost})
    undamped = facts.cascade and facts.number("angle_d_gain") == 0
    return Verdict("warning", "hunts", text, _lower_p(gain, threshold("hunting_share"), d_gain=undamped), params)


def _low_supply(_one: _Step, _band: float, facts: RunFacts) -> Verdict | None:
    if facts.voltage_v is None or not facts.nominal_v or facts.voltage_v >= threshold("low_supply") * facts.nominal_v:
        return None
    share = facts.voltage_v / facts.nominal_v * 100
    text = f"Limited by the supply: {facts.voltage_v:.1f} V is {share:.0f} % of nominal, so speed and torque are lower."
    advice = _note("try_supply", f"Measure with a supply of {facts.nominal_v:g} V.", nominal_v=facts.nominal_v)
    params = known(supply_v=round(facts.voltage_v, 2), supply_pct=round(share), nominal_v=facts.nominal_v)
    return Verdict("notice", "supply_limited", text, advice, params)


def _smoothing(one: _Step, _band: float, facts: RunFacts) -> Verdict | None:
    if not facts.smoothing:
        return None
    settling = one.trace.metrics.settling_s
    settled = "does not settle" if settling is None else f"settles in {_ms(settling)}"
    text = f"Smoothing is on, so this is the response of the smoothing, which {settled}."
    advice = _note("try_smoothing_off", "Turn smoothing (0x22) off while tuning.")
    return Verdict("notice", "smoothing_measured", text, advice, known(settling_ms=_whole_ms(settling)))


def _limit(one: _Step, _band: float, facts: RunFacts) -> Verdict | None:
    rows, speed = list(facts.limits), one.trace.metrics.peak_speed_rpm or 0.0
    clockwise = one.trace.to_deg > one.trace.from_deg
    row = "speed_limit_cw" if clockwise else "speed_limit_ccw"
    limit = abs(facts.number(row) or 0.0)
    if facts.cascade and limit and speed >= threshold("at_speed_limit") * limit and row not in rows:
        rows.append(row)
    if not rows:
        return None
    names = ", ".join(row.replace("_", " ").replace(" ccw", " CCW").replace(" cw", " CW") for row in rows)
    text = f"A limit was reached ({names}): these are the figures of the limit, not of the control loop."
    advice = _note("try_smaller_step", "Measure a smaller step, or raise the limit.", keys=[*rows])
    return Verdict("notice", "limit_reached", text, advice, {"keys": [*rows]})


def _off_target(one: _Step, band: float, facts: RunFacts) -> Verdict | None:
    error = one.rest_error_deg
    if error is None or abs(error) <= threshold("off_target"):
        return None
    side = "before" if error < 0 else "beyond"
    deadband = facts.number("angle_dead_band") or 0.0
    params = known(error_deg=round(abs(error), 2), side=side, dead_band_deg=deadband)
    stands = f"Stops {abs(error):.1f}° {side} its target"
    level = "notice" if abs(error) <= band else "warning"
    if abs(error) <= deadband + threshold("deadband_slack"):
        text = f"{stands}, within its deadband of {deadband:g}°."
        return Verdict(
            level, "off_target", text, _note("try_narrow_deadband", "Narrow the deadband (0x2E)."),
            {**params, "why": "deadband"},
        )  # fmt: skip
    torque = min((abs(facts.number(f"torque_limit_{side}") or 100.0) for side in ("cw", "ccw")), default=100.0)
    if facts.cascade and torque < 100.0:
        text = f"{stands}: load or friction needs more than the torque limit of {torque:g} %, or a higher P gain."
        return Verdict(
            level, "off_target", text, _note("try_raise_torque", "Raise the torque limit.", torque_limit_pct=torque),
            {**params, "why": "torque_limit", "torque_limit_pct": torque},
        )  # fmt: skip
    return Verdict(
        level, "off_target", f"{stands}: load or friction.",
        _raise_p(facts.number("angle_p_gain")), {**params, "why": "load"},
    )  # fmt: skip


def _rings(one: _Step, _band: float, facts: RunFacts) -> Verdict | None:
    if one.swings < threshold("swings"):
        return None
    settling = one.trace.metrics.settling_s
    rate = "" if one.ring_hz is None else f" at {one.ring_hz:.0f} Hz"
    after = "" if settling is None else f" and settles in {_ms(settling)}"
    text = f"Rings{rate}: swings {one.swings} times beyond its target{after}."
    params = known(rate_hz=_rounded(one.ring_hz, 1), swings=one.swings, settling_ms=_whole_ms(settling))
    return Verdict("warning", "rings", text, _damp(one, facts), params)


def _overshoots(one: _Step, band: float, facts: RunFacts) -> Verdict | None:
    over = one.trace.metrics.overshoot_pct or 0.0
    beyond = over / 100 * abs(one.trace.to_deg - one.trace.from_deg)
    if over <= threshold("overshoot") or beyond <= band:
        return None
    settling = one.trace.metrics.settling_s
    after = "" if settling is None else f" and settles in {_ms(settling)}"
    text = f"Overshoots by {over:.0f} %{after}."
    params = known(overshoot_pct=round(over, 1), settling_ms=_whole_ms(settling))
    return Verdict("notice", "overshoots", text, _damp(one, facts), params)


def _unsettled(one: _Step, band: float, _facts: RunFacts) -> Verdict | None:
    if one.trace.metrics.settling_s is not None:
        return None
    took = one.trace.t[-1] if one.trace.t else 0.0
    text = f"Does not settle to ±{band:g}° within {took:.1f} s."
    advice = _note("try_longer", "Measure longer, or raise the P gain.", dwell_s=round(2 * took, 1))
    return Verdict("warning", "not_settled", text, advice, {"band_deg": band, "dwell_s": round(took, 2)})


def _slow(one: _Step, _band: float, facts: RunFacts) -> Verdict | None:
    settling = one.trace.metrics.settling_s or 0.0
    travel = abs(one.trace.to_deg - one.trace.from_deg)
    limit = threshold("slow") + travel / (threshold("slow_speed") * 6)
    if settling <= limit:
        return None
    text = f"Slow: settles in {_ms(settling)}, no hunting."
    params = known(settling_ms=_whole_ms(settling), limit_ms=_whole_ms(limit))
    return Verdict("notice", "slow", text, _raise_p(facts.number("angle_p_gain")), params)


def _settles(steps: Sequence[_Step]) -> Verdict:
    """Verdict on steps without any peculiarity."""
    settling = max((one.trace.metrics.settling_s or 0.0 for one in steps), default=0.0)
    text = f"Good: settles in {_ms(settling)}, no hunting."
    return Verdict("ok", "settles", text, None, known(settling_ms=_whole_ms(settling)))


_CASES: Final[Iterable[Callable[[_Step, float, RunFacts], Verdict | None]]] = (
    _moved_not, _hunts, _off_target, _smoothing, _limit, _rings, _unsettled, _low_supply, _overshoots, _slow,
)  # fmt: skip
"""Cases in order of severity."""


def of_frequency_response(curves: Sequence[FrequencyCurve], dependence: Note | None, facts: RunFacts) -> Verdict:
    """Verdict on a frequency response: that of the curve at the requested amplitude. Never raises."""
    if not curves:
        return Verdict("failure", "not_reliable", "Not reliable: nothing was measured.", None, {})
    curve = curves[len(curves) // 2]
    metrics, gain = curve.metrics, facts.number("angle_p_gain")
    reliable = [hz for hz, good in zip(curve.frequency_hz, curve.reliable, strict=True) if good]
    if not reliable:
        text = "Not reliable at any frequency: the command explains too little of the motion."
        return Verdict("failure", "not_reliable", text, _more_signal(curve), {"coherence": 0.9})
    if facts.smoothing:
        text = "Smoothing is on, so this is the response of the smoothing."
        advice = _note("try_smoothing_off", "Turn smoothing (0x22) off while tuning.")
        return Verdict("notice", "smoothing_measured", text, advice, _figures(metrics, reliable))
    margins = _margins(metrics)
    if metrics.peak_db is not None and metrics.peak_hz is not None and metrics.peak_db.value > threshold("resonance"):
        name = "P gain" if gain is None else f"P gain {gain:g}"
        text = f"Resonant: +{metrics.peak_db.value:.0f} dB at {metrics.peak_hz:.0f} Hz{margins}. "
        text += f"{name} is high for this load."
        return Verdict(
            "warning", "resonant", text, _lower_p(gain, _margin_share(metrics), d_gain=facts.cascade),
            {**_figures(metrics, reliable), **known(p_gain=gain)},
        )  # fmt: skip
    phase, factor = metrics.phase_margin_deg, metrics.gain_margin_db
    if (phase is not None and phase.value < threshold("phase_margin")) or (
        factor is not None and factor.value < threshold("gain_margin")
    ):
        text = f"Close to hunting{margins}."
        return Verdict(
            "warning", "low_margin", text, _lower_p(gain, _margin_share(metrics), d_gain=facts.cascade),
            {**_figures(metrics, reliable), **known(p_gain=gain)},
        )  # fmt: skip
    if metrics.bandwidth_3db_hz is not None:
        follows = f"Follows to {metrics.bandwidth_3db_hz.value:.1f} Hz (−3 dB){margins}."
    else:
        follows = f"Follows from {reliable[0]:.1f} to {reliable[-1]:.1f} Hz, without a limit in this range{margins}."
    if dependence is not None:
        text = f"{follows} {dependence.text}"
        return Verdict("notice", "amplitude_dependent", text, None, _figures(metrics, reliable))
    return Verdict("ok", "follows", follows, None, _figures(metrics, reliable))


def _figures(metrics: FrequencyMetrics, reliable: Sequence[float]) -> dict[str, Param]:
    """Decisive figures of a frequency response."""

    def value(one: Estimate | None, digits: int) -> float | None:
        return None if one is None else _rounded(one.value, digits)

    return known(
        bandwidth_hz=value(metrics.bandwidth_3db_hz, 2), peak_db=value(metrics.peak_db, 1),
        peak_hz=_rounded(metrics.peak_hz, 1), phase_margin_deg=value(metrics.phase_margin_deg, 0),
        gain_margin_db=value(metrics.gain_margin_db, 1), from_hz=_rounded(reliable[0], 2),
        to_hz=_rounded(reliable[-1], 2),
    )  # fmt: skip


def _margins(metrics: FrequencyMetrics) -> str:
    if metrics.phase_margin_deg is not None:
        return f", phase margin {metrics.phase_margin_deg.value:.0f}°"
    return "" if metrics.gain_margin_db is None else f", gain margin {metrics.gain_margin_db.value:.0f} dB"


def _margin_share(metrics: FrequencyMetrics) -> float:
    """Share of the P gain that leaves the wanted gain margin. The open-loop gain is proportional to the P gain."""
    if metrics.gain_margin_db is None:
        return threshold("hunting_share")
    share = 10 ** ((metrics.gain_margin_db.value - threshold("gain_margin")) / 20)
    return min(max(share, threshold("least_share")), 0.95)


def _more_signal(curve: FrequencyCurve) -> Note:
    missed = curve.missed_slots / curve.slots if curve.slots else 0.0
    if missed > threshold("missed"):
        text = f"{missed:.0%} of the commands were missed. Check the bus, then measure again."
        return _note("try_check_bus", text, missed_pct=round(missed * 100))
    amplitude = round(2 * curve.amplitude_deg, 1)
    text = f"Measure with an amplitude of {amplitude:g}° or for a longer time."
    return _note("try_larger_amplitude", text, amplitude_deg=amplitude)


def _damp(one: _Step, facts: RunFacts) -> Note | None:
    """Advice for a loop with too little damping: the P gain for which a second-order loop would have enough."""
    gain, found, aim = facts.number("angle_p_gain"), one.damping, threshold("damping")
    share = threshold("hunting_share") if found is None else (found / aim) ** 2
    return _lower_p(gain, min(max(share, threshold("least_share")), 0.95), d_gain=facts.cascade)


def _lower_p(gain: float | None, share: float, *, d_gain: bool = False) -> Note:
    other = " or raise the D gain," if d_gain else ""
    improve = " or let Improve find the stiffest gains that do not hunt."
    if gain is None or gain < 2:
        return _note("try_lower_p", f"Lower the P gain,{other}{improve}", d_gain=d_gain)
    try_p = max(1, int(gain * share))
    return _note("try_lower_p", f"Try P gain {try_p} or less,{other}{improve}", p_gain=try_p, d_gain=d_gain)


def _raise_p(gain: float | None) -> Note:
    if gain is None:
        return _note("try_higher_p", "Raise the P gain (0x2C) in small steps.")
    try_p = max(int(gain) + 1, round(gain * threshold("raise_share")))
    return _note("try_higher_p", f"Try P gain {try_p}, and lower it again if the horn hunts.", p_gain=try_p)


def _note(code: NoteCode, text: str, **params: Param) -> Note:
    return Note(text, code, params)


def _rounded(value: float | None, digits: int) -> float | None:
    return round(value, digits) if value is not None and isfinite(value) else None


def _whole_ms(seconds: float | None) -> int | None:
    return None if seconds is None else round(seconds * 1000)


def _ms(seconds: float) -> str:
    return f"{seconds * 1000:.0f} ms" if seconds < 0.9995 else f"{seconds:.2f} s"
