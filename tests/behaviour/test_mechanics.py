"""Mechanics over the bus: results against the truth of the simulator, end stops, twin, and bad days."""

import asyncio
import xml.etree.ElementTree as ET
from typing import Any

import pytest

from behaviour.restarting import failed_with, succeeded
from behaviour.rig import Rig, json, problem, until
from behaviour.scene import scene
from hornbill.domain.plant import PlantConstants, plant_from
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe

ARM = PlantConstants(
    inertia=2.0, breakaway=0.045, coulomb=0.03, viscous=0.4, backlash_deg=0.4, load_pct=1.5, supply_ohm=0.1
)
STOPS = PlantConstants(inertia=1.0, stop_cw_deg=31.3, stop_ccw_deg=-24.7)
ROM = {"soft_start": 0, "timeout_action": 0}


def recipe(plant: PlantConstants, **rom: int) -> Recipe:
    return Recipe("BLA21-12U-A0", "1.300", servo_id=1, node_id=11, plant=plant, rom=ROM | rom)


async def begin(rig: Rig, **body: object) -> tuple[Servo, str, str]:
    """Start a measurement of a servo with torque on: itself, lease and job."""
    servo = (await rig.ready())[0]
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    job = json(await rig.call("POST", f"/servos/{servo.uid}/mechanics", body, lease=lease), 202)
    return servo, lease, job["id"]


async def ended(rig: Rig, job: str, renew: str | None = None) -> Any:
    """The job once it has ended; its lease is renewed meanwhile."""
    async with asyncio.timeout(600):
        while True:
            found = json(await rig.call("GET", f"/jobs/{job}"))
            if found["state"] in ("succeeded", "failed", "cancelled"):
                return found
            if renew is not None:
                json(await rig.call("PUT", f"/leases/{renew}"))
            await asyncio.sleep(0.5)


def rows(rig: Rig, servo: Servo) -> dict[str, int]:
    """All values in the RAM of the simulated servo that a user may write."""
    memory = rig.sim(servo).memory
    return {
        key: memory.get(one.parameter.address)
        for key, one in servo.registers.items()
        if one.parameter.rom and key != "torque_mode"
    }


async def values(rig: Rig, servo: Servo) -> dict[str, Any]:
    found = json(await rig.call("GET", f"/servos/{servo.uid}/mechanics"))
    return {one["name"]: one for one in found["values"]}


@scene(recipe(ARM))
async def test_the_truth_is_within_the_intervals_and_the_twin_is_the_servo(rig: Rig) -> None:
    servo, lease, job = await begin(rig)
    before = rows(rig, servo)
    done = succeeded(await ended(rig, job, lease))
    assert rows(rig, servo) == before
    found = await values(rig, servo)
    measured = ("inertia", "breakaway", "coulomb", "viscous", "backlash_deg", "torque_lag_s", "load_pct", "supply_ohm")
    for name in measured:
        one = found[name]["estimate"]
        assert one["low"] <= getattr(ARM, name) <= one["high"], (name, one)
        assert found[name]["run"] == done["result"]["run"]
    twin = json(await rig.call("GET", f"/servos/{servo.uid}/mechanics/export"))
    assert twin["plant"]["inertia"] == pytest.approx(2.0, rel=0.05)
    constants = plant_from(twin["plant"])
    made = json(
        await rig.call("POST", "/sim/servos", {"model": "BLA21-12U-A0", "node_id": 12, "plant": twin["plant"]}), 201
    )
    assert rig.bench.servo(made["uid"]).conditions.plant == constants
    mjcf = ET.fromstring((await rig.call("GET", f"/servos/{servo.uid}/mechanics/export?format=mujoco")).text)
    assert float(mjcf.find(".//joint").attrib["frictionloss"]) == pytest.approx(0.03, rel=0.1)  # pyright: ignore[reportOptionalMemberAccess]
    path = f"/servos/{servo.uid}/mechanics/export?format=urdf&stall_nm=2"
    urdf = ET.fromstring((await rig.call("GET", path)).text)
    assert float(urdf.find(".//dynamics").attrib["friction"]) == pytest.approx(0.06, rel=0.1)  # pyright: ignore[reportOptionalMemberAccess]
    problem(await rig.call("GET", f"/servos/{made['uid']}/mechanics/export"), "unknown_servo", 404)


