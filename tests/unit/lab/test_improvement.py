"""Identification, search and the decision what to keep, on simulated servos without a bus."""

import asyncio
import pickle

import numpy as np
import pytest

from bare_servo import CATALOG, BareServo, BareSubject, loop_of
from hornbill.domain.plant import PlantConstants
from hornbill.lab import identification, improvement, search
from hornbill.lab.identification import Chain
from hornbill.lab.improvement import Plan, Score, Stalled, Watch
from hornbill.lab.model import Loop, Move
from hornbill.lab.search import Goal
from hornbill.servo.runtime.computing import in_a_process

MODEL = CATALOG.models["BLA21-12U-A0"]
PLANT = PlantConstants(inertia=4.0, backlash_deg=0.3, coulomb=0.03, breakaway=0.045, load_pct=8.0)
CASCADE = {"speed_torque_control": 1, "smoothing": 0}


def improved(
    rows: dict[str, int], plant: PlantConstants, goal: Goal = "fast"
) -> tuple[improvement.Improvement, BareServo, Loop]:
    servo = BareServo(MODEL, {**CASCADE, **rows}, plant)
    servo.write("command_angle", 0)
    servo.wait(1.0)
    loop = loop_of(servo)
    return asyncio.run(improvement.improve(BareSubject(servo, 0.5), loop, Plan(goal, 0.0, 10.0, 1.0, 0.5))), servo, loop


def test_the_model_moves_as_the_simulated_servo() -> None:
    servo = BareServo(MODEL, CASCADE, PLANT)
    servo.write("command_angle", 0)
    servo.wait(1.0)
    begin = servo.device.motion.angle
    step = asyncio.run(BareSubject(servo, 0.5).step(10.0, 1.0))
    (angles,) = loop_of(servo).respond(PLANT, begin, [Move(10.0, 1.1, {})])
    t = np.asarray(step.trace.t)
    expected = np.interp(t, np.arange(len(angles)) * 0.002, angles)
    assert float(np.sqrt(np.square(expected - np.asarray(step.trace.angle_deg)).mean())) < 0.15


def test_constants_of_a_horn_are_identified_with_intervals() -> None:
    made, _, _ = improved({}, PLANT)
    assert made.identified is not None
    found, intervals = made.identified.constants, made.identified.intervals
    assert found.inertia == pytest.approx(PLANT.inertia, rel=0.15)
    assert found.load_pct == pytest.approx(PLANT.load_pct, abs=2.5)
    assert found.coulomb == pytest.approx(PLANT.coulomb, abs=0.012)
    assert all(one.low <= getattr(found, name) <= one.high for name, one in intervals.items())
    assert made.identified.rms_deg < 0.2


