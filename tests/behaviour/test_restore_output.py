"""Torque restored after Stop: one servo after the other, each at its present angle, and off again after a failure."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.restarting import ended, failed_with, succeeded
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo

HOLDS = replace(PLAIN, rom={"timeout_action": 0, "soft_start": 0})
THREE = [replace(HOLDS, servo_id=n, node_id=10 + n, angle_deg=10.0 * n) for n in (1, 2, 3)]
TORQUE_OFF = replace(HOLDS, rom={"torque_mode": 1, "timeout_action": 0})
TIMES_OUT = replace(PLAIN, rom={"soft_start": 0})
NARROW = replace(THREE[0], rom={"timeout_action": 0, "soft_start": 0, "angle_limit_cw": 450, "angle_limit_ccw": -450})


async def stop(rig: Rig, mode: str = "off") -> None:
    json(await rig.call("POST", "/stop?by=Aki", {"mode": mode}))


async def restore(rig: Rig, body: object = None, **more: Any) -> Any:
    return json(await rig.call("POST", "/stop/restore?wait=true&by=Kim", body, **more))


async def begun(rig: Rig) -> str:
    """Start to restore torque after a stop; the job's id once torque is on at a servo."""
    await stop(rig)
    started = json(await rig.call("POST", "/stop/restore"), 202)
    await until(lambda: 0 in outputs(rig, rig.host.fleet.all()), every_s=0.0005)
    return str(started["id"])


def outputs(rig: Rig, servos: list[Servo]) -> list[int]:
    return [rig.sim(servo).output for servo in servos]


async def angle(rig: Rig, servo: Servo) -> float:
    return float(json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))["value"])


@pytest.mark.parametrize("latched", [True, False])
@scene(*THREE)
async def test_torque_is_restored_on_every_servo_and_holds_the_present_angle(
    rig: Rig, servos: list[Servo], latched: bool
) -> None:
    await stop(rig)
    if not latched:
        json(await rig.call("DELETE", "/stop"))
    for place, servo in enumerate(servos):
        rig.sim(servo).turn_manually(-40.0 * place, asyncio.get_running_loop().time())
    before = [await angle(rig, servo) for servo in servos]
    writes = len(rig.writes())
    job = succeeded(await restore(rig))
    assert outputs(rig, servos) == [0, 0, 0]
    assert not json(await rig.call("GET", "/stop"))["latched"]
    await asyncio.sleep(3)
    assert outputs(rig, servos) == [0, 0, 0], "its timeout is set to hold, so no client is needed"
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


@scene(HOLDS, replace(TORQUE_OFF, servo_id=2, node_id=12))
async def test_torque_is_restored_where_it_was_on_and_elsewhere_if_requested(rig: Rig, servos: list[Servo]) -> None:
    on, off = servos
    await stop(rig)
    job = await restore(rig)
    assert [one["uid"] for one in job["result"]["servos"]] == [on.uid]
    assert outputs(rig, servos) == [0, 1]
    job = succeeded(await restore(rig, {"uids": [off.uid]}))
    assert outputs(rig, servos) == [0, 0]
    job = await restore(rig)
    assert (job["state"], job["result"]["servos"]) == ("succeeded", []), "there is nothing left to do"


@scene(*THREE)
async def test_torque_that_a_lease_or_a_command_turned_off_is_restored_too(
    rig: Rig, servos: list[Servo], lease: str
) -> None:
    json(await rig.call("POST", f"/servos/{servos[0].uid}/torque", {"mode": "on"}, lease=lease))
    await rig.call("DELETE", f"/leases/{lease}")
    json(await rig.call("POST", f"/servos/{servos[1].uid}/torque", {"mode": "off"}))
    staged = {"values": {"torque_mode": "off"}}
    json(await rig.call("PATCH", f"/servos/{servos[2].uid}/parameters", staged))
    await asyncio.sleep(0.2)
    assert outputs(rig, servos) == [1, 1, 1]
    job = await restore(rig)
    assert outputs(rig, servos) == [0, 0, 1], "torque that is configured off is not restored"
    assert len(job["result"]["servos"]) == 2
    report = json(await rig.call("GET", f"/jobs/{job['id']}/report"))["servos"]
    assert [(one["verdict"], one["label"], one["problem"]) for one in report] == [("done", "", None)] * 2


