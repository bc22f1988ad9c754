"""Improve, without a bus: baseline, identification, search, confirmation by measured steps, and what is kept.

The servo is a `Subject`, so that a simulated one without a bus can take its place.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal, Protocol

import numpy as np

from hornbill.domain.step_test import StepTrace
from hornbill.lab import identification, metrics, search
from hornbill.lab.identification import Chain, Identified
from hornbill.lab.model import Gains, Loop
from hornbill.lab.search import Goal, Proposal, Task
from hornbill.servo.runtime.computing import Compute, inline
from hornbill.units import Raw

LARGEST_ERROR: Final = 0.25
"""Distance from the target, as a share of the step, beyond which a horn at rest has not settled."""
SMALL: Final = 0.4
"""First amplitude of each set of gains, as a share of the step."""
REPEATS: Final = 2
"""Steps out and back on which a set of gains is judged."""
ROUNDS: Final = 3
"""Maximum number of sets of gains that are tried."""
CALMER: Final = 4
"""Maximum number of times gains are lowered until a hunting servo stops hunting."""
SOONER: Final = 0.95
"""Share of the time before that counts as sooner."""
FIRMER: Final = 1.05
ERROR_DEG: Final = 0.15
"""Difference in the distance from the target that does not count, °: more than one step of the sensor."""
AS_PREDICTED: Final = 0.08
"""Difference between measured and predicted time up to which the model needs no further measurement, as a share."""
OVERSHOOT_PCT: Final = 3.0
"""Difference in overshoot that counts as calmer, % of the step."""
RESOLUTION_S: Final = 0.004
"""Resolution of measured times: two samples."""

MOVED: Final = 0.5
"""Share of a step that the horn must have moved at its end."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Goal and motion of an improvement: steps of `step_deg` from `from_deg` and back, each measured for `dwell_s`."""

    goal: Goal
    from_deg: float
    step_deg: float
    dwell_s: float
    band_deg: float
    expert: bool = False

    def task(self, most_error_deg: float) -> Task:
        """What to search for."""
        return Task(
            self.goal, self.from_deg, self.step_deg, self.dwell_s, self.band_deg, most_error_deg, self.expert
        )  # fmt: skip

    @property
    def most_steps(self) -> int:
        """Maximum number of steps of an improvement."""
        return 2 * (1 + REPEATS) * (1 + ROUNDS) + 4 * CALMER

    @property
    def longest_s(self) -> float:
        """Maximum duration of its motion, s."""
        return self.most_steps * (self.dwell_s + 0.3)


class Stalled(Exception):
    """The horn did not move as far as commanded: blocked, overloaded, or with gains that are too low for its load."""

    def __init__(self, trace: StepTrace) -> None:
        super().__init__("stalled")
        self.trace = trace


class Watch:
    """Watches the angles of one step for hunting, and for a horn that is far from where it should be."""

    def __init__(self, begin_deg: float, to_deg: float, band_deg: float) -> None:
        self._to = to_deg
        self._band = 1.2 * band_deg
        self._way = 1.0 if to_deg >= begin_deg else -1.0
        self._most = 1.5 * abs(to_deg - begin_deg) + 3.0
        self._peaks: list[float] = []
        self._side = 0.0

    def add(self, angle_deg: float) -> "str | None":
        """Take the next angle. Returns "hunting", "away", or None.

        Hunting: six swings beyond the settling band that do not become smaller. Away: an overshoot of 1.5 steps and 3°.
        """
        over = (angle_deg - self._to) * self._way
        if over > self._most:
            return "away"
        if abs(over) > self._band:
            side = 1.0 if over > 0 else -1.0
            if side != self._side:
                if side < 0 and not self._peaks and not self._side:
                    return None  # still on its way
                self._side = side
                self._peaks.append(0.0)
            self._peaks[-1] = max(self._peaks[-1], abs(over))
        peaks = self._peaks
        return "hunting" if len(peaks) > 6 and min(peaks[-3:-1]) > 0.85 * max(peaks[-6:-3]) else None


