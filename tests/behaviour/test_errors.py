"""Each code of the contract's error table, produced by the request that deserves it; nothing changes by any of them."""

import asyncio

import pytest

from behaviour.rig import Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.messages import NodeStatus

NOBODY = "0" * 32


@scene()
async def test_unknown_servo(rig: Rig) -> None:
    for verb, path in (("GET", ""), ("PATCH", ""), ("GET", "/parameters"), ("POST", "/save"), ("POST", "/command")):
        body = {"label": "x"} if verb == "PATCH" else {"type": "angle", "value": 1}
        answer = await rig.call(verb, f"/servos/{NOBODY}{path}", None if verb == "GET" else body)
        problem(answer, "unknown_servo", 404)


@scene()
async def test_unknown_parameter_names_the_nearest_one(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/parameters"
    assert (
        "angle_limit_cw" in problem(await rig.call("GET", path + "/angle_limit_cv"), "unknown_parameter", 404)["detail"]
    )
    problem(await rig.call("PATCH", path, {"values": {"nonsense": 1}}), "unknown_parameter", 404)
    for action in ("initialize", "reboot", "write_rom"):
        problem(await rig.call("PUT", f"{path}/{action}", {"value": 1}), "unknown_parameter", 404)
    assert rig.writes() == []


@scene()
async def test_not_in_this_model(rig: Rig, servo: Servo) -> None:
    answer = await rig.call("PUT", f"/servos/{servo.uid}/parameters/pwm_neutral", {"value": 1500})
    problem(answer, "not_in_this_model", 409)


@pytest.mark.parametrize(
    "key", ["current_angle", "model_number", "firmware_version", "fault_overview", "production_year"]
)
@scene()
async def test_read_only(rig: Rig, servo: Servo, key: str) -> None:
    problem(await rig.call("PUT", f"/servos/{servo.uid}/parameters/{key}", {"value": 1}), "read_only", 409)
    problem(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {key: 1}}), "read_only", 409)
    assert rig.writes() == []


@pytest.mark.parametrize(
    ("key", "value", "minimum", "maximum", "unit"),
    [
        ("torque_limit_cw", 120, 0, 100, "%"),
        ("angle_p_gain", 0, 1, 100, ""),
        ("voltage_limit_upper", 99, 7.4, 12, "V"),
        ("timeout_time", 0, 1, 60_000, "ms"),
        ("servo_id", 255, 0, 254, ""),
    ],
)
@scene()
async def test_out_of_range(
    rig: Rig, servo: Servo, key: str, value: float, minimum: float, maximum: float, unit: str
) -> None:
    answer = await rig.call("PUT", f"/servos/{servo.uid}/parameters/{key}", {"value": value})
    found = problem(answer, "out_of_range", 422)
    shown = (found["minimum"], found["maximum"], found["unit"], found["requested"])
    assert shown == (minimum, maximum, unit, value)
    assert rig.writes() == []


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("angle_limit_cw", "sixty"), ("angle_limit_cw", True), ("angle_limit_cw", None), ("angle_limit_cw", [1]),
        ("angle_limit_cw", 12.34), ("smoothing", 1), ("smoothing", "on"), ("timeout_action", 1),
        ("timeout_action", "run"),
        ("angle_p_gain", 40.5), ("command_angle", 5), ("angle_limit_cw", 1e308), ("angle_limit_cw", {}),
    ],
)  # fmt: skip
@scene()
async def test_invalid_value(rig: Rig, servo: Servo, key: str, value: object) -> None:
    answer = await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {key: value}})
    expected = "out_of_range" if value == 1e308 else "invalid_value"
    problem(answer, expected, 422)
    assert rig.writes() == []


@scene()
async def test_a_value_between_two_steps_names_the_nearest_legal_ones(rig: Rig, servo: Servo) -> None:
    answer = await rig.call("PUT", f"/servos/{servo.uid}/parameters/angle_limit_cw", {"value": 12.34})
    assert problem(answer, "invalid_value", 422)["nearest"] == [12.3, 12.4]


@pytest.mark.parametrize(
    "body", [b"", b"{", b"[]", b'{"value": NaN}', b'{"value": 1, "more": 2}', b'{"other": 1}', b"\xff"]
)
@scene()
async def test_a_body_that_is_no_body(rig: Rig, servo: Servo, body: bytes) -> None:
    path = f"/servos/{servo.uid}/parameters/angle_limit_cw"
    answer = await rig.http.put(path, content=body, headers={"Content-Type": "application/json"})
    problem(answer, "invalid_value", 422)
    assert rig.writes() == []


@scene()
async def test_refused_by_servo_and_no_answer_are_different(rig: Rig, servo: Servo) -> None:
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
    assert json(await rig.call("DELETE", "/bus"))["state"] == "disconnected"
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    problem(await rig.call("GET", path + "/parameters/angle_p_gain"), "bus_disconnected", 503)
    problem(await rig.call("PUT", path + "/parameters/angle_p_gain", {"value": 1}), "bus_disconnected", 503)
    problem(await rig.call("POST", path + "/save"), "bus_disconnected", 503)
    command = {"type": "angle", "value": 1}
    problem(await rig.call("POST", path + "/command", command, lease=lease), "bus_disconnected", 503)
    assert json(await rig.call("GET", path))["state"] == "offline"
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await rig.ready()


