"""Identify: a bounded wiggle of one horn that affects no other servo and restores everything."""

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from typing import Any

import pytest

from behaviour.actions import by_servo_id, move, write
from behaviour.applying import in_order
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.domain.plant import PlantConstants
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo

NEW = Recipe("BLA21-06U-A0", "1.300", rom={"soft_start": 0, "torque_mode": 1}, angle_deg=40.0)
"""As delivered, without IDs, but with torque off, so that its horn stays where it is."""

OFF = replace(NEW, servo_id=1, node_id=11)
ON = replace(PLAIN, rom={"soft_start": 0, "timeout_action": 0}, angle_deg=25.0)
OLD = replace(OFF, firmware="1.010")


@dataclass
class Watched:
    """Extremes of a horn, sampled every millisecond."""

    sim: SimulatedServo
    start: float = 0.0
    low: float = 0.0
    high: float = 0.0
    fastest_rpm: float = 0.0

    async def watch(self) -> None:
        loop = asyncio.get_running_loop()
        self.start = self.low = self.high = self.sim.angle_deg
        while True:
            motion = self.sim._device.motion  # pyright: ignore[reportPrivateUsage] - between its frames
            motion.advance(loop.time())
            self.low, self.high = min(self.low, motion.angle), max(self.high, motion.angle)
            self.fastest_rpm = max(self.fastest_rpm, abs(motion.speed / 6))
            await asyncio.sleep(0.001)

    def assert_bounded(self) -> None:
        assert self.low >= self.start - 4
        assert self.high <= self.start + 4
        assert self.fastest_rpm <= 31


@asynccontextmanager
async def watching(rig: Rig, *servos: Servo) -> AsyncGenerator[list[Watched]]:
    watched = [Watched(rig.sim(servo)) for servo in servos]
    tasks = [asyncio.create_task(one.watch()) for one in watched]
    await asyncio.sleep(0.002)
    yield watched
    for task in tasks:
        task.cancel()


def rows(rig: Rig, servo: Servo) -> dict[str, int]:
    """RAM of all configuration rows, as the servo itself has it."""
    memory = rig.sim(servo).memory
    return {key: memory.get(one.parameter.address) for key, one in servo.registers.items() if one.parameter.rom}


def path(servo: Servo) -> str:
    return f"/servos/{servo.uid}/identify"


async def identify(rig: Rig, servo: Servo, lease: str | None = None) -> Any:
    return json(await rig.call("POST", path(servo) + "?wait=true", lease=lease))


async def begun(rig: Rig, servo: Servo, lease: str | None = None) -> RunningJob:
    return rig.host.jobs.get(json(await rig.call("POST", path(servo), lease=lease), 202)["id"])


async def moving(rig: Rig, servo: Servo, lease: str | None = None) -> RunningJob:
    """A job whose horn is moving."""
    job = await begun(rig, servo, lease)
    await until(lambda: sum(name == "0x00" for _, name, _ in rig.writes()) >= 12, 10)
    return job


def evidence(job: Any, name: str) -> str:
    return next(one["evidence"] for one in job["steps"] if one["name"] == name)


@scene(ON)
async def test_limits_are_never_reported_as_unsaved_even_if_not_restored_yet(rig: Rig, servo: Servo) -> None:
    await write(rig, servo, speed_limit_cw=200)
    before = set(servo.unsaved())
    assert "speed_limit_cw" in before
    job = await begun(rig, servo)
    seen, limited = set[str](), False
    while not job.ended:
        seen |= set(servo.unsaved())
        limited = limited or servo.raw("speed_limit_cw") == 30
        await asyncio.sleep(0.005)
    assert limited
    assert seen - {"torque_mode"} == before - {"torque_mode"}
    assert servo.overridden == {}

    await write(rig, servo, speed_limit_cw=300)
    assert "speed_limit_cw" not in servo.unsaved()
    job = await begun(rig, servo)
    await until(lambda: job.step == "wiggle", every_s=0.005)
    rig.sim(servo).conditions.mute = True
    await rig.host.jobs.wait(job)
    assert servo.overridden["speed_limit_cw"] == 300
    assert "speed_limit_cw" in servo.owed
    assert "speed_limit_cw" not in servo.unsaved()
    rig.sim(servo).conditions.mute = False
    await until(lambda: not servo.owed and servo.overridden == {})
    assert rig.sim(servo).memory.get(0x3A) == 300