class Subject(Protocol):
    """A servo, whose horn is at `Plan.from_deg` in the beginning."""

    async def step(self, to_deg: float, dwell_s: float) -> "Measured":
        """Command an angle and measure. Ends early if it hunts or is away (`Watch`)."""
        ...

    async def home(self) -> None:
        """Command the start and wait until the horn is at rest."""
        ...

    async def write(self, gains: Gains) -> None:
        """Write gains, temporarily."""
        ...


@dataclass(frozen=True, slots=True)
class Measured:
    """A step, and why it ended early: hunting, away, or None."""

    trace: StepTrace
    ended: str | None = None

    @property
    def hunts(self) -> bool:
        """Whether it did not become calm."""
        return self.ended is not None or self.trace.metrics.hunting == "hunting"


def measured(
    direction: Literal["there", "back"],
    to_deg: float,
    t: list[float],
    angles: list[float],
    ended: str | None,
    band_deg: float,
) -> Measured:
    """A step from its samples, the first of which is from before the command."""
    begin = angles[0]
    # a horn that was there already has no step; its metrics are those of the smallest one
    step_from = begin if begin != to_deg else begin - 0.1
    made = metrics.of_step(t, angles, step_from, to_deg, band_deg=band_deg)
    trace = StepTrace(direction=direction, from_deg=begin, to_deg=to_deg, t=t, angle_deg=angles, metrics=made)
    return Measured(trace, ended)


@dataclass(frozen=True, slots=True)
class Score:
    """Worst of several measured steps. `time_s`: time by which gains are compared (`search.scored`), s."""

    time_s: float
    settling_s: float | None
    overshoot_pct: float
    hunting: str
    error_deg: float
    stiffness: float

    @classmethod
    def of(cls, steps: Sequence[Measured], plan: Plan, stiffness: float) -> "Score":
        """Judge steps."""
        found = [
            search.settled(np.asarray(one.trace.t), np.asarray(one.trace.angle_deg), one.trace.to_deg, plan.band_deg)
            for one in steps
        ]
        most = max(plan.band_deg, LARGEST_ERROR * abs(plan.step_deg))
        times = [None if one.ended or error > most else time for one, (time, error) in zip(steps, found, strict=True)]
        scores = [search.scored(time, error, plan.dwell_s, most) for time, (_, error) in zip(times, found, strict=True)]
        levels = ["hunting" if one.hunts else one.trace.metrics.hunting for one in steps]
        return cls(
            max(scores),
            None if None in times else max(one or 0.0 for one in times),
            max(one.trace.metrics.overshoot_pct or 0.0 for one in steps),
            max(levels, key=("none", "slight", "hunting").index),
            max(error for _, error in found),
            stiffness,
        )


@dataclass(slots=True)
class Trial:
    """One proposal and what was measured with it. `score`: None if it was abandoned, for the reason `ended`."""

    proposal: Proposal
    score: Score | None = None
    ended: str | None = None


@dataclass(slots=True)
class Improvement:
    """Course and result of an improvement. `kept`: the gains to keep, None to restore the previous ones."""

    before: Score | None = None
    baseline: list[Measured] = field(default_factory=list[Measured])
    identified: Identified | None = None
    trials: list[Trial] = field(default_factory=list[Trial])
    confirmed: list[Measured] = field(default_factory=list[Measured])
    after: Score | None = None
    predicted: Proposal | None = None
    kept: dict[str, Raw] | None = None