@pytest.mark.parametrize("reverse", [0, 1])
@scene(lambda reverse: recipe(STOPS, reverse=reverse))
async def test_end_stops_are_found_within_half_a_degree_and_never_above_35_percent(rig: Rig, reverse: int) -> None:
    servo, lease, job = await begin(rig, tests=["end_stops"], from_deg=-60, to_deg=60)
    peak = 0.0

    async def watch() -> None:
        nonlocal peak
        while True:
            peak = max(peak, abs(rig.sim(servo).motion.torque))
            await asyncio.sleep(0.002)

    watching = asyncio.create_task(watch())
    before = rows(rig, servo)
    succeeded(await ended(rig, job, lease))
    watching.cancel()
    assert 0.2 < peak <= 0.35, "it pressed on the stop, with limited torque"
    assert rows(rig, servo) == before
    found = await values(rig, servo)
    high, low = (24.7, -31.3) if reverse else (31.3, -24.7)
    assert found["stop_cw_deg"]["estimate"]["value"] == pytest.approx(high, abs=0.5)
    assert found["stop_ccw_deg"]["estimate"]["value"] == pytest.approx(low, abs=0.5)
    twin = json(await rig.call("GET", f"/servos/{servo.uid}/mechanics/export"))["plant"]
    assert (twin["stop_cw_deg"], twin["stop_ccw_deg"]) == pytest.approx((31.3, -24.7), abs=0.5)


@scene(recipe(PlantConstants(inertia=0.5, load_by_angle=((-60.0, 12.0), (60.0, -12.0))), angle_dead_band=8))
async def test_deadband_sides_speed_and_travel(rig: Rig) -> None:
    tests = ["deadband", "repeatability", "speed", "travel", "end_stops"]
    servo, lease, job = await begin(rig, tests=tests, from_deg=-30, to_deg=30)
    before = rows(rig, servo)
    succeeded(await ended(rig, job, lease))
    assert rows(rig, servo) == before
    found = await values(rig, servo)
    deadband = found["deadband_deg"]["estimate"]
    assert deadband["low"] - 0.1 <= 0.8 <= deadband["high"] + 0.1
    assert found["reversal_deg"]["estimate"]["value"] == pytest.approx(1.6, abs=0.5), "both ends of the deadband"
    assert 60 < found["top_speed_rpm"]["estimate"]["value"] < 160
    assert found["stop_cw_deg"]["estimate"] is None
    assert found["stop_cw_deg"]["note"]["code"] == "no_stop_in_range"
    travel = json(await rig.call("GET", f"/servos/{servo.uid}/mechanics"))["travel"]
    assert len(travel) >= 8
    for point in travel:
        assert point["load_pct"] == pytest.approx(-point["angle_deg"] * 0.2, abs=0.8)
        assert point["friction_pct"] == pytest.approx(2.0, abs=1.5)
    twin = json(await rig.call("GET", f"/servos/{servo.uid}/mechanics/export"))["plant"]
    assert len(twin["load_by_angle"]) == len(travel)


async def interrupted(rig: Rig, seconds: float = 4.0, **body: object) -> tuple[Servo, str, str, dict[str, int]]:
    """A measurement that has run for a while, with temporary values in the servo, and the values before it."""
    servo = (await rig.ready())[0]
    before = rows(rig, servo)
    servo, lease, job = await begin(rig, **body)
    await until(lambda: rows(rig, servo) != before, within_s=60)
    await asyncio.sleep(seconds)
    return servo, lease, job, before


async def is_safe(rig: Rig, servo: Servo, before: dict[str, int]) -> None:
    """Output off, and all values as before."""
    await until(lambda: rig.sim(servo).output != 0, within_s=30)
    await until(lambda: rows(rig, servo) == before, within_s=60)


@scene(recipe(ARM))
async def test_stop_ends_it_with_output_off_and_all_values_restored(rig: Rig) -> None:
    servo, _, job, before = await interrupted(rig)
    json(await rig.call("POST", "/stop", {"reason": "test"}))
    failed_with(await ended(rig, job), "stopped")
    await is_safe(rig, servo, before)


@scene(recipe(ARM))
async def test_the_end_of_the_lease_ends_it(rig: Rig) -> None:
    servo, lease, job, before = await interrupted(rig, 0.5)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    failed_with(await ended(rig, job), "lease_required")
    await is_safe(rig, servo, before)


