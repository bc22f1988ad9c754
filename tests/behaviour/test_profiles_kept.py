"""Profiles: kept, refused, taken from a servo, and exported to and imported from files."""

from typing import Any

import pytest

from behaviour.bag import GAINS, MIXED, put, send
from behaviour.rig import CATALOG, Rig, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo


@scene()
async def test_a_profile_is_kept_replaced_listed_and_forgotten_and_each_is_in_the_audit(rig: Rig) -> None:
    first = await rig.call("PUT", "/profiles/Left%20hand", {"values": {"timeout_time": 500}, "description": "d"})
    kept = json(first, 201)
    assert (kept["values"], kept["units"]) == ({"timeout_time": 500}, {"timeout_time": "ms"})
    assert kept["schema_revision"] == CATALOG.revision
    again = json(await rig.call("PUT", "/profiles/Left%20hand", {"values": {"timeout_time": 600}}))
    assert again["created_at"] == kept["created_at"]
    assert [one["name"] for one in json(await rig.call("GET", "/profiles"))] == ["Left hand"]
    assert json(await rig.call("GET", "/profiles/Left%20hand"))["values"] == {"timeout_time": 600}
    assert (await rig.call("DELETE", "/profiles/Left%20hand")).status_code == 204
    problem(await rig.call("GET", "/profiles/Left%20hand"), "unknown_profile", 404)
    rows = [one.entry for one in rig.host.audit.rows.rows(action="profile")]
    assert [(one.before, one.after) for one in reversed(rows)] == [
        (None, {"timeout_time": 500}), ({"timeout_time": 500}, {"timeout_time": 600}),
        ({"timeout_time": 600}, None),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("values", "code", "status"),
    [
        ({"boot_loader": 1}, "forbidden_parameter", 403),
        ({"0x49": 1}, "forbidden_parameter", 403),
        ({"73": 1}, "forbidden_parameter", 403),
        ({"write_rom": 1}, "forbidden_parameter", 403),
        ({"command_angle": 1}, "invalid_value", 422),
        ({"servo_id": 1}, "invalid_value", 422),
        ({"current_voltage": 1}, "read_only", 409),
        ({"timeout_tme": 1}, "unknown_parameter", 404),
        ({"timeout_time": 99_999}, "out_of_range", 422),
        ({"timeout_time": True}, "invalid_value", 422),
    ],
)
@scene(connect=False)
async def test_a_profile_that_could_not_be_applied_is_not_kept(
    rig: Rig, values: dict[str, Any], code: str, status: int
) -> None:
    refused = problem(await rig.call("PUT", "/profiles/bad", {"values": {"smoothing": True, **values}}), code, status)
    assert refused["key"] in values
    assert json(await rig.call("GET", "/profiles")) == []


@scene(MIXED[0])
async def test_a_profile_taken_from_a_servo_leaves_out_identity_and_torque_unless_they_are_named(
    rig: Rig, servo: Servo
) -> None:
    kept = await put(rig, from_uid=servo.uid)
    rows = {key for key, one in servo.registers.items() if one.parameter.rom}
    assert set(kept["values"]) == rows - {"torque_mode", "origin", "servo_id", "node_id"}
    assert len(kept["values"]) == 30
    assert (kept["model"], kept["firmware"]) == ("BLA21-06U-AB", "1.300")
    assert kept["units"]["pwm_output_range"] == "°"
    named = await put(rig, from_uid=servo.uid, keys=["torque_mode", "smoothing"])
    assert set(named["values"]) == {"torque_mode", "smoothing"}
    body = {"from_uid": servo.uid, "keys": ["servo_id"]}
    assert "identity" in problem(await rig.call("PUT", "/profiles/x", body), "invalid_value", 422)["detail"]
    whole = await put(rig, from_uid=servo.uid, identity=True)
    assert whole["values"]["servo_id"] == 1


@scene(MIXED[0])
async def test_a_file_that_is_exported_can_be_imported_and_a_bad_line_keeps_the_old_profile(
    rig: Rig, servo: Servo
) -> None:
    kept = await put(rig, from_uid=servo.uid)
    for form in ("toml", "json"):
        file = await rig.call("GET", f"/profiles/gains/file?format={form}")
        assert file.headers["content-type"] == f"application/{form}"
        assert file.headers["content-disposition"].startswith(f'attachment; filename="gains.{form}"')
        answer = json(await send(rig, "copy", file.text, form), 201 if form == "toml" else 200)
        assert answer["profile"]["values"] == kept["values"]
        assert {line["verdict"] for line in answer["lines"]} == {"ok"}
        spoilt = file.text.replace("timeout_time", "timeout_tme", 1)
        refused = problem(await send(rig, "copy", spoilt, form), "invalid_value", 422)
        wrong = [line for line in refused["lines"] if line["verdict"] != "ok"]
        assert ("timeout_tme", "unknown") in [(line["key"], line["verdict"]) for line in wrong]
        assert "timeout_tme" in spoilt.split("\n")[wrong[0]["line"] - 1]
        assert json(await rig.call("GET", "/profiles/copy"))["values"] == kept["values"]


@scene(connect=False)
async def test_a_file_name_can_never_leave_its_quotation_marks(rig: Rig) -> None:
    await put(rig, "a%22%3B%20x%3Db")
    header = (await rig.call("GET", "/profiles/a%22%3B%20x%3Db/file")).headers["content-disposition"]
    assert header == "attachment; filename=\"a_x_b.toml\"; filename*=UTF-8''a%22%3B%20x%3Db.toml"
    problem(await rig.call("PUT", "/profiles/a%0Ab", {"values": GAINS}), "invalid_value", 422)


@scene(connect=False)
async def test_a_file_too_large_of_another_kind_or_no_text_is_refused(rig: Rig) -> None:
    large = problem(await send(rig, "x", "#" * 300_000, "toml"), "invalid_value", 422)
    assert "256 kB" in large["detail"]
    problem(await send(rig, "x", "smoothing,true", "csv"), "invalid_value", 422)
    headers = {"Content-Type": "application/toml"}
    bad = await rig.http.put("/profiles/x/file", content=b"[values]\n\xff = 1", headers=headers)
    assert "Line 2" in problem(bad, "invalid_value", 422)["detail"]