async def improve(
    subject: Subject,
    loop: Loop,
    plan: Plan,
    compute: Compute = inline,
    tell: Callable[[str, "Improvement"], None] = lambda _phase, _made: None,
) -> Improvement:
    """Improve a servo as far as measured steps confirm it.

    `compute` runs fits and searches. `tell` is called at the beginning of each phase: baseline, identify, search,
    confirm. Raises Stalled if the horn does not move with its present gains.

    The gains written last remain: the caller keeps or restores them by `kept`. The horn ends at its start.
    """
    made, present = Improvement(), {key: loop.rows[key] for key in loop.ranges if key in loop.rows}
    tell("baseline", made)
    small = await _pairs(subject, plan, SMALL, 1)
    made.baseline = small if any(one.hunts for one in small) else await _pairs(subject, plan, 1.0, REPEATS)
    made.before = Score.of(made.baseline, plan, loop.stiffness)
    tell("identify", made)
    calm, chain = present, _chain(present, [*small, *made.baseline[:2]])
    if any(one.hunts for one in made.baseline):
        calm, chain = await _calmed(subject, loop, plan, present)
    if not chain:
        return made
    chains = [chain]
    made.identified = found = await compute(identification.fit, loop, chains, None)
    hunted = made.before.hunting == "hunting"
    task = plan.task(most_error(0.0 if hunted else made.before.error_deg, plan))
    task = replace(task, most_s=None if hunted else made.before.time_s)
    best: tuple[Trial, list[Measured]] | None = None
    for _ in range(ROUNDS):
        tell("search", made)
        proposal: Proposal = await compute(search.best, _placed(loop, found), found, task)
        found_better = best is not None and _is_better(plan, made.before, best[0])
        if any(trial.proposal.gains == proposal.gains for trial in made.trials):
            if found_better:
                break
            task = _lower(task, proposal, 0.85)
            proposal = await compute(search.best, _placed(loop, found), found, task)
        if found_better and best is not None and not _promising(plan, best[0], proposal):
            break
        if proposal.gains == present and not any(one.hunts for one in made.baseline):
            break
        trial = Trial(proposal)
        made.trials.append(trial)
        tell("confirm", made)
        await subject.write(proposal.gains)
        try:
            small = steps = await _pairs(subject, plan, SMALL, 1)
            if not any(one.hunts for one in small):
                steps = await _pairs(subject, plan, 1.0, REPEATS)
            bad = next((one.ended or "hunting" for one in steps if one.hunts), None)
        except Stalled:
            bad, steps = "stalled", []
        if bad is None:
            chains.append(_chain(proposal.gains, [*small, *steps[:2]]))
        if bad is not None:
            trial.ended = bad
            task = _lower(task, proposal, 0.7)
            await subject.write(calm)
            await subject.home()
            continue
        trial.score = score = Score.of(steps, plan, loop.tuned(proposal.gains).stiffness)
        if best is None or _preferred(plan, made.before, trial, best[0]):
            best = trial, steps
        if _swings(trial) and made.before.hunting != "slight":
            task = _lower(task, proposal, 0.8)
        elif abs(score.time_s - proposal.predicted.score) <= AS_PREDICTED * proposal.predicted.score:
            break  # the model is right, so it would propose the same again
        tell("identify", made)
        made.identified = found = await compute(identification.fit, loop, chains, found)
    if best is not None:
        made.confirmed, made.after, made.predicted = best[1], best[0].score, best[0].proposal
        if made.after is not None and better(plan.goal, made.before, made.after, plan.band_deg):
            made.kept = best[0].proposal.gains
    return made


def most_error(before_deg: float, plan: Plan) -> float:
    """Distance from the target at rest that gains may have, for a servo that had `before_deg`, °."""
    return max(plan.band_deg, min(before_deg, LARGEST_ERROR * abs(plan.step_deg)) + ERROR_DEG / 2)


def _chain(gains: Gains, steps: Sequence[Measured]) -> Chain:
    return [(gains, one.trace) for one in steps]


def _placed(loop: Loop, found: Identified) -> Loop:
    return replace(loop, delay_s=max(0.0, found.delay_s))


