"""Frequency responses over the bus: true, honest where they are not reliable, bounded, and safe on bad days."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np
import pytest

from behaviour.restarting import failed_with, succeeded
from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from frequency_truth import Case, deviation
from hornbill.lab.excitation import ExcitationPlan
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.services import GetSetRequest

FREE = Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, rom={"smoothing": 0})
SHORT = {"from_hz": 1.0, "to_hz": 10.0, "duration_s": 5.0}


async def ready(rig: Rig, ttl_s: float = 60.0) -> tuple[Servo, str, str]:
    """A servo with torque on under a lease: itself, its path and the lease."""
    servo = (await rig.ready())[0]
    lease = await rig.lease(ttl_s)
    path = f"/servos/{servo.uid}"
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    return servo, path, lease


async def measure(rig: Rig, path: str, lease: str | None, **body: object) -> Any:
    """The ended job."""
    return json(await rig.call("POST", f"{path}/frequency-response?wait=true", {**SHORT, **body}, lease=lease))


async def result(rig: Rig, path: str, lease: str | None, **body: object) -> Any:
    """The frequency response."""
    job = succeeded(await measure(rig, path, lease, **body))
    return json(await rig.call("GET", f"/frequency-responses/{job['result']['run']}"))


def angles(rig: Rig) -> list[float]:
    """Commanded angles, °."""
    found: list[float] = []
    for transfer in rig.transfers("host"):
        request = GetSetRequest.decode(transfer.payload)
        if request is not None and request.name == "0x00" and isinstance(request.value.value, int):
            found.append(request.value.value / 10)
    return found


@pytest.mark.release
@pytest.mark.parametrize(
    "case",
    [
        pytest.param(Case("BLA21-12U-A0", 0.0, True), id="0x25 on"),
        pytest.param(Case("BLA15-12U-A0", 3.0, False), id="with inertia"),
    ],
)
def test_a_response_is_that_of_an_independent_integration(case: Case) -> None:
    """All models and inertias: `make bench BENCH=identify`."""
    found = deviation(case, ExcitationPlan("chirp", 2.0, 0.5, 10.0, 12.0))
    assert found.reliable > 0.9 * found.frequencies
    assert found.gain_db.max() < 0.5
    assert found.phase_deg.max() < 5.0


@scene(FREE)
async def test_a_response_is_stored_with_its_conditions_listed_exported_and_deleted(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    start = rig.sim(servo).angle_deg
    json(await rig.call("PUT", f"{path}/set-up", {"arm_mm": 60.0, "mass_g": 120.0, "mounting": "vice"}))
    run = await result(rig, path, lease, note="arm of 60 mm")
    assert (run["procedure"], run["note"]) == ("frequency_response/1", "arm of 60 mm")
    assert run["set_up"]["mass_g"] == 120.0
    assert run["parameters"]["angle_p_gain"] == servo.registers["angle_p_gain"].parameter.default
    assert (run["verdict"]["level"], run["dependence"], run["warnings"]) == ("ok", None, [])
    (curve,) = run["curves"]
    assert curve["achieved_hz"] > 250
    assert (curve["missed_slots"], curve["slots"]) == (0, 601)
    assert np.mean(curve["reliable"]) > 0.9
    assert curve["metrics"]["phase_margin_deg"]["low"] < curve["metrics"]["phase_margin_deg"]["value"]
    (listed,) = json(await rig.call("GET", f"/frequency-responses?uid={servo.uid}"))
    assert listed["curves"][0]["frequency_hz"] == []
    assert listed["verdict"] == run["verdict"]
    lines = (await rig.call("GET", f"/frequency-responses/{run['id']}/csv")).text.splitlines()
    assert len(lines) == 1 + len(curve["frequency_hz"])
    assert lines[0].startswith("amplitude_deg,frequency_hz,gain_db")
    assert json(await rig.call("GET", "/runs")) == [], "it is no step test"
    problem(await rig.call("GET", f"/runs/{run['id']}"), "unknown_run", 404)
    problem(await rig.call("DELETE", f"/runs/{run['id']}"), "unknown_run", 404)
    assert (await rig.call("DELETE", f"/frequency-responses/{run['id']}")).status_code == 204
    problem(await rig.call("GET", f"/frequency-responses/{run['id']}"), "unknown_run", 404)
    await asyncio.sleep(0.5)
    assert abs(rig.sim(servo).angle_deg - start) < 0.6


@pytest.mark.parametrize("excitation", ["chirp", pytest.param("multisine", marks=pytest.mark.release)])
@scene(FREE)
async def test_no_command_exceeds_the_requested_amplitude(rig: Rig, excitation: str) -> None:
    _, path, lease = await ready(rig)
    before = len(angles(rig))
    run = await result(rig, path, lease, excitation=excitation, amplitude_deg=2.5)
    offsets = np.array(angles(rig)[before:]) - run["start_deg"]
    assert np.abs(offsets).max() <= 2.5 + 1e-9
    assert np.abs(offsets).max() >= 2.2
    assert np.abs(np.diff(offsets)).max() < 2.0, "no jump"


@pytest.mark.release
@scene(FREE)
async def test_a_ladder_measures_three_amplitudes_and_names_what_depends_on_them(rig: Rig) -> None:
    _, path, lease = await ready(rig)
    run = await result(rig, path, lease, amplitude_deg=1.0, ladder=True)
    assert [one["amplitude_deg"] for one in run["curves"]] == [0.5, 1.0, 2.0]
    assert run["dependence"]["code"] == "deadband_dependence", "0.3° of 0.5° are within the deadband"
    assert run["verdict"]["code"] == "amplitude_dependent"
    job = json(await rig.call("GET", "/jobs?kind=frequency_response"))[-1]
    assert [one["code"] for one in job["steps"]] == ["check", "measure", "measure", "measure", "evaluate"]


@scene(FREE)
async def test_lost_frames_and_an_amplitude_near_the_resolution_are_not_reliable(rig: Rig) -> None:
    _, path, lease = await ready(rig)
    small = await result(rig, path, lease, amplitude_deg=0.3)
    assert not any(small["curves"][0]["reliable"])
    assert (small["verdict"]["code"], small["verdict"]["advice"]["code"]) == ("not_reliable", "try_larger_amplitude")
    assert all(value is None for value in small["curves"][0]["metrics"].values())
    rig.bus.loss(20.0)
    lossy = await result(rig, path, lease)
    rig.bus.loss(0.0)
    (curve,) = lossy["curves"]
    assert curve["missed_slots"] > 0.05 * curve["slots"]
    high = np.array(curve["frequency_hz"]) > 5
    assert not np.array(curve["reliable"])[high].any()
    assert lossy["verdict"]["text"].startswith("Not reliable") == (not any(curve["reliable"]))


@scene(PLAIN)
async def test_with_smoothing_there_are_no_margins(rig: Rig) -> None:
    _, path, lease = await ready(rig)
    run = await result(rig, path, lease)
    assert run["verdict"]["code"] == "smoothing_measured"
    metrics = run["curves"][0]["metrics"]
    assert metrics["bandwidth_3db_hz"]["value"] == pytest.approx(4.0, abs=1.2), "a lag of 40 ms"
    assert (metrics["phase_margin_deg"], metrics["gain_margin_db"]) == (None, None)


@scene(FREE)
async def test_an_impossible_request_is_refused_and_moves_nothing(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    before = len(rig.writes())
    for body in (
        {"amplitude_deg": 21}, {"amplitude_deg": 11, "ladder": True}, {"from_hz": 6, "to_hz": 10}, {"duration_s": 4},
        {"to_hz": 26}, {"amplitude_deg": 0.1}, {"excitation": "noise"}, {"other": 1},
    ):  # fmt: skip
        problem(
            await rig.call("POST", f"{path}/frequency-response", {**SHORT, **body}, lease=lease), "invalid_value", 422
        )
    problem(await rig.call("POST", f"{path}/frequency-response", SHORT), "lease_held", 409)
    assert len(rig.writes()) == before
    json(await rig.call("PATCH", f"{path}/parameters", {"values": {"angle_limit_cw": 1.5}}, lease=lease))
    before = len(rig.writes())
    failed_with(await measure(rig, path, lease), "out_of_range")
    assert len(rig.writes()) == before
    assert abs(rig.sim(servo).angle_deg) < 0.6


async def stop(rig: Rig, _job: str) -> None:
    json(await rig.call("POST", "/stop"))


async def cancel(rig: Rig, job: str) -> None:
    json(await rig.call("DELETE", f"/jobs/{job}"))


async def unplug(rig: Rig, _job: str) -> None:
    await rig.cable.unplug()


async def lose_lease(_rig: Rig, _job: str) -> None:
    """The client dies: its lease expires."""


async def lose_power(rig: Rig, _job: str) -> None:
    rig.sim(rig.host.fleet.all()[0]).power_off(asyncio.get_running_loop().time())


@pytest.mark.parametrize(
    ("happens", "state", "code", "output"),
    [
        (stop, "failed", "stopped", 1),
        (cancel, "cancelled", None, 0),
        (unplug, "failed", "bus_disconnected", None),
        (lose_lease, "failed", "lease_required", 1),
        (lose_power, "failed", "no_response", None),
    ],
)
@scene(FREE)
async def test_a_bad_day_ends_with_the_output_off_or_the_horn_at_its_start_and_a_reason(
    rig: Rig, happens: Callable[[Rig, str], Awaitable[None]], state: str, code: str | None, output: int | None
) -> None:
    servo, path, lease = await ready(rig, ttl_s=3.0 if happens is lose_lease else 60.0)
    sim = rig.sim(servo)
    start = sim.angle_deg
    body = {**SHORT, "amplitude_deg": 8.0, "duration_s": 20.0}
    job = json(await rig.call("POST", f"{path}/frequency-response", body, lease=lease), 202)
    await asyncio.sleep(1.9)
    assert abs(sim.angle_deg - start) > 1
    await happens(rig, job["id"])
    await rig.host.jobs.wait(rig.host.jobs.get(job["id"]))
    ended = json(await rig.call("GET", f"/jobs/{job['id']}"))
    assert (ended["state"], ended["error"] and ended["error"]["code"]) == (state, code)
    if code is not None:
        assert len(ended["error"]["detail"]) > 20, "a sentence with the reason"
    await asyncio.sleep(1.0)
    assert json(await rig.call("GET", "/frequency-responses")) == []
    if output is not None:
        assert sim.output == output
    if output == 0:
        assert abs(sim.angle_deg - start) < 0.6
    if happens is unplug:
        rig.cable.plug_in()
        async with asyncio.timeout(30):
            while sim.output != 1:
                await asyncio.sleep(0.1)


@scene(FREE)
async def test_a_horn_that_is_carried_away_ends_the_test(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    job = json(await rig.call("POST", f"{path}/frequency-response", {**SHORT, "duration_s": 20.0}, lease=lease), 202)
    await asyncio.sleep(2.0)
    rig.sim(servo).conditions.load_pct = 100.0
    await rig.host.jobs.wait(rig.host.jobs.get(job["id"]))
    error = failed_with(json(await rig.call("GET", f"/jobs/{job['id']}")), "did_not_move")
    assert error["cause"] == "swings_too_far"
    assert "at an amplitude of 2°" in error["detail"]
    rig.sim(servo).conditions.load_pct = 0.0
    await asyncio.sleep(1.0)
    assert abs(rig.sim(servo).angle_deg) < 0.6, "commanded back"


@scene(FREE)
async def test_a_blocked_horn_is_not_reliable(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    rig.sim(servo).conditions.load_inertia = 1e6
    blocked = await result(rig, path, lease)
    assert blocked["verdict"]["code"] == "not_reliable"
    assert blocked["curves"][0]["peak_deg"] < 0.5
