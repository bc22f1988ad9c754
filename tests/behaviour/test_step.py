"""The step test, whose measurements over the bus are compared with the simulated horn itself."""

import asyncio
from itertools import pairwise
from typing import Any

import pytest

from behaviour.restarting import failed_with, succeeded
from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from hornbill.domain.plant import PlantConstants
from hornbill.lab import metrics
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.store.tables import Json
from hornbill.wire.services import GetSetRequest

LIVELY = Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, plant=PlantConstants(inertia=4.0))
"""A horn with an arm on it: it overshoots and rings."""


class Witness:
    """The true angle of a simulated horn, every millisecond."""

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


async def step_test(rig: Rig, path: str, lease: str | None, **body: object) -> Any:
    """The ended job of a step test."""
    return json(await rig.call("POST", f"{path}/step-test?wait=true", body, lease=lease))


async def ready(rig: Rig) -> tuple[Servo, str, str]:
    """A servo with torque on under a lease: itself, its path and the lease."""
    servo = (await rig.ready())[0]
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    return servo, path, lease


@pytest.mark.parametrize(
    ("recipe", "step_deg", "overshoot_pct"),
    [(PLAIN, 8.0, (0, 6)), (LIVELY, -15.0, (9, 100))],
    ids=["plain", "with an arm"],
)
@scene(lambda recipe: recipe)
async def test_the_metrics_measured_over_the_bus_are_those_of_the_horn(
    rig: Rig, recipe: Recipe, step_deg: float, overshoot_pct: tuple[float, float]
) -> None:
    servo, path, lease = await ready(rig)
    witness = Witness(rig.sim(servo))
    before = rig.sim(servo).angle_deg
    job = succeeded(await step_test(rig, path, lease, step_deg=step_deg, note="arm of 30 g"))
    witness.end()
    run = json(await rig.call("GET", f"/runs/{job['result']['run']}"))
    assert run["note"] == "arm of 30 g"
    assert run["achieved_hz"] > 400
    assert run["parameters"]["angle_p_gain"] == servo.registers["angle_p_gain"].parameter.default
    assert [one["direction"] for one in run["steps"]] == ["there", "back"]
    for shown, (at, _) in zip(run["steps"], commands(rig)[-2:], strict=True):
        # the same metrics of the true angle
        truth = [(t - at, deg) for t, deg in witness.seen if at <= t <= at + 1.0]
        times, angles = [t for t, _ in truth], [deg for _, deg in truth]
        exact = metrics.of_step(times, angles, angles[0], shown["to_deg"], band_deg=run["band_deg"])
        measured = shown["metrics"]
        assert measured["overshoot_pct"] == pytest.approx(exact.overshoot_pct, abs=2.0)
        # 0x08 reads tenths of a degree, which on a slow approach is more than a sample
        tenths = [round(deg, 1) for deg in angles]
        real = metrics.of_step(times, tenths, tenths[0], shown["to_deg"], band_deg=run["band_deg"])
        assert overshoot_pct[0] <= measured["overshoot_pct"] <= overshoot_pct[1], "more with an arm on the horn"
        for name in ("rise_s", "settling_s", "delay_s"):
            assert measured[name] == pytest.approx(getattr(real, name), abs=measured["sample_s"] + 0.001), name
    assert abs(rig.sim(servo).angle_deg - before) < 0.6


