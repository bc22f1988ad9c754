"""The step test against the simulated horn itself: what is measured over the bus is what the horn really did."""

import asyncio
from itertools import pairwise

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.lab import metrics
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo

LIVELY = Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, load_inertia=4.0)
"""A horn with an arm on it: it overshoots and rings."""


class Witness:
    """Where a simulated horn really stands, once in a millisecond."""

    def __init__(self, sim: SimulatedServo) -> None:
        self.seen: list[tuple[float, float]] = []
        self._task = asyncio.create_task(self._watch(sim))

    async def _watch(self, sim: SimulatedServo) -> None:
        loop = asyncio.get_running_loop()
        while True:
            self.seen.append((loop.time(), sim.angle_deg))
            await asyncio.sleep(0.001)

    def end(self) -> None:
        self._task.cancel()


def ran(path: str) -> str:
    return f"{path}/step-test?wait=true"


async def ready(rig: Rig) -> tuple[Servo, str, str]:
    """A servo that holds its place under a lease: itself, its path and the lease."""
    servo = (await rig.ready())[0]
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    return servo, path, lease


@pytest.mark.parametrize("recipe", [PLAIN, LIVELY], ids=["plain", "with an arm"])
@pytest.mark.parametrize("step_deg", [8.0, -15.0])
@scene(lambda recipe: recipe)
async def test_what_is_measured_over_the_bus_is_what_the_horn_did(rig: Rig, recipe: Recipe, step_deg: float) -> None:
    servo, path, lease = await ready(rig)
    witness = Witness(rig.sim(servo))
    before = rig.sim(servo).angle_deg
    job = json(await rig.call("POST", ran(path), {"step_deg": step_deg, "note": "arm of 30 g"}, lease=lease))
    witness.end()
    assert job["state"] == "succeeded", job["error"]
    run = json(await rig.call("GET", f"/runs/{job['result']['run']}"))
    assert run["note"] == "arm of 30 g"
    assert run["achieved_hz"] > 400
    assert run["parameters"]["angle_p_gain"] == servo.registers["angle_p_gain"].parameter.default
    commands = [(t, deg) for t, deg in _commands(rig) if abs(deg) > 1e-9 or t > 0]
    assert [one["direction"] for one in run["steps"]] == ["there", "back"]
    for step, (at, _) in zip(run["steps"], commands[-2:], strict=True):
        # the same definitions on what the horn did, a millisecond apart, are the truth to compare with
        truth = [(t - at, deg) for t, deg in witness.seen if at <= t <= at + 1.0]
        times, angles = [t for t, _ in truth], [deg for _, deg in truth]
        exact = metrics.of_step(times, angles, angles[0], step["to_deg"], band_deg=run["band_deg"])
        told = step["metrics"]
        assert told["overshoot_pct"] == pytest.approx(exact.overshoot_pct, abs=2.0)
        # 0x08 reads tenths of a degree, which on a slow approach is more than a sample
        tenths = [round(deg, 1) for deg in angles]
        real = metrics.of_step(times, tenths, tenths[0], step["to_deg"], band_deg=run["band_deg"])
        assert told["rise_s"] == pytest.approx(real.rise_s, abs=told["sample_s"] + 0.001)
        assert told["settling_s"] == pytest.approx(real.settling_s, abs=told["sample_s"] + 0.001)
        assert told["delay_s"] == pytest.approx(real.delay_s, abs=told["sample_s"] + 0.001)
    assert abs(rig.sim(servo).angle_deg - before) < 0.6


def test_an_arm_on_the_horn_shows_as_overshoot() -> None:
    async def scene(rig: Rig) -> float:
        _, path, lease = await ready(rig)
        job = json(await rig.call("POST", ran(path), {"step_deg": 10}, lease=lease))
        return float(job["result"]["metrics"]["overshoot_pct"])

    assert play(scene, LIVELY) > play(scene, PLAIN) + 3


