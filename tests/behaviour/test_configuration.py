"""RAM, ROM and what is known of each: write, read back, roll back, save, restart (sections 2.3, 4.10, 4.11)."""

import asyncio
import json as text_json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.hub import Change, ReadingChanged, Sampled
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.units import Uid


async def patch(rig: Rig, servo: Servo, values: dict[str, Any], **more: Any) -> Any:
    return json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values, **more}))


async def save(rig: Rig, servo: Servo) -> Any:
    return json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))


@scene()
async def test_a_patch_is_written_read_back_and_unsaved_until_it_is_in_rom(rig: Rig, servo: Servo) -> None:
    answer = await patch(rig, servo, {"angle_limit_cw": 60, "angle_limit_ccw": -60.5, "smoothing": False})
    assert answer["outcome"] == "applied"
    assert [change["verdict"] for change in answer["changes"]] == ["applied"] * 3
    memory = rig.sim(servo).memory
    assert (memory.get(0x38), memory.get(0x39), memory.get(0x22)) == (600, -605, 0)
    assert memory.stored(0x38) == 1799
    shown = json(await rig.call("GET", f"/servos/{servo.uid}"))
    assert set(shown["unsaved"]) == {"angle_limit_cw", "angle_limit_ccw", "smoothing"}
    reading = json(await rig.call("GET", f"/servos/{servo.uid}/parameters/angle_limit_cw"))
    assert (reading["value"], reading["rom"], reading["default"]) == (60.0, 179.9, 179.9)


@scene()
async def test_one_illegal_value_and_nothing_is_sent(rig: Rig, servo: Servo) -> None:
    body = {"values": {"angle_limit_cw": 60, "torque_limit_cw": 120}}
    refused = problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body), "out_of_range", 422)
    assert (refused["key"], refused["maximum"], refused["unit"]) == ("torque_limit_cw", 100, "%")
    assert "120 % is above this model's limit of 100 %" in refused["detail"]
    assert rig.writes() == []


@scene()
async def test_a_dry_run_says_what_would_change_and_sends_nothing(rig: Rig, servo: Servo) -> None:
    answer = await patch(rig, servo, {"angle_limit_cw": 60}, dry_run=True)
    assert answer["outcome"] == "planned"
    planned = {"key": "angle_limit_cw", "before": 179.9, "requested": 60.0, "after": 179.9, "verdict": "planned"}
    assert answer["changes"] == [planned]
    assert rig.writes() == []


EIGHT: dict[str, Any] = {
    "soft_start": False, "smoothing": False, "timeout_action": "brake", "timeout_time": 500, "angle_p_gain": 50,
    "angle_d_gain": 30, "angle_dead_band": 0.5, "temperature_limit_upper": 70,
}  # fmt: skip


@scene()
async def test_when_the_fifth_of_eight_writes_is_refused_all_eight_registers_are_as_before(
    rig: Rig, servo: Servo
) -> None:
    before = {key: servo.raw(key) for key in EIGHT}
    register = servo.registers["angle_p_gain"]
    register.parameter = register.parameter.model_copy(update={"maximum": 200})  # the servo knows better: 100
    answer = await patch(rig, servo, {**EIGHT, "angle_p_gain": 150})
    assert answer["outcome"] == "rolled_back"
    assert "refused to write angle_p_gain" in answer["failure"]
    verdicts = [change["verdict"] for change in answer["changes"]]
    assert verdicts == ["rolled_back"] * 4 + ["refused"]
    memory = rig.sim(servo).memory
    assert {key: memory.get(servo.registers[key].parameter.address) for key in EIGHT} == before
    assert {key: servo.raw(key) for key in EIGHT} == before