@scene(
    Recipe(
        "BLA21-12U-A0", "1.300", servo_id=1, node_id=11, angle_deg=60.0, plant=PlantConstants(inertia=3.0),
        rom={"speed_torque_control": 1, "angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0},
    )
)  # fmt: skip
async def test_a_horn_that_keeps_oscillating_is_measured_as_hunting(rig: Rig) -> None:
    """As in the demo: P 100, D 0."""
    servo, path, lease = await ready(rig)
    witness = Witness(rig.sim(servo))
    job = succeeded(await step_test(rig, path, lease, step_deg=5))
    witness.end()
    assert "hunting at" in job["steps"][-1]["evidence"]
    late = [deg for at, deg in witness.seen if witness.seen[-1][0] - at < 0.4]
    middle = (max(late) + min(late)) / 2
    turns = sum(one < middle <= other for one, other in pairwise(late))
    for shown in json(await rig.call("GET", f"/runs/{job['result']['run']}"))["steps"]:
        measured = shown["metrics"]
        assert (measured["settling_s"], measured["hunting"]) == (None, "hunting")
        assert measured["hunting_hz"] == pytest.approx(turns / 0.4, abs=3)
        assert measured["hunting_rms_deg"] == pytest.approx((max(late) - min(late)) / 2 / 2**0.5, rel=0.25)


@scene()
async def test_a_step_test_needs_a_lease_and_torque_and_writes_no_parameter(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}"
    problem(await rig.call("POST", f"{path}/step-test", {"step_deg": 5}), "lease_required", 428)
    lease = await rig.lease()
    json(await rig.call("POST", f"{path}/torque", {"mode": "off"}))
    failed_with(await step_test(rig, path, lease, step_deg=5), "torque_off")
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    written = len(rig.writes())
    await step_test(rig, path, lease, step_deg=5)
    assert {name for _, name, _ in rig.writes()[written:]} == {"0x00"}
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", f"{path}/step-test", {"step_deg": 5}, lease=lease), "stopped", 423)


@scene()
async def test_a_step_of_zero_or_beyond_45_degrees_or_a_limit_is_refused_and_moves_nothing(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    written = len(rig.writes())
    for step_deg in (0, 46, -50):
        body = {"step_deg": step_deg}
        problem(await rig.call("POST", f"{path}/step-test", body, lease=lease), "invalid_value", 422)
    assert len(rig.writes()) == written
    json(await rig.call("PATCH", f"{path}/parameters", {"values": {"angle_limit_cw": 3.0}}, lease=lease))
    failed_with(await step_test(rig, path, lease, step_deg=5), "out_of_range")
    await asyncio.sleep(0.5)
    assert abs(rig.sim(servo).angle_deg) < 1


@scene()
async def test_stop_ends_a_step_test_and_only_torque_off_follows(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    job = json(await rig.call("POST", f"{path}/step-test", {"step_deg": 10, "runs": 5}, lease=lease), 202)
    await asyncio.sleep(1.5)
    json(await rig.call("POST", "/stop"))
    written = len(rig.writes())
    await rig.host.jobs.wait(rig.host.jobs.get(job["id"]))
    failed_with(json(await rig.call("GET", f"/jobs/{job['id']}")), "stopped")
    assert rig.sim(servo).output == 1
    await asyncio.sleep(1)
    assert {(name, raw) for _, name, raw in rig.writes()[written:]} <= {("0x20", 1)}


@scene()
async def test_cancelling_moves_the_horn_back_and_a_blocked_horn_is_a_failure_without_a_run(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    job = json(await rig.call("POST", f"{path}/step-test", {"step_deg": 20, "dwell_s": 3}, lease=lease), 202)
    await asyncio.sleep(1.5)
    assert rig.sim(servo).angle_deg > 15
    json(await rig.call("DELETE", f"/jobs/{job['id']}"))
    await asyncio.sleep(1)
    assert abs(rig.sim(servo).angle_deg) < 1
    rig.sim(servo).conditions.load_inertia = 1e6
    failed_with(await step_test(rig, path, lease, step_deg=5), "did_not_move")
    assert json(await rig.call("GET", "/runs")) == []


@scene()
async def test_runs_are_stored_listed_overlaid_exported_and_deleted(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    first = (await step_test(rig, path, lease, step_deg=5))["result"]["run"]
    json(await rig.call("PATCH", f"{path}/parameters", {"values": {"angle_p_gain": 30.0}}, lease=lease))
    second = (await step_test(rig, path, lease, step_deg=5))["result"]["run"]
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


def commands(rig: Rig) -> list[tuple[float, float]]:
    """The time and value of each change of the angle command."""
    found: list[tuple[float, float]] = []
    for transfer in rig.transfers("host"):
        request = GetSetRequest.decode(transfer.payload)
        if request is not None and request.name == "0x00" and isinstance(request.value.value, int):
            angle = request.value.value / 10
            if not found or abs(found[-1][1] - angle) > 0.05:
                found.append((transfer.at, angle))
    return found


@scene(PLAIN)
async def test_conditions_that_spoil_the_metrics_are_noted_with_the_run(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    for smoothing, codes in ((0, []), (1, ["smoothing_on"])):
        json(await rig.call("PATCH", f"{path}/parameters", {"values": {"smoothing": bool(smoothing)}}, lease=lease))
        job = succeeded(await step_test(rig, path, lease, step_deg=4.0))
        run = json(await rig.call("GET", f"/runs/{job['result']['run']}"))
        assert [one["code"] for one in run["warnings"]] == codes
    older: dict[str, Json] = {**rig.host.store.runs.of(servo.uid)[0].document, "warnings": ["A sentence."]}
    stored = rig.host.store.runs.add(servo.uid, "", older)
    run = json(await rig.call("GET", f"/runs/{stored.id}"))
    assert [(one["text"], one["code"]) for one in run["warnings"]] == [("A sentence.", "text")]