@scene(
    Recipe(
        "BLA21-12U-A0",
        "1.300",
        servo_id=1,
        node_id=11,
        angle_deg=60.0,
        load_inertia=3.0,
        rom={"speed_torque_control": 1, "angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0},
    )
)
async def test_a_horn_that_never_comes_to_rest_hunts_with_its_frequency_and_size(rig: Rig) -> None:
    """The story of the demo: P 100, D 0."""
    servo, path, lease = await ready(rig)
    witness = Witness(rig.sim(servo))
    job = json(await rig.call("POST", ran(path), {"step_deg": 5}, lease=lease))
    witness.end()
    assert job["state"] == "succeeded", job["error"]
    assert "hunting at" in job["steps"][-1]["evidence"]
    late = [deg for at, deg in witness.seen if witness.seen[-1][0] - at < 0.4]
    middle = (max(late) + min(late)) / 2
    turns = sum(one < middle <= other for one, other in pairwise(late))
    for step in json(await rig.call("GET", f"/runs/{job['result']['run']}"))["steps"]:
        told = step["metrics"]
        assert (told["settling_s"], told["hunting"]) == (None, "hunting")
        assert told["hunting_hz"] == pytest.approx(turns / 0.4, abs=3)
        assert told["hunting_rms_deg"] == pytest.approx((max(late) - min(late)) / 2 / 2**0.5, rel=0.25)


@scene()
async def test_a_step_test_needs_a_lease_and_torque_and_writes_no_parameter(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}"
    problem(await rig.call("POST", ran(path), {"step_deg": 5}), "lease_required", 428)
    lease = await rig.lease()
    json(await rig.call("POST", f"{path}/torque", {"mode": "off"}))
    job = json(await rig.call("POST", ran(path), {"step_deg": 5}, lease=lease))
    assert (job["state"], job["error"]["code"]) == ("failed", "torque_off")
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    written = len(rig.writes())
    json(await rig.call("POST", ran(path), {"step_deg": 5}, lease=lease))
    assert {name for _, name, _ in rig.writes()[written:]} == {"0x00"}
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", ran(path), {"step_deg": 5}, lease=lease), "stopped", 423)


@pytest.mark.parametrize("step_deg", [0, 46, -50])
@scene()
async def test_a_step_that_is_none_or_too_large_is_refused_before_anything_is_sent(rig: Rig, step_deg: float) -> None:
    _, path, lease = await ready(rig)
    written = len(rig.writes())
    problem(await rig.call("POST", ran(path), {"step_deg": step_deg}, lease=lease), "invalid_value", 422)
    assert len(rig.writes()) == written


@scene()
async def test_a_step_beyond_a_limit_is_refused_and_the_horn_stays(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    json(await rig.call("PATCH", f"{path}/parameters", {"values": {"angle_limit_cw": 3.0}}, lease=lease))
    job = json(await rig.call("POST", ran(path), {"step_deg": 5}, lease=lease))
    assert (job["state"], job["error"]["code"]) == ("failed", "out_of_range")
    await asyncio.sleep(0.5)
    assert abs(rig.sim(servo).angle_deg) < 1


@scene()
async def test_stop_in_the_middle_ends_it_and_nothing_moves_afterwards(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    job = json(await rig.call("POST", f"{path}/step-test", {"step_deg": 10, "runs": 5}, lease=lease), 202)
    await asyncio.sleep(1.5)
    json(await rig.call("POST", "/stop"))
    written = len(rig.writes())
    await rig.host.jobs.wait(rig.host.jobs.get(job["id"]))
    ended = json(await rig.call("GET", f"/jobs/{job['id']}"))
    assert (ended["state"], ended["error"]["code"]) == ("failed", "stopped")
    assert rig.sim(servo).output == 1
    await asyncio.sleep(1)
    assert {(name, raw) for _, name, raw in rig.writes()[written:]} <= {("0x20", 1)}


@scene()
async def test_cancelled_it_brings_the_horn_back_under_the_lease(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    job = json(await rig.call("POST", f"{path}/step-test", {"step_deg": 20, "dwell_s": 3}, lease=lease), 202)
    await asyncio.sleep(1.5)
    assert rig.sim(servo).angle_deg > 15
    json(await rig.call("DELETE", f"/jobs/{job['id']}"))
    await asyncio.sleep(1)
    assert abs(rig.sim(servo).angle_deg) < 1


@scene()
async def test_a_blocked_horn_is_told_and_makes_no_run(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    rig.sim(servo).conditions.load_inertia = 1e6
    job = json(await rig.call("POST", ran(path), {"step_deg": 5}, lease=lease))
    assert (job["state"], job["error"]["code"]) == ("failed", "did_not_move")
    assert json(await rig.call("GET", "/runs")) == []


@scene()
async def test_runs_are_kept_listed_laid_over_one_another_and_dropped(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    first = json(await rig.call("POST", ran(path), {"step_deg": 5}, lease=lease))["result"]["run"]
    json(await rig.call("PATCH", f"{path}/parameters", {"values": {"angle_p_gain": 30.0}}, lease=lease))
    second = json(await rig.call("POST", ran(path), {"step_deg": 5}, lease=lease))["result"]["run"]
    listed = json(await rig.call("GET", f"/runs?uid={servo.uid}"))
    assert [one["id"] for one in listed] == [second, first]
    assert listed[0]["steps"][0]["t"] == []
    overlay = json(await rig.call("GET", f"/runs/overlay?ids={first},{second}"))
    default = servo.registers["angle_p_gain"].parameter.default
    assert overlay["differences"]["angle_p_gain"] == [default, 30]
    assert [len(run["steps"][0]["t"]) > 100 for run in overlay["runs"]] == [True, True]
    text = (await rig.call("GET", f"/runs/{first}/csv")).text
    assert text.splitlines()[0] == "step,direction,t_s,angle_deg,target_deg"
    assert len(text.splitlines()) > 200
    assert (await rig.call("DELETE", f"/runs/{first}")).status_code == 204
    problem(await rig.call("GET", f"/runs/{first}"), "unknown_run", 404)
    problem(await rig.call("GET", "/runs/overlay?ids=a"), "invalid_value", 422)


def _commands(rig: Rig) -> list[tuple[float, float]]:
    """When the servo had each angle command whole, and what it was."""
    found: list[tuple[float, float]] = []
    for transfer in rig.transfers("host"):
        raw = _angle_write(transfer.payload)
        if raw is not None and (not found or abs(found[-1][1] - raw / 10) > 0.05):
            found.append((transfer.at, raw / 10))
    return found


def _angle_write(payload: bytes) -> int | None:
    from hornbill.wire.services import GetSetRequest, ValueKind

    request = GetSetRequest.decode(payload)
    if request is None or request.name != "0x00" or request.value.kind is ValueKind.EMPTY:
        return None
    assert isinstance(request.value.value, int)
    return request.value.value
