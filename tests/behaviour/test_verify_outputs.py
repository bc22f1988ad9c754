"""Live verification of an autopilot's outputs, and the failsafe of a servo confirmed by a measured gap."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene

THREE = [replace(PLAIN, node_id=19 + n, servo_id=n) for n in (1, 2, 3)]
ENDS = {"low_deg": -36.0, "high_deg": 25.2, "neutral_deg": 0.0}


async def flying(rig: Rig, **changes: dict[str, Any]) -> None:
    """An armed simulated autopilot whose outputs have the exported ends, except for `changes` (o1, o2, o3)."""
    json(await rig.call("PUT", "/sim/autopilot", {"program": "ardupilot", "output_count": 3}))
    outputs = [{"output": n, **ENDS, **changes.get(f"o{n}", {})} for n in (1, 2, 3)]
    body = {"armed": True, "safety_on": False, "sweep": False, "outputs": outputs}
    json(await rig.call("PATCH", "/sim/autopilot", body))
    await asyncio.sleep(0.5)


def plan() -> dict[str, Any]:
    return {"program": "ardupilot", "outputs": [{"output": n, "servo_id": n, **ENDS} for n in (1, 2, 3)]}


async def hold(rig: Rig, output: int | None, *demanded: int) -> list[dict[str, Any]]:
    """A step while the demand of these outputs is 1 and that of the others 0."""
    outputs = [{"output": n, "demand": 1.0 if n in demanded else 0.0} for n in (1, 2, 3)]
    json(await rig.call("PATCH", "/sim/autopilot", {"outputs": outputs}))
    body = {"kind": "neutral"} if output is None else {"kind": "positive", "output": output}
    state = json(await rig.call("POST", "/autopilot/verification/steps", body))
    assert state["left_s"] == pytest.approx(3, abs=0.1)
    await asyncio.sleep(3.2)
    state = json(await rig.call("GET", "/autopilot/verification"))
    assert state["step"] is None
    rows: list[dict[str, Any]] = state["rows"]
    return rows


@scene(*THREE)
async def test_outputs_that_match_are_proved_one_by_one(rig: Rig) -> None:
    await rig.ready(3)
    await flying(rig)
    state = json(await rig.call("PUT", "/autopilot/verification", plan()))
    assert [row["result"] for row in state["rows"]] == ["not_moved"] * 3
    rows = await hold(rig, None)
    assert [row["held_deg"] for row in rows] == [0.0] * 3
    for n in (1, 2):
        rows = await hold(rig, n, n)
    assert [row["result"] for row in rows] == ["matches", "matches", "not_moved"]
    assert rows[0]["held_deg"] == pytest.approx(25.2, abs=0.4)
    rows = await hold(rig, 3, 1, 3)
    assert [row["result"] for row in rows] == ["matches"] * 3
    assert (await rig.call("DELETE", "/autopilot/verification")).status_code == 204
    problem(await rig.call("GET", "/autopilot/verification"), "no_verification", 404)


@pytest.mark.parametrize(
    ("wrong", "demanded", "result"),
    [
        ({"o2": {"reversed": True}}, (2,), "reversed"),
        ({"o2": {"high_deg": 18.0}}, (2,), "throw_too_small"),
        ({"o2": {"high_deg": 40.0}}, (2,), "throw_too_large"),
        ({"o2": {"sent": False}}, (2,), "missing"),
        ({}, (3,), "swapped"),
        ({}, (), "not_moved"),
    ],
)
@scene(*THREE)
async def test_each_mistake_is_named(
    rig: Rig, wrong: dict[str, dict[str, Any]], demanded: tuple[int, ...], result: str
) -> None:
    await rig.ready(3)
    await flying(rig, **wrong)
    json(await rig.call("PUT", "/autopilot/verification", plan()))
    rows = await hold(rig, 2, *demanded)
    assert rows[1]["result"] == result
    assert rows[1]["swapped_with"] == (3 if result == "swapped" else None)
    assert rows[0]["result"] == "not_moved"


@scene(*THREE)
async def test_a_plan_and_a_step_are_checked(rig: Rig) -> None:
    await rig.ready(3)
    problem(await rig.call("POST", "/autopilot/verification/steps", {"kind": "neutral"}), "no_verification", 404)
    json(await rig.call("PUT", "/autopilot/verification", plan()))
    body = {"kind": "positive", "output": 9}
    problem(await rig.call("POST", "/autopilot/verification/steps", body), "invalid_value", 422)
    wrong = plan()
    wrong["outputs"][0]["servo_id"] = 7
    found = problem(await rig.call("POST", "/autopilot/export", wrong), "invalid_value", 422)
    assert found["wanted_id"] == 1


@scene(*THREE)
async def test_a_plan_of_the_connected_servos_is_exported_with_advice_and_read_back(rig: Rig) -> None:
    await rig.ready(3)
    outputs = json(await rig.call("GET", "/autopilot/plan", None))
    assert [(one["output"], one["servo_id"]) for one in outputs] == [(1, 1), (2, 2), (3, 3)]
    file = json(await rig.call("POST", "/autopilot/export", {"program": "ardupilot", "outputs": outputs}))
    assert "CAN_D1_UC_SRV_BM,7" in file["text"]
    codes = {one["code"] for one in file["advice"]}
    assert {"silent_when_unarmed", "step_above_deadband", "position_in_log"} <= codes
    read = json(await rig.call("POST", "/autopilot/import", {"program": "ardupilot", "text": file["text"]}))
    for one, again in zip(outputs, read["plan"]["outputs"], strict=True):
        assert again["low_deg"] == pytest.approx(one["low_deg"], abs=0.36)
        assert again["high_deg"] == pytest.approx(one["high_deg"], abs=0.36)


@scene(THREE[0])
async def test_the_failsafe_is_confirmed_by_a_measured_gap(rig: Rig) -> None:
    (servo,) = await rig.ready(1)
    path = f"/servos/{servo.uid}/failsafe"
    card = json(await rig.call("GET", path))
    assert (card["action"], card["after_s"], card["confirmed"]) == ("off", 1.0, None)
    assert "switches its output off" in card["text"]
    json(await rig.call("PUT", "/sim/autopilot", {"program": "ardupilot", "output_count": 1}))
    json(await rig.call("PATCH", "/sim/autopilot", {"armed": True, "safety_on": False, "sweep": False}))
    await asyncio.sleep(1)
    json(await rig.call("PATCH", "/sim/autopilot", {"safety_on": True}))
    await asyncio.sleep(1.5)
    assert rig.sim(servo).output == 1
    assert json(await rig.call("GET", path))["confirmed"]["gap_s"] is None, "the gap lasts"
    json(await rig.call("PATCH", "/sim/autopilot", {"safety_on": False}))
    await asyncio.sleep(0.5)
    gap = json(await rig.call("GET", path))["confirmed"]
    assert gap["node_id"] == 10
    assert gap["gap_s"] == pytest.approx(1.5, abs=0.06)
    assert rig.sim(servo).output == 0
