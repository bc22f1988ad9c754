"""Configuration asked for in odd ways: what is said of it stays true, and is JSON."""

import asyncio
import json as text_json
import time
from dataclasses import replace
from pathlib import Path

from behaviour.rig import PLAIN, Rig, json, play, problem
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.units import Uid

PWM = Recipe("BLA21-06U-AB", "1.300", servo_id=1, node_id=11)


def _no_constant(name: str) -> None:
    raise AssertionError(f"{name} is not JSON")


def test_0x36_is_told_in_the_unit_it_had_and_the_unit_it_is_to_have_when_0x37_changes_with_it() -> None:
    values = {"pwm_mode": "speed", "pwm_output_range": 100}

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        path = f"/servos/{servo.uid}/parameters"
        planned = json(await rig.call("PATCH", path, {"values": values, "dry_run": True}))["changes"][1]
        assert (planned["before"], planned["requested"], planned["after"]) == (70.0, 100, 70.0)
        applied = json(await rig.call("PATCH", path, {"values": values}))["changes"][1]
        assert (applied["before"], applied["requested"], applied["after"]) == (70.0, 100, 100)
        entry = next(one.entry for one in rig.host.store.audit.rows() if one.entry.key == "pwm_output_range")
        assert (entry.before, entry.requested, entry.after) == (70.0, 100, 100)

    play(scene, PWM)


def test_a_problem_that_repeats_nan_is_json_all_the_same() -> None:
    async def scene(rig: Rig) -> None:
        answer = await rig.http.request(
            "PUT", "/profiles/odd/file", content="[values]\nangle_limit_cw = nan\nspeed_limit_cw = -inf\n",
            headers={"Content-Type": "application/toml"},
        )  # fmt: skip
        problem(answer, "invalid_value", 422)
        found = text_json.loads(answer.text, parse_constant=_no_constant)
        assert [one["value"] for one in found["lines"]] == ["NaN", "-Infinity"]

    play(scene)


def test_a_profile_is_not_taken_of_half_a_change_that_is_undone() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        values = {"angle_p_gain": 60, "angle_d_gain": 70, "smoothing": True, "angle_limit_cw": 30}
        changing = asyncio.create_task(rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))
        while servo.raw("angle_p_gain") != 60:
            await asyncio.sleep(0.0001)
        rig.sim(servo).conditions.refuse_keys.add("angle_limit_cw")
        kept = json(await rig.call("PUT", "/profiles/golden", {"from_uid": servo.uid}), 201)
        assert json(await changing)["outcome"] == "rolled_back"
        assert kept["values"]["angle_p_gain"] == 40

    play(scene)


def test_a_snapshot_by_hand_and_a_profile_hold_what_another_tool_wrote_meanwhile() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        rig.sim(servo).memory.put(servo.registers["angle_limit_cw"].parameter.address, 450)
        assert servo.raw("angle_limit_cw") != 450
        kept = json(await rig.call("PUT", "/profiles/golden", {"from_uid": servo.uid}), 201)
        assert kept["values"]["angle_limit_cw"] == 45.0
        rig.sim(servo).memory.put(servo.registers["angle_limit_cw"].parameter.address, 300)
        made = json(await rig.call("POST", f"/servos/{servo.uid}/snapshots"), 201)
        assert made["values"]["angle_limit_cw"] == 30.0

    play(scene)


def test_revisions_of_a_batch_are_read_as_if_match_is() -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        for text in ("*", f'W/"{servo.revision}"', f'"{servo.revision}"', servo.revision):
            body = {"servos": {servo.uid: {"angle_p_gain": 40}}, "revisions": {servo.uid: text}}
            (one,) = json(await rig.call("PATCH", "/parameters", body))["servos"]
            assert one["outcome"] == "applied", text
        body = {"servos": {servo.uid: {"angle_p_gain": 40}}, "revisions": {servo.uid: "other"}}
        (one,) = json(await rig.call("PATCH", "/parameters", body))["servos"]
        assert (one["outcome"], one["problem"]["code"]) == ("rejected", "stale_revision")

    play(scene, PLAIN)


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
        store.servos.met(Uid(bytes(range(16)).hex()))
    play(later, recipe, store=place, connect=False)
