"""Requests are taken literally: no unknown query parameter, any name of a servo, and lists that are all alike."""

import asyncio
import gzip
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.actions import move, torque
from behaviour.rig import PLAIN, Rig, Socket, json, problem, until
from behaviour.scene import scene
from hornbill.app.composition import bus_log_of
from hornbill.bus.recordings.folder import RECORDINGS, FileFolder
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.jobs import RunningJob

TWO = [PLAIN, replace(PLAIN, servo_id=2, node_id=12)]


@scene()
async def test_unknown_and_repeated_query_parameters_are_refused(rig: Rig, servo: Servo) -> None:
    for verb, path, parameter, nearest in (
        ("GET", "/servos?serail=62-914866", "serail", "serial"),
        ("GET", "/servos?bogus=1", "bogus", None),
        ("GET", "/jobs?limt=1", "limt", "limit"),
        ("GET", "/audit?Limit=1", "Limit", "limit"),
        ("GET", f"/servos/{servo.uid}/parameters?refesh=true", "refesh", "refresh"),
        ("GET", f"/servos/{servo.uid}/parameters/angle_boost?refresh=true", "refresh", None),
        ("POST", f"/servos/{servo.uid}/save?wiat=true", "wiat", "wait"),
        ("DELETE", f"/inventory/{servo.uid}?histroy=true", "histroy", "history"),
        ("GET", "/events/stream?topic=servos", "topic", "topics"),
    ):
        found = problem(await rig.call(verb, path), "invalid_value", 422)
        facts = found["cause"], found["parameter"], found["nearest"]
        assert facts == ("query_parameter_unknown", parameter, nearest), path
        assert nearest is None or f"'{nearest}'" in found["detail"], path
    found = problem(await rig.call("GET", "/jobs?limit=1&limit=2"), "invalid_value", 422)
    assert (found["cause"], found["parameter"]) == ("query_parameter_repeated", "limit")
    assert json(await rig.call("GET", "/jobs")) == [], "a refused request did nothing"
    found = problem(await rig.call("POST", "/leases", {"holder": "x", "ttl": 3}), "invalid_value", 422)
    assert "body.ttl: Unknown field. The nearest name is 'ttl_s'" in found["detail"]


@scene(*TWO)
async def test_servos_are_addressed_by_unique_id_serial_number_or_label(rig: Rig) -> None:
    one, other = await rig.ready(2)
    await rig.call("PATCH", f"/servos/{one.uid}", {"label": "Elevator L"})
    lease = await rig.lease()
    for name in (one.uid, one.serial, "Elevator%20L"):
        for path in ("/servos/{}", "/inventory/{}", "/servos/{}/position-unit", "/sim/servos/{}"):
            assert json(await rig.call("GET", path.format(name))).get("uid", one.uid) == one.uid, (name, path)
        assert json(await rig.call("GET", f"/servos/{name}/parameters/angle_boost"))["key"] == "angle_boost"
        assert json(await rig.call("GET", f"/servos/{name}/snapshots")) is not None
    assert [row["uid"] for row in json(await rig.call("GET", "/audit?uid=Elevator%20L&action=label"))] == [one.uid]
    read = json(await rig.call("GET", f"/parameters?keys=angle_boost&uids=Elevator%20L,{other.serial},nope"))["servos"]
    assert [read.keys(), read["nope"]["problem"]["code"]] == [{one.uid, other.uid, "nope"}, "unknown_servo"]
    body = {"servos": {"Elevator L": {"angle_p_gain": 41}, other.serial: {"angle_p_gain": 42}}}
    done = json(await rig.call("PATCH", "/parameters", body, lease=lease))["servos"]
    assert [(row["uid"], row["outcome"]) for row in done] == [(one.uid, "applied"), (other.uid, "applied")]
    both = {"servos": {"Elevator L": {"angle_p_gain": 41}, one.uid: {"angle_p_gain": 42}}}
    problem(await rig.call("PATCH", "/parameters", both, lease=lease), "invalid_value", 422)

    await torque(rig, one, "on", lease)
    burst = {"commands": [{"uid": "Elevator L", "type": "angle", "value": 3.0}]}
    assert json(await rig.call("POST", "/commands", burst, lease=lease))["commands"][0]["uid"] == one.uid
    socket = Socket(rig.app)
    socket.send(type="command", lease=lease, commands=[{"uid": "Elevator L", "type": "angle", "value": 5.0}])
    await until(lambda: round(rig.sim(one).angle_deg) == 5)
    await socket.close()

    for verb, path, body in (
        ("GET", "/servos/Elevatr", None),
        ("GET", "/audit?uid=Elevatr", None),
        ("PUT", "/allocations/Elevatr", {"node_id": 9}),
        ("POST", "/commands", {"commands": [{"uid": "Elevatr", "type": "angle", "value": 3.0}]}),
    ):
        assert problem(await rig.call(verb, path, body, lease=lease), "unknown_servo", 404)["uid"] == "Elevatr"
    await rig.call("PATCH", f"/servos/{other.uid}", {"label": "Elevator L"})
    found = problem(await rig.call("GET", "/servos/Elevator%20L"), "conflict", 409)
    assert (found["cause"], found["candidates"]) == ("servo_ambiguous", sorted([one.uid, other.uid]))
    assert json(await rig.call("GET", f"/servos/{one.serial}"))["serial"] == one.serial
    assert json(await rig.call("GET", f"/sim/servos/{one.uid}"))["serial"] == one.serial, "one format everywhere"


