"""Error codes, each caused by a request; none of the requests changes anything."""

import asyncio

from behaviour.actions import move
from behaviour.rig import Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.wire.messages import NodeStatus

NONE = "0" * 32


UNKNOWN = f"/servos/{NONE}"
ANGLE = {"type": "angle", "value": 1}
READ_ONLY = ("current_angle", "model_number", "firmware_version", "fault_overview", "production_year")
OPCODES = ("initialize", "reboot", "write_rom")
REJECTED: list[tuple[str, str, object, str, int]] = [
    ("GET", UNKNOWN, None, "unknown_servo", 404),
    ("PATCH", UNKNOWN, {"label": "x"}, "unknown_servo", 404),
    ("GET", f"{UNKNOWN}/parameters", None, "unknown_servo", 404),
    ("POST", f"{UNKNOWN}/save", ANGLE, "unknown_servo", 404),
    ("POST", f"{UNKNOWN}/command", ANGLE, "unknown_servo", 404),
    ("PATCH", "S/parameters", {"values": {"nonsense": 1}}, "unknown_parameter", 404),
    *(
        ("PUT", f"S/parameters/{key}", {"value": 1}, "unknown_parameter", 404)
        for key in ("initialize", "reboot", "write_rom")
    ),
    ("PUT", "S/parameters/pwm_neutral", {"value": 1500}, "not_in_this_model", 409),
    *(("PUT", f"S/parameters/{key}", {"value": 1}, "read_only", 409) for key in READ_ONLY),
    *(("PATCH", "S/parameters", {"values": {key: 1}}, "read_only", 409) for key in READ_ONLY),
    ("PUT", "S/telemetry", {"channels": ["nothing"], "rate_hz": 5}, "unknown_parameter", 404),
    ("PUT", "S/telemetry", {"channels": ["torque_mode"], "rate_hz": 5}, "invalid_value", 422),
    ("PUT", "S/telemetry", {"channels": ["pwm_range"], "rate_hz": 5}, "not_in_this_model", 409),
    ("PUT", "S/telemetry", {"channels": ["current_angle"], "rate_hz": 0}, "invalid_value", 422),
    *((verb, "/jobs/none", None, "unknown_job", 404) for verb in ("GET", "DELETE")),
    *((verb, "/leases/none", None, "unknown_lease", 404) for verb in ("PUT", "DELETE")),
    ("GET", "/nothing", None, "not_found", 404),
]
"""Verb, path (S for a servo), body, code, status."""


@scene()
async def test_rejected_requests(rig: Rig, servo: Servo) -> None:
    for verb, path, body, code, status in REJECTED:
        problem(await rig.call(verb, path.replace("S/", f"/servos/{servo.uid}/", 1), body), code, status)
    path = f"/servos/{servo.uid}/parameters"
    misspelt = await rig.call("GET", f"{path}/angle_limit_cv")
    assert "angle_limit_cw" in problem(misspelt, "unknown_parameter", 404)["detail"]
    mine = await rig.lease(ttl_s=30)
    found = problem(await rig.call("POST", "/leases", {"holder": "other", "ttl_s": 5}), "lease_held", 409)
    assert found["holder"] == "test"
    assert 29 < found["expires_in_s"] <= 30
    body = {"values": {"angle_p_gain": 41}}
    problem(await rig.call("PATCH", path, body), "lease_held", 409)
    command = f"/servos/{servo.uid}/command"
    odd = await rig.http.request("POST", command, json=ANGLE, headers=[(b"Lease", "é".encode("latin-1"))])
    problem(odd, "lease_held", 409)
    problem(await rig.call("PUT", "/leases/é"), "unknown_lease", 404)
    page = Socket(rig.app)
    page.send(type="heartbeat", lease="é")
    assert (await page.receive("error"))["code"] == "unknown_lease"
    assert rig.writes() == []
    assert json(await rig.call("PATCH", path, body, lease=mine))["outcome"] == "applied"


OUT_OF_RANGE = [
    ("torque_limit_cw", 120, 0, 100, "%"),
    ("angle_p_gain", 0, 1, 100, ""),
    ("voltage_limit_upper", 99, 7.4, 12, "V"),
    ("timeout_time", 0, 1, 60_000, "ms"),
    ("servo_id", 255, 0, 254, ""),
]
INVALID: list[tuple[str, object]] = [
    ("angle_limit_cw", "sixty"), ("angle_limit_cw", True), ("angle_limit_cw", None), ("angle_limit_cw", [1]),
    ("angle_limit_cw", {}), ("angle_limit_cw", 12.34), ("smoothing", 1), ("smoothing", "on"), ("timeout_action", 1),
    ("timeout_action", "run"), ("angle_p_gain", 40.5), ("command_angle", 5),
]  # fmt: skip
BODIES = [b"", b"{", b"[]", b'{"value": NaN}', b'{"value": 1, "more": 2}', b'{"other": 1}', b"\xff"]


