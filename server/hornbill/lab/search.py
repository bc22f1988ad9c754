"""Search for better gains on an identified model. Pure.

Scores are times, so that gains which settle sooner are better (`scored`).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from hornbill.domain.plant import PlantConstants
from hornbill.lab.identification import Identified, variants
from hornbill.lab.metrics import DWELL_S
from hornbill.lab.model import EXPERT_GAINS, SAMPLE_S, Angles, Gains, Loop, Move
from hornbill.units import Raw

Goal = Literal["calm", "fast", "stiff"]

MARGIN_DEG: Final = {"calm": 50.0, "fast": 35.0, "stiff": 40.0}
"""Minimum phase margin by goal, °."""
OVERSHOOT_PCT: Final = {"calm": 2.0, "fast": 15.0, "stiff": 25.0}
"""Overshoot that is not penalized, % of the step."""
TAIL: Final = 0.35
"""Share of the time at the end in which a horn must be at rest."""
QUIET_DEG: Final = 0.12
"""Largest movement of a horn at rest, peak to peak, °."""
NARROWEST_RAW: Final = 2
"""Narrowest deadband that is tried, 0.1°. Narrower, every reading of the sensor is corrected."""

_P: Final = (0.06, 0.1, 0.16, 0.25, 0.4, 0.6, 0.8, 1.0, 1.3, 1.8, 2.5)
"""P gains that are tried, as shares of the default or of the present one."""
_D: Final = (0.0, 0.5, 1.0, 2.0)
_FINALISTS: Final = 10


@dataclass(frozen=True, slots=True)
class Task:
    """What to search for. `step_deg`: from `from_deg` and back, each measured for `dwell_s`. `band_deg`: settling band.

    `most_error_deg`: distance from the target at rest up to which a horn counts as settled there. `most_p`: highest P
    gain that may be tried, after higher ones did not work on the servo. `most_s`: time of the present gains, which no
    others may exceed.
    """

    goal: Goal
    from_deg: float
    step_deg: float
    dwell_s: float
    band_deg: float
    most_error_deg: float
    expert: bool = False
    most_p: Raw | None = None
    most_s: float | None = None


@dataclass(frozen=True, slots=True)
class Prediction:
    """Predicted behaviour, of the worse direction: settling time (s, None if it does not settle), overshoot (%),
    distance from the target at rest (°).

    `score`: time that decides (s). `quiet`: whether the horn is at rest at the end.
    """

    score: float
    settling_s: float | None
    overshoot_pct: float
    error_deg: float
    quiet: bool


@dataclass(frozen=True, slots=True)
class Proposal:
    """Gains that are best on the model, with their prediction, phase margin (°) and stiffness (stall torque per °)."""

    gains: dict[str, Raw]
    predicted: Prediction
    margin_deg: float
    stiffness: float
    tried: int


def predict(loop: Loop, constants: PlantConstants, task: Task, gains: Gains) -> Prediction:
    """Predict a step out and back."""
    there = task.from_deg + task.step_deg
    moves = [Move(there, task.dwell_s, gains), Move(task.from_deg, task.dwell_s, {})]
    found = loop.respond(constants, task.from_deg, moves)
    parts = [
        _judged(angles, begin, end, task, loop.delay_s)
        for angles, begin, end in zip(found, (task.from_deg, there), (there, task.from_deg), strict=True)
    ]
    settling = [one.settling_s for one in parts]
    return Prediction(
        max(one.score for one in parts),
        None if None in settling else max(one or 0.0 for one in settling),
        max(one.overshoot_pct for one in parts),
        max(one.error_deg for one in parts),
        all(one.quiet for one in parts),
    )


def _judged(angles: Angles, begin: float, end: float, task: Task, delay: float) -> Prediction:
    angles = np.round(angles, 1)  # as read
    times = np.arange(len(angles)) * SAMPLE_S + delay
    tail = angles[round(len(angles) * (1 - TAIL)) :]
    over = max(0.0, float(((angles - end) * np.sign(end - begin)).max()) / abs(end - begin) * 100)
    settling, error = settled(times, angles, end, task.band_deg)
    score = scored(settling, error, float(times[-1]), task.most_error_deg)
    return Prediction(score, settling, over, error, float(np.ptp(tail)) <= QUIET_DEG)


def settled(times: Angles, angles: Angles, end: float, band: float) -> tuple[float | None, float]:
    """Settling time (s, None if not settled) and distance from the target at rest (°).

    A horn that a load holds off its target settles to where it comes to rest.
    """
    tail = angles[2 * len(angles) // 3 :]
    rest = float(tail.mean())
    error = abs(rest - end)
    outside = np.flatnonzero(np.abs(angles - (end if error <= band else rest)) > band + 1e-6)
    last = 0 if not len(outside) else int(outside[-1]) + 1
    if last >= len(angles) or times[-1] - times[last] < DWELL_S:
        return None, float(np.sqrt(np.square(tail - end).mean()))
    return float(times[last]), error


def scored(settling: float | None, error: float, duration: float, most_error: float) -> float:
    """Time by which gains are compared, s: the whole time and more if the horn does not settle, or too far off."""
    if settling is None or error > most_error:
        return duration * (1.0 + error / most_error)
    return settling


def best(loop: Loop, found: Identified, task: Task) -> Proposal:
    """The best gains for the goal. The present gains are among those compared."""
    present = {key: loop.rows[key] for key in loop.ranges if key in loop.rows}
    cases, tried = variants(found), 0

    def cost(gains: Gains, constants: Sequence[PlantConstants]) -> float:
        nonlocal tried
        tried += 1
        return _cost(loop, task, gains, constants)

    grid = _grid(loop, task, present)
    ranked = sorted(grid, key=lambda one: cost(one, cases[:1]))[:_FINALISTS]
    scored = sorted(((cost(one, cases), index) for index, one in enumerate(ranked)))
    value, gains = scored[0][0], ranked[scored[0][1]]
    for share in (0.12, 0.05):
        improved = True
        rounds = 0
        while improved and rounds < 4:
            improved, rounds = False, rounds + 1
            for other in _neighbours(loop, task, gains, share):
                if (at := cost(other, cases)) < value * 0.995:
                    value, gains, improved = at, other, True
    tuned = loop.tuned(gains)
    return Proposal(
        gains, predict(loop, cases[0], task, gains), tuned.phase_margin_deg(cases[1]), tuned.stiffness, tried
    )


def _cost(loop: Loop, task: Task, gains: Gains, constants: Sequence[PlantConstants]) -> float:
    """Time, s, increased by everything that the goal excludes; lower is better."""
    tuned, goal = loop.tuned(gains), task.goal
    found = [predict(tuned, one, task, {}) for one in constants]
    mean = sum(one.score for one in found) / len(found)
    worst = max(one.score for one in found)
    time = found[0].score * 0.3 + mean * 0.3 + worst * 0.4
    excess = max(0.0, *(one.overshoot_pct - OVERSHOOT_PCT[goal] for one in found))
    noisy = sum(not one.quiet for one in found) / len(found)
    lacking = max(0.0, MARGIN_DEG[goal] - tuned.phase_margin_deg(constants[-1 if len(constants) == 1 else 1]))
    cost = time * (1.0 + excess / 20.0 + 2.0 * noisy + (lacking / 10.0) ** 2)
    if goal == "calm":
        cost *= 1.0 + 0.15 * (tuned.stiffness / max(loop.stiffness, 1e-9)) ** 0.5
    if goal == "stiff":
        settled = all(one.settling_s is not None for one in found) and not noisy
        firm = tuned.stiffness * (1.0 if settled else 0.3) / (1.0 + gains.get("angle_dead_band", 0) / 10.0)
        cost = (1.0 + 3 * noisy + (lacking / 10.0) ** 2 + excess / 20.0) * (1.0 + 0.2 * time) / max(firm, 1e-9)
    if task.most_s is not None:
        cost *= 1.0 + 10.0 * max(0.0, found[0].score / task.most_s - 0.95)
    return cost


def _grid(loop: Loop, task: Task, present: Mapping[str, Raw]) -> list[dict[str, Raw]]:
    p_default, d_default = 40, max(30, present.get("angle_d_gain", 0))
    p_range = loop.ranges["angle_p_gain"]
    highest = p_range[1] if task.most_p is None else min(task.most_p, p_range[1])
    shares = {*(p_default * one for one in _P), present["angle_p_gain"]}
    ps = sorted({round(min(max(one, p_range[0]), highest)) for one in shares})
    ds = sorted({_within(loop, "angle_d_gain", round(d_default * one)) for one in _D}) if loop.cascade else [None]
    bands = _bands(loop, task, present)
    boosts = [None]
    if "angle_boost" in loop.ranges:
        boosts = sorted({0, present["angle_boost"], *((20, 50) if not loop.cascade else (20,))})
    made: list[dict[str, Raw]] = [{**present, "angle_p_gain": min(present["angle_p_gain"], highest)}]
    for p in ps:
        for d in ds:
            for band in bands:
                for boost in boosts:
                    one = {**present, "angle_p_gain": p, "angle_dead_band": band}
                    if d is not None:
                        one["angle_d_gain"] = d
                    if boost is not None:
                        one["angle_boost"] = boost
                    made.append(one)
    return made


def _bands(loop: Loop, task: Task, present: Mapping[str, Raw]) -> list[Raw]:
    """Deadbands to try: never so wide that the horn may rest outside the settling band."""
    widest = max(NARROWEST_RAW, round(task.band_deg * 10) - 1)
    return sorted({min(max(one, NARROWEST_RAW), widest) for one in (2, 4)})


def _within(loop: Loop, key: str, raw: Raw) -> Raw:
    low, high = loop.ranges[key]
    return min(max(raw, low), high)


def _neighbours(loop: Loop, task: Task, gains: dict[str, Raw], share: float) -> Iterable[dict[str, Raw]]:
    steps: dict[str, Iterable[Raw]] = {"angle_p_gain": _around(gains["angle_p_gain"], share)}
    if loop.cascade:
        steps["angle_d_gain"] = _around(gains["angle_d_gain"], share)
        if task.expert:
            steps |= {key: _around(gains[key], 2 * share) for key in EXPERT_GAINS if key in gains}
    steps["angle_dead_band"] = (gains["angle_dead_band"] - 1, gains["angle_dead_band"] + 1)
    if "angle_boost" in gains:
        steps["angle_boost"] = _around(gains["angle_boost"], 2 * share)
    widest = max(NARROWEST_RAW, round(task.band_deg * 10) - 1)
    for key, values in steps.items():
        for raw in values:
            value = _within(loop, key, raw)
            if key == "angle_dead_band":
                value = min(max(value, NARROWEST_RAW), widest)
            if key == "angle_p_gain" and task.most_p is not None:
                value = min(value, task.most_p)
            if value != gains[key]:
                yield {**gains, key: value}


def _around(raw: Raw, share: float) -> tuple[Raw, Raw]:
    step = max(1, round(raw * share))
    return raw - step, raw + step
