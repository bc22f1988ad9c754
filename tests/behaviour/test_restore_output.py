"""Output restored after a stop: servo by servo, each held where it stands, and off again when anything is wrong."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo

HOLDS = replace(PLAIN, rom={"timeout_action": 0, "soft_start": 0})
THREE = [replace(HOLDS, servo_id=n, node_id=10 + n, angle_deg=10.0 * n) for n in (1, 2, 3)]
LIMP = replace(HOLDS, rom={"torque_mode": 1, "timeout_action": 0})
LETS_GO = replace(PLAIN, rom={"soft_start": 0})


async def stop(rig: Rig, mode: str = "off") -> None:
    json(await rig.call("POST", "/stop?by=Aki", {"mode": mode}))


async def restore(rig: Rig, body: object = None, **more: Any) -> Any:
    return json(await rig.call("POST", "/stop/restore?wait=true&by=Kim", body, **more))


def outputs(rig: Rig, servos: list[Servo]) -> list[int]:
    return [rig.sim(servo).output for servo in servos]


async def angle(rig: Rig, servo: Servo) -> float:
    return float(json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))["value"])


@pytest.mark.parametrize("latched", [True, False])
@scene(*THREE)
async def test_every_output_comes_on_again_and_each_horn_is_held_where_it_was_moved_to(rig: Rig, latched: bool) -> None:
    servos = await rig.ready(3)
    await stop(rig)
    if not latched:
        json(await rig.call("DELETE", "/stop"))
    for place, servo in enumerate(servos):
        rig.sim(servo).turn_manually(-40.0 * place, asyncio.get_running_loop().time())
    before = [await angle(rig, servo) for servo in servos]
    writes = len(rig.writes())
    job = await restore(rig)
    assert job["state"] == "succeeded", job["error"]
    assert outputs(rig, servos) == [0, 0, 0]
    assert not json(await rig.call("GET", "/stop"))["latched"]
    await asyncio.sleep(3)
    assert outputs(rig, servos) == [0, 0, 0], "its own timeout holds, and nobody has to be there"
    assert [await angle(rig, servo) for servo in servos] == [pytest.approx(one, abs=0.4) for one in before]
    assert [(one["outcome"], one["held_by"]) for one in job["result"]["servos"]] == [("on", "servo")] * 3
    sent = [(node, name) for node, name, _ in rig.writes()[writes:] if name in ("0x00", "0x20")]
    for node in (11, 12, 13):
        mine = [name for where, name in sent if where == node]
        assert mine[:2] == ["0x00", "0x20"], "the present angle first"
    assert [one["name"] for one in job["steps"]] == ["clear", "restore 1", "restore 2", "restore 3"]
    found = json(await rig.call("GET", f"/servos/{servos[0].uid}"))["output"]
    assert (found["state"], found["reason"], found["by"]) == ("on", "command", "Kim")
    assert json(await rig.call("GET", "/leases")) == []
    rows = [one.entry for one in rig.host.store.audit.rows() if one.entry.action == "restore_output"]
    assert [(one.by, one.outcome, one.job) for one in rows] == [("Kim", "succeeded", job["id"])] * 3


@scene(HOLDS, replace(LIMP, servo_id=2, node_id=12))
async def test_only_what_was_on_before_comes_on_and_anything_else_when_it_is_named(rig: Rig) -> None:
    servos = sorted(await rig.ready(2), key=lambda one: one.node_id or 0)
    on, limp = servos
    await stop(rig)
    job = await restore(rig)
    assert [one["uid"] for one in job["result"]["servos"]] == [on.uid]
    assert outputs(rig, servos) == [0, 1]
    job = await restore(rig, {"uids": [limp.uid]})
    assert job["state"] == "succeeded", job["error"]
    assert outputs(rig, servos) == [0, 0]
    job = await restore(rig)
    assert (job["state"], job["result"]["servos"]) == ("succeeded", []), "there is nothing left to do"


@scene(*THREE)
async def test_what_a_lease_or_a_command_switched_off_comes_on_again_too(rig: Rig) -> None:
    servos = sorted(await rig.ready(3), key=lambda one: one.node_id or 0)
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servos[0].uid}/torque", {"mode": "on"}, lease=lease))
    await rig.call("DELETE", f"/leases/{lease}")
    json(await rig.call("POST", f"/servos/{servos[1].uid}/torque", {"mode": "off"}))
    staged = {"values": {"torque_mode": "off"}}
    json(await rig.call("PATCH", f"/servos/{servos[2].uid}/parameters", staged))
    await asyncio.sleep(0.2)
    assert outputs(rig, servos) == [1, 1, 1]
    job = await restore(rig)
    assert outputs(rig, servos) == [0, 0, 1], "configured to be off is not switched off by anybody"
    assert len(job["result"]["servos"]) == 2
    told = json(await rig.call("GET", f"/jobs/{job['id']}/report"))["servos"]
    assert [(one["verdict"], one["label"], one["problem"]) for one in told] == [("done", "", None)] * 2


@scene(LETS_GO)
async def test_a_servo_that_lets_go_by_itself_needs_a_lease_and_is_off_when_it_ends(rig: Rig, servo: Servo) -> None:
    await stop(rig)
    refused = problem(await rig.call("POST", "/stop/restore"), "lease_required", 428)
    assert refused["uids"] == [servo.uid]
    assert "timeout" in refused["detail"]
    assert json(await rig.call("GET", "/stop"))["latched"], "nothing was cleared"
    lease = await rig.lease()
    job = await restore(rig, lease=lease)
    assert job["state"] == "succeeded", job["error"]
    assert job["result"]["servos"][0]["held_by"] == "lease"
    await asyncio.sleep(4)
    assert rig.sim(servo).output == 0, "it is kept on while the lease lives"
    await rig.call("DELETE", f"/leases/{lease}")
    await asyncio.sleep(0.2)
    assert rig.sim(servo).output == 1


@scene(HOLDS)
async def test_who_else_holds_a_lease_is_asked_first(rig: Rig) -> None:
    await rig.ready()
    await stop(rig)
    await rig.lease()
    problem(await rig.call("POST", "/stop/restore"), "lease_held", 409)


@pytest.mark.parametrize("way", ["brake", "turning"])
@scene(*THREE[:2])
async def test_a_horn_that_may_carry_something_is_asked_about_by_name(rig: Rig, way: str) -> None:
    servos = sorted(await rig.ready(2), key=lambda one: one.node_id or 0)
    await stop(rig, "brake" if way == "brake" else "off")
    if way == "turning":
        rig.sim(servos[0]).conditions.load_pct = 30.0
        await asyncio.sleep(0.3)
    asked = problem(await rig.call("POST", "/stop/restore"), "needs_confirmation", 409)
    loaded = servos if way == "brake" else servos[:1]
    assert (asked["confirm"], asked["uids"]) == ("load", [one.uid for one in loaded])
    plan = json(await rig.call("POST", "/stop/restore", {"dry_run": True}))
    assert [one["uid"] for one in plan["servos"] if one["under_load"]] == asked["uids"]
    assert all(one.title in asked["detail"] for one in loaded)
    assert outputs(rig, servos) == ([2, 2] if way == "brake" else [1, 1])
    assert json(await rig.call("GET", "/stop"))["latched"]
    job = await restore(rig, {"confirm": ["load"]})
    if way == "brake":
        assert job["state"] == "succeeded", job["error"]
        assert outputs(rig, servos) == [0, 0]
    else:  # one that turns is not caught, whoever agrees
        assert (job["state"], job["error"]["code"]) == ("failed", "busy")
        assert outputs(rig, servos) == [1, 0]


def test_a_dry_run_names_each_servo_and_its_load_and_changes_nothing() -> None:
    async def scene(rig: Rig) -> None:
        holds, lets_go, hot, outside = servos = sorted(await rig.ready(4), key=lambda one: one.node_id or 0)
        await stop(rig, "brake")
        json(await rig.call("POST", f"/servos/{lets_go.uid}/torque", {"mode": "off"}))
        rig.sim(hot).conditions.temperature_c = 110.0
        rig.sim(outside).turn_manually(90.0, asyncio.get_running_loop().time())
        await asyncio.sleep(2.5)
        before, writes = outputs(rig, servos), len(rig.writes())
        plan = json(await rig.call("POST", "/stop/restore?by=Kim", {"dry_run": True}))
        assert plan["clears_stop"]
        shown = {one["uid"]: one for one in plan["servos"]}
        assert list(shown) == [one.uid for one in servos]
        assert [shown[one.uid]["under_load"] for one in servos] == [True, False, True, True]
        assert [shown[one.uid]["needs_lease"] for one in servos] == [False, True, False, False]
        codes = [None if shown[one.uid]["problem"] is None else shown[one.uid]["problem"]["code"] for one in servos]
        assert codes == [None, None, "busy", "out_of_range"]
        assert shown[holds.uid]["output"]["state"] == "brake"
        assert (shown[lets_go.uid]["output"]["reason"], shown[lets_go.uid]["title"]) == ("command", lets_go.title)
        under = json(await rig.call("POST", "/stop/restore", {"dry_run": True}, lease=await rig.lease()))
        assert not any(one["needs_lease"] for one in under["servos"])
        sent = [one for one in rig.writes()[writes:] if one[2] != 2 or one[1] != "0x20"]
        assert sent == [], "the stop writes its brake, and nobody anything else"
        assert outputs(rig, servos) == before
        assert json(await rig.call("GET", "/stop"))["latched"]
        assert not [job for job in rig.host.jobs.all() if job.kind == "restore_output"]

    narrow = {"timeout_action": 0, "soft_start": 0, "angle_limit_cw": 450, "angle_limit_ccw": -450}
    fourth = replace(HOLDS, servo_id=4, node_id=14, rom=narrow)
    play(scene, THREE[0], replace(LETS_GO, servo_id=2, node_id=12), THREE[2], fourth)


@scene(HOLDS)
async def test_a_dry_run_is_refused_as_the_job_would_be(rig: Rig, servo: Servo) -> None:
    await stop(rig)
    look = {"dry_run": True}
    problem(await rig.call("POST", "/stop/restore", look, lease="0" * 32), "lease_required", 428)
    lease = await rig.lease()
    problem(await rig.call("POST", "/stop/restore", look), "lease_held", 409)
    await rig.call("DELETE", f"/leases/{lease}")
    async with servo.changing:
        problem(await rig.call("POST", "/stop/restore", look), "busy", 409)
    problem(await rig.call("POST", "/stop/restore", {**look, "uids": ["0" * 32]}), "unknown_servo", 404)
    json(await rig.call("POST", "/stop/restore", look))


@scene(*THREE)
async def test_motion_control_that_is_taken_meanwhile_ends_a_job_without_it(rig: Rig) -> None:
    servos = sorted(await rig.ready(3), key=lambda one: one.node_id or 0)
    await stop(rig)
    started = json(await rig.call("POST", "/stop/restore"), 202)
    while outputs(rig, servos).count(0) < 1:
        await asyncio.sleep(0.001)
    await rig.lease()
    job = await rig.host.jobs.wait(rig.host.jobs.get(started["id"]))
    assert (job.state, job.error.code if job.error else None) == ("failed", "lease_held")
    await asyncio.sleep(1)
    assert outputs(rig, servos) == [0, 1, 1], "what is on holds by itself, and nobody else comes on"


@scene(*THREE)
async def test_stop_during_the_job_ends_it_at_once(rig: Rig) -> None:
    servos = sorted(await rig.ready(3), key=lambda one: one.node_id or 0)
    await stop(rig)
    started = json(await rig.call("POST", "/stop/restore"), 202)
    while outputs(rig, servos).count(0) < 1:
        await asyncio.sleep(0.001)
    json(await rig.call("POST", "/stop?by=Ben"))
    assert outputs(rig, servos) == [1, 1, 1]
    job = await rig.host.jobs.wait(rig.host.jobs.get(started["id"]))
    assert (job.state, job.error.code if job.error else None) == ("failed", "stopped")
    await asyncio.sleep(2)
    assert outputs(rig, servos) == [1, 1, 1]
    assert rig.host.stop.latched
    assert json(await rig.call("GET", "/leases")) == []


@scene(HOLDS)
async def test_a_stop_pressed_before_the_job_clears_anything_stays(rig: Rig, servo: Servo) -> None:
    await stop(rig)
    await asyncio.sleep(2)
    asked = asyncio.create_task(rig.call("POST", "/stop/restore?wait=true"))
    await asyncio.sleep(0.002)  # it is reading
    json(await rig.call("POST", "/stop?by=Ben"))
    job = json(await asked)
    assert (job["state"], job["error"]["code"]) == ("failed", "stopped")
    assert rig.host.stop.latched
    assert rig.sim(servo).output == 1


def test_each_failure_names_its_servo_and_leaves_that_one_as_it_was() -> None:
    async def scene(rig: Rig) -> None:
        servos = sorted(await rig.ready(3), key=lambda one: one.node_id or 0)
        await stop(rig)
        rig.sim(servos[0]).turn_manually(90.0, asyncio.get_running_loop().time())  # outside its limits
        rig.sim(servos[1]).conditions.temperature_c = 110.0
        await asyncio.sleep(2.5)
        job = await restore(rig)
        assert job["state"] == "failed"
        shown = {one["uid"]: one for one in job["result"]["servos"]}
        codes = [None if shown[one.uid]["problem"] is None else shown[one.uid]["problem"]["code"] for one in servos]
        assert codes == ["out_of_range", "busy", None]
        assert outputs(rig, servos) == [1, 1, 0]
        assert job["error"]["uids"] == [servos[0].uid, servos[1].uid]
        assert servos[0].title in job["error"]["detail"]
        assert servos[1].title in job["error"]["detail"]
        assert [servo.raw("torque_mode") for servo in servos] == [1, 1, 0]

    narrow = {"timeout_action": 0, "soft_start": 0, "angle_limit_cw": 450, "angle_limit_ccw": -450}
    play(scene, replace(THREE[0], rom=narrow), *THREE[1:])


@scene(HOLDS)
async def test_a_servo_that_has_not_confirmed_the_stop_is_left_to_it(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.drop_responses_pct = 100
    await stop(rig)
    started = json(await rig.call("POST", "/stop/restore", {"uids": [servo.uid]}), 202)
    job = await rig.host.jobs.wait(rig.host.jobs.get(started["id"]))
    assert (job.state, job.error.code if job.error else None) == ("failed", "no_response")
    rig.sim(servo).conditions.drop_responses_pct = 0
    await asyncio.sleep(2)
    assert rig.sim(servo).output == 1


@scene(HOLDS)
async def test_a_servo_to_which_a_stop_is_still_written_is_told_of_though_it_can_be_read(
    rig: Rig, servo: Servo
) -> None:
    rig.sim(servo).conditions.drop_responses_pct = 100
    await stop(rig)
    await asyncio.sleep(2)
    rig.sim(servo).conditions.drop_responses_pct = 0  # and the next write comes a quarter of a second later
    (found,) = json(await rig.call("POST", "/stop/restore", {"dry_run": True, "uids": [servo.uid]}))["servos"]
    assert found["problem"]["code"] == "no_response"
    assert "is not acknowledged yet" in found["problem"]["detail"]
    await asyncio.sleep(1)
    (found,) = json(await rig.call("POST", "/stop/restore", {"dry_run": True}))["servos"]
    assert found["problem"] is None


@scene(HOLDS)
async def test_a_servo_that_was_driven_somewhere_by_its_output_is_switched_off_again(rig: Rig, servo: Servo) -> None:
    await stop(rig)
    started = json(await rig.call("POST", "/stop/restore"), 202)
    while rig.sim(servo).output != 0:
        await asyncio.sleep(0.0005)
    rig.sim(servo).conditions.load_pct = 140.0  # more than it can hold
    job = await rig.host.jobs.wait(rig.host.jobs.get(started["id"]))
    assert (job.state, job.error.code if job.error else None) == ("failed", "did_not_move")
    await asyncio.sleep(0.5)
    assert rig.sim(servo).output == 1
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]["reason"] == "stop"


@pytest.mark.parametrize("seed", range(1, 7))
@scene(*THREE)
async def test_with_a_fifth_of_all_frames_lost_each_output_is_on_or_is_named_and_off(rig: Rig, seed: int) -> None:
    servos = sorted(await rig.ready(3), key=lambda one: one.node_id or 0)
    await stop(rig)
    rig.bus.loss(20, seed=seed)
    job = await restore(rig)
    rig.bus.loss(0)
    await asyncio.sleep(3)
    shown = {one["uid"]: one["outcome"] for one in job["result"]["servos"]}
    assert outputs(rig, servos) == [0 if shown[one.uid] == "on" else 1 for one in servos]
    assert (job["state"] == "succeeded") == all(one == "on" for one in shown.values())