@scene()
async def test_a_request_that_waits_when_the_bus_goes_is_told_so(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.drop_responses_pct = 100
    waiting = asyncio.create_task(rig.call("GET", f"/servos/{servo.uid}/parameters/angle_p_gain"))
    await asyncio.sleep(0.05)
    began = asyncio.get_running_loop().time()
    await rig.call("DELETE", "/bus")
    problem(await waiting, "bus_disconnected", 503)
    assert asyncio.get_running_loop().time() - began < 0.5


@scene()
async def test_lease_held_names_the_holder(rig: Rig, servo: Servo) -> None:
    mine = await rig.lease(ttl_s=30)
    found = problem(await rig.call("POST", "/leases", {"holder": "other", "ttl_s": 5}), "lease_held", 409)
    assert found["holder"] == "test"
    assert 29 < found["expires_in_s"] <= 30
    body = {"values": {"angle_p_gain": 41}}
    path = f"/servos/{servo.uid}/parameters"
    problem(await rig.call("PATCH", path, body), "lease_held", 409)
    assert json(await rig.call("PATCH", path, body, lease=mine))["outcome"] == "applied"


@scene()
async def test_unknown_jobs_leases_and_paths(rig: Rig) -> None:
    problem(await rig.call("GET", "/jobs/none"), "unknown_job", 404)
    problem(await rig.call("DELETE", "/jobs/none"), "unknown_job", 404)
    problem(await rig.call("PUT", "/leases/none"), "unknown_lease", 404)
    problem(await rig.call("DELETE", "/leases/none"), "unknown_lease", 404)
    problem(await rig.call("GET", "/nothing"), "not_found", 404)


@scene(Recipe("BLA21-06U-A0", "1.010", node_id=30))
async def test_telemetry_of_what_is_no_channel(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/telemetry"
    problem(await rig.call("PUT", path, {"channels": ["nothing"], "rate_hz": 5}), "unknown_parameter", 404)
    problem(await rig.call("PUT", path, {"channels": ["torque_mode"], "rate_hz": 5}), "invalid_value", 422)
    problem(await rig.call("PUT", path, {"channels": ["pwm_range"], "rate_hz": 5}), "not_in_this_model", 409)
    problem(await rig.call("PUT", path, {"channels": ["current_angle"], "rate_hz": 0}), "invalid_value", 422)


@scene()
async def test_connecting_again_to_the_same_adapter_opens_it_anew_and_a_broken_one_leaves_the_bus_as_it_was(
    rig: Rig,
) -> None:
    await rig.ready()
    assert json(await rig.call("PUT", "/bus", {"address": "memory:host"}))["state"] == "active"
    await rig.ready()
    problem(await rig.call("PUT", "/bus", {"address": "memory:broken"}), "bus_open_failed", 502)
    assert json(await rig.call("GET", "/bus"))["address"] == "memory:host"
    await rig.ready()


@scene()
async def test_two_who_connect_at_once_leave_one_connection(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 5}, lease=lease))
    rig.sim(servo).conditions.drop_responses_pct = 100
    await asyncio.gather(
        rig.call("PUT", "/bus", {"address": "memory:other"}),
        rig.call("DELETE", "/bus"),
        rig.call("PUT", "/bus", {"address": "memory:third"}),
    )
    since = asyncio.get_running_loop().time() + 0.5
    await asyncio.sleep(3.5)
    said = [one for one in rig.transfers() if one.source == 127 and one.type_id == NodeStatus.TYPE.id]
    assert len([one for one in said if one.at > since]) == 3, "one participant speaks, once a second"
    assert json(await rig.call("GET", "/bus"))["state"] == "active"


@scene()
async def test_a_lease_id_that_is_none_is_answered_and_the_socket_lives(rig: Rig, servo: Servo) -> None:
    await rig.lease()
    path, body = f"/servos/{servo.uid}/command", {"type": "angle", "value": 1}
    answer = await rig.http.request("POST", path, json=body, headers=[(b"Lease", "é".encode("latin-1"))])
    problem(answer, "lease_held", 409)
    problem(await rig.call("PUT", "/leases/é"), "unknown_lease", 404)
    page = Socket(rig.app)
    page.say(type="heartbeat", lease="é")
    assert (await page.hear("error"))["code"] == "unknown_lease"
    await page.close()


@pytest.mark.parametrize("value", ["9" * 400, '"\\ud800"', "NaN", "1e400"])
@pytest.mark.parametrize("key", ["angle_p_gain", "torque_mode", "command_angle"])
@scene()
async def test_values_that_json_can_write_and_nothing_can_hold(rig: Rig, servo: Servo, key: str, value: str) -> None:
    lease = await rig.lease()
    headers = {"Content-Type": "application/json", "Lease": lease}
    body = f'{{"value": {value}}}'
    answer = await rig.http.request("PUT", f"/servos/{servo.uid}/parameters/{key}", content=body, headers=headers)
    assert answer.status_code == 422
    assert answer.json()["code"] in ("invalid_value", "out_of_range")
    assert rig.writes() == []
