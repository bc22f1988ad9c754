"""Jobs over REST: found by what they are about, known to the next server, and never going on by themselves."""

import asyncio
from pathlib import Path

from behaviour.rig import Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.runtime.jobs import RunningJob, Step, Work
from hornbill.servo.runtime.steps import Evidence


@scene()
async def test_jobs_are_found_by_kind_state_and_servo(rig: Rig) -> None:
    (servo,) = await rig.ready()
    path = f"/servos/{servo.uid}"
    save = json(await rig.call("POST", f"{path}/save?wait=true"))
    await rig.ready()
    restart = json(await rig.call("POST", f"{path}/restart?wait=true"))

    async def bad(job: RunningJob) -> dict[str, object]:
        raise ZeroDivisionError

    several = await rig.host.jobs.wait(rig.host.jobs.start("profile", None, [Step("check", "A", uid=servo.uid)], bad))
    other = await rig.host.jobs.wait(rig.host.jobs.start("profile", None, [], bad))

    async def found(query: str) -> list[str]:
        return [job["id"] for job in json(await rig.call("GET", f"/jobs{query}"))]

    assert await found("") == [save["id"], restart["id"], several.id, other.id]
    assert await found("?kind=save") == [save["id"]]
    assert await found("?state=failed") == [several.id, other.id]
    assert await found(f"?uid={servo.uid}") == [save["id"], restart["id"], several.id]
    assert await found(f"?uid={servo.uid}&state=succeeded&kind=restart") == [restart["id"]]
    problem(await rig.call("GET", "/jobs?state=lost"), "invalid_value", 422)


def test_a_restart_of_the_server_resumes_nothing_until_somebody_asks(tmp_path: Path) -> None:
    ran: list[str] = []

    def resumer(job: RunningJob) -> Work:
        async def go_on(job: RunningJob) -> dict[str, object]:
            for step in job.steps:
                if step.state == "waiting":
                    job.begin(step.name)
                    ran.append(step.name)
                    job.done(step.name)
            return {}

        return go_on

    async def first(rig: Rig) -> None:
        async def body(job: RunningJob) -> dict[str, object]:
            job.begin("check")
            job.done("check", Evidence("failed_before", "done before"))
            job.begin("limit")
            await asyncio.sleep(1e6)
            return {}

        rig.host.jobs.start("identify", None, [Step("check", "A"), Step("limit", "B")], body, {"count": 1})
        await asyncio.sleep(1)

    async def second(rig: Rig) -> None:
        await rig.ready()
        (job,) = json(await rig.call("GET", "/jobs"))
        path = f"/jobs/{job['id']}"
        assert (job["state"], job["error"]["code"], job["resumable"]) == ("failed", "interrupted", False)
        assert job["error"]["status"] == 500
        problem(await rig.call("POST", f"{path}/resume"), "busy", 409)
        rig.host.jobs.resumers["identify"] = resumer
        assert json(await rig.call("GET", path))["resumable"]
        await asyncio.sleep(60)
        assert ran == []
        assert rig.writes() == []

        lease = await rig.lease()
        problem(await rig.call("POST", f"{path}/resume"), "lease_held", 409)
        json(await rig.call("POST", "/stop", {"mode": "off"}))
        problem(await rig.call("POST", f"{path}/resume", lease=lease), "stopped", 423)
        await rig.call("DELETE", "/stop")
        await rig.call("DELETE", "/bus")
        problem(await rig.call("POST", f"{path}/resume", lease=lease), "bus_disconnected", 503)
        json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
        assert ran == []

        done = json(await rig.call("POST", f"{path}/resume?wait=true", lease=lease))
        assert (done["id"], done["state"], done["progress"], done["resumable"]) == (job["id"], "succeeded", 1.0, False)
        assert done["steps"][0]["evidence"] == "done before"
        assert ran == ["limit"]
        problem(await rig.call("POST", f"{path}/resume", lease=lease), "busy", 409)
        problem(await rig.call("POST", "/jobs/none/resume"), "unknown_job", 404)

    place = str(tmp_path)
    play(first, store=place)
    play(second, store=place)