async def page_through(rig: Rig, path: str, limit: int) -> list[list[Any]]:
    """Rows of each page of a list, by following the header Link."""
    found: list[list[Any]] = []
    query = f"?limit={limit}"
    while query:
        response = await rig.call("GET", path + query)
        found.append(json(response))
        link = response.headers.get("link")
        query = "" if link is None else link.removeprefix("<").partition(">")[0]
        assert link is None or link.endswith('; rel="next"')
    return found


LISTS = {
    "/audit": "id", "/benches": "name", "/bus/adapters": "address", "/bus/logs": "name", "/frequency-responses": "id",
    "/inventory": "uid", "/jobs": "id", "/leases": "shown_id", "/nodes": "node_id", "/profiles": "name",
    "/recorder/recordings": "name", "/runs": "id", "/servos": "uid", "/servos/{uid}/faults": "key",
    "/servos/{uid}/snapshots": "id", "/sim/chaos/injections": "number", "/sim/servos": "uid", "/streams": "id",
    "/tokens": "name",
}  # fmt: skip
"""All lists, and what distinguishes their rows."""
DIAGNOSES = {"/bus/doctor", "/autopilot/plan", "/servos/{uid}/cautions"}
"""Arrays that are one finding, not a list of things."""
SHORT = {
    "/recorder/recordings", "/frequency-responses", "/runs", "/benches", "/bus/logs", "/bus/adapters",
    "/sim/chaos/injections",
}  # fmt: skip
"""Lists that the test leaves with at most one row."""


def arrays(document: dict[str, Any]) -> set[str]:
    """Paths whose GET returns an array."""
    found: set[str] = set()
    for path, verbs in document["paths"].items():
        content = verbs.get("get", {}).get("responses", {}).get("200", {}).get("content", {})
        schema = content.get("application/json", {}).get("schema", {})
        schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema
        if schema.get("type") == "array":
            found.add(path.removeprefix("/api/v1"))
    return found


@scene(*TWO)
async def test_all_lists_have_limit_and_cursor(rig: Rig, tmp_path: Path) -> None:
    async def nothing(_job: RunningJob) -> dict[str, object]:
        return {}

    assert LISTS.keys() | DIAGNOSES == arrays(json(await rig.call("GET", "/openapi.json")))
    rig.app.state.bus_log = bus_log_of(rig.host, tmp_path)
    rig.app.state.recordings = FileFolder(tmp_path, RECORDINGS)
    one, other = await rig.ready(2)
    uids = [one.uid, other.uid]
    jobs = [await rig.host.jobs.wait(rig.host.jobs.start("profile", None, [], nothing)) for _ in range(5)]
    for number in range(3):
        json(await rig.call("POST", f"/servos/{one.uid}/snapshots", {"reason": "test"}), 201)
        json(await rig.call("PUT", f"/profiles/p{number}", {"values": {"angle_p_gain": 41}}), 201)
        rig.host.store.tokens.add(f"t{number}", "view")
    for servo in uids:
        lease = json(await rig.call("POST", "/leases", {"holder": "test", "uids": [servo]}), 201)["id"]
        json(await rig.call("POST", "/streams", {"uids": [servo], "type": "angle", "rate_hz": 10}, lease=lease), 201)
    for fault in ("voltage_low", "temperature_high"):
        rig.sim(one).faults.inject(fault, True)
    await until(lambda: len(rig.host.store.faults.of(one.uid)) > 1)
    for listed, key in LISTS.items():
        path = listed.format(uid=one.uid)
        every = [row[key] for row in json(await rig.call("GET", path))]
        assert len(every) > 1 or listed in SHORT, path
        paged = await page_through(rig, path, 1)
        assert [row[key] for rows in paged for row in rows] == every, path
        assert max(map(len, paged)) <= 1, path
        for wrong, cause in (
            ("cursor=!", "cursor_invalid"),
            ("limit=0", "request_malformed"),
            ("limt=1", "query_parameter_unknown"),
        ):
            assert problem(await rig.call("GET", f"{path}?{wrong}"), "invalid_value", 422)["cause"] == cause, path
    newest = [job.id for job in reversed(jobs)]
    paged = await page_through(rig, "/jobs", 2)
    assert [[job["id"] for job in rows] for rows in paged] == [newest[:2], newest[2:4], newest[4:]]
    for path in (f"/servos/{one.uid}/snapshots", "/audit"):
        ids = [row["id"] for row in json(await rig.call("GET", path))]
        assert ids == sorted(ids, reverse=True), path
        assert len(ids) >= 3, path
    for path in ("/jobs?cursor=bm9uZQ", "/audit?cursor=bm9uZQ", "/servos?cursor=bm9uZQ"):
        assert problem(await rig.call("GET", path), "invalid_value", 422)["cause"] == "cursor_invalid", path


