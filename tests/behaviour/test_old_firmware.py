"""Advice on a firmware that lacks rows: it names nothing that this servo has not (section 5)."""

import pytest

from behaviour.rig import PLAIN, Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe

OLD = Recipe("BLA21-06U-A0", "1.010", servo_id=1, node_id=11)


@pytest.mark.states("B75")
@pytest.mark.parametrize("kind", ["speed", "torque"])
@scene(OLD)
async def test_no_way_to_command_a_speed_or_torque_advises_to_switch_on_what_is_not_there(
    rig: Rig, servo: Servo, kind: str
) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    body = {"type": kind, "value": 20}
    answers = [
        await rig.call("POST", f"{path}/command", body, lease=lease),
        await rig.call("POST", f"{path}/command", body | {"hold": {"for_s": 0.3}}, lease=lease),
        await rig.call("POST", "/commands", {"commands": [{"uid": servo.uid, **body}]}, lease=lease),
        await rig.call("POST", "/streams", {"uids": [servo.uid], "type": kind, "rate_hz": 10}, lease=lease),
        await rig.call("PUT", f"{path}/parameters/command_{kind}", {"value": 20}, lease=lease),
        await rig.call("GET", f"{path}/cautions?type={kind}&value=20"),
    ]
    for answer in answers:
        found = problem(answer, "not_in_this_model", 409)
        assert found["key"] == "speed_torque_control"
        assert "firmware 1.010 has no speed and torque control (0x25). It was added in 1.100." in found["detail"]
        assert "PUT" not in found["detail"]
    socket = Socket(rig.app)
    await socket.receive("hello")
    socket.send(type="command", lease=lease, commands=[{"uid": servo.uid, **body}])
    assert (await socket.receive("error"))["code"] == "not_in_this_model"
    await socket.close()
    assert {name for _, name, _ in rig.writes()} == set()


@scene(PLAIN)
async def test_the_row_that_is_advised_on_a_newer_firmware_can_be_written(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    body = {"type": "speed", "value": 20}
    refused = problem(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease), "mode_off", 409)
    advised = str(refused["detail"]).rpartition("PUT /api/v1")[2].rstrip(".")
    json(await rig.call("PUT", advised, {"value": True}, lease=lease))
    json(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))