@scene()
async def test_when_the_servo_falls_silent_half_way_what_was_written_is_undone_once_it_hears_again(
    rig: Rig, servo: Servo
) -> None:
    memory = rig.sim(servo).memory
    before = {key: servo.raw(key) for key in EIGHT}
    task = asyncio.create_task(rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": EIGHT}))
    while sum(name != "0x20" for _, name, _ in rig.writes()) < 4:
        await asyncio.sleep(0.0002)
    rig.bus.loss(100)
    await asyncio.sleep(3.5)
    rig.bus.loss(0)
    answer = json(await task)
    assert answer["outcome"] == "rolled_back"
    assert "did not respond" in answer["failure"]
    assert {key: servo.raw(key) for key in EIGHT} == before
    assert {key: memory.get(servo.registers[key].parameter.address) for key in EIGHT} == before


def test_a_value_the_servo_clamps_is_reported_and_never_called_applied() -> None:
    clamping = replace(PLAIN, behaviour=Behaviour(out_of_range="clamp"))

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        row = servo.registers["timeout_time"].parameter
        wide = row.model_copy(update={"maximum": 90_000})
        servo.registers["timeout_time"].parameter = wide  # our table is wrong, the servo knows better
        answer = await patch(rig, servo, {"timeout_time": 80_000})
        change = answer["changes"][0]
        assert (change["verdict"], change["requested"], change["after"]) == ("clamped", 80_000, 60_000)

    play(scene, clamping)


@scene()
async def test_if_match_refuses_what_somebody_else_changed_meanwhile(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters"
    revision = json(await rig.call("GET", path))["revision"]
    await patch(rig, servo, {"angle_p_gain": 41})
    body = {"values": {"angle_p_gain": 42}}
    stale = problem(await rig.call("PATCH", path, body, **{"If-Match": f'"{revision}"'}), "stale_revision", 412)
    fresh = await rig.call("PATCH", path, body, **{"If-Match": stale["revision"]})
    assert json(fresh)["outcome"] == "applied"


@pytest.mark.parametrize(
    "behaviour",
    [
        Behaviour(),
        Behaviour(acknowledges_save=False),
        Behaviour(save_opcode_restarts=False),
        Behaviour(acknowledges_restart=False, save_opcode_restarts=False),
    ],
    ids=["answers and restarts", "answer lost in the restart", "does not restart", "restart unanswered"],
)
@pytest.mark.parametrize("node_id", [11, 0], ids=["static id", "dynamic id"])
@scene(lambda behaviour, node_id: replace(PLAIN, node_id=node_id, behaviour=behaviour))
async def test_save_ends_only_when_every_row_was_read_back_after_a_restart(
    rig: Rig, servo: Servo, behaviour: Behaviour, node_id: int
) -> None:
    await patch(rig, servo, {"angle_limit_cw": 60, "speed_limit_cw": 200})
    job = await save(rig, servo)
    assert job["state"] == "succeeded", job
    assert [step["name"] for step in job["steps"]][-1] == "read_back"
    assert all(step["state"] in ("done", "skipped") for step in job["steps"])
    assert rig.sim(servo).memory.stored(0x38) == 600
    assert rig.sim(servo).starts == 2
    assert servo.unsaved() == []
    assert servo.registers["angle_limit_cw"].rom == 600
    assert servo.state is State.READY


@pytest.mark.parametrize("delay", [0.05, 1.0, 3.0])
@scene()
async def test_save_waits_for_slow_restarts(rig: Rig, servo: Servo, delay: float) -> None:
    await asyncio.sleep(3)
    rig.sim(servo).conditions.restart_delay_s = delay
    await patch(rig, servo, {"angle_p_gain": 55})
    assert (await save(rig, servo))["state"] == "succeeded"


@scene()
async def test_save_works_under_heavy_loss(rig: Rig, servo: Servo) -> None:
    await patch(rig, servo, {"angle_p_gain": 55})
    rig.bus.loss(10, seed=3)
    job = await save(rig, servo)
    assert job["state"] == "succeeded", job["error"]


@scene()
async def test_a_save_after_which_the_servo_never_returns_fails_and_claims_nothing(rig: Rig, servo: Servo) -> None:
    await patch(rig, servo, {"angle_p_gain": 55})
    rig.sim(servo).conditions.restart_delay_s = 1000
    job = await save(rig, servo)
    assert job["state"] == "failed"
    assert job["error"]["code"] == "no_response"
    assert servo.registers["angle_p_gain"].rom is None, "old or new: nobody knows"
    assert servo.unsaved() == []
    assert servo.state is State.OFFLINE


@scene()
async def test_saving_twice_at_once_is_one_save(rig: Rig, servo: Servo) -> None:
    first = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    second = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    assert first["id"] == second["id"]
    busy = await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 1}})
    problem(busy, "busy", 409)
    lease = await rig.lease()
    moving = await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 1}, lease=lease)
    problem(moving, "busy", 409)
    async with asyncio.timeout(20):
        while json(await rig.call("GET", f"/jobs/{first['id']}"))["state"] in ("queued", "running"):
            await asyncio.sleep(0.1)
    assert rig.sim(servo).starts == 2


@scene()
async def test_a_servo_under_command_is_not_saved_because_that_would_drop_its_torque(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 9}, lease=lease))
    problem(await rig.call("POST", f"/servos/{servo.uid}/save", lease=lease), "busy", 409)
    problem(await rig.call("POST", f"/servos/{servo.uid}/save"), "lease_held", 409)
    assert rig.sim(servo).starts == 1


@scene()
async def test_a_restart_brings_back_what_rom_holds(rig: Rig, servo: Servo) -> None:
    await patch(rig, servo, {"angle_p_gain": 55})
    job = json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    assert job["state"] == "succeeded"
    assert servo.raw("angle_p_gain") == 40
    assert servo.unsaved() == []


