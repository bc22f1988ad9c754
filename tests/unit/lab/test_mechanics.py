"""Estimators of mechanics, ten random horns without a bus, their twins, and exported models in MuJoCo."""

import pickle
import xml.etree.ElementTree as ET
from typing import Any

import mujoco
import numpy as np
import pytest

from bare_horn import CATALOG, BareHorn
from bench import mechanics as bench
from hornbill.domain.frequency_response import Estimate
from hornbill.domain.plant import PlantConstants
from hornbill.lab import mechanics, mechanics_export
from hornbill.lab.mechanics import Breakaway, Pulse, SupplySample, Zone
from hornbill.lab.mechanics_export import Actuator
from hornbill.lab.mechanics_moves import Moves, Range
from hornbill.sim.mechanics.plant import plant_of
from hornbill.store.runs import Run
from hornbill.units import Uid

MODEL = CATALOG.models[bench.MODEL]
PLANT = plant_of(MODEL)
engine: Any = mujoco


@pytest.mark.release
def test_the_truth_of_ten_random_horns_is_within_the_intervals_and_twins_follow_unseen_commands() -> None:
    """The bench does the same with 100 horns."""
    stated = missed = 0
    for one in bench.measured(range(10)):
        assert one.twin_rms_deg < 0.3, one.truth
        hits = one.hits()
        assert {"inertia", "breakaway", "coulomb", "viscous", "torque_lag_s", "load_pct"} <= hits.keys()
        stated, missed = stated + len(hits), missed + sum(not hit for hit in hits.values())
        size = 1.0 + one.truth.inertia
        inertia = one.estimates["inertia"]
        assert inertia is not None
        assert inertia.high - inertia.low < 0.1 * size, "an interval that is too wide says nothing"
    assert missed <= 0.07 * stated


def test_a_backlash_on_which_a_load_leans_is_not_stated() -> None:
    for load, known in ((0.0, True), (20.0, False)):
        constants = PlantConstants(load_pct=load, backlash_deg=0.5)
        found = mechanics.fit(PLANT, 1.0, pulses(constants), 0.03, load / 100.0)
        assert found is not None
        backlash = mechanics.intervals(found)["backlash_deg"]
        assert (backlash is not None) is known
        if backlash is not None:
            assert backlash.low <= 0.5 <= backlash.high


def pulses(constants: PlantConstants) -> list[Pulse]:
    """Pulses of the model itself, as read: rounded to what registers show."""
    found: list[Pulse] = []
    for force in (0.1, -0.1, 0.18, -0.18):
        load = constants.load_pct / 100.0
        pulse = Pulse([(0.0, round(force - load, 2)), (0.07, round(-force - load, 2))], before=-load)
        t, angle, torque = mechanics.respond(PLANT, 1.0, constants, pulse, 0.2)
        pulse.angle = [(float(a), round(float(b), 1)) for a, b in zip(t, angle, strict=True)]
        pulse.torque = [(float(a), round(float(b), 2)) for a, b in zip(t, torque, strict=True)][::3]
        found.append(pulse)
    return found


def test_a_fit_can_be_computed_in_another_process() -> None:
    """In the server it must not delay Stop."""
    arguments = (PLANT, 1.0, pulses(PlantConstants()), 0.03, 0.0)
    found = mechanics.fit(*pickle.loads(pickle.dumps(arguments)))
    assert found is not None
    assert pickle.loads(pickle.dumps(found)).constants == found.constants


def test_a_fit_of_nothing_is_none() -> None:
    assert mechanics.fit(PLANT, 1.0, [], 0.03, 0.0) is None
    assert mechanics.fit(PLANT, 1.0, [Pulse([(0.0, 0.1)], [(0.01 * n, 0.0) for n in range(50)])], 0.03, 0.0) is None


def test_breakaway_is_between_the_steps_of_both_directions() -> None:
    seen = Breakaway(cw=(-0.07, -0.06), ccw=(0.13, 0.14))  # load 0.1, breakaway 0.03 to 0.04
    assert mechanics.load_guess(seen) == pytest.approx(0.1)
    rough = mechanics.breakaway_of(seen, None)
    assert rough is not None
    assert rough.low <= 0.03 < 0.04 <= rough.high
    fine = mechanics.breakaway_of(seen, Estimate(0.1, 0.099, 0.101))
    assert fine is not None
    assert (fine.low, fine.high) == pytest.approx((0.029, 0.041))
    assert mechanics.breakaway_of(Breakaway(cw=(0.02, 0.03)), None) is None


def test_the_resistance_of_the_supply_is_its_drop_without_that_of_the_servo() -> None:
    drop = 0.2 * PLANT.stall_a + mechanics.DROOP * PLANT.nominal_v
    samples = [SupplySample(share, 12.0 - drop * abs(share)) for share in (-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3)]
    found = mechanics.supply_of(samples, PLANT)
    assert found is not None
    assert found.value == pytest.approx(0.2, abs=1e-6)
    assert mechanics.supply_of(samples[3:4] * 9, PLANT) is None, "always the same torque"


def test_noise_below_the_resolution_may_be_none() -> None:
    still = mechanics.noise_of([10.0] * 50)
    assert (still.value, still.low) == (0.0, 0.0)
    random = np.random.default_rng(1)
    loud = mechanics.noise_of([round(float(one), 1) for one in random.normal(0.0, 0.3, 200)])
    assert loud.low <= 0.3 <= loud.high


def test_both_ends_of_a_deadband_are_its_reversal() -> None:
    sides = mechanics.sides_of([-0.3, -0.3, -0.2, -0.3], [0.3, 0.3, 0.3, 0.2])
    assert sides.reversal.low <= 0.55 <= sides.reversal.high
    assert sides.repeatability.value < 0.1