@pytest.mark.parametrize("goal", ["calm", "fast", "stiff"])
def test_a_hunting_servo_stops_hunting_with_every_goal(goal: Goal) -> None:
    made, _, loop = improved(
        {"angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0}, PlantConstants(inertia=3.0), goal
    )
    assert made.before is not None
    assert made.before.hunting == "hunting"
    assert made.kept is not None
    assert made.after is not None
    assert made.after.hunting == "none", "a slight swing is kept"
    assert made.after.settling_s is not None
    margin = loop.tuned(made.kept).phase_margin_deg(PlantConstants(inertia=3.0))
    assert margin >= search.MARGIN_DEG[goal] - 8


def test_stiff_is_stiffer_than_calm_and_calm_does_not_overshoot() -> None:
    soft = {"angle_p_gain": 12, "angle_d_gain": 10}
    stiff, _, loop = improved(soft, PLANT, "stiff")
    calm, _, _ = improved(soft, PLANT, "calm")
    assert stiff.kept is not None
    assert calm.kept is not None
    assert calm.after is not None
    assert calm.after.overshoot_pct <= search.OVERSHOOT_PCT["calm"] + 2.0
    assert loop.tuned(stiff.kept).stiffness > loop.tuned(calm.kept).stiffness
    assert stiff.predicted is not None
    assert stiff.predicted.margin_deg >= search.MARGIN_DEG["stiff"] - 3.0


def test_a_blocked_horn_stalls() -> None:
    with pytest.raises(Stalled):
        improved({}, PlantConstants(inertia=1e6))


@pytest.mark.release
def test_good_gains_are_not_replaced_by_worse_ones() -> None:
    before, _, _ = improved({}, PLANT)
    gains = before.kept or {}
    made, _, _ = improved(gains, PLANT)
    assert made.kept is None or (
        made.after is not None and made.before is not None and made.after.time_s < made.before.time_s
    )


def score(**changed: object) -> Score:
    values: dict[str, object] = {
        "time_s": 0.2, "settling_s": 0.2, "overshoot_pct": 5.0, "hunting": "none", "error_deg": 0.2, "stiffness": 1.0,
    }  # fmt: skip
    return Score(**(values | changed))  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("goal", "before", "after", "kept"),
    [
        ("fast", {}, {"time_s": 0.1, "settling_s": 0.1}, True),
        ("fast", {}, {"time_s": 0.199, "settling_s": 0.199}, False),
        ("fast", {}, {"time_s": 0.1, "settling_s": 0.1, "hunting": "slight"}, False),
        ("fast", {}, {"time_s": 0.1, "settling_s": 0.1, "hunting": "hunting"}, False),
        ("fast", {}, {"time_s": 0.1, "settling_s": 0.1, "error_deg": 0.8}, False),
        ("fast", {"hunting": "hunting"}, {"time_s": 0.4, "settling_s": 0.4}, True),
        ("fast", {"hunting": "hunting"}, {"hunting": "hunting"}, False),
        ("fast", {"hunting": "hunting"}, {"settling_s": None, "time_s": 1.0}, False),
        ("calm", {"overshoot_pct": 12.0}, {"overshoot_pct": 1.0}, True),
        ("calm", {"overshoot_pct": 12.0}, {"overshoot_pct": 1.0, "time_s": 0.25, "settling_s": 0.25}, False),
        ("stiff", {}, {"stiffness": 1.2}, True),
        ("stiff", {}, {"stiffness": 1.2, "time_s": 0.3, "settling_s": 0.3}, False),
        ("stiff", {}, {"stiffness": 1.0}, False),
    ],
)
def test_gains_are_kept_only_if_better_and_never_slower(
    goal: Goal, before: dict[str, object], after: dict[str, object], kept: bool
) -> None:
    assert improvement.better(goal, score(**before), score(**after), 0.5) is kept


def test_hunting_is_noticed_within_a_few_swings_and_decaying_ringing_is_not() -> None:
    def fed(decay: float) -> str | None:
        watch = Watch(0.0, 10.0, 0.5)
        for n in range(1500):
            t = n / 500
            found = watch.add(10.0 - 10.0 * float(np.exp(-decay * t) * np.cos(2 * np.pi * 8 * t)))
            if found:
                assert t < 1.0
                return found
        return None

    assert fed(0.0) == "hunting"
    assert fed(3.0) is None
    watch = Watch(0.0, 10.0, 0.5)
    assert [watch.add(angle) for angle in (5.0, 12.0, 27.9, 28.1)] == [None, None, None, "away"]


@pytest.mark.real_time
async def test_a_fit_runs_in_another_process() -> None:
    servo = BareServo(MODEL, CASCADE, PLANT)
    loop = loop_of(servo)
    assert pickle.loads(pickle.dumps(loop)) == loop
    step = await BareSubject(servo, 0.5).step(10.0, 0.5)
    chain: Chain = [({}, step.trace)]
    found = await in_a_process(identification.fit, loop, [chain], None)
    assert found.constants.inertia == pytest.approx(PLANT.inertia, rel=0.4)