@scene()
async def test_an_unexpected_restart_is_noticed_and_everything_is_read_again(rig: Rig, servo: Servo) -> None:
    await patch(rig, servo, {"angle_p_gain": 55})
    await asyncio.sleep(5)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.3)
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(4)
    assert rig.events("restarted")
    assert servo.raw("angle_p_gain") == 40
    assert servo.state is State.READY


def test_rows_are_those_of_model_and_firmware_and_the_rest_is_named() -> None:
    old = Recipe("BLA21-06U-A0", "1.010", servo_id=1, node_id=11)

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
        assert not {"speed_torque_control", "overcurrent_limit", "angle_boost", "pwm_neutral"} & set(shown)
        path = f"/servos/{servo.uid}/parameters/angle_boost"
        refused = problem(await rig.call("PUT", path, {"value": 1.0}), "not_in_this_model", 409)
        assert "It was added in 1.200" in refused["detail"]
        problem(await rig.call("GET", path), "not_in_this_model", 409)
        assert rig.writes() == []

    play(scene, old)


@scene()
async def test_what_would_turn_the_zero_under_a_held_position_needs_torque_off(rig: Rig, servo: Servo) -> None:
    for values in ({"reverse": True}, {"origin": 10.0}):
        refused = await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values})
        problem(refused, "torque_on", 409)
    assert rig.writes() == []
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    await patch(rig, servo, {"reverse": True, "origin": 10.0})


@scene()
async def test_effects_follow_their_cause_at_once(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters/speed_limit_cw"
    off = json(await rig.call("GET", path))
    assert off["in_effect"] is False
    assert "0x25" in off["why_not"]
    rig.changes.clear()
    await patch(rig, servo, {"speed_torque_control": True})
    told = {change.key for change in rig.changes if isinstance(change, ReadingChanged)}
    assert "speed_limit_cw" in told
    assert json(await rig.call("GET", path))["in_effect"] is True


@scene()
async def test_a_save_is_not_called_read_back_when_a_row_was_not(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(3)
    started = json(await rig.call("POST", f"/servos/{servo.uid}/save"), 202)
    while rig.sim(servo).starts < 2:
        await asyncio.sleep(0.001)
    rig.sim(servo).conditions.refuse_keys.add("angle_p_gain")
    job = rig.host.jobs.get(started["id"])
    await rig.host.jobs.wait(job)
    assert job.state == "failed"


@scene()
async def test_a_value_whose_write_was_not_answered_is_stale(rig: Rig, servo: Servo) -> None:

    def deafen(change: Change) -> None:
        if isinstance(change, Sampled) and change.key == "angle_p_gain":
            rig.sim(servo).conditions.drop_responses_pct = 100

    forget = rig.host.hub.subscribe(deafen)  # it answers the read before the write, and nothing after
    refused = await rig.call("PUT", f"/servos/{servo.uid}/parameters/angle_p_gain", {"value": 41})
    problem(refused, "no_response", 504)
    forget()
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]["angle_p_gain"]
    assert shown["stale"] is True


@scene()
async def test_of_two_who_change_the_same_revision_at_once_one_is_refused(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters"
    revision = json(await rig.call("GET", path))["revision"]
    answers = await asyncio.gather(
        *(rig.call("PATCH", path, {"values": {"angle_p_gain": value}}, **{"If-Match": revision}) for value in (41, 42))
    )
    assert sorted(answer.status_code for answer in answers) == [200, 412]


@scene()
async def test_what_another_tool_changed_unseen_is_a_stale_revision_too(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters"
    revision = json(await rig.call("GET", path))["revision"]
    rig.sim(servo).memory.put(0x2C, 77)
    answer = await rig.call("PATCH", path, {"values": {"angle_p_gain": 41}}, **{"If-Match": revision})
    problem(answer, "stale_revision", 412)
    assert rig.writes() == []


@scene()
async def test_a_servo_is_not_saved_in_the_middle_of_a_change(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(3)
    values = {"angle_p_gain": 41, "angle_d_gain": 31, "angle_dead_band": 1.0, "smoothing": False}
    changing = asyncio.create_task(rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))
    while not rig.writes():
        await asyncio.sleep(0.0002)
    problem(await rig.call("POST", f"/servos/{servo.uid}/save"), "busy", 409)
    assert json(await changing)["outcome"] == "applied"


@scene()
async def test_a_change_that_cannot_be_saved_is_refused_before_anything_is_written(rig: Rig, servo: Servo) -> None:
    await rig.call("POST", "/stop")
    count = len(rig.writes())
    body = {"values": {"angle_p_gain": 41}, "save": True}
    problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", body), "stopped", 423)
    assert len(rig.writes()) == count
    assert rig.sim(servo).memory.get(0x2C) == 40


@scene(replace(PLAIN, rom_sound=False))
async def test_of_a_servo_that_lost_its_settings_rom_is_not_known_until_a_save_is_proved(
    rig: Rig, servo: Servo
) -> None:
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    assert shown["fault_warning"]["value"] == 1 << 15
    assert {key for key, reading in shown.items() if reading["rom"] is not None} == set()
    assert json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))["state"] == "succeeded"
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    assert shown["fault_warning"]["value"] == 0
    assert shown["angle_limit_cw"]["rom"] == shown["angle_limit_cw"]["value"] == 179.9
    assert all(shown[key]["rom"] is not None for key, reg in servo.registers.items() if reg.parameter.rom)


def test_a_server_that_comes_later_does_not_take_remembered_values_for_lost_ones(tmp_path: Path) -> None:
    """The servo lost its ROM while we were away: what we remember of it is not there any more."""

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
async def test_0x36_is_told_in_the_unit_it_had_and_the_unit_it_is_to_have_when_0x37_changes_with_it(rig: Rig) -> None:
    values = {"pwm_mode": "speed", "pwm_output_range": 100}
    servo = (await rig.ready())[0]
    path = f"/servos/{servo.uid}/parameters"
    planned = json(await rig.call("PATCH", path, {"values": values, "dry_run": True}))["changes"][1]
    assert (planned["before"], planned["requested"], planned["after"]) == (70.0, 100, 70.0)
    applied = json(await rig.call("PATCH", path, {"values": values}))["changes"][1]
    assert (applied["before"], applied["requested"], applied["after"]) == (70.0, 100, 100)
    entry = next(one.entry for one in rig.host.store.audit.rows() if one.entry.key == "pwm_output_range")
    assert (entry.before, entry.requested, entry.after) == (70.0, 100, 100)


@scene()
async def test_a_problem_that_repeats_nan_is_json_all_the_same(rig: Rig) -> None:
    answer = await rig.http.request(
        "PUT", "/profiles/odd/file", content="[values]\nangle_limit_cw = nan\nspeed_limit_cw = -inf\n",
        headers={"Content-Type": "application/toml"},
    )  # fmt: skip
    problem(answer, "invalid_value", 422)
    found = text_json.loads(answer.text, parse_constant=_no_constant)
    assert [one["value"] for one in found["lines"]] == ["NaN", "-Infinity"]


@scene()
async def test_a_profile_is_not_taken_of_half_a_change_that_is_undone(rig: Rig, servo: Servo) -> None:
    values = {"angle_p_gain": 60, "angle_d_gain": 70, "smoothing": True, "angle_limit_cw": 30}
    changing = asyncio.create_task(rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))
    while servo.raw("angle_p_gain") != 60:
        await asyncio.sleep(0.0001)
    rig.sim(servo).conditions.refuse_keys.add("angle_limit_cw")
    kept = json(await rig.call("PUT", "/profiles/golden", {"from_uid": servo.uid}), 201)
    assert json(await changing)["outcome"] == "rolled_back"
    assert kept["values"]["angle_p_gain"] == 40