@scene(TIMES_OUT)
async def test_a_servo_whose_timeout_turns_torque_off_requires_a_lease(rig: Rig, servo: Servo) -> None:
    await stop(rig)
    refused = problem(await rig.call("POST", "/stop/restore"), "lease_required", 428)
    assert refused["uids"] == [servo.uid]
    assert "timeout" in refused["detail"]
    assert json(await rig.call("GET", "/stop"))["latched"], "nothing was cleared"
    lease = await rig.lease()
    job = succeeded(await restore(rig, lease=lease))
    assert job["result"]["servos"][0]["held_by"] == "lease"
    await asyncio.sleep(4)
    assert rig.sim(servo).output == 0, "torque stays on during the lease"
    await rig.call("DELETE", f"/leases/{lease}")
    await asyncio.sleep(0.2)
    assert rig.sim(servo).output == 1


@pytest.mark.parametrize("state", ["brake", "turning"])
@scene(*THREE[:2])
async def test_a_horn_that_may_carry_a_load_requires_a_confirmation(rig: Rig, servos: list[Servo], state: str) -> None:
    await stop(rig, "brake" if state == "brake" else "off")
    if state == "turning":
        rig.sim(servos[0]).conditions.load_pct = 30.0
        await asyncio.sleep(0.3)
    refused = problem(await rig.call("POST", "/stop/restore"), "needs_confirmation", 409)
    loaded = servos if state == "brake" else servos[:1]
    assert (refused["confirm"], refused["uids"]) == ("load", [one.uid for one in loaded])
    plan = json(await rig.call("POST", "/stop/restore", {"dry_run": True}))
    assert [one["uid"] for one in plan["servos"] if one["under_load"]] == refused["uids"]
    assert all(one.title in refused["detail"] for one in loaded)
    assert outputs(rig, servos) == ([2, 2] if state == "brake" else [1, 1])
    assert json(await rig.call("GET", "/stop"))["latched"]
    job = await restore(rig, {"confirm": ["load"]})
    if state == "brake":
        assert job["state"] == "succeeded", job["error"]
        assert outputs(rig, servos) == [0, 0]
    else:  # torque is not turned on while a horn turns, even if confirmed
        failed_with(job, "busy")
        assert outputs(rig, servos) == [1, 0]


@scene(THREE[0], replace(TIMES_OUT, servo_id=2, node_id=12), THREE[2], replace(NARROW, servo_id=4, node_id=14))
async def test_a_dry_run_lists_each_servo_and_its_load_and_changes_nothing(rig: Rig, servos: list[Servo]) -> None:
    holds, times_out, hot, outside = servos
    await stop(rig, "brake")
    json(await rig.call("POST", f"/servos/{times_out.uid}/torque", {"mode": "off"}))
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
    assert (shown[times_out.uid]["output"]["reason"], shown[times_out.uid]["title"]) == ("command", times_out.title)
    under = json(await rig.call("POST", "/stop/restore", {"dry_run": True}, lease=await rig.lease()))
    assert not any(one["needs_lease"] for one in under["servos"])
    sent = [one for one in rig.writes()[writes:] if one[2] != 2 or one[1] != "0x20"]
    assert sent == [], "only the brake of the stop is written"
    assert outputs(rig, servos) == before
    assert json(await rig.call("GET", "/stop"))["latched"]
    assert not [job for job in rig.host.jobs.all() if job.kind == "restore_output"]


@pytest.mark.parametrize("body", [{"dry_run": True}, {}])
@scene(HOLDS)
async def test_a_dry_run_is_refused_for_the_same_reasons_as_the_job(
    rig: Rig, servo: Servo, body: dict[str, Any]
) -> None:
    await stop(rig)
    problem(await rig.call("POST", "/stop/restore", body, lease="0" * 32), "lease_required", 428)
    lease = await rig.lease()
    problem(await rig.call("POST", "/stop/restore", body), "lease_held", 409)
    await rig.call("DELETE", f"/leases/{lease}")
    async with servo.changing:
        problem(await rig.call("POST", "/stop/restore", body), "busy", 409)
    problem(await rig.call("POST", "/stop/restore", {**body, "uids": ["0" * 32]}), "unknown_servo", 404)
    json(await rig.call("POST", "/stop/restore", body), 200 if body else 202)