def test_a_zone_binds_if_its_friction_is_far_above_that_of_the_travel() -> None:
    swept = {angle: (0.02 if angle < 20 else 0.12) for angle in range(-40, 41)}
    cw = [(float(angle), friction + 0.05) for angle, friction in swept.items() for _ in range(3)]
    ccw = [(float(angle), -friction + 0.05) for angle, friction in swept.items() for _ in range(3)]
    zones = mechanics.along(cw, ccw)
    assert all(one.load == pytest.approx(-0.05) for one in zones)
    assert [one.deg for one in mechanics.binding(zones)] == [22.5, 27.5, 32.5, 37.5]


def test_the_speed_of_a_ramp_is_its_slope() -> None:
    found = mechanics.speed_of([(0.002 * n, round(0.9 * n, 1)) for n in range(60)])
    assert found is not None
    assert found.low <= 75.0 <= found.high
    assert mechanics.speed_of([(0.0, 0.0)]) is None


def test_reverse_and_origin_are_removed_from_a_twin() -> None:
    found = {
        "load_pct": Estimate(5.0, 4.0, 6.0), "stop_cw_deg": Estimate(30.0, 29.0, 31.0),
        "stop_ccw_deg": Estimate(-20.0, -21.0, -19.0), "backlash_deg": None,
    }  # fmt: skip
    zones = [Zone(-10.0, 0.1, 0.02), Zone(10.0, -0.1, 0.02)]
    twin = mechanics.plant_constants(found, sign=-1, origin_deg=4.0, zones=zones)
    assert (twin.stop_cw_deg, twin.stop_ccw_deg) == (16.0, -34.0)
    assert twin.load_by_angle == ((-14.0, 10.0), (6.0, -10.0))
    assert mechanics.plant_constants(found, sign=-1, origin_deg=4.0).load_pct == -5.0


async def test_an_end_stop_is_found_and_the_torque_stays_limited() -> None:
    constants = PlantConstants(inertia=3.0, stop_cw_deg=22.4, stop_ccw_deg=-17.9, backlash_deg=0.5)
    horn = BareHorn(
        constants,
        model=bench.MODEL,
        **bench.STEADY,
        torque_limit_cw=30,
        torque_limit_ccw=-30,
        speed_limit_cw=30,
        speed_limit_ccw=-30,
    )
    found = await Moves(horn, PLANT, Range(-60.0, 60.0, 60.0, 60.0)).end_stops()
    high, low = found["stop_cw_deg"], found["stop_ccw_deg"]
    assert high is not None
    assert low is not None
    assert (high.value, low.value) == pytest.approx((22.4, -17.9), abs=0.15)
    assert horn.peak_torque <= 0.35


@pytest.mark.parametrize("cascade", [1, 0])
@pytest.mark.parametrize("inertia", [1.0, 4.0, 10.0])
def test_the_exported_model_reproduces_a_step_in_mujoco_within_5_percent(cascade: int, inertia: float) -> None:
    constants = PlantConstants(inertia=inertia, backlash_deg=0.0)
    rom = {"speed_torque_control": cascade, "angle_p_gain": 10 if cascade else 20, "angle_dead_band": 0}
    horn = BareHorn(constants, model=bench.MODEL, **rom)
    rows = {key: one.default for key, one in MODEL.parameters.items()} | rom | {"speed_torque_control": bool(cascade)}
    model = engine.MjModel.from_xml_string(mechanics_export.mjcf("twin", Actuator(PLANT, constants, rows)))
    data = engine.MjData(model)
    step, worst = 5.0, 0.0
    horn.write("command_angle", round(step * 10))
    data.ctrl[0] = np.radians(step)
    for number in range(1, 601):
        horn.wait(0.001)
        while data.time < number * 0.001 - 1e-9:
            engine.mj_step(model, data)
        worst = max(worst, abs(horn.sim.angle_deg - float(np.degrees(data.qpos[0]))))
    assert horn.sim.angle_deg == pytest.approx(step, abs=0.5), "it moves"
    assert worst < 0.05 * step


def test_si_units_scale_with_the_stall_torque() -> None:
    constants = PlantConstants(inertia=1.0, stop_cw_deg=90.0, stop_ccw_deg=-90.0)
    shares, newtons = (Actuator(PLANT, constants, {"angle_p_gain": 40}, nm) for nm in (1.0, 2.0))
    assert newtons.armature == pytest.approx(2 * shares.armature)
    assert newtons.friction == pytest.approx(0.04)
    joint = ET.fromstring(mechanics_export.urdf("twin", newtons)).find("joint")
    assert joint is not None
    limit = joint.find("limit")
    assert limit is not None
    assert float(limit.attrib["upper"]) == pytest.approx(np.pi / 2, abs=1e-4)
    assert float(limit.attrib["velocity"]) == pytest.approx(PLANT.top_rpm / 60 * 2 * np.pi, rel=0.01)


def test_the_newest_value_of_each_quantity_is_shown_with_its_reason() -> None:
    uid = Uid("0" * 32)

    def run(number: int, **estimates: object) -> Run:
        return Run(number, uid, float(number), "", {"estimates": estimates, "zones": []}, "mechanics")  # pyright: ignore[reportArgumentType] - plain JSON

    one = {"value": 1.0, "low": 0.5, "high": 1.5}
    found = mechanics_export.known(uid, [run(2, backlash_deg=None), run(1, backlash_deg=one, inertia=one)])
    assert [(each.name, each.run) for each in found.values] == [("inertia", 1), ("backlash_deg", 2)]
    assert found.values[1].note is not None
    assert found.values[1].note.code == "gear_on_one_side"
    assert {one.code for one in found.unknowable} >= {"unknowable_torque", "unknowable_elasticity"}