@scene()
async def test_a_snapshot_by_hand_and_a_profile_hold_what_another_tool_wrote_meanwhile(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).memory.put(servo.registers["angle_limit_cw"].parameter.address, 450)
    assert servo.raw("angle_limit_cw") != 450
    kept = json(await rig.call("PUT", "/profiles/golden", {"from_uid": servo.uid}), 201)
    assert kept["values"]["angle_limit_cw"] == 45.0
    rig.sim(servo).memory.put(servo.registers["angle_limit_cw"].parameter.address, 300)
    made = json(await rig.call("POST", f"/servos/{servo.uid}/snapshots"), 201)
    assert made["values"]["angle_limit_cw"] == 30.0


@scene(PLAIN)
async def test_revisions_of_a_batch_are_read_as_if_match_is(rig: Rig, servo: Servo) -> None:
    for text in ("*", f'W/"{servo.revision}"', f'"{servo.revision}"', servo.revision):
        body = {"servos": {servo.uid: {"angle_p_gain": 40}}, "revisions": {servo.uid: text}}
        (one,) = json(await rig.call("PATCH", "/parameters", body))["servos"]
        assert one["outcome"] == "applied", text
    body = {"servos": {servo.uid: {"angle_p_gain": 40}}, "revisions": {servo.uid: "other"}}
    (one,) = json(await rig.call("PATCH", "/parameters", body))["servos"]
    assert (one["outcome"], one["problem"]["code"]) == ("rejected", "stale_revision")


def test_a_clock_that_was_set_back_proves_nothing_of_rom(tmp_path: Path) -> None:
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
