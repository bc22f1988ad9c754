"""RAM and ROM: write, read back, save, restart, and which values are known (sections 2.3, 4.10, 4.11)."""

import asyncio
import json as text_json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.hub import Change, Sampled
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.units import Uid


async def patch(rig: Rig, servo: Servo, values: dict[str, Any], **more: Any) -> Any:
    return json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values, **more}))


async def save(rig: Rig, servo: Servo) -> Any:
    return json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))


@scene()
async def test_a_change_is_written_read_back_and_unsaved(rig: Rig, servo: Servo) -> None:
    response = await patch(rig, servo, {"angle_limit_cw": 60, "angle_limit_ccw": -60.5, "smoothing": False})
    assert response["outcome"] == "applied"
    assert [change["verdict"] for change in response["changes"]] == ["applied"] * 3
    memory = rig.sim(servo).memory
    assert (memory.get(0x38), memory.get(0x39), memory.get(0x22)) == (600, -605, 0)
    assert memory.stored(0x38) == 1799
    shown = json(await rig.call("GET", f"/servos/{servo.uid}"))
    assert set(shown["unsaved"]) == {"angle_limit_cw", "angle_limit_ccw", "smoothing"}
    reading = json(await rig.call("GET", f"/servos/{servo.uid}/parameters/angle_limit_cw"))
    assert (reading["value"], reading["rom"], reading["default"]) == (60.0, 179.9, 179.9)


@scene()
async def test_one_invalid_value_rejects_the_change(rig: Rig, servo: Servo) -> None:
    body = {"values": {"angle_limit_cw": 60, "torque_limit_cw": 120}}
    refused = problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body), "out_of_range", 422)
    assert (refused["key"], refused["maximum"], refused["unit"]) == ("torque_limit_cw", 100, "%")
    assert "120 % is above this model's limit of 100 %" in refused["detail"]
    assert rig.writes() == []


@scene()
async def test_a_dry_run_shows_the_change_and_sends_nothing(rig: Rig, servo: Servo) -> None:
    response = await patch(rig, servo, {"angle_limit_cw": 60}, dry_run=True)
    assert response["outcome"] == "planned"
    planned = {"key": "angle_limit_cw", "before": 179.9, "requested": 60.0, "after": 179.9, "verdict": "planned"}
    assert response["changes"] == [planned]
    assert rig.writes() == []


@pytest.mark.parametrize(
    "behaviour",
    [
        Behaviour(),
        Behaviour(acknowledges_save=False),
        Behaviour(save_opcode_restarts=False),
        Behaviour(acknowledges_restart=False, save_opcode_restarts=False),
    ],
    ids=["responds and restarts", "response lost in the restart", "does not restart", "restart without a response"],
)
@pytest.mark.parametrize("node_id", [11, 0], ids=["static id", "dynamic id"])
@scene(lambda behaviour, node_id: replace(PLAIN, node_id=node_id, behaviour=behaviour))
async def test_a_save_reads_every_row_back_after_a_restart(
    rig: Rig, servo: Servo, behaviour: Behaviour, node_id: int
) -> None:
    await patch(rig, servo, {"angle_limit_cw": 60, "speed_limit_cw": 200})
    job = await save(rig, servo)
    assert job["state"] == "succeeded", job
    assert [step["name"] for step in job["steps"]][-1] == "read_back"
    assert all(step["state"] in ("done", "skipped") for step in job["steps"])
    (restart,) = [step["evidence_code"] for step in job["steps"] if step["name"] == "restart"]
    assert restart == ("restarted" if behaviour.save_opcode_restarts else "restarted_on_request")
    assert rig.sim(servo).memory.stored(0x38) == 600
    assert rig.sim(servo).starts == 2
    assert servo.unsaved() == []
    assert servo.registers["angle_limit_cw"].rom == 600
    assert servo.state is State.READY


@scene()
async def test_a_commanded_servo_is_not_saved(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 9}, lease=lease))
    problem(await rig.call("POST", f"/servos/{servo.uid}/save", lease=lease), "busy", 409)
    problem(await rig.call("POST", f"/servos/{servo.uid}/save"), "lease_held", 409)
    assert rig.sim(servo).starts == 1


@scene()
async def test_an_unexpected_restart_is_noticed_and_values_are_read_again(rig: Rig, servo: Servo) -> None:
    await patch(rig, servo, {"angle_p_gain": 55})
    await asyncio.sleep(5)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.3)
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(4)
    assert rig.events("restarted")
    assert servo.raw("angle_p_gain") == 40
    assert servo.state is State.READY


@scene()
async def test_reverse_and_origin_need_torque_off(rig: Rig, servo: Servo) -> None:
    for values in ({"reverse": True}, {"origin": 10.0}):
        refused = await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values})
        problem(refused, "torque_on", 409)
    assert rig.writes() == []
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    await patch(rig, servo, {"reverse": True, "origin": 10.0})


