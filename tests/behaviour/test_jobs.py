"""Jobs over REST: listed by subject, stored over a restart of the server, and resumed only on request."""

import asyncio
import re
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, get_args

import pytest

from behaviour.actions import torque
from behaviour.rig import Rig, json, play, problem, until
from behaviour.scene import scene
from hornbill.domain.job import Job as JobShape
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.jobs import OUTCOME_UNKNOWN, RunningJob, Step
from hornbill.sim.bench.recipe import Recipe

DOCUMENT = Path(__file__).parents[2] / "docs" / "explanation" / "jobs.md"
KINDS: tuple[str, ...] = get_args(JobShape.model_fields["kind"].annotation)


@scene()
async def test_jobs_are_listed_by_kind_state_and_servo(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}"
    save = json(await rig.call("POST", f"{path}/save?wait=true"))
    await rig.ready()
    restart = json(await rig.call("POST", f"{path}/restart?wait=true"))

    async def bad(job: RunningJob) -> dict[str, object]:
        raise ZeroDivisionError

    several = await rig.host.jobs.wait(rig.host.jobs.start("profile", None, [Step("check", "A", uid=servo.uid)], bad))
    other = await rig.host.jobs.wait(rig.host.jobs.start("profile", None, [], bad))
    for query, expected in {
        "": [other.id, several.id, restart["id"], save["id"]],
        "?kind=save": [save["id"]],
        "?state=failed": [other.id, several.id],
        f"?uid={servo.uid}": [several.id, restart["id"], save["id"]],
        f"?uid={servo.uid}&state=succeeded&kind=restart": [restart["id"]],
    }.items():
        assert [job["id"] for job in json(await rig.call("GET", f"/jobs{query}"))] == expected, query
    problem(await rig.call("GET", "/jobs?state=lost"), "invalid_value", 422)
    problem(await rig.call("POST", "/jobs/none/resume"), "unknown_job", 404)


Start = Callable[[Rig, Servo], Awaitable[Any]]


def post(action: str, body: object = None) -> Start:
    return lambda rig, servo: rig.call("POST", f"/servos/{servo.uid}/{action}", body)


def post_with_torque(action: str, body: object = None) -> Start:
    async def start(rig: Rig, servo: Servo) -> Any:
        lease = await rig.lease()
        await torque(rig, servo, "on", lease)
        return await rig.call("POST", f"/servos/{servo.uid}/{action}", body, lease=lease)

    return start


async def profile(rig: Rig, servo: Servo) -> Any:
    await rig.call("PUT", "/profiles/soft", {"values": {"angle_p_gain": 55}})
    return await rig.call("POST", "/profiles/soft/apply", {"uids": [servo.uid], "save": True})


async def commissioning(rig: Rig, servo: Servo) -> Any:
    await rig.call("PUT", "/profiles/soft", {"values": {"angle_p_gain": 55}})
    target = {"uid": servo.uid, "label": "left", "servo_id": 9}
    return await rig.call("POST", "/commissioning", {"servos": [target], "profile": "soft"})


async def restore_output(rig: Rig, servo: Servo) -> Any:
    lease = await rig.lease()
    await rig.call("POST", "/stop")
    await asyncio.sleep(0.5)
    return await rig.call("POST", "/stop/restore", {"uids": [servo.uid]}, lease=lease)


async def run_plan(rig: Rig, servo: Servo) -> Any:
    steps = [{"do": "move", "angle_deg": 5}, {"do": "move", "angle_deg": -5}]
    return await rig.call("POST", "/plans", {"plan": {"name": "x", "servos": [servo.uid], "cycles": 3, "steps": steps}})


START: dict[str, Start] = {
    "save": post("save"), "restart": post("restart"), "factory_reset": post("factory-reset", {}),
    "identify": post_with_torque("identify"), "step_test": post_with_torque("step-test", {"runs": 3}),
    "frequency_response": post_with_torque("frequency-response", {}),
    "mechanics": post_with_torque("mechanics", {}), "improve": post_with_torque("improve", {}),
    "profile": profile, "commissioning": commissioning, "restore_output": restore_output,
    "plan": run_plan,
}  # fmt: skip


def documented() -> dict[str, str]:
    """Whether docs/explanation/jobs.md calls a job resumable, by kind."""
    return dict(re.findall(r"^\| `(\w+)` \| (resumable|repeat) \|", DOCUMENT.read_text(encoding="utf-8"), re.M))


def test_the_document_covers_every_kind() -> None:
    assert set(documented()) == set(KINDS) == set(START)


@pytest.mark.parametrize("kind", KINDS)
def test_a_job_interrupted_by_the_end_of_the_server_is_resumable_as_documented(kind: str, tmp_path: Path) -> None:
    started: dict[str, Any] = {}

    async def first(rig: Rig) -> None:
        (servo,) = await rig.ready()
        await asyncio.sleep(5)
        started.update(json(await START[kind](rig, servo), 202))
        job = rig.host.jobs.get(started["id"])
        await until(lambda: job.step, 60, every_s=0.001)
        await asyncio.sleep(0.005)
        assert not job.ended

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
        assert len(rig.writes()) == before, "nothing continues automatically"
        assert json(await rig.call("GET", path)) == job
        assert job["resumable"] is (documented()[kind] == "resumable")
        if job["resumable"]:
            lease = await rig.lease()
            problem(await rig.call("POST", f"{path}/resume"), "lease_held", 409)
            json(await rig.call("POST", "/stop", {"mode": "off"}))
            problem(await rig.call("POST", f"{path}/resume", lease=lease), "stopped", 423)
            await rig.call("DELETE", "/stop")
            await rig.call("DELETE", "/bus")
            problem(await rig.call("POST", f"{path}/resume", lease=lease), "bus_disconnected", 503)
            json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
            await rig.ready()
            done = json(await rig.call("POST", f"{path}/resume?wait=true", lease=lease))
            shown = (done["id"], done["state"], done["progress"], done["resumable"])
            assert shown == (job["id"], "succeeded", 1.0, False), done["error"]
            problem(await rig.call("POST", f"{path}/resume", lease=lease), "busy", 409)
        else:
            problem(await rig.call("POST", f"{path}/resume"), "busy", 409)
            assert json(await START[kind](rig, servo), 202)["id"] != job["id"]

    play(first, Recipe("BLA21-06U-A0"), store=str(tmp_path))
    play(second, Recipe("BLA21-06U-A0"), store=str(tmp_path))