@pytest.mark.parametrize(
    "recipe", [NEW, ON, OLD, replace(OFF, model="BLA15-12U-A0")], ids=["new", "on", "1.010", "BLA15"]
)
@scene(lambda recipe: recipe, lambda recipe: replace(recipe, node_id=recipe.node_id and 12))
async def test_one_horn_wiggles_within_its_bounds_and_everything_is_restored(rig: Rig, recipe: Recipe) -> None:
    one, other = await rig.ready(2)
    before = [rows(rig, servo) for servo in (one, other)]
    saved = one.unsaved()
    async with watching(rig, one, other) as (moved, still):
        job = await identify(rig, one)
        assert job["state"] == "succeeded", job
        assert [one["state"] for one in job["steps"]] == ["done"] * 5
        await asyncio.sleep(1)
        moved.assert_bounded()
        assert moved.high - moved.low > 4
        assert abs(moved.sim.angle_deg - moved.start) <= 0.5
        assert still.high - still.low < 0.3
        result = job["result"]
        assert result["moved"] is True
        assert result["from_deg"] == pytest.approx(moved.start, abs=0.1)
        assert result["low_deg"] == pytest.approx(moved.low, abs=0.3)
        assert result["high_deg"] == pytest.approx(moved.high, abs=0.3)
        assert result["back_deg"] == pytest.approx(result["from_deg"], abs=0.5)
    assert [rows(rig, servo) for servo in (one, other)] == before
    assert {key: one.raw(key) for key in before[0]} == before[0]
    assert one.unsaved() == saved
    assert rig.sim(one).output == before[0]["torque_mode"]
    assert rig.array_commands() == []
    assert {node for node, _, _ in rig.writes()} == {one.node_id}
    assert not rig.host.motion.is_commanded(one.uid)
    assert json(await rig.call("GET", "/leases")) == []
    (row,) = rig.host.store.audit.rows(action="identify")
    assert (row.entry.uid, row.entry.outcome, row.entry.by) == (one.uid, "succeeded", "no lease")
    leases = {row.entry.outcome: row.entry.by for row in rig.host.store.audit.rows(action="lease")}
    assert leases["taken"] == leases["released"] == f"identify {one.title}"


@scene(OFF)
async def test_limits_are_set_before_torque_on_and_restored_after_torque_off(rig: Rig, servo: Servo) -> None:
    first, second = await begun(rig, servo), await begun(rig, servo)
    assert first is second, "two requests share one job"
    await rig.host.jobs.wait(first)
    written = [(name, raw) for _, name, raw in rig.writes() if name != "0x00"]
    limits = [("0x3A", 30), ("0x3B", -30), ("0x3C", 30), ("0x3D", -30), ("0x25", 1), ("0x20", 0)]
    assert written == [
        *limits, ("0x20", 1), ("0x25", 0), ("0x3D", -100), ("0x3C", 100), ("0x3B", -300), ("0x3A", 300),
    ]  # fmt: skip
    assert "30 rpm" in evidence(json(await rig.call("GET", f"/jobs/{first.id}")), "limit")


LOWER = {"speed_limit_cw": 20, "torque_limit_ccw": -25, "speed_limit_ccw": -10}


@scene(replace(OFF, rom={**OFF.rom, **LOWER}), replace(OLD, servo_id=2, node_id=12))
async def test_lower_limits_are_left_alone_and_old_firmware_without_0x25_writes_none(rig: Rig) -> None:
    new, old = by_servo_id(await rig.ready(2))
    await identify(rig, new)
    assert not {"0x3A", "0x3D"} & {name for _, name, _ in rig.writes()}
    assert ("0x3C", 30) in [(name, raw) for _, name, raw in rig.writes()]
    job = await identify(rig, old)
    assert "no 0x25" in evidence(job, "limit")
    assert {name for node, name, _ in rig.writes() if node == old.node_id} == {"0x20", "0x00"}


@pytest.mark.parametrize("limit", [400, 300])
@scene(lambda limit: replace(OFF, rom={**OFF.rom, "angle_limit_cw": limit}))
async def test_at_an_angle_limit_it_wiggles_to_the_other_side_only_and_beyond_it_not(
    rig: Rig, servo: Servo, limit: int
) -> None:
    async with watching(rig, servo) as (horn,):
        job = await identify(rig, servo)
        horn.assert_bounded()
    if limit == 400:
        assert job["state"] == "succeeded", job
        assert job["result"]["high_deg"] <= 40.5
        assert job["result"]["low_deg"] < 38.0
    else:
        assert (job["state"], job["error"]["code"], job["error"]["maximum"]) == ("failed", "out_of_range", 30)
        assert rig.writes() == []