@scene()
async def test_a_save_with_an_unread_row_fails(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(3)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    await until(lambda: rig.sim(servo).starts >= 2, every_s=0.001)
    rig.sim(servo).conditions.refuse_keys.add("angle_p_gain")
    job = rig.host.jobs.get(started["id"])
    await rig.host.jobs.wait(job)
    assert job.state == "failed"


@scene()
async def test_a_value_whose_write_was_not_acknowledged_is_stale(rig: Rig, servo: Servo) -> None:

    def mute(change: Change) -> None:
        if isinstance(change, Sampled) and change.key == "angle_p_gain":
            rig.sim(servo).conditions.drop_responses_pct = 100

    unsubscribe = rig.host.hub.subscribe(mute)  # it responds to the read before the write, and to nothing later
    refused = await rig.call("PUT", f"/servos/{servo.uid}/parameters/angle_p_gain", {"value": 41})
    problem(refused, "no_response", 504)
    unsubscribe()
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]["angle_p_gain"]
    assert shown["stale"] is True


@scene()
async def test_of_two_concurrent_changes_of_a_revision_one_is_rejected(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters"
    revision = json(await rig.call("GET", path))["revision"]
    responses = await asyncio.gather(
        *(rig.call("PATCH", path, {"values": {"angle_p_gain": value}}, **{"If-Match": revision}) for value in (41, 42))
    )
    assert sorted(response.status_code for response in responses) == [200, 412]


@scene()
async def test_a_change_by_another_tool_makes_the_revision_stale(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters"
    revision = json(await rig.call("GET", path))["revision"]
    rig.sim(servo).memory.put(0x2C, 77)
    response = await rig.call("PATCH", path, {"values": {"angle_p_gain": 41}}, **{"If-Match": revision})
    problem(response, "stale_revision", 412)
    assert rig.writes() == []


@scene()
async def test_a_save_during_a_change_is_rejected(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(3)
    values = {"angle_p_gain": 41, "angle_d_gain": 31, "angle_dead_band": 1.0, "smoothing": False}
    changing = asyncio.create_task(rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))
    await until(rig.writes, every_s=0.0002)
    problem(await rig.call("POST", f"/servos/{servo.uid}/save"), "busy", 409)
    assert json(await changing)["outcome"] == "applied"


@scene()
async def test_a_change_that_cannot_be_saved_is_rejected_before_the_first_write(rig: Rig, servo: Servo) -> None:
    await rig.call("POST", "/stop")
    count = len(rig.writes())
    body = {"values": {"angle_p_gain": 41}, "save": True}
    problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body), "stopped", 423)
    assert len(rig.writes()) == count
    assert rig.sim(servo).memory.get(0x2C) == 40


@scene(replace(PLAIN, rom_sound=False))
async def test_after_lost_rom_its_values_are_unknown_until_a_save(rig: Rig, servo: Servo) -> None:
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    assert shown["fault_warning"]["value"] == 1 << 15
    assert {key for key, reading in shown.items() if reading["rom"] is not None} == set()
    assert json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))["state"] == "succeeded"
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    assert shown["fault_warning"]["value"] == 0
    assert shown["angle_limit_cw"]["rom"] == shown["angle_limit_cw"]["value"] == 179.9
    assert all(shown[key]["rom"] is not None for key, reg in servo.registers.items() if reg.parameter.rom)


