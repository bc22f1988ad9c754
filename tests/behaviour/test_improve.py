"""Improve: better gains that are kept only if measured better, and every other ending leaves the servo as it was."""

import asyncio
import contextlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.actions import power_cycle
from behaviour.restarting import failed_with, succeeded
from behaviour.rig import Rig, json, play, problem, until
from behaviour.scene import scene, settled
from behaviour.test_temporary_values import again, at, kill_server
from hornbill.domain.plant import PlantConstants
from hornbill.errors import HornbillError
from hornbill.lab import identification
from hornbill.lab import improve as improve_module
from hornbill.lab.identification import Identified, Interval
from hornbill.lab.model import Loop
from hornbill.lab.search import Prediction, Proposal
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.services import ExecuteOpcodeRequest

HUNTING = Recipe(
    "BLA21-12U-A0", "1.300", servo_id=1, node_id=11, plant=PlantConstants(inertia=3.0),
    rom={
        "speed_torque_control": 1, "angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0, "soft_start": 0,
        "smoothing": 0, "timeout_action": 0,
    },
)  # fmt: skip
"""As in the demo: P 100, D 0."""

GOOD = replace(HUNTING, rom={**HUNTING.rom, "angle_p_gain": 40, "angle_d_gain": 40, "angle_dead_band": 3})
BOUNDS = {"from_deg": -14.0, "to_deg": 14.0, "torque_pct": 80, "speed_rpm": 100, "time_s": 120.0}


def ram(rig: Rig, servo: Servo) -> dict[str, int]:
    """RAM of all rows stored in ROM but 0x20, as the servo itself has it."""
    memory = rig.sim(servo).memory
    return {
        key: memory.get(one.parameter.address)
        for key, one in servo.registers.items()
        if one.parameter.rom and key != "torque_mode"
    }


async def on(rig: Rig, servo: Servo) -> str:
    """A lease under which torque is on."""
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    rig.host.holding = asyncio.create_task(renewed(rig, lease))  # pyright: ignore[reportAttributeAccessIssue]
    return lease


async def renewed(rig: Rig, lease: str) -> None:
    """Renew it as a client does, until it ends."""
    with contextlib.suppress(HornbillError):
        while True:
            await asyncio.sleep(10)
            rig.host.leases.renew(lease, rig.host.base.now())


async def improve(rig: Rig, servo: Servo, lease: str, goal: str = "fast", **more: object) -> Any:
    """The ended job."""
    body = {"goal": goal, "bounds": BOUNDS, **more}
    return json(await rig.call("POST", f"/servos/{servo.uid}/improve?wait=true", body, lease=lease))


def saved(rig: Rig) -> bool:
    """Whether a save was ever requested."""
    return any(one.type_id == ExecuteOpcodeRequest.TYPE.id for one in rig.transfers("host"))


@scene(HUNTING)
async def test_a_hunting_servo_becomes_calm_in_ram_only(rig: Rig, servo: Servo) -> None:
    lease, before = await on(rig, servo), ram(rig, servo)
    plan = json(await rig.call("POST", f"/servos/{servo.uid}/improve/plan", {"goal": "fast", "bounds": BOUNDS}))
    assert (plan["from_deg"], plan["to_deg"], plan["step_deg"]) == (-14.0, 14.0, 10.0)
    assert set(plan["limits"]) == {
        "angle_limit_cw", "angle_limit_ccw", "torque_limit_cw", "torque_limit_ccw", "speed_limit_cw", "speed_limit_ccw",
    }  # fmt: skip
    assert ram(rig, servo) == before
    job = succeeded(await improve(rig, servo, lease))
    result = job["result"]
    assert result["outcome"] == "kept"
    assert [one["state"] for one in job["steps"]] == ["done"] * 6
    assert result["measured_before"]["hunting"] == "hunting"
    assert result["measured_after"]["hunting"] == "none"
    assert result["predicted_settling_s"] == pytest.approx(result["measured_after"]["settling_s"], rel=0.15)
    changed = {key for key, raw in ram(rig, servo).items() if raw != before[key]}
    assert changed <= {"angle_p_gain", "angle_d_gain", "angle_dead_band", "angle_boost"}
    assert "angle_p_gain" in changed
    assert set(servo.unsaved()) == changed
    assert (servo.overridden, servo.owed) == ({}, [])
    assert not saved(rig)
    assert rig.host.store.settings.get(f"temporary_values.{servo.uid}") is None
    runs = [json(await rig.call("GET", f"/runs/{one}")) for one in result["runs"]]
    assert [one["verdict"]["code"] == "hunts" for one in runs] == [True, False]
    assert [abs(one["step_deg"]) for one in runs] == [4.0, 10.0], "a servo that hunts makes small steps"
    assert abs(rig.sim(servo).angle_deg) < 0.6
    assert rig.host.motion.is_commanded(servo.uid)