@scene(ON)
async def test_it_needs_the_lease_and_the_command_under_it_resumes(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    await move(rig, servo, lease, 10, wait="settled")
    problem(await rig.call("POST", path(servo)), "lease_held", 409)
    problem(await rig.call("POST", path(servo), lease="f" * 32), "lease_held", 409)
    job = await identify(rig, servo, lease)
    assert job["state"] == "succeeded", job
    assert servo.raw("command_angle") == 100
    await asyncio.sleep(3)
    assert rig.host.motion.is_commanded(servo.uid)
    assert rig.sim(servo).output == 0
    assert rig.sim(servo).angle_deg == pytest.approx(10, abs=0.5)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    assert rig.sim(servo).output == 1


@pytest.mark.parametrize("recipe", [OFF, ON], ids=["was off", "was on"])
@pytest.mark.parametrize("how", ["stop", "cancel", "lease"])
@scene(lambda recipe: recipe)
async def test_an_early_end_turns_torque_off_and_restores_every_row(
    rig: Rig, servo: Servo, how: str, recipe: Recipe
) -> None:
    before = rows(rig, servo)
    lease = await rig.lease()
    job = await moving(rig, servo, lease)
    assert rig.sim(servo).memory.get(0x25) == 1
    if how == "stop":
        json(await rig.call("POST", "/stop"))
    else:
        json(await rig.call("DELETE", f"/jobs/{job.id}" if how == "cancel" else f"/leases/{lease}"))
    assert rig.sim(servo).output == 1, "at once"
    await rig.host.jobs.wait(job)
    assert (job.state, job.error and job.error.code) == {
        "stop": ("failed", "stopped"), "lease": ("failed", "lease_required"), "cancel": ("cancelled", None),
    }[how]  # fmt: skip
    assert rows(rig, servo) == {**before, "torque_mode": 1}
    assert rig.events("not_restored") == []
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 1
    assert abs(rig.sim(servo).angle_deg - recipe.angle_deg) <= 4


@scene(
    replace(OFF, plant=PlantConstants(inertia=1e7)),
    replace(ON, servo_id=2, node_id=12, rom={"soft_start": 0, "timeout_action": 1}),
)
async def test_a_blocked_horn_fails_and_the_timeout_of_a_servo_is_announced(rig: Rig) -> None:
    servo, other = await in_order(rig, 2)
    before = rows(rig, servo)
    job = await identify(rig, servo)
    assert (job["state"], job["error"]["code"]) == ("failed", "did_not_move")
    assert job["result"]["moved"] is False
    assert rows(rig, servo) == before
    assert rig.sim(servo).output == 1
    job = await identify(rig, other)
    assert "timeout (0x26) switches torque off in 1 s" in evidence(job, "restore")
    assert rig.sim(other).output == 0
    await asyncio.sleep(1.1)
    assert (rig.sim(other).output, other.raw("torque_mode")) == (1, 0)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.release) for seed in (1, 2))])
@scene(OFF)
async def test_despite_frame_loss_everything_is_restored_or_named_and_torque_off_is_retried(
    rig: Rig, servo: Servo, seed: int
) -> None:
    """Seed 0 loses all frames once the horn moves, the others 20 %."""
    before = rows(rig, servo)
    if seed:
        rig.bus.loss(20, seed=seed)
        async with watching(rig, servo) as (horn,):
            shown = await identify(rig, servo)
            assert shown["state"] == "succeeded" or shown["error"]["code"] in ("no_response", "lease_required"), shown
            horn.assert_bounded()
    else:
        job = await moving(rig, servo)
        rig.bus.loss(100)
        await rig.host.jobs.wait(job)
        assert job.state == "failed"
        assert job.error is not None
        keys: Any = job.error.facts["not_restored"]
        assert set(keys) == {
            "speed_torque_control", "torque_limit_cw", "torque_limit_ccw", "speed_limit_cw", "speed_limit_ccw",
        }  # fmt: skip
        assert all(key in rig.events("not_restored")[0].text for key in keys)
    rig.bus.loss(0)
    await asyncio.sleep(2 if seed else 6)
    assert {**rows(rig, servo), "torque_mode": 1} == before
    assert rig.sim(servo).output == 1


@scene(ON, replace(PLAIN, servo_id=2, node_id=12, rom_sound=False))
async def test_it_is_rejected_where_nothing_may_move(rig: Rig) -> None:
    servo, lost = await in_order(rig, 2)
    rig.sim(servo).conditions.load_pct = 50
    await asyncio.sleep(1)
    job = await identify(rig, servo)
    assert (job["state"], job["error"]["code"]) == ("failed", "busy")
    assert "could drop" in job["error"]["detail"]
    assert rig.writes() == []
    assert rig.sim(servo).output == 0
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", path(servo)), "stopped", 423)
    json(await rig.call("DELETE", "/stop"))
    sent = len(rig.writes())
    problem(await rig.call("POST", path(servo), lease="f" * 32), "lease_required", 428)
    problem(await rig.call("POST", f"/servos/{'0' * 32}/identify"), "unknown_servo", 404)
    problem(await rig.call("POST", path(lost)), "configuration_lost", 409)
    servo.busy = State.SAVING
    problem(await rig.call("POST", path(servo)), "busy", 409)
    servo.busy = None
    async with servo.changing:
        problem(await rig.call("POST", path(servo)), "busy", 409)
    assert json(await rig.call("GET", "/leases")) == []
    assert len(rig.writes()) == sent
