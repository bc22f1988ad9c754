"""Profiles: stored, imported and exported, and applied by one job to many servos of several models."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.applying import ADDRESSES, GAINS, MIXED, RAW, THREE, apply, memory, outcomes, put, send, states
from behaviour.rig import CATALOG, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.domain.change import LeftOut
from hornbill.domain.profile import Profile
from hornbill.schema.scale import Value
from hornbill.servo.device.servo import Servo
from hornbill.sim.behaviour import Behaviour


@scene()
async def test_a_profile_is_stored_replaced_listed_and_deleted_with_an_audit_row_each(rig: Rig) -> None:
    path = "/profiles/Left%20hand"
    first = await rig.call("PUT", path, {"values": {"timeout_time": 500}, "description": "d"})
    stored = json(first, 201)
    assert (stored["values"], stored["units"]) == ({"timeout_time": 500}, {"timeout_time": "ms"})
    assert stored["schema_revision"] == CATALOG.revision
    again = json(await rig.call("PUT", path, {"values": {"timeout_time": 600}}))
    assert again["created_at"] == stored["created_at"]
    assert [one["name"] for one in json(await rig.call("GET", "/profiles"))] == ["Left hand"]
    assert json(await rig.call("GET", path))["values"] == {"timeout_time": 600}
    assert (await rig.call("DELETE", path)).status_code == 204
    problem(await rig.call("GET", path), "unknown_profile", 404)
    rows = [one.entry for one in rig.host.audit.rows.rows(action="profile")]
    assert [(one.before, one.after) for one in reversed(rows)] == [
        (None, {"timeout_time": 500}), ({"timeout_time": 500}, {"timeout_time": 600}),
        ({"timeout_time": 600}, None),
    ]  # fmt: skip


@scene(connect=False)
async def test_a_profile_that_could_not_be_applied_is_not_stored(rig: Rig) -> None:
    cases: list[tuple[str, object, str, int]] = [
        ("boot_loader", 1, "forbidden_parameter", 403),
        ("0x49", 1, "forbidden_parameter", 403),
        ("73", 1, "forbidden_parameter", 403),
        ("write_rom", 1, "forbidden_parameter", 403),
        ("command_angle", 1, "invalid_value", 422),
        ("servo_id", 1, "invalid_value", 422),
        ("current_voltage", 1, "read_only", 409),
        ("timeout_tme", 1, "unknown_parameter", 404),
        ("timeout_time", 99_999, "out_of_range", 422),
        ("timeout_time", True, "invalid_value", 422),
    ]
    for key, value, code, status in cases:
        body = {"values": {"smoothing": True, key: value}}
        assert problem(await rig.call("PUT", "/profiles/bad", body), code, status)["key"] == key
    problem(await rig.call("PUT", "/profiles/a%0Ab", {"values": GAINS}), "invalid_value", 422)
    assert json(await rig.call("GET", "/profiles")) == []


@scene(MIXED[0])
async def test_a_profile_of_a_servo_has_identity_and_torque_only_on_request(rig: Rig, servo: Servo) -> None:
    stored = await put(rig, from_uid=servo.uid)
    rows = {key for key, one in servo.registers.items() if one.parameter.rom}
    assert set(stored["values"]) == rows - {"torque_mode", "origin", "servo_id", "node_id"}
    assert len(stored["values"]) == 30
    assert (stored["model"], stored["firmware"]) == ("BLA21-06U-AB", "1.300")
    assert stored["units"]["pwm_output_range"] == "°"
    named = await put(rig, from_uid=servo.uid, keys=["torque_mode", "smoothing"])
    assert set(named["values"]) == {"torque_mode", "smoothing"}
    body = {"from_uid": servo.uid, "keys": ["servo_id"]}
    assert "identity" in problem(await rig.call("PUT", "/profiles/x", body), "invalid_value", 422)["detail"]
    assert (await put(rig, from_uid=servo.uid, identity=True))["values"]["servo_id"] == 1


@scene(MIXED[0])
async def test_an_exported_file_can_be_imported_and_an_invalid_one_not(rig: Rig, servo: Servo) -> None:
    stored = await put(rig, from_uid=servo.uid)
    for form in ("toml", "json"):
        file = await rig.call("GET", f"/profiles/gains/file?format={form}")
        assert file.headers["content-type"] == f"application/{form}"
        assert file.headers["content-disposition"].startswith(f'attachment; filename="gains.{form}"')
        imported = json(await send(rig, "copy", file.text, form), 201 if form == "toml" else 200)
        assert imported["profile"]["values"] == stored["values"]
        assert {line["verdict"] for line in imported["lines"]} == {"ok"}
        invalid = file.text.replace("timeout_time", "timeout_tme", 1)
        refused = problem(await send(rig, "copy", invalid, form), "invalid_value", 422)
        wrong = [line for line in refused["lines"] if line["verdict"] != "ok"]
        assert ("timeout_tme", "unknown") in [(line["key"], line["verdict"]) for line in wrong]
        assert "timeout_tme" in invalid.split("\n")[wrong[0]["line"] - 1]
        assert json(await rig.call("GET", "/profiles/copy"))["values"] == stored["values"]
    large = problem(await send(rig, "x", "#" * 300_000, "toml"), "invalid_value", 422)
    assert "256 kB" in large["detail"]
    problem(await send(rig, "x", "smoothing,true", "csv"), "invalid_value", 422)
    headers = {"Content-Type": "application/toml"}
    bad = await rig.http.put("/profiles/x/file", content=b"[values]\n\xff = 1", headers=headers)
    assert "Line 2" in problem(bad, "invalid_value", 422)["detail"]


@scene(connect=False)
async def test_the_name_of_a_file_is_escaped_in_its_header(rig: Rig) -> None:
    await put(rig, "a%22%3B%20x%3Db")
    header = (await rig.call("GET", "/profiles/a%22%3B%20x%3Db/file")).headers["content-disposition"]
    assert header == "attachment; filename=\"a_x_b.toml\"; filename*=UTF-8''a%22%3B%20x%3Db.toml"


@scene(*MIXED)
async def test_rows_that_a_model_lacks_are_skipped_and_reported_also_in_a_dry_run(
    rig: Rig, servos: list[Servo]
) -> None:
    await put(rig, values={**GAINS, "pwm_neutral": 1500, "angle_boost": 1.5})
    planned = await apply(rig, servos, dry_run=True, save=True)
    assert (planned["state"], outcomes(planned)) == ("succeeded", ["planned"] * 3), planned
    assert {one["key"]: one["requested"] for one in planned["result"]["servos"][1]["changes"]} == GAINS
    assert rig.writes() == []
    assert [rig.sim(servo).starts for servo in servos] == [1, 1, 1]

    job = await apply(rig, servos)
    assert (job["state"], outcomes(job)) == ("succeeded", ["applied"] * 3), job["error"]
    skipped = [[row["key"] for row in one["left_out"]] for one in job["result"]["servos"]]
    assert skipped == [[], ["angle_boost", "pwm_neutral"], ["pwm_neutral"]]
    reason = job["result"]["servos"][1]["left_out"][0]
    assert "BLA21-12U-A0 with firmware 1.010" in reason["why"]
    assert reason["why_code"] == "not_in_servo"
    assert reason["why_params"] == {"model": "BLA21-12U-A0", "firmware": "1.010"}
    assert [memory(rig, servo) for servo in servos] == [RAW] * 3
    written = {(node, name) for node, name, _ in rig.writes() if name != "0x20"}
    assert not {(12, "0x2F"), (12, "0x34"), (13, "0x34")} & written
    snapshots = rig.host.store.snapshots.counts()
    assert [snapshots[servo.uid] for servo in servos] == [1, 1, 1]


@pytest.mark.parametrize("on_anomaly", ["stop", "continue"])
@scene(*MIXED)
async def test_a_value_that_a_model_does_not_allow_is_never_written_there(
    rig: Rig, servos: list[Servo], on_anomaly: str
) -> None:
    before = [memory(rig, servo) for servo in servos]
    await put(rig, values={**GAINS, "voltage_limit_upper": 15.0})
    job = await apply(rig, servos, on_anomaly=on_anomaly)
    assert (job["state"], job["error"]["code"]) == ("failed", "out_of_range")
    assert outcomes(job) == ["rejected", "not_tried" if on_anomaly == "stop" else "applied", "rejected"]
    first = job["result"]["servos"][0]["problem"]
    assert (first["code"], first["key"]) == ("out_of_range", "voltage_limit_upper")
    assert "2 of 3 servos" in job["error"]["detail"]
    assert [memory(rig, servo) for servo in (servos[0], servos[2])] == [before[0], before[2]]
    if on_anomaly == "stop":
        assert rig.writes() == []
        assert states(job)["write 2"] == "skipped"
    else:
        assert memory(rig, servos[1]) == RAW


@scene(*THREE)
async def test_with_stop_the_job_ends_at_the_first_servo_that_refuses(rig: Rig, servos: list[Servo]) -> None:
    before = memory(rig, servos[1])
    rig.sim(servos[1]).conditions.refuse_keys.add("angle_limit_cw")
    await put(rig)
    job = await apply(rig, servos, on_anomaly="stop")
    assert job["state"] == "failed"
    assert (job["error"]["code"], job["error"]["uid"]) == ("refused_by_servo", servos[1].uid)
    assert outcomes(job)[::2] == ["applied", "not_tried"]
    assert outcomes(job)[1] in ("rolled_back", "rejected")
    assert [memory(rig, servo) for servo in servos] == [RAW, before, before]
    assert {node for node, name, _ in rig.writes() if name != "0x20"} <= {11, 12}
    assert (states(job)["write 2"], states(job)["write 3"]) == ("failed", "skipped")
    evidence = next(step["evidence"] for step in job["steps"] if step["name"] == "write 3")
    assert servos[1].title in evidence


@scene(*THREE)
async def test_with_continue_the_job_skips_a_servo_that_refuses_and_fails_at_the_end(
    rig: Rig, servos: list[Servo]
) -> None:
    before = memory(rig, servos[1])
    rig.sim(servos[1]).conditions.refuse_keys.add("angle_limit_cw")
    await put(rig)
    job = await apply(rig, servos, on_anomaly="continue", save=True)
    assert job["state"] == "failed"
    assert "1 of 3 servos" in job["error"]["detail"]
    assert outcomes(job)[::2] == ["applied", "applied"]
    assert [one["saved"] for one in job["result"]["servos"]] == [True, False, True]
    assert [memory(rig, servo) for servo in servos] == [RAW, before, RAW]
    assert [rig.sim(servo).starts for servo in servos] == [2, 1, 2]
    assert states(job)["save 2"] == "skipped"
    report = json(await rig.call("GET", f"/jobs/{job['id']}/report"))["servos"]
    assert [(one["verdict"], one["verified_in"], one["profile"]) for one in report] == [
        ("done", "rom", "gains"), ("failed", None, "gains"), ("done", "rom", "gains")
    ]  # fmt: skip
    assert report[0]["values"]["timeout_time"] == {"value": 500, "unit": "ms"}
    assert report[1]["problem"] == job["result"]["servos"][1]["problem"]["detail"]


@scene(*THREE)
async def test_servos_are_written_and_saved_one_after_the_other_and_rom_is_verified(
    rig: Rig, servos: list[Servo]
) -> None:
    await put(rig)
    job = await apply(rig, servos, save=True)
    assert job["state"] == "succeeded", job
    assert set(states(job).values()) == {"done"}
    for servo, one in zip(servos, job["result"]["servos"], strict=True):
        assert (one["outcome"], one["saved"]) == ("applied", True)
        own = json(await rig.call("GET", f"/jobs/{one['job']}"))
        assert (own["kind"], own["uid"], own["state"]) == ("save", servo.uid, "succeeded")
        assert rig.sim(servo).starts == 2
        assert {key: rig.sim(servo).memory.stored(address) for key, address in ADDRESSES.items()} == RAW
        assert servo.unsaved() == []
    steps = [step for step in job["steps"] if step["name"].startswith(("write", "save"))]
    assert [step["uid"] for step in steps] == [servo.uid for servo in servos for _ in range(2)]
    times = [time for step in steps for time in (step["started_at"], step["ended_at"])]
    assert times == sorted(times)


@pytest.mark.parametrize(("on_anomaly", "third"), [("stop", "not_tried"), ("continue", "applied")])
@pytest.mark.parametrize(
    ("kind", "code", "outcome", "result"),
    [("clamp", "unexpected_result", "applied", 60_000), ("refuse", "refused_by_servo", "rolled_back", 1000)],
)
@scene(lambda kind: (THREE[0], replace(THREE[1], behaviour=Behaviour(out_of_range=kind)), THREE[2]))
async def test_a_servo_that_clamps_or_refuses_a_value_is_not_saved(
    rig: Rig, servos: list[Servo], on_anomaly: str, third: str, kind: str, code: str, outcome: str, result: int
) -> None:
    row = servos[1].registers["timeout_time"].parameter
    assert memory(rig, servos[1])["timeout_time"] == 1000
    servos[1].registers["timeout_time"].parameter = row.model_copy(update={"maximum": 80_000})
    await put(rig, values={"angle_p_gain": 55, "timeout_time": 60_000})
    values_for = rig.host.profiles.values_for

    def beyond_the_limit(profile: Profile, servo: Servo) -> tuple[dict[str, Value], list[LeftOut]]:
        values, skipped = values_for(profile, servo)
        return (values | {"timeout_time": 70_000} if servo is servos[1] else values), skipped

    rig.host.profiles.values_for = beyond_the_limit  # our table says 80,000, the servo disagrees
    job = await apply(rig, servos, save=True, on_anomaly=on_anomaly)
    assert (job["state"], job["error"]["code"]) == ("failed", code)
    assert outcomes(job) == ["applied", outcome, third]
    assert memory(rig, servos[1])["timeout_time"] == result
    assert rig.sim(servos[1]).starts == 1
    assert [one["saved"] for one in job["result"]["servos"]] == [True, False, third == "applied"]


@scene(*THREE)
async def test_invalid_targets_are_rejected_and_a_profile_with_an_id_is_for_one_servo(
    rig: Rig, servos: list[Servo]
) -> None:
    await put(rig, values={"servo_id": 9}, identity=True)
    uids = [servo.uid for servo in servos]
    for name, given, code, status in (
        ("gains", uids, "conflict", 409),
        ("gains", uids[:1] * 2, "invalid_value", 422),
        ("other", uids, "unknown_profile", 404),
        ("gains", ["0" * 32], "unknown_servo", 404),
    ):
        problem(await rig.call("POST", f"/profiles/{name}/apply", {"uids": given}), code, status)
    assert rig.writes() == []
    assert (await apply(rig, servos[:1]))["state"] == "succeeded"
    assert rig.sim(servos[0]).memory.get(0x45) == 9


@scene(MIXED[0])
async def test_0x36_in_a_unit_other_than_that_of_the_pwm_mode_is_rejected(rig: Rig, servo: Servo) -> None:
    stored = await put(rig, values={"pwm_output_range": 60}, units={"pwm_output_range": "rpm"})
    assert stored["units"] == {"pwm_output_range": "rpm"}
    job = await apply(rig, [servo])
    assert (job["state"], job["error"]["code"]) == ("failed", "invalid_value")
    assert "pwm_mode" in job["error"]["detail"]
    assert rig.writes() == []
    await put(rig, values={"pwm_output_range": 60, "pwm_mode": "speed"})
    assert (await apply(rig, [servo]))["state"] == "succeeded"
    assert (rig.sim(servo).memory.get(0x36), rig.sim(servo).memory.get(0x37)) == (60, 1)


@scene()
async def test_applying_needs_the_lease_and_after_stop_saves_nothing(rig: Rig, servo: Servo) -> None:
    await put(rig)
    lease = await rig.lease()
    body = {"uids": [servo.uid]}
    problem(await rig.call("POST", "/profiles/gains/apply", body), "lease_held", 409)
    job = json(await rig.call("POST", "/profiles/gains/apply?wait=true", body, lease=lease))
    assert job["state"] == "succeeded"
    (row, *_) = rig.host.audit.rows.rows(uid=servo.uid, key="angle_p_gain")
    assert (row.entry.by, row.entry.job, row.entry.outcome) == ("test", job["id"], "applied")
    json(await rig.call("DELETE", f"/leases/{lease}"))
    json(await rig.call("POST", "/stop"))
    await put(rig, values={**GAINS, "angle_p_gain": 56})
    job = await apply(rig, [servo], save=True)
    assert (job["state"], job["error"]["code"]) == ("failed", "stopped")
    assert memory(rig, servo) == {**RAW, "angle_p_gain": 56}
    assert rig.sim(servo).starts == 1


@scene(*THREE)
async def test_a_cancelled_job_completes_the_current_servo_and_reports_it(rig: Rig, servos: list[Servo]) -> None:
    before = memory(rig, servos[2])
    await put(rig)
    started = json(await rig.call("POST", "/profiles/gains/apply", {"uids": [one.uid for one in servos]}), 202)
    await until(lambda: any(node == 12 and name == "0x2C" for node, name, _ in rig.writes()), every_s=0.0002)
    job = json(await rig.call("DELETE", f"/jobs/{started['id']}"))
    assert (job["state"], outcomes(job)) == ("cancelled", ["applied", "applied", "not_tried"])
    assert [memory(rig, servo) for servo in servos] == [RAW, RAW, before]


@scene(*THREE)
async def test_an_offline_servo_is_reported_before_anything_is_written(rig: Rig, servos: list[Servo]) -> None:
    await put(rig)
    rig.bench.power(servos[2].uid, on=False)
    await asyncio.sleep(4)
    job = await apply(rig, servos)
    assert (job["state"], job["error"]["code"]) == ("failed", "no_response")
    assert outcomes(job) == ["not_tried", "not_tried", "rejected"]
    assert rig.writes() == []