@pytest.mark.release
@scene(GOOD)
async def test_gains_that_are_not_measured_better_are_not_kept(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wrong model proposes them."""
    shortened(monkeypatch)
    lease, before = await on(rig, servo), ram(rig, servo)
    rig.host.compute = Stub(p_gain=6)  # pyright: ignore[reportAttributeAccessIssue]
    job = succeeded(await improve(rig, servo, lease))
    assert job["result"]["outcome"] == "not_better"
    assert len(job["result"]["tried"]) >= 1
    assert job["result"]["after"]["angle_p_gain"] == 40
    assert ram(rig, servo) == before
    assert {key: servo.raw(key) for key in before} == before
    assert (servo.overridden, servo.owed, servo.unsaved()) == ({}, [], [])
    assert "0x2C" in {name for _, name, _ in rig.writes()}
    assert rig.sim(servo).output == 0, "it holds under the lease"
    assert not saved(rig)


class Stub:
    """Takes the place of fit and search: the horn as it is, and a proposal with this P gain. Takes 0.3 s."""

    def __init__(self, p_gain: int) -> None:
        self.p_gain = p_gain

    async def __call__(self, function: Any, loop: Loop, *arguments: Any) -> Any:
        await asyncio.sleep(0.3)
        if function is identification.fit:
            interval = Interval(0.0, 1.0)
            return Identified(PlantConstants(inertia=3.0), dict.fromkeys(NAMES, interval), 0.0, 0.0)
        gains = {key: loop.rows[key] for key in loop.ranges} | {"angle_p_gain": self.p_gain}
        return Proposal(gains, Prediction(0.05, 0.05, 0.0, 0.0, quiet=True), 60.0, 1.0, 1)


NAMES = ("inertia", "breakaway", "coulomb", "viscous", "backlash_deg", "load_pct", "supply_ohm")


def shortened(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the steps of Improve and the rests between them."""
    monkeypatch.setattr(improve_module, "DWELL_S", 0.4)
    monkeypatch.setattr(improve_module, "REST_S", 0.1)


PHASES = ("check", "baseline", "identify", "search", "confirm", "finish")


async def stopped(rig: Rig, servo: Servo, lease: str) -> None:
    json(await rig.call("POST", "/stop"))


async def braked(rig: Rig, servo: Servo, lease: str) -> None:
    json(await rig.call("POST", "/stop", {"mode": "brake"}))


async def released(rig: Rig, servo: Servo, lease: str) -> None:
    json(await rig.call("DELETE", f"/leases/{lease}"))


async def cancelled(rig: Rig, servo: Servo, lease: str) -> None:
    (job,) = [one for one in rig.host.jobs.all() if one.kind == "improve" and not one.ended]
    json(await rig.call("DELETE", f"/jobs/{job.id}"))


async def torque_off(rig: Rig, servo: Servo, lease: str) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))


async def unplugged(rig: Rig, servo: Servo, lease: str) -> None:
    await rig.cable.unplug()
    await asyncio.sleep(1.0)
    rig.cable.plug_in()


async def off_the_bus(rig: Rig, servo: Servo, lease: str) -> None:
    rig.cable.bus_off()


async def silent(rig: Rig, servo: Servo, lease: str) -> None:
    rig.sim(servo).conditions.mute = True
    await asyncio.sleep(5.0)
    rig.sim(servo).conditions.mute = False


async def losing_frames(rig: Rig, servo: Servo, lease: str) -> None:
    rig.bus.loss(20, seed=5)


async def without_supply(rig: Rig, servo: Servo, lease: str) -> None:
    await power_cycle(rig, servo.uid, 0.5)


WAYS = [
    stopped, braked, released, cancelled, torque_off, unplugged, off_the_bus, silent, losing_frames, without_supply,
]  # fmt: skip