@pytest.mark.parametrize("wait_s", [0, 0.5, 30])
@scene()
async def test_a_job_is_waited_for(rig: Rig, servo: Servo, wait_s: float) -> None:
    async def work(_job: RunningJob) -> dict[str, object]:
        await asyncio.sleep(5)
        return {}

    job = rig.host.jobs.start("profile", None, [], work)
    await asyncio.sleep(0)
    before = asyncio.get_running_loop().time()
    state = json(await rig.call("GET", f"/jobs/{job.id}?wait={wait_s}"))["state"]
    took = asyncio.get_running_loop().time() - before
    assert (state, round(took, 1)) == (("succeeded", 5.0) if wait_s == 30 else ("running", wait_s))
    for wrong in ("true", "-1", "61", "nan"):
        problem(await rig.call("GET", f"/jobs/{job.id}?wait={wrong}"), "invalid_value", 422)


@scene()
async def test_json_is_compressed_and_files_are_not(rig: Rig, servo: Servo) -> None:
    async def encoding(path: str, accepted: str = "gzip") -> str | None:
        response = await rig.call("GET", path, **{"Accept-Encoding": accepted})
        assert response.status_code == 200
        return response.headers.get("content-encoding")

    assert await encoding("/schema") == "gzip"
    assert await encoding("/schema", "identity") is None
    assert await encoding("/stop") is None, "it fits in one packet"
    assert await encoding("/audit.csv") is None
    assert await encoding(f"/servos/{servo.uid}/telemetry.csv") is None
    plain = (await rig.call("GET", "/schema", **{"Accept-Encoding": "identity"})).content
    assert len(gzip.compress(plain, 4)) < len(plain) / 5


@scene()
async def test_the_usual_form_of_a_write_gets_the_response_of_every_other_form(rig: Rig, servo: Servo) -> None:
    """`direct` of a route serves the usual form only; a media type with a parameter is another form of the same."""
    lease = await rig.lease()
    await torque(rig, servo, lease=lease)
    bodies = (
        '{"value":1.5}', '{"value":-1e9}', '{"value":"on"}', '{"value":NaN}', '{"value":null}', '{"value":[1]}',
        '{"value":1,"confirm":["supply"]}', '{"value":1,"valeu":2}', '{"valeu":1}', "{}", "[1]", "1.5", "{", "",
        "[" * 10_000,
    )  # fmt: skip
    for key in ("command_angle", "smoothing", "current_angle", "no_such_key", "product_code", "memory_switching"):
        for uid in (servo.uid, servo.uid[:-1] + ("0" if servo.uid[-1] != "0" else "1")):
            for body in bodies if key == "command_angle" else bodies[:3]:
                for held in (lease, None):
                    found = [await _put(rig, f"/servos/{uid}/parameters/{key}", body, held, end) for end in FORMS]
                    assert found[0] == found[1], (key, uid, body, held)


@scene(*TWO)
async def test_the_list_without_a_query_is_that_of_every_query(rig: Rig) -> None:
    lease = await rig.lease()
    for servo in await rig.ready(2):
        await torque(rig, servo, lease=lease)
        await move(rig, servo, lease, 90.0)
    for _ in range(20):  # each servo is encoded once per change; its angle must still be the latest, with its age
        await asyncio.sleep(0.03)
        every, limited = [json(await rig.call("GET", f"/servos{query}")) for query in ("", "?limit=9")]
        assert every == limited
        for listed in every:
            alone = json(await rig.call("GET", f"/servos/{listed['uid']}"))
            assert {**listed, "activity": None} == {**alone, "activity": None}


FORMS = ("", "; charset=utf-8")


async def _put(rig: Rig, path: str, body: str, lease: str | None, end: str) -> tuple[int, dict[str, Any]]:
    headers = {"Content-Type": f"application/json{end}"} | ({} if lease is None else {"Lease": lease})
    response = await rig.http.request("PUT", path, content=body, headers=headers)
    return response.status_code, {name: what for name, what in response.json().items() if name not in ("at", "age_s")}