@scene()
async def test_invalid_values_and_bodies_are_rejected(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters"
    for key, value, minimum, maximum, unit in OUT_OF_RANGE:
        found = problem(await rig.call("PUT", f"{path}/{key}", {"value": value}), "out_of_range", 422)
        shown = (found["minimum"], found["maximum"], found["unit"], found["requested"])
        assert shown == (minimum, maximum, unit, value)
    problem(await rig.call("PATCH", path, {"values": {"angle_limit_cw": 1e308}}), "out_of_range", 422)
    for key, value in INVALID:
        problem(await rig.call("PATCH", path, {"values": {key: value}}), "invalid_value", 422)
    between = await rig.call("PUT", f"{path}/angle_limit_cw", {"value": 12.34})
    assert problem(between, "invalid_value", 422)["nearest"] == [12.3, 12.4]
    headers = {"Content-Type": "application/json"}
    for body in BODIES:
        problem(await rig.http.put(f"{path}/angle_limit_cw", content=body, headers=headers), "invalid_value", 422)
    headers["Lease"] = await rig.lease()
    for key in ("angle_p_gain", "torque_mode", "command_angle"):  # JSON can express these, and no register can
        for number in ("9" * 400, '"\\ud800"', "NaN", "1e400"):
            response = await rig.http.put(f"{path}/{key}", content=f'{{"value": {number}}}', headers=headers)
            assert response.status_code == 422
            assert response.json()["code"] in ("invalid_value", "out_of_range")
    assert rig.writes() == []


@scene()
async def test_refused_by_servo_and_no_response_are_different(rig: Rig, servo: Servo) -> None:
    conditions = rig.sim(servo).conditions
    path = f"/servos/{servo.uid}/parameters/angle_p_gain"
    conditions.refuse_keys.add("angle_p_gain")
    problem(await rig.call("GET", path), "refused_by_servo", 502)
    problem(await rig.call("PUT", path, {"value": 41}), "refused_by_servo", 502)
    conditions.refuse_keys.clear()
    conditions.drop_responses_pct = 100
    problem(await rig.call("GET", path), "no_response", 504)
    problem(await rig.call("PUT", path, {"value": 41}), "no_response", 504)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    assert "offline" in problem(await rig.call("PUT", path, {"value": 41}), "no_response", 504)["detail"]


@scene()
async def test_bus_disconnected(rig: Rig, servo: Servo) -> None:
    lease, path = await rig.lease(), f"/servos/{servo.uid}"
    rig.sim(servo).conditions.drop_responses_pct = 100
    waiting = asyncio.create_task(rig.call("GET", f"{path}/parameters/angle_p_gain"))
    await asyncio.sleep(0.05)
    began = asyncio.get_running_loop().time()
    assert json(await rig.call("DELETE", "/bus"))["state"] == "disconnected"
    problem(await waiting, "bus_disconnected", 503)
    assert asyncio.get_running_loop().time() - began < 0.5
    for verb, end, body in (
        ("GET", "parameters/angle_p_gain", None),
        ("PUT", "parameters/angle_p_gain", {"value": 1}),
        ("POST", "save", None),
        ("POST", "command", ANGLE),
    ):
        problem(await rig.call(verb, f"{path}/{end}", body, lease=lease), "bus_disconnected", 503)
    assert json(await rig.call("GET", path))["state"] == "offline"
    rig.sim(servo).conditions.drop_responses_pct = 0
    assert json(await rig.call("PUT", "/bus", {"address": "memory:host"}))["state"] == "active"
    await rig.ready()
    problem(await rig.call("PUT", "/bus", {"address": "memory:broken"}), "bus_open_failed", 502)
    assert json(await rig.call("GET", "/bus"))["address"] == "memory:host"
    await rig.ready()


@scene()
async def test_two_concurrent_connects_leave_one_connection(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    await move(rig, servo, lease)
    rig.sim(servo).conditions.drop_responses_pct = 100
    await asyncio.gather(
        rig.call("PUT", "/bus", {"address": "memory:other"}),
        rig.call("DELETE", "/bus"),
        rig.call("PUT", "/bus", {"address": "memory:third"}),
    )
    since = asyncio.get_running_loop().time() + 0.5
    await asyncio.sleep(3.5)
    statuses = [one for one in rig.transfers() if one.source == 127 and one.type_id == NodeStatus.TYPE.id]
    assert len([one for one in statuses if one.at > since]) == 3, "one participant sends its status, once a second"
    assert json(await rig.call("GET", "/bus"))["state"] == "active"
