"""Leases of some servos: two stations share a bus, each ends alone, and Stop reaches both (section 4.13)."""

import asyncio
from dataclasses import replace
from typing import Any

from behaviour.actions import move
from behaviour.losing import HOLDING
from behaviour.rig import Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.errors import Busy
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.steps import Step

THREE = [replace(HOLDING, servo_id=n, node_id=10 + n) for n in (1, 2, 3)]


async def take(rig: Rig, holder: str, *servos: Servo, ttl_s: float = 30.0, **more: object) -> dict[str, Any]:
    body = {"holder": holder, "ttl_s": ttl_s, "uids": [one.serial for one in servos], **more}
    return json(await rig.call("POST", "/leases", body), 201)


def outputs(rig: Rig, *servos: Servo) -> list[int]:
    return [rig.sim(servo).output for servo in servos]


@scene(*THREE)
async def test_two_stations_share_a_bus(rig: Rig, servos: list[Servo]) -> None:
    one, two, three = servos
    left = await take(rig, "left", one)
    right = await take(rig, "right", two, ttl_s=1.0)
    assert [(row["holder"], row["uids"]) for row in json(await rig.call("GET", "/leases"))] == [
        ("left", [one.uid]), ("right", [two.uid])
    ]  # fmt: skip
    await move(rig, one, left["id"])
    await move(rig, two, right["id"])

    def command(servo: Servo) -> tuple[str, str, dict[str, object]]:
        return "POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 1.0}

    held = problem(await rig.call(*command(two), lease=left["id"]), "lease_held", 409)
    assert (held["holder"], held["uids"]) == ("right", [two.uid])
    found = problem(await rig.call(*command(three), lease=left["id"]), "lease_required", 428)
    assert (found["cause"], found["uids"]) == ("lease_does_not_cover", [three.uid])
    both = {"commands": [{"uid": each.uid, "type": "angle", "value": 2.0} for each in (one, two)]}
    problem(await rig.call("POST", "/commands", both, lease=left["id"]), "lease_held", 409)
    stream = {"uids": [one.uid, two.uid], "type": "angle", "rate_hz": 20}
    problem(await rig.call("POST", "/streams", stream, lease=left["id"]), "lease_held", 409)
    for overlapping in ({}, {"uids": [two.uid, three.uid]}):
        body = {"holder": "third", "ttl_s": 3, **overlapping}
        problem(await rig.call("POST", "/leases", body), "lease_held", 409)
    problem(await rig.call("POST", "/leases", {"holder": "third", "uids": []}), "invalid_value", 422)
    problem(await rig.call("POST", "/leases", {"holder": "third", "uids": ["nope"]}), "unknown_servo", 404)

    written = await rig.call("PUT", f"/servos/{three.uid}/parameters/angle_p_gain", {"value": 41})
    assert written.status_code == 200, "no lease covers it"
    path = f"/servos/{two.uid}/parameters/angle_p_gain"
    problem(await rig.call("PUT", path, {"value": 41}, lease=left["id"]), "lease_held", 409)

    await asyncio.sleep(1.5)  # right expires
    assert outputs(rig, one, two) == [0, 1], "torque is off on what that lease commanded, and on nothing else"
    assert [row["holder"] for row in json(await rig.call("GET", "/leases"))] == ["left"]
    assert json(await rig.call(*command(one), lease=left["id"]))["value"] == 1.0


@scene(*THREE)
async def test_all_clients_see_all_leases_and_a_lease_is_extended(rig: Rig, servos: list[Servo]) -> None:
    one, two, three = servos
    left = await take(rig, "left", one)
    right = await take(rig, "right", two)
    page = Socket(rig.app)
    shown = await page.receive("lease")
    assert [(row["holder"], row["uids"]) for row in shown["leases"]] == [("left", [one.uid]), ("right", [two.uid])]
    assert shown["lease"] == shown["leases"][0]
    await move(rig, one, left["id"])
    path = f"/leases/{left['id']}"
    held = problem(await rig.call("PUT", path, {"uids": [two.uid, three.uid]}), "lease_held", 409)
    assert held["holder"] == "right"
    problem(await rig.call("PUT", path, {"uids": ["nope"]}), "unknown_servo", 404)
    assert json(await rig.call("PUT", path))["uids"] == [one.uid]
    assert json(await rig.call("PUT", path, {"uids": [three.serial]}))["uids"] == sorted([one.uid, three.uid])
    assert outputs(rig, one) == [0], "what was commanded continues"
    await move(rig, three, left["id"])
    shown = await page.receive("lease")
    assert [row["uids"] for row in shown["leases"]] == [sorted([one.uid, three.uid]), [two.uid]]
    json(await rig.call("DELETE", f"/leases/{right['id']}"))
    wanted = {"holder": "Bob", "ttl_s": 9.0, "timeout_s": 10.0, "uids": [two.uid]}
    await rig.call("POST", "/leases/requests", wanted)
    await rig.call("POST", "/leases/requests", {**wanted, "holder": "Eve", "uids": [one.uid]})
    problem(await rig.call("PUT", path, {"uids": [two.uid]}), "lease_held", 409)
    json(await rig.call("DELETE", path))
    assert outputs(rig, one, three) == [1, 1], "the end of the lease reaches what was added"
    problem(await rig.call("PUT", path, {"uids": [one.uid]}), "unknown_lease", 404)
    taken = [row["notes"] for row in json(await rig.call("GET", "/audit?action=lease")) if row["outcome"] == "taken"]
    assert [f"{uid[:8]}…" for uid in sorted([one.uid, three.uid])] in [
        note["params"]["servos"] for notes in taken for note in notes
    ]
    await page.close()