@pytest.mark.parametrize(("number", "way"), list(enumerate(WAYS)))
@settled(GOOD)
async def test_an_abort_leaves_every_register_as_before(
    rig: Rig, servo: Servo, number: int, way: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each way in one phase; `make test-release` has all pairs."""
    await abort(rig, servo, way, (PHASES[number % 6],), monkeypatch)


async def abort(rig: Rig, servo: Servo, way: Any, phases: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Abort Improve in each of these phases, and compare RAM with that before."""
    shortened(monkeypatch)
    rig.host.compute = Stub(p_gain=50)  # pyright: ignore[reportAttributeAccessIssue]
    before = ram(rig, servo)
    for phase in phases:
        lease = await on(rig, servo)
        path = f"/servos/{servo.uid}/improve"
        started = json(await rig.call("POST", path, {"goal": "fast", "bounds": BOUNDS}, lease=lease), 202)
        job = rig.host.jobs.get(started["id"])
        await until(lambda job=job, phase=phase: job.step == phase or job.ended, every_s=0.001)
        assert job.step == phase
        await way(rig, servo, lease)
        await rig.host.jobs.wait(job)
        late = way is losing_frames and phase == "finish" and job.result is not None  # it may end as usual
        assert job.state in ("failed", "cancelled") or late, (phase, job.result)
        if job.error is not None:
            assert len(job.error.detail) > 20
        rig.bus.loss(0)
        await until(lambda: servo.online and servo.identified and not servo.owed and not servo.restoring, 60)
        if not late and way is not without_supply:
            await until(lambda: rig.sim(servo).output != 0, 10)
        assert ram(rig, servo) == before, phase
        await asyncio.sleep(1.5)
        assert ram(rig, servo) == before, phase
        assert (servo.overridden, servo.unsaved()) == ({}, [])
        await rig.call("DELETE", "/stop")
        await rig.call("DELETE", f"/leases/{lease}")
        await until(lambda: not rig.host.watch.gone and servo.state is State.READY, 60)
        await asyncio.sleep(2.0)
    assert not saved(rig)


@pytest.mark.parametrize("phase", [*PHASES[1:-1], pytest.param(PHASES[-1], marks=pytest.mark.release)])
def test_a_killed_server_restores_at_its_next_start(
    tmp_path: Path, phase: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    shortened(monkeypatch)

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        await asyncio.sleep(4)
        rig.host.compute = Stub(p_gain=50)  # pyright: ignore[reportAttributeAccessIssue]
        before, lease = ram(rig, servo), await on(rig, servo)
        path = f"/servos/{servo.uid}/improve"
        started = json(await rig.call("POST", path, {"goal": "fast", "bounds": BOUNDS}, lease=lease), 202)
        job = rig.host.jobs.get(started["id"])
        await until(lambda: job.step == phase, every_s=0.001)
        await asyncio.sleep(0.05)
        await kill_server(rig, tmp_path)
        assert ram(rig, servo) != before
        servo = await again(rig)
        await until(lambda: not servo.restoring and servo.overridden == {}, 60)
        assert ram(rig, servo) == before
        ended = rig.host.jobs.get(started["id"])
        assert ended.error is not None
        assert ended.error.code == "interrupted"
        rig.host.store.close()

    play(scene, GOOD, store=at(tmp_path))


async def blocked(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.plant = replace(GOOD.plant, inertia=1e7)


async def sluggish(rig: Rig, servo: Servo) -> None:
    """Its gain is too low for the friction of its horn."""
    rig.sim(servo).conditions.plant = replace(GOOD.plant, breakaway=0.6, coulomb=0.5)
    rig.sim(servo).memory.put(0x2C, 1)


async def binding(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.plant = replace(GOOD.plant, stop_cw_deg=7.0)


async def noisy(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.plant = replace(GOOD.plant, sensor_noise_deg=0.8)


async def lossy(rig: Rig, servo: Servo) -> None:
    rig.bus.loss(20, seed=2)


async def hurried(rig: Rig, servo: Servo) -> None:
    """Nothing is wrong, but the time is over."""


BAD_DAYS: list[tuple[Any, str, dict[str, Any]]] = [
    (blocked, "improve_saturated", {}),
    (sluggish, "improve_stalled", {}),
    (binding, "improve_binding", {}),
    (noisy, "improve_noisy", {}),
    (lossy, "improve_too_few_samples", {}),
    (hurried, "improve_timeout", {"bounds": {"time_s": 10.0}}),
]


@pytest.mark.parametrize(("prepare", "cause", "more"), BAD_DAYS, ids=[cause for _, cause, _ in BAD_DAYS])
@settled(GOOD)
async def test_a_bad_day_ends_with_the_output_off_everything_restored_and_the_reason(
    rig: Rig, servo: Servo, prepare: Any, cause: str, more: dict[str, Any]
) -> None:
    lease = await on(rig, servo)
    await prepare(rig, servo)
    await asyncio.sleep(0.2)
    before = ram(rig, servo)
    job = await improve(rig, servo, lease, **more)
    causes = [cause, *(["servo_not_responding"] if prepare is lossy else [])]  # a command is never repeated
    assert job["state"] == "failed"
    assert job["error"]["cause"] in causes, job["error"]
    assert job["error"]["detail"].startswith(
        ("The horn of", "The angle readings of", "The improvement of", servo.title, "Only ")
    )
    rig.bus.loss(0)
    await until(lambda: rig.sim(servo).output == 1 and not servo.owed and ram(rig, servo) == before, 30)
    assert servo.overridden == {}
    assert not saved(rig)
    report = await rig.call("GET", f"/jobs/{job['id']}/report?format=junit")
    assert report.status_code == 200
    assert "failure" in report.text


@scene(GOOD)
async def test_it_is_refused_where_nothing_may_move_and_changes_nothing(rig: Rig, servo: Servo) -> None:
    path, before = f"/servos/{servo.uid}/improve", ram(rig, servo)
    problem(await rig.call("POST", path, {"goal": "calm"}), "lease_required", 428)
    lease = await on(rig, servo)
    problem(await rig.call("POST", path, {"goal": "quick"}, lease=lease), "invalid_value", 422)
    problem(await rig.call("POST", path, {"bounds": {"from": 1}}, lease=lease), "invalid_value", 422)
    wide = {"bounds": {"from_deg": -1.0, "to_deg": 1.0}}
    found = problem(await rig.call("POST", f"{path}/plan", wide), "invalid_value", 422)
    assert found["cause"] == "improve_range_too_small"
    job = json(await rig.call("POST", f"{path}?wait=true", wide, lease=lease))
    failed_with(job, "invalid_value")
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    failed_with(await improve(rig, servo, lease), "torque_off")
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", path, {}, lease=lease), "stopped", 423)
    assert ram(rig, servo) == before


@scene(GOOD)
async def test_without_scipy_it_names_the_package(rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(improve_module, "PACKAGE", "a_package_that_does_not_exist")
    for path in (f"/servos/{servo.uid}/improve", f"/servos/{servo.uid}/improve/plan"):
        found = problem(await rig.call("POST", path, {}), "not_available", 501)
        assert found["cause"] == "package_missing"
        assert "pip install 'hornbill[tune]'" in found["detail"]


@pytest.mark.release
@settled(GOOD, replace(GOOD, servo_id=2, node_id=12), replace(GOOD, servo_id=3, node_id=13))
async def test_several_servos_are_improved_in_turn_with_spread_and_outlier(
    rig: Rig, servos: list[Servo], monkeypatch: pytest.MonkeyPatch
) -> None:
    shortened(monkeypatch)
    lease = await rig.lease()
    for one in servos:
        json(await rig.call("POST", f"/servos/{one.uid}/torque", {"mode": "on"}, lease=lease))
    holding = asyncio.create_task(renewed(rig, lease))
    rig.host.compute = Stub(p_gain=6)  # pyright: ignore[reportAttributeAccessIssue]
    before = [ram(rig, one) for one in servos]
    rig.sim(servos[1]).conditions.plant = replace(GOOD.plant, inertia=1e7)
    body = {"uids": [one.uid for one in servos], "goal": "fast", "bounds": BOUNDS}
    job = succeeded(json(await rig.call("POST", "/improve?wait=true", body, lease=lease)))
    assert [one["state"] for one in job["steps"]] == ["done", "failed", "done"]
    assert set(job["result"]["results"]) == {servos[0].uid, servos[2].uid}
    assert job["result"]["spread"]["angle_p_gain"] == {"least": 40.0, "most": 40.0}
    assert job["result"]["outlier"] is None
    assert [ram(rig, one) for one in servos] == before
    assert [rig.sim(one).output for one in servos] == [0, 1, 0]
    twice = {**body, "uids": [servos[0].uid] * 2}
    problem(await rig.call("POST", "/improve", twice, lease=lease), "invalid_value", 422)
    holding.cancel()


def test_the_outlier_is_the_servo_furthest_from_the_others() -> None:
    def one(inertia: float, settling_s: float | None) -> dict[str, object]:
        after = None if settling_s is None else {"settling_s": settling_s}
        plant = {"inertia": inertia, "coulomb": 0.02}
        return {"after": {"angle_p_gain": 20.0 + inertia}, "plant": plant, "measured_after": after}

    found = improve_module.spread({"a": one(1.0, 0.1), "b": one(1.1, 0.11), "c": one(5.0, 0.12), "d": one(0.9, None)})
    assert found["outlier"] == {"uid": "c", "because": "inertia"}
    assert found["spread"] == {"angle_p_gain": {"least": 20.9, "most": 25.0}}
    assert improve_module.spread({"a": one(1.0, 0.1), "b": one(9.0, 0.3)})["outlier"] is None, "two have no middle"
