"""A horn that shows itself: a wiggle that is bounded, touches nobody else, and leaves everything as it found it."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo

NEW = Recipe("BLA21-06U-A0", "1.300", rom={"soft_start": 0, "torque_mode": 1}, angle_deg=40.0)
"""As delivered, without ids, but off: its horn stays where it stands."""

OFF = replace(NEW, servo_id=1, node_id=11)
HELD = replace(PLAIN, rom={"soft_start": 0, "timeout_action": 0}, angle_deg=25.0)
OLD = replace(OFF, firmware="1.010")


@dataclass
class Watched:
    """A horn, looked at every millisecond."""

    sim: SimulatedServo
    start: float = 0.0
    low: float = 0.0
    high: float = 0.0
    fastest_rpm: float = 0.0

    @property
    def span(self) -> float:
        return self.high - self.low

    def begin(self) -> None:
        self.start = self.low = self.high = self.sim.angle_deg
        self.fastest_rpm = 0.0

    async def watch(self) -> None:
        loop = asyncio.get_running_loop()
        self.begin()
        while True:
            motion = self.sim._device.motion  # pyright: ignore[reportPrivateUsage] - between its frames
            motion.advance(loop.time())
            self.low, self.high = min(self.low, motion.angle), max(self.high, motion.angle)
            self.fastest_rpm = max(self.fastest_rpm, abs(motion.speed / 6))
            await asyncio.sleep(0.001)


async def watching(rig: Rig, servos: list[Servo], scene: Callable[[list[Watched]], Awaitable[None]]) -> None:
    watched = [Watched(rig.sim(servo)) for servo in servos]
    tasks = [asyncio.create_task(one.watch()) for one in watched]
    await asyncio.sleep(0.002)
    try:
        await scene(watched)
    finally:
        for task in tasks:
            task.cancel()


def rows(rig: Rig, servo: Servo) -> dict[str, int]:
    """Everything RAM keeps of configuration, as the servo itself has it."""
    memory = rig.sim(servo).memory
    return {key: memory.get(one.parameter.address) for key, one in servo.registers.items() if one.parameter.rom}


async def identify(rig: Rig, servo: Servo, lease: str | None = None) -> Any:
    return json(await rig.call("POST", f"/servos/{servo.uid}/identify?wait=true", lease=lease))


def step(job: Any, name: str) -> Any:
    return next(one for one in job["steps"] if one["name"] == name)


def bounded(one: Watched) -> None:
    assert one.low >= one.start - 4
    assert one.high <= one.start + 4
    assert one.fastest_rpm <= 31


@scene(HELD)
async def test_what_a_wiggle_borrows_is_never_told_as_in_ram_only(rig: Rig, servo: Servo) -> None:
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"speed_limit_cw": 200}}))
    before = servo.unsaved()
    assert "speed_limit_cw" in before
    started = json(await rig.call("POST", f"/servos/{servo.uid}/identify"), 202)
    job, seen, lent = rig.host.jobs.get(started["id"]), set[tuple[str, ...]](), False
    while not job.ended:
        seen.add(tuple(servo.unsaved()))
        lent = lent or servo.raw("speed_limit_cw") == 30
        await asyncio.sleep(0.005)
    assert lent, "it was limited meanwhile"
    assert {key for keys in seen for key in keys} - {"torque_mode"} == set(before) - {"torque_mode"}
    assert servo.overridden == {}


@scene(HELD)
async def test_what_a_wiggle_could_not_give_back_is_told_as_in_ram_only(rig: Rig, servo: Servo) -> None:
    started = json(await rig.call("POST", f"/servos/{servo.uid}/identify"), 202)
    job = rig.host.jobs.get(started["id"])
    while job.step != "wiggle":
        await asyncio.sleep(0.005)
    rig.sim(servo).conditions.mute = True
    await rig.host.jobs.wait(job)
    assert servo.overridden == {}
    assert "speed_limit_cw" in servo.unsaved()


@pytest.mark.parametrize(
    "recipe", [NEW, HELD, OLD, replace(OFF, model="BLA15-12U-A0")], ids=["new", "on", "1.010", "BLA15"]
)
@scene(lambda recipe: recipe, lambda recipe: replace(recipe, node_id=recipe.node_id and 12))
async def test_one_horn_wiggles_within_its_bounds_and_everything_is_as_before(rig: Rig, recipe: Recipe) -> None:
    one, other = await rig.ready(2)
    before = [rows(rig, servo) for servo in (one, other)]
    saved = one.unsaved()

    async def wiggle(watched: list[Watched]) -> None:
        job = await identify(rig, one)
        assert job["state"] == "succeeded", job
        assert [one["state"] for one in job["steps"]] == ["done"] * 5
        await asyncio.sleep(1)
        moved, still = watched
        bounded(moved)
        assert moved.span > 4
        assert abs(moved.sim.angle_deg - moved.start) <= 0.5
        assert still.span < 0.3
        result = job["result"]
        assert result["moved"] is True
        assert result["from_deg"] == pytest.approx(moved.start, abs=0.1)
        assert result["low_deg"] == pytest.approx(moved.low, abs=0.3)
        assert result["high_deg"] == pytest.approx(moved.high, abs=0.3)
        assert result["back_deg"] == pytest.approx(result["from_deg"], abs=0.5)

    await watching(rig, [one, other], wiggle)
    assert [rows(rig, servo) for servo in (one, other)] == before
    assert {key: one.raw(key) for key in before[0]} == before[0]
    assert one.unsaved() == saved
    assert rig.sim(one).output == before[0]["torque_mode"]
    assert rig.array_commands() == []
    assert {node for node, _, _ in rig.writes()} == {one.node_id}
    assert not rig.host.motion.is_commanded(one.uid)
    assert json(await rig.call("GET", "/leases")) == []
    (kept,) = rig.host.store.audit.rows(action="identify")
    assert (kept.entry.uid, kept.entry.outcome, kept.entry.by) == (one.uid, "succeeded", "no lease")
    leases = {row.entry.outcome: row.entry.by for row in rig.host.store.audit.rows(action="lease")}
    assert leases["taken"] == leases["released"] == f"identify {one.title}"


@scene(OFF)
async def test_speed_and_torque_are_limited_before_torque_comes_on_and_freed_after_it_went_off(
    rig: Rig, servo: Servo
) -> None:
    job = await identify(rig, servo)
    written = [(name, raw) for _, name, raw in rig.writes() if name != "0x00"]
    limits = [("0x3A", 30), ("0x3B", -30), ("0x3C", 30), ("0x3D", -30), ("0x25", 1), ("0x20", 0)]
    assert written == [
        *limits, ("0x20", 1), ("0x25", 0), ("0x3D", -100), ("0x3C", 100), ("0x3B", -300), ("0x3A", 300),
    ]  # fmt: skip
    assert "30 rpm" in step(job, "limit")["evidence"]


def test_limits_that_are_lower_already_stay_and_old_firmware_says_what_bounds_it() -> None:
    async def scene(rig: Rig) -> None:
        new, old = sorted(await rig.ready(2), key=lambda one: one.servo_id or 0)
        await identify(rig, new)
        assert not {"0x3A", "0x3D"} & {name for _, name, _ in rig.writes()}
        assert ("0x3C", 30) in [(name, raw) for _, name, raw in rig.writes()]
        job = await identify(rig, old)
        assert "no 0x25" in step(job, "limit")["evidence"]
        assert {name for node, name, _ in rig.writes() if node == old.node_id} == {"0x20", "0x00"}

    low = {"speed_limit_cw": 20, "torque_limit_ccw": -25, "speed_limit_ccw": -10}
    play(scene, replace(OFF, rom={**OFF.rom, **low}), replace(OLD, servo_id=2, node_id=12))


@scene(replace(OFF, rom={**OFF.rom, "angle_limit_cw": 400}))
async def test_at_an_angle_limit_it_wiggles_to_the_other_side_only(rig: Rig, servo: Servo) -> None:

    async def wiggle(watched: list[Watched]) -> None:
        job = await identify(rig, servo)
        assert job["state"] == "succeeded", job
        assert job["result"]["high_deg"] <= 40.5
        assert job["result"]["low_deg"] < 38.0
        bounded(watched[0])

    await watching(rig, [servo], wiggle)


@scene(replace(OFF, rom={**OFF.rom, "angle_limit_cw": 300}))
async def test_a_horn_outside_its_limits_is_not_moved(rig: Rig, servo: Servo) -> None:
    job = await identify(rig, servo)
    assert (job["state"], job["error"]["code"], job["error"]["maximum"]) == ("failed", "out_of_range", 30)
    assert rig.writes() == []


@scene(HELD)
async def test_the_command_of_a_live_lease_goes_on_after_it(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}/command"
    json(await rig.call("POST", path, {"type": "angle", "value": 10, "wait": "settled"}, lease=lease))
    problem(await rig.call("POST", f"/servos/{servo.uid}/identify"), "lease_held", 409)
    problem(await rig.call("POST", f"/servos/{servo.uid}/identify", lease="f" * 32), "lease_held", 409)
    job = await identify(rig, servo, lease)
    assert job["state"] == "succeeded", job
    assert servo.raw("command_angle") == 100
    await asyncio.sleep(3)
    assert rig.host.motion.is_commanded(servo.uid)
    assert rig.sim(servo).output == 0
    assert rig.sim(servo).angle_deg == pytest.approx(10, abs=0.5)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    assert rig.sim(servo).output == 1


async def mid_wiggle(rig: Rig, servo: Servo, lease: str | None = None) -> Any:
    """A job whose horn is on its way."""
    started = json(await rig.call("POST", f"/servos/{servo.uid}/identify", lease=lease), 202)
    async with asyncio.timeout(10):
        while sum(name == "0x00" for _, name, _ in rig.writes()) < 12:
            await asyncio.sleep(0.01)
    return rig.host.jobs.get(started["id"])


@pytest.mark.parametrize("recipe", [OFF, HELD], ids=["was off", "was on"])
@pytest.mark.parametrize("how", ["stop", "cancel", "lease"])
@scene(lambda recipe: recipe)
async def test_what_ends_it_half_way_takes_torque_and_gives_every_row_back(
    rig: Rig, servo: Servo, how: str, recipe: Recipe
) -> None:
    before = rows(rig, servo)
    lease = await rig.lease()
    job = await mid_wiggle(rig, servo, lease)
    assert rig.sim(servo).memory.get(0x25) == 1
    if how == "stop":
        json(await rig.call("POST", "/stop"))
    elif how == "cancel":
        json(await rig.call("DELETE", f"/jobs/{job.id}"))
    else:
        json(await rig.call("DELETE", f"/leases/{lease}"))
    assert rig.sim(servo).output == 1, "at once"
    await rig.host.jobs.wait(job)
    assert job.state == ("cancelled" if how == "cancel" else "failed")
    if how != "cancel":
        assert job.error.code == ("stopped" if how == "stop" else "lease_required")
    assert rows(rig, servo) == {**before, "torque_mode": 1}
    assert rig.events("not_restored") == []
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 1
    angle = rig.sim(servo).angle_deg
    assert abs(angle - recipe.angle_deg) <= 4


@scene(replace(OFF, load_inertia=1e7))
async def test_a_blocked_horn_fails_honestly_and_everything_is_as_before(rig: Rig, servo: Servo) -> None:
    before = rows(rig, servo)
    job = await identify(rig, servo)
    assert (job["state"], job["error"]["code"]) == ("failed", "did_not_move")
    assert "did not move" in job["error"]["detail"]
    assert job["result"]["moved"] is False
    assert rows(rig, servo) == before
    assert rig.sim(servo).output == 1


@scene(OFF)
async def test_a_servo_that_falls_silent_fails_it_and_the_rows_left_behind_are_named(rig: Rig, servo: Servo) -> None:
    job = await mid_wiggle(rig, servo)
    rig.bus.loss(100)
    await rig.host.jobs.wait(job)
    assert job.state == "failed"
    keys = job.error.facts["not_restored"]
    assert set(keys) == {
        "speed_torque_control", "torque_limit_cw", "torque_limit_ccw", "speed_limit_cw", "speed_limit_ccw",
    }  # fmt: skip
    assert all(key in rig.events("not_restored")[0].text for key in keys)
    rig.bus.loss(0)
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 1, "torque off is owed until it answers"


@pytest.mark.parametrize("seed", [1, 2, 3])
@scene(OFF)
async def test_with_a_fifth_of_all_frames_lost_it_works_or_fails_and_restores_all_the_same(
    rig: Rig, servo: Servo, seed: int
) -> None:
    before = rows(rig, servo)
    rig.bus.loss(20, seed=seed)

    async def wiggle(watched: list[Watched]) -> None:
        job = await identify(rig, servo)
        assert job["state"] == "succeeded" or job["error"]["code"] in ("no_response", "lease_required"), job
        bounded(watched[0])

    await watching(rig, [servo], wiggle)
    rig.bus.loss(0)
    await asyncio.sleep(1)
    assert rows(rig, servo) == before
    assert rig.sim(servo).output == 1


@scene(OFF)
async def test_it_is_refused_where_nothing_may_move(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/identify"
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", path), "stopped", 423)
    json(await rig.call("DELETE", "/stop"))
    sent = len(rig.writes())
    problem(await rig.call("POST", path, lease="f" * 32), "lease_required", 428)
    problem(await rig.call("POST", f"/servos/{'0' * 32}/identify"), "unknown_servo", 404)
    servo.busy = State.SAVING
    problem(await rig.call("POST", path), "busy", 409)
    servo.busy = None
    async with servo.changing:
        problem(await rig.call("POST", path), "busy", 409)
    assert json(await rig.call("GET", "/leases")) == []
    assert len(rig.writes()) == sent


@scene(replace(PLAIN, rom_sound=False))
async def test_a_servo_that_lost_its_configuration_is_not_moved(rig: Rig, servo: Servo) -> None:
    problem(await rig.call("POST", f"/servos/{servo.uid}/identify"), "configuration_lost", 409)
    assert rig.writes() == []


@scene(HELD)
async def test_a_horn_that_carries_more_than_the_limit_or_turns_is_left_alone(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.load_pct = 50
    await asyncio.sleep(1)
    job = await identify(rig, servo)
    assert (job["state"], job["error"]["code"]) == ("failed", "busy")
    assert "could drop" in job["error"]["detail"]
    assert rig.writes() == []
    assert rig.sim(servo).output == 0


@scene(replace(HELD, rom={"soft_start": 0, "timeout_action": 1}))
async def test_a_servo_with_a_time_out_of_its_own_is_said_to_let_go_by_itself(rig: Rig, servo: Servo) -> None:
    job = await identify(rig, servo)
    assert "timeout (0x26) switches torque off in 1 s" in step(job, "restore")["evidence"]
    assert rig.sim(servo).output == 0
    await asyncio.sleep(1.1)
    assert (rig.sim(servo).output, servo.raw("torque_mode")) == (1, 0)


@scene(OFF)
async def test_asking_twice_is_one_wiggle(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/identify"
    first, second = json(await rig.call("POST", path), 202), json(await rig.call("POST", path), 202)
    assert first["id"] == second["id"]