@scene(*THREE)
async def test_a_lease_taken_by_another_client_ends_the_job(rig: Rig, servos: list[Servo]) -> None:
    job = await begun(rig)
    await rig.lease()
    failed_with(await ended(rig, job), "lease_held")
    await asyncio.sleep(1)
    assert outputs(rig, servos) == [0, 1, 1], "torque stays on where it was restored, and off elsewhere"


@scene(*THREE)
async def test_stop_during_the_job_ends_it_at_once(rig: Rig, servos: list[Servo]) -> None:
    job = await begun(rig)
    json(await rig.call("POST", "/stop?by=Ben"))
    assert outputs(rig, servos) == [1, 1, 1]
    failed_with(await ended(rig, job), "stopped")
    await asyncio.sleep(2)
    assert outputs(rig, servos) == [1, 1, 1]
    assert rig.host.stop.latched
    assert json(await rig.call("GET", "/leases")) == []


@scene(HOLDS)
async def test_a_stop_pressed_before_the_job_clears_the_latch_remains(rig: Rig, servo: Servo) -> None:
    await stop(rig)
    await asyncio.sleep(2)
    pending = asyncio.create_task(rig.call("POST", "/stop/restore?wait=true"))
    await asyncio.sleep(0.002)  # it is reading
    json(await rig.call("POST", "/stop?by=Ben"))
    failed_with(json(await pending), "stopped")
    assert rig.host.stop.latched
    assert rig.sim(servo).output == 1


@scene(NARROW, *THREE[1:])
async def test_a_failure_names_its_servo_and_leaves_it_unchanged(rig: Rig, servos: list[Servo]) -> None:
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


@scene(HOLDS)
async def test_restoring_waits_for_the_acknowledgement_of_the_stop(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.drop_responses_pct = 100
    await stop(rig)
    job = json(await rig.call("POST", "/stop/restore", {"uids": [servo.uid]}), 202)["id"]
    failed_with(await ended(rig, job), "no_response")
    await asyncio.sleep(2)
    rig.sim(servo).conditions.drop_responses_pct = 0  # and the next write comes a quarter of a second later
    (found,) = json(await rig.call("POST", "/stop/restore", {"dry_run": True, "uids": [servo.uid]}))["servos"]
    assert found["problem"]["code"] == "no_response"
    assert "is not acknowledged yet" in found["problem"]["detail"]
    await asyncio.sleep(1)
    (found,) = json(await rig.call("POST", "/stop/restore", {"dry_run": True}))["servos"]
    assert found["problem"] is None
    assert rig.sim(servo).output == 1


@scene(HOLDS)
async def test_torque_is_off_again_on_a_servo_that_its_load_moves(rig: Rig, servo: Servo) -> None:
    job = await begun(rig)
    rig.sim(servo).conditions.load_pct = 140.0  # more than its torque
    failed_with(await ended(rig, job), "did_not_move")
    await asyncio.sleep(0.5)
    assert rig.sim(servo).output == 1
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]["reason"] == "stop"


@pytest.mark.parametrize("seed", range(1, 4))
@scene(*THREE)
async def test_with_a_fifth_of_all_frames_lost_torque_is_on_or_reported_off(
    rig: Rig, servos: list[Servo], seed: int
) -> None:
    await stop(rig)
    rig.bus.loss(20, seed=seed)
    job = await restore(rig)
    rig.bus.loss(0)
    await asyncio.sleep(3)
    shown = {one["uid"]: one["outcome"] for one in job["result"]["servos"]}
    assert outputs(rig, servos) == [0 if shown[one.uid] == "on" else 1 for one in servos]
    assert (job["state"] == "succeeded") == all(one == "on" for one in shown.values())