async def _pairs(subject: Subject, plan: Plan, share: float, count: int) -> list[Measured]:
    """Steps out and back. Ends with the first that hunts."""
    found: list[Measured] = []
    for _ in range(count):
        for to_deg in (plan.from_deg + share * plan.step_deg, plan.from_deg):
            found.append(await subject.step(round(to_deg, 1), plan.dwell_s))
            if found[-1].hunts:
                return found
            moved = abs(found[-1].trace.angle_deg[-1] - found[-1].trace.from_deg)
            if moved < MOVED * abs(share * plan.step_deg):
                raise Stalled(found[-1].trace)
    return found


async def _calmed(subject: Subject, loop: Loop, plan: Plan, present: Gains) -> tuple[dict[str, Raw], Chain]:
    """Lower the gains until the servo does not hunt. Returns those gains and the steps measured with them."""
    gains = dict(present)
    wide = min(max(gains["angle_dead_band"], 4), max(2, round(plan.band_deg * 10) - 1))
    for _ in range(CALMER):
        gains |= {"angle_p_gain": max(1, gains["angle_p_gain"] // 2), "angle_dead_band": wide}
        if "angle_boost" in gains:
            gains["angle_boost"] = 0
        if loop.cascade:
            gains["angle_d_gain"] = max(gains["angle_d_gain"], 40)
        await subject.write(gains)
        await subject.home()
        steps = await _pairs(subject, plan, SMALL, 1)
        if any(one.hunts for one in steps):
            continue
        steps += await _pairs(subject, plan, 1.0, 1)
        if not any(one.hunts for one in steps):
            return gains, _chain(dict(gains), steps)
    return gains, []


def _lower(task: Task, proposal: Proposal, share: float) -> Task:
    """The same task with lower P gains than this proposal, which did not work on the servo."""
    return replace(task, most_p=max(1, round(proposal.gains["angle_p_gain"] * share)))


def _is_better(plan: Plan, before: Score, trial: Trial) -> bool:
    return trial.score is not None and better(plan.goal, before, trial.score, plan.band_deg)


def _preferred(plan: Plan, before: Score, trial: Trial, best: Trial) -> bool:
    """Whether a trial takes the place of the best so far: better than the present gains, then without a swing."""
    kept = _is_better(plan, before, trial)
    if kept != _is_better(plan, before, best):
        return kept
    if _swings(trial) != _swings(best):
        return _swings(best)
    return (
        trial.score is not None and best.score is not None and better(plan.goal, best.score, trial.score, plan.band_deg)
    )


def _swings(trial: Trial) -> bool:
    """Whether the horn swings slightly at rest, which the model does not predict."""
    return trial.score is not None and trial.score.hunting == "slight"


def _promising(plan: Plan, trial: Trial, proposal: Proposal) -> bool:
    """Whether another proposal is expected to be clearly better than what was measured."""
    if trial.score is None or _swings(trial):
        return True
    if plan.goal == "stiff":
        return proposal.stiffness > trial.score.stiffness * 1.15
    return proposal.predicted.score < trial.score.time_s * 0.92


def better(goal: Goal, before: Score, after: Score, band_deg: float) -> bool:
    """Whether `after` is better for the goal, and in no case hunting, or slower than a servo that did not hunt."""
    if before.hunting == "hunting":
        return after.hunting != "hunting" and after.settling_s is not None
    if after.hunting == "hunting" or (after.hunting == "slight" and before.hunting == "none"):
        return False
    if before.settling_s is not None and (after.settling_s or np.inf) > before.settling_s + RESOLUTION_S:
        return False
    if after.time_s > before.time_s + RESOLUTION_S or after.error_deg > max(band_deg, before.error_deg) + ERROR_DEG:
        return False
    sooner = after.time_s < before.time_s * SOONER
    calmer = after.overshoot_pct < before.overshoot_pct - OVERSHOOT_PCT or before.hunting == "slight"
    firmer = after.stiffness > before.stiffness * FIRMER
    return {"fast": sooner, "calm": calmer or sooner, "stiff": firmer}[goal]