@scene(*THREE)
async def test_a_request_for_servos_of_two_holders_names_both(rig: Rig, servos: list[Servo]) -> None:
    for name, servo in zip(("A", "B"), servos, strict=False):
        await take(rig, name, servo)
    wanted = {"holder": "Bob", "ttl_s": 9.0, "timeout_s": 3.0}
    request = json(await rig.call("POST", "/leases/requests", wanted), 202)
    assert [row["request"]["by"] for row in json(await rig.call("GET", "/leases"))] == ["Bob", "Bob"]
    assert rig.logged("lease_requested")[0][2]["holder"] == "A, B"
    for _ in range(4):
        await asyncio.sleep(1)
        request = json(await rig.call("GET", f"/leases/requests/{request['id']}"))
    assert request["state"] == "granted"
    assert rig.logged("lease_passed")[0][2]["holder"] == "A, B"


@scene(*THREE)
async def test_a_job_is_resumed_unless_a_lease_covers_its_servos(rig: Rig, servos: list[Servo]) -> None:
    one, two, _ = servos

    async def fails(job: RunningJob) -> dict[str, object]:
        raise Busy("It fails once.", cause=None)

    async def works(job: RunningJob) -> dict[str, object]:
        return {}

    rig.host.jobs.resumers["profile"] = lambda job: works
    steps = [Step("check", "check", uid=servo.uid) for servo in (one, two)]
    job = await rig.host.jobs.wait(rig.host.jobs.start("profile", None, steps, fails, {"any": 1}))
    path = f"/jobs/{job.id}/resume?wait=true"
    await take(rig, "right", servos[2])
    held = await take(rig, "left", two)
    assert problem(await rig.call("POST", path), "lease_held", 409)["holder"] == "left"
    json(await rig.call("DELETE", f"/leases/{held['id']}"))
    assert json(await rig.call("POST", path))["state"] == "succeeded", "the lease of a third servo does not matter"


@scene(*THREE)
async def test_stop_reaches_every_servo_whatever_its_lease(rig: Rig, servos: list[Servo]) -> None:
    for holder, servo in zip(("left", "right"), servos[:2], strict=True):
        await move(rig, servo, (await take(rig, holder, servo))["id"])
    await rig.call("POST", "/stop", {})
    assert outputs(rig, *servos) == [1, 1, 1]


@scene(*THREE)
async def test_force_and_requests_concern_the_overlapping_leases(rig: Rig, servos: list[Servo]) -> None:
    one, two, three = servos
    leases = [await take(rig, name, servo) for name, servo in zip(("A", "B", "C"), servos, strict=True)]
    for lease, servo in zip(leases, servos, strict=True):
        await move(rig, servo, lease["id"])
    forced = await take(rig, "boss", one, two, force=True, reason="test")
    assert outputs(rig, one, two, three) == [1, 1, 0]
    assert [row["holder"] for row in json(await rig.call("GET", "/leases"))] == ["C", "boss"]

    wanted = {"holder": "Bob", "ttl_s": 9.0, "timeout_s": 10.0, "uids": [three.uid]}
    request = json(await rig.call("POST", "/leases/requests", wanted), 202)
    assert request["holder"]["holder"] == "C"
    shown = {row["holder"]: row["request"] for row in json(await rig.call("GET", "/leases"))}
    assert (shown["boss"], shown["C"]["by"]) == (None, "Bob")
    path = f"/leases/requests/{shown['C']['id']}/refuse"
    problem(await rig.call("POST", path, lease=forced["id"]), "unknown_lease", 404)
    json(await rig.call("DELETE", f"/leases/{leases[2]['id']}"))
    request = json(await rig.call("GET", f"/leases/requests/{request['id']}"))
    assert request["state"] == "granted"
    assert outputs(rig, three) == [1], "off before it passes"
    assert json(await rig.call("PUT", f"/leases/{request['lease_id']}"))["uids"] == [three.uid]
    assert [row["holder"] for row in json(await rig.call("GET", "/leases"))] == ["boss", "Bob"]


@scene(*THREE)
async def test_a_servo_is_identified_beside_the_lease_of_another(rig: Rig, servos: list[Servo]) -> None:
    lease = await take(rig, "left", servos[0])
    await move(rig, servos[0], lease["id"])
    problem(await rig.call("POST", f"/servos/{servos[0].uid}/identify"), "lease_held", 409)
    job = json(await rig.call("POST", f"/servos/{servos[1].uid}/identify?wait=true"))
    assert job["state"] == "succeeded", job["error"]
    assert outputs(rig, servos[0]) == [0]
