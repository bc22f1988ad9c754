"""Firmware of a servo: the version of 0x52, and advice on firmware that lacks rows (section 5)."""

from dataclasses import replace

import pytest

from behaviour.rig import PLAIN, Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid

UID = bytes(range(16))
OLD = Recipe("BLA21-06U-A0", "1.010", servo_id=1, node_id=11)


@pytest.mark.parametrize("firmware", ["1.010", "1.300", None])
@scene(lambda firmware: replace(PLAIN, firmware=firmware or "1.010", uid=UID))
async def test_the_version_is_that_of_0x52_even_if_every_newer_row_is_refused(rig: Rig, firmware: str | None) -> None:
    oldest = rig.host.catalog.firmware_steps[0]
    newer = {row.key for row in rig.host.catalog.parameters.values() if row.since != oldest}
    assert newer
    refused = rig.bench.servo(Uid(UID.hex())).conditions.refuse_keys
    refused |= newer if firmware else {"firmware_version"}
    (servo,) = await rig.ready()
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["firmware"] == firmware
    if firmware is not None:
        assert servo.model is not None
        assert set(servo.registers) == set(servo.model.rows(servo.firmware))
    if firmware == "1.300":
        refused.clear()
        lease, body = await rig.lease(), {"type": "speed", "value": 20}
        failed = problem(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease), "mode_off", 409)
        advised = str(failed["detail"]).rpartition("PUT /api/v1")[2].rstrip(".")
        json(await rig.call("PUT", advised, {"value": True}, lease=lease))
        json(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))


@pytest.mark.states("B75")
@pytest.mark.parametrize("kind", ["speed", "torque"])
@scene(OLD)
async def test_a_refused_speed_or_torque_never_advises_a_row_that_old_firmware_lacks(
    rig: Rig, servo: Servo, kind: str
) -> None:
    lease = await rig.lease()
    path, body = f"/servos/{servo.uid}", {"type": kind, "value": 20}
    for verb, target, content in (
        ("POST", f"{path}/command", body),
        ("POST", f"{path}/command", body | {"hold": {"for_s": 0.3}}),
        ("POST", "/commands", {"commands": [{"uid": servo.uid, **body}]}),
        ("POST", "/streams", {"uids": [servo.uid], "type": kind, "rate_hz": 10}),
        ("PUT", f"{path}/parameters/command_{kind}", {"value": 20}),
        ("GET", f"{path}/cautions?type={kind}&value=20", None),
    ):
        found = problem(await rig.call(verb, target, content, lease=lease), "not_in_this_model", 409)
        assert found["key"] == "speed_torque_control"
        assert "1.100" in found["detail"], "the firmware that has the row"
        assert "PUT" not in found["detail"]
    socket = Socket(rig.app)
    await socket.receive("hello")
    socket.send(type="command", lease=lease, commands=[{"uid": servo.uid, **body}])
    assert (await socket.receive("error"))["code"] == "not_in_this_model"
    await socket.close()
    assert rig.writes() == []