@scene(recipe(ARM))
async def test_cancelling_ends_it(rig: Rig) -> None:
    servo, _, job, before = await interrupted(rig, 0.5)
    json(await rig.call("DELETE", f"/jobs/{job}"))
    assert (await ended(rig, job))["state"] == "cancelled"
    await is_safe(rig, servo, before)


@scene(recipe(ARM))
async def test_an_unplugged_adapter_ends_it_and_values_are_restored_once_it_is_back(rig: Rig) -> None:
    servo, _, job, before = await interrupted(rig, 0.5)
    await rig.cable.unplug()
    done = await ended(rig, job)
    assert done["state"] == "failed"
    assert done["error"]["detail"]
    assert rows(rig, servo) != before, "nothing could be restored without a bus"
    rig.cable.plug_in()
    await is_safe(rig, servo, before)


@scene(recipe(PlantConstants(inertia=1e7)))
async def test_a_blocked_horn_ends_it_with_a_sentence(rig: Rig) -> None:
    servo = (await rig.ready())[0]
    before = rows(rig, servo)
    servo, lease, job = await begin(rig, torque_pct=20)
    found = failed_with(await ended(rig, job, lease), "did_not_move")
    assert "did not move at the permitted torque of 20 %" in str(found)
    await is_safe(rig, servo, before)


@pytest.mark.release
@scene(recipe(PlantConstants(breakaway=0.4, coulomb=0.35)))
async def test_a_binding_horn_ends_it_with_a_sentence(rig: Rig) -> None:
    servo = (await rig.ready())[0]
    before = rows(rig, servo)
    servo, lease, job = await begin(rig, torque_pct=30)
    failed_with(await ended(rig, job, lease), "did_not_move")
    await is_safe(rig, servo, before)


@pytest.mark.release
@scene(recipe(PlantConstants(inertia=2.0, load_pct=1.0, sensor_noise_deg=0.4)))
async def test_a_noisy_sensor_widens_the_intervals(rig: Rig) -> None:
    servo, lease, job = await begin(rig)
    before = rows(rig, servo)
    succeeded(await ended(rig, job, lease))
    found = await values(rig, servo)
    noise = found["sensor_noise_deg"]["estimate"]
    assert noise["low"] <= 0.4 <= noise["high"]
    inertia = found["inertia"]["estimate"]
    assert inertia["low"] <= 2.0 <= inertia["high"]
    assert rows(rig, servo) == before


@scene(recipe(ARM))
async def test_with_a_fifth_of_the_frames_lost_it_measures_or_says_why_not(rig: Rig) -> None:
    servo, lease, job = await begin(rig)
    before = rows(rig, servo)
    rig.cable.deafen(20)
    done = await ended(rig, job, lease)
    rig.cable.deafen(0)
    await until(lambda: rows(rig, servo) == before, within_s=60)
    if done["state"] == "succeeded":
        inertia = (await values(rig, servo))["inertia"]["estimate"]
        assert inertia["low"] <= ARM.inertia <= inertia["high"]
        return
    assert done["error"]["code"] in ("no_response", "did_not_move")
    await is_safe(rig, servo, before)


@scene(recipe(PlantConstants(load_pct=40.0)))
async def test_end_stops_are_not_searched_under_a_load_that_could_drop(rig: Rig) -> None:
    servo, lease, job = await begin(rig, tests=["end_stops"], from_deg=-60, to_deg=60)
    failed_with(await ended(rig, job, lease), "busy")
    await until(lambda: rig.sim(servo).output != 0, within_s=30)


@scene(recipe(ARM))
async def test_what_cannot_be_measured_is_refused_before_anything_moves(rig: Rig) -> None:
    servo = (await rig.ready())[0]
    path = f"/servos/{servo.uid}/mechanics"
    problem(await rig.call("POST", path, {}), "lease_required", 428)
    lease = await rig.lease()
    none: list[str] = []
    wrong: list[dict[str, object]] = [{"tests": none}, {"tests": ["colour"]}, {"from_deg": -5, "to_deg": 5}]
    for body in wrong:
        problem(await rig.call("POST", path, body, lease=lease), "invalid_value", 422)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    far = json(await rig.call("POST", path, {"from_deg": 40, "to_deg": 80}, lease=lease), 202)
    failed_with(await ended(rig, far["id"], lease), "invalid_value")
    problem(await rig.call("GET", f"{path}/export"), "unknown_run", 404)
    assert json(await rig.call("GET", path))["values"] == []
