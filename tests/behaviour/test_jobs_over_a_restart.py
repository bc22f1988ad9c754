"""What becomes of a job of each kind when the server ends amid it: as docs/explanation/jobs.md states, kind by kind."""

import asyncio
import re
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, get_args

import pytest

from behaviour.rig import Rig, json, play, problem
from hornbill.domain.job import Job as JobShape
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.jobs import OUTCOME_UNKNOWN
from hornbill.sim.bench.recipe import Recipe

DOCUMENT = Path(__file__).parents[2] / "docs" / "explanation" / "jobs.md"
KINDS: tuple[str, ...] = get_args(JobShape.model_fields["kind"].annotation)
Start = Callable[[Rig, Servo], Awaitable[Any]]


async def _on(rig: Rig, servo: Servo) -> str:
    """Motion control with torque on; the lease's id."""
    lease = await rig.lease(60)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    return lease


async def save(rig: Rig, servo: Servo) -> Any:
    return await rig.call("POST", f"/servos/{servo.uid}/save")


async def restart(rig: Rig, servo: Servo) -> Any:
    return await rig.call("POST", f"/servos/{servo.uid}/restart")


async def factory_reset(rig: Rig, servo: Servo) -> Any:
    return await rig.call("POST", f"/servos/{servo.uid}/factory-reset", {})


async def identify(rig: Rig, servo: Servo) -> Any:
    return await rig.call("POST", f"/servos/{servo.uid}/identify", lease=await _on(rig, servo))


async def profile(rig: Rig, servo: Servo) -> Any:
    await rig.call("PUT", "/profiles/soft", {"values": {"angle_p_gain": 55}})
    return await rig.call("POST", "/profiles/soft/apply", {"uids": [servo.uid], "save": True})


async def commissioning(rig: Rig, servo: Servo) -> Any:
    await rig.call("PUT", "/profiles/soft", {"values": {"angle_p_gain": 55}})
    unit = {"uid": servo.uid, "label": "left", "servo_id": 9}
    return await rig.call("POST", "/commissioning", {"servos": [unit], "profile": "soft"})


async def step_test(rig: Rig, servo: Servo) -> Any:
    return await rig.call("POST", f"/servos/{servo.uid}/step-test", {"runs": 3}, lease=await _on(rig, servo))


async def restore_output(rig: Rig, servo: Servo) -> Any:
    lease = await rig.lease()
    await rig.call("POST", "/stop")
    await asyncio.sleep(0.5)
    return await rig.call("POST", "/stop/restore", {"uids": [servo.uid]}, lease=lease)


START: dict[str, Start] = {
    "save": save, "restart": restart, "factory_reset": factory_reset, "identify": identify, "profile": profile,
    "commissioning": commissioning, "step_test": step_test, "restore_output": restore_output,
}  # fmt: skip


def stated() -> dict[str, str]:
    """By kind, whether the document says that it can be resumed."""
    rows = re.findall(r"^\| `(\w+)` \| (resumable|repeat) \|", DOCUMENT.read_text(encoding="utf-8"), re.M)
    return dict(rows)


def test_the_document_states_of_every_kind_what_a_restart_of_the_server_does_to_it() -> None:
    assert set(stated()) == set(KINDS)
    assert len(KINDS) >= 7


@pytest.mark.parametrize("kind", KINDS)
def test_a_job_the_server_ended_amid_is_interrupted_and_can_be_resumed_only_where_that_is_stated(
    kind: str, tmp_path: Path
) -> None:
    started: dict[str, Any] = {}

    async def first(rig: Rig) -> None:
        (servo,) = await rig.ready()
        await asyncio.sleep(5)
        started.update(json(await START[kind](rig, servo), 202))
        async with asyncio.timeout(60):
            while rig.host.jobs.get(started["id"]).step is None:
                await asyncio.sleep(0.001)
        await asyncio.sleep(0.005)
        assert not rig.host.jobs.get(started["id"]).ended

    async def second(rig: Rig) -> None:
        (servo,) = await rig.ready()
        path = f"/jobs/{started['id']}"
        job = json(await rig.call("GET", path))
        assert (job["kind"], job["state"], job["error"]["code"]) == (kind, "failed", "interrupted")
        assert job["ended_at"] is not None
        (begun,) = [step for step in job["steps"] if step["state"] == "failed"]
        assert begun["evidence"] == OUTCOME_UNKNOWN
        assert not [step for step in job["steps"] if step["state"] == "running"]
        before = len(rig.writes())
        await asyncio.sleep(30)
        assert len(rig.writes()) == before, "nothing goes on by itself"
        assert json(await rig.call("GET", path)) == job
        assert job["resumable"] is (stated()[kind] == "resumable")
        if job["resumable"]:
            done = json(await rig.call("POST", f"{path}/resume?wait=true"))
            assert (done["id"], done["state"]) == (job["id"], "succeeded"), done["error"]
        else:
            problem(await rig.call("POST", f"{path}/resume"), "busy", 409)
            again = json(await START[kind](rig, servo), 202)
            assert again["id"] != job["id"], "what cannot be resumed can be started anew"

    place = str(tmp_path)
    play(first, Recipe("BLA21-06U-A0"), store=place)
    play(second, Recipe("BLA21-06U-A0"), store=place)
