"""Random plants with factory or random gains, improved without a bus, and judged on the plant itself."""

import asyncio
import time
from dataclasses import dataclass
from random import Random

from bare_servo import CATALOG, BareServo, BareSubject, loop_of
from hornbill.domain.plant import PlantConstants
from hornbill.lab import improvement, search
from hornbill.lab.identification import Identified, Interval
from hornbill.lab.improvement import Improvement, Plan, Score, Stalled
from hornbill.lab.model import Loop
from hornbill.lab.search import Goal
from hornbill.units import Raw

STEP_DEG, DWELL_S, BAND_DEG = 10.0, 1.0, 0.5
SOONER = 0.7
"""30 % sooner."""
NAMES = ("inertia", "breakaway", "coulomb", "viscous", "backlash_deg", "load_pct", "supply_ohm")


@dataclass(frozen=True)
class Case:
    """A servo: rows that differ from the defaults, plant, supply relative to nominal. `drawn`: its gains are random."""

    seed: int
    model: str
    rows: dict[str, Raw]
    plant: PlantConstants
    supply: float
    drawn: bool


@dataclass(frozen=True)
class Judged:
    """An improvement, and the steps measured afterwards. `made`: None if the horn stalled with its gains.

    `possible_s`: settling time with the best gains that are known for the true plant.
    """

    case: Case
    made: Improvement | None
    finally_: Score | None
    possible_s: float | None
    cpu_s: float

    @property
    def worse(self) -> bool:
        """Whether it ends hunting, or slower than a servo that did not hunt.

        With its previous gains it ends as it began: a second measurement differs only because the horn rests elsewhere
        in its backlash.
        """
        if self.made is None or self.made.before is None or self.finally_ is None or self.made.kept is None:
            return False
        before, after = self.made.before, self.finally_
        if after.hunting == "hunting" or before.hunting == "hunting":
            return after.hunting == "hunting"
        return after.time_s > before.time_s * 1.03 + 0.01

    @property
    def mistuned(self) -> bool:
        """Whether its gains were drawn, and the plant has gains with which it settles 30 % sooner."""
        if not self.case.drawn or self.made is None or self.made.before is None or self.possible_s is None:
            return False
        return self.made.before.hunting == "hunting" or self.possible_s <= SOONER * self.made.before.time_s

    @property
    def sooner(self) -> bool:
        """Whether it settles 30 % sooner than it did, or settles at all instead of hunting."""
        if self.made is None or self.made.before is None or self.finally_ is None:
            return False
        if self.made.before.hunting == "hunting":
            return self.finally_.hunting != "hunting" and self.finally_.settling_s is not None
        return self.finally_.time_s <= SOONER * self.made.before.time_s

    @property
    def predicted(self) -> tuple[float, float] | None:
        """Predicted and measured settling time of the gains that were kept, s."""
        if self.made is None or self.made.kept is None or self.made.predicted is None or self.made.after is None:
            return None
        expected, found = self.made.predicted.predicted.settling_s, self.made.after.settling_s
        return None if expected is None or found is None else (expected, found)


def draw(seed: int) -> Case:
    """Inertia 0 to 20, friction × 0.5 to 3, backlash 0 to 0.6°, load ±40 %, supply 85 to 110 % with up to 0.15 Ω."""
    random = Random(f"improve {seed}")
    model = CATALOG.models[random.choice(sorted(CATALOG.models))]
    friction = random.uniform(0.5, 3.0)
    plant = PlantConstants(
        inertia=random.uniform(0.0, 20.0),
        breakaway=0.03 * friction,
        coulomb=0.02 * friction,
        viscous=0.3 * random.uniform(0.5, 3.0),
        backlash_deg=random.uniform(0.0, 0.6),
        load_pct=random.uniform(-40.0, 40.0),
        supply_ohm=random.uniform(0.0, 0.15),
    )
    rows = {"speed_torque_control": random.randrange(2), "smoothing": random.randrange(2)}
    drawn = seed % 3 != 0
    if drawn:
        share = random.choice([random.uniform(0.25, 0.6), random.uniform(1.5, 2.5)])
        rows["angle_p_gain"] = min(max(round((model.parameters["angle_p_gain"].default or 1) * share), 1), 100)
        rows["angle_d_gain"] = random.choice([0, 10, 30, 100])
        rows["angle_dead_band"] = random.choice([0, 1, 3, 5])
        rows["angle_boost"] = random.choice([0, 30, 100])
    return Case(seed, model.name, rows, plant, random.uniform(0.85, 1.1), drawn)


def judge(seed: int, goal: Goal = "fast", *, possible: bool = True) -> Judged:
    """Improve a random servo, and measure it afterwards with the gains that it has then."""
    case = draw(seed)
    servo = BareServo(CATALOG.models[case.model], case.rows, case.plant, supply=case.supply, seed=seed)
    servo.write("command_angle", 0)
    servo.wait(1.0)
    plan, subject, loop = Plan(goal, 0.0, STEP_DEG, DWELL_S, BAND_DEG), BareSubject(servo, BAND_DEG), loop_of(servo)

    async def run() -> tuple[Improvement | None, Score | None, float]:
        began = time.process_time()
        try:
            made = await improvement.improve(subject, loop, plan)
        except Stalled:
            return None, None, time.process_time() - began
        took = time.process_time() - began
        await subject.write(made.kept or {key: loop.rows[key] for key in loop.ranges})
        await subject.home()
        steps = [await subject.step(to_deg, DWELL_S) for to_deg in (STEP_DEG, 0.0, STEP_DEG, 0.0)]
        return made, Score.of(steps, plan, 0.0), took

    made, after, took = asyncio.run(run())
    best = _possible(loop, case, made, plan) if possible and case.drawn and made is not None else None
    return Judged(case, made, after, best, took)


def _possible(loop: Loop, case: Case, made: Improvement, plan: Plan) -> float | None:
    """Settling time with the best gains for the true constants."""
    exact = {name: Interval(getattr(case.plant, name), getattr(case.plant, name)) for name in NAMES}
    error = 0.0 if made.before is None else made.before.error_deg
    task = plan.task(improvement.most_error(error, plan))
    return search.best(loop, Identified(case.plant, exact, 0.0, 0.0), task).predicted.settling_s