def test_a_later_server_does_not_take_stored_values_for_lost_ones(tmp_path: Path) -> None:
    """The servo lost its ROM while the server was away."""

    async def first(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        assert servo.registers["angle_limit_cw"].rom == 600

    async def later(rig: Rig) -> None:
        await rig.host.disconnect()
        await asyncio.sleep(10)
        json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
        servo = (await rig.ready())[0]
        assert servo.registers["angle_limit_cw"].rom is None

    uid = bytes(range(16))
    play(first, replace(PLAIN, uid=uid, rom={"angle_limit_cw": 600}), store=str(tmp_path / "data"))
    play(later, replace(PLAIN, uid=uid, rom={"angle_limit_cw": 600}, rom_sound=False), store=str(tmp_path / "data"))


PWM = Recipe("BLA21-06U-AB", "1.300", servo_id=1, node_id=11)


def _no_constant(name: str) -> None:
    raise AssertionError(f"{name} is not JSON")


@scene(PWM)
async def test_0x36_is_shown_in_the_units_before_and_after_0x37(rig: Rig, servo: Servo) -> None:
    values = {"pwm_mode": "speed", "pwm_output_range": 100}
    path = f"/servos/{servo.uid}/parameters"
    planned = json(await rig.call("PATCH", path, {"values": values, "dry_run": True}))["changes"][1]
    assert (planned["before"], planned["requested"], planned["after"]) == (70.0, 100, 70.0)
    applied = json(await rig.call("PATCH", path, {"values": values}))["changes"][1]
    assert (applied["before"], applied["requested"], applied["after"]) == (70.0, 100, 100)
    entry = next(one.entry for one in rig.host.store.audit.rows() if one.entry.key == "pwm_output_range")
    assert (entry.before, entry.requested, entry.after) == (70.0, 100, 100)


@scene()
async def test_a_problem_with_nan_is_valid_json(rig: Rig) -> None:
    response = await rig.http.request(
        "PUT", "/profiles/odd/file", content="[values]\nangle_limit_cw = nan\nspeed_limit_cw = -inf\n",
        headers={"Content-Type": "application/toml"},
    )  # fmt: skip
    problem(response, "invalid_value", 422)
    found = text_json.loads(response.text, parse_constant=_no_constant)
    assert [one["value"] for one in found["lines"]] == ["NaN", "-Infinity"]


@scene()
async def test_a_profile_contains_no_values_of_a_change_in_progress(rig: Rig, servo: Servo) -> None:
    values = {"angle_p_gain": 60, "angle_d_gain": 70, "smoothing": True, "angle_limit_cw": 30}
    changing = asyncio.create_task(rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))
    await until(lambda: servo.raw("angle_p_gain") == 60, every_s=0.0001)
    rig.sim(servo).conditions.refuse_keys.add("angle_limit_cw")
    stored = json(await rig.call("PUT", "/profiles/golden", {"from_uid": servo.uid}), 201)
    assert json(await changing)["outcome"] == "rolled_back"
    assert stored["values"]["angle_p_gain"] == 40


@scene()
async def test_a_manual_snapshot_and_a_profile_contain_the_latest_values(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).memory.put(servo.registers["angle_limit_cw"].parameter.address, 450)
    assert servo.raw("angle_limit_cw") != 450
    stored = json(await rig.call("PUT", "/profiles/golden", {"from_uid": servo.uid}), 201)
    assert stored["values"]["angle_limit_cw"] == 45.0
    rig.sim(servo).memory.put(servo.registers["angle_limit_cw"].parameter.address, 300)
    made = json(await rig.call("POST", f"/servos/{servo.uid}/snapshots"), 201)
    assert made["values"]["angle_limit_cw"] == 30.0


@scene(PLAIN)
async def test_revisions_of_a_batch_have_the_forms_of_if_match(rig: Rig, servo: Servo) -> None:
    for text in ("*", f'W/"{servo.revision}"', f'"{servo.revision}"', servo.revision):
        body = {"servos": {servo.uid: {"angle_p_gain": 40}}, "revisions": {servo.uid: text}}
        (one,) = json(await rig.call("PATCH", "/parameters", body))["servos"]
        assert one["outcome"] == "applied", text
    body = {"servos": {servo.uid: {"angle_p_gain": 40}}, "revisions": {servo.uid: "other"}}
    (one,) = json(await rig.call("PATCH", "/parameters", body))["servos"]
    assert (one["outcome"], one["problem"]["code"]) == ("rejected", "stale_revision")


def test_a_clock_set_back_proves_nothing_about_rom(tmp_path: Path) -> None:
    recipe = replace(PLAIN, uid=bytes(range(16)))
    place = str(tmp_path / "data")

    async def first(rig: Rig) -> None:
        (servo,) = await rig.ready()
        assert servo.registers["angle_p_gain"].rom == 40

    async def later(rig: Rig) -> None:
        await asyncio.sleep(30)  # it restarted since it was seen, and another tool may have saved
        await rig.host.connect("memory:host", 1_000_000)
        (servo,) = await rig.ready()
        assert servo.registers["angle_p_gain"].rom is None

    play(first, recipe, store=place)
    with Store(place, wall=lambda: time.time() + 3600) as store:
        store.servos.seen(Uid(bytes(range(16)).hex()))
    play(later, recipe, store=place, connect=False)


@scene(Recipe("BLA21-06U-A0", "1.010", servo_id=1, node_id=11))
async def test_rows_are_those_of_model_and_firmware(rig: Rig, servo: Servo) -> None:
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    assert not {"speed_torque_control", "overcurrent_limit", "angle_boost", "pwm_neutral"} & set(shown)
    path = f"/servos/{servo.uid}/parameters/angle_boost"
    refused = problem(await rig.call("PUT", path, {"value": 1.0}), "not_in_this_model", 409)
    assert "It was added in 1.200" in refused["detail"]
    problem(await rig.call("GET", path), "not_in_this_model", 409)
    assert rig.writes() == []
