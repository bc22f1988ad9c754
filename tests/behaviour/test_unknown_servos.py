"""Servos that are not in the tables: a newer firmware or hardware number, and an unknown series (4.40 to 4.43)."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from hornbill.errors import NotInThisModel
from hornbill.servo.device.requests import TORQUE
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe

NEWER = replace(PLAIN, firmware="1.900", any_firmware=True)
UNKNOWN = Recipe(
    "BLA34-12U-AB", "1.500", servo_id=4, node_id=21, rom={"soft_start": 0, "angle_p_gain": 61},
    reads={"model_number": 99, "hardware_version": 48050, "firmware_version": 3210},
)  # fmt: skip


async def shown(rig: Rig, servo: Servo) -> dict[str, Any]:
    return json(await rig.call("GET", f"/servos/{servo.uid}"))


@pytest.mark.parametrize(
    ("recipe", "model", "treated_as", "note"),
    [
        (PLAIN, "BLA21-06U-A0", (None, None), "1.400 fixes a stall at low speed"),
        (replace(PLAIN, firmware="1.400"), "BLA21-06U-A0", (None, None), "Fixes a stall"),
        (NEWER, "BLA21-06U-A0", (None, "1.400"), None),
        (replace(PLAIN, firmware="1.500", any_firmware=True), "BLA21-06U-A0", (None, "1.400"), None),
        (replace(PLAIN, reads={"hardware_version": 6090}), "BLA21-06U-AB", ("BLA21-06U-AB", None), "1.400"),
        (Recipe("BLA34-28U-AB", "1.500", node_id=11), "BLA34-28U-AB", (None, None), "BLA34"),
    ],
)
@scene(lambda recipe: recipe)
async def test_a_newer_firmware_or_hardware_is_treated_as_the_newest_known(
    rig: Rig, servo: Servo, recipe: Recipe, model: str, treated_as: tuple[str | None, str | None], note: str | None
) -> None:
    one = await shown(rig, servo)
    assert (one["known_model"], one["model"]) == (True, model)
    assert (one["treated_as"]["model"], one["treated_as"]["firmware"]) == treated_as
    if note is None:
        assert one["firmware_note"] is None
    else:
        assert note in one["firmware_note"]


@scene(replace(NEWER, reads={"hardware_version": 6020}))
async def test_a_servo_treated_as_another_can_be_written_and_moved(rig: Rig, servo: Servo, lease: str) -> None:
    path = f"/servos/{servo.uid}"
    json(await rig.call("PUT", f"{path}/parameters/angle_p_gain", {"value": 30}, lease=lease))
    json(await rig.call("POST", f"{path}/command", {"type": "angle", "value": 20, "wait": "settled"}, lease=lease))
    assert abs(rig.sim(servo).angle_deg - 20) < 1


@scene(UNKNOWN)
async def test_an_unknown_series_can_be_read_stored_and_compared(rig: Rig, servo: Servo) -> None:
    one = await shown(rig, servo)
    assert (one["known_model"], one["model"], one["series"]) == (False, None, None)
    assert (one["model_number"], one["hardware_version"], one["firmware"]) == (99, 48050, "3.210")
    path = f"/servos/{servo.uid}"
    rows = json(await rig.call("GET", f"{path}/parameters"))["parameters"]
    assert (rows["angle_p_gain"]["value"], rows["angle_p_gain"]["maximum"]) == (61, None)
    assert rows["angle_limit_cw"]["value"] == 179.9
    assert rows["pwm_range"]["value"] == 1100
    again = json(await rig.call("GET", f"{path}/parameters/angle_p_gain"))
    assert again["value"] == 61
    rig.sim(servo).memory.put(0x2C, 60)
    first = json(await rig.call("POST", f"{path}/snapshots", {"reason": "as found"}), 201)
    assert first["values"]["angle_p_gain"] == 60
    rig.sim(servo).memory.put(0x2C, 70)
    second = json(await rig.call("POST", f"{path}/snapshots", {"reason": "later"}), 201)
    compared = json(await rig.call("GET", f"/compare?left=snapshot:{first['id']}&right=snapshot:{second['id']}"))
    assert [row["key"] for row in compared["differences"]] == ["angle_p_gain"]
    stored = json(await rig.call("GET", f"/inventory/{servo.uid}"))
    assert stored["rom"]["angle_p_gain"] == 61
    assert rig.writes() == []


WRITES: tuple[tuple[str, str, object], ...] = (
    ("PUT", "/parameters/angle_p_gain", {"value": 30}),
    ("PATCH", "/parameters", {"values": {"angle_p_gain": 30}}),
    ("PATCH", "/parameters", {"values": {"angle_p_gain": 30}, "dry_run": True}),
    ("POST", "/command", {"type": "angle", "value": 5}),
    ("GET", "/cautions?type=angle&value=5", None),
    ("POST", "/torque", {"mode": "on"}),
    ("POST", "/identify", None),
    ("POST", "/save", None),
    ("POST", "/restart", None),
    ("POST", "/factory-reset", {}),
    ("GET", "/factory-reset", None),
)


@scene(UNKNOWN)
async def test_an_unknown_series_cannot_be_written_or_moved(rig: Rig, servo: Servo, lease: str) -> None:
    for verb, path, body in WRITES:
        response = await rig.call(verb, f"/servos/{servo.uid}{path}", body, lease=lease)
        found = problem(response, "not_in_this_model", 409)
        assert found["series_number"] == 99, path
        assert "is of series 99 (0x50)" in found["detail"], path
        assert "reading, snapshots and comparison are possible" in found["detail"], path
    command = {"uid": servo.uid, "type": "angle", "value": 5}
    stream = {"uids": [servo.uid], "type": "angle", "rate_hz": 10}
    for path, body in (("/commands", {"commands": [command]}), ("/streams", stream)):
        problem(await rig.call("POST", path, body, lease=lease), "not_in_this_model", 409)
    await asyncio.sleep(1)
    assert (rig.writes(), rig.array_commands()) == ([], [])
    assert rig.sim(servo).starts == 1


@scene(replace(UNKNOWN, rom={"soft_start": 0, "timeout_action": 0}))
async def test_torque_off_and_stop_work_on_an_unknown_series(rig: Rig, servo: Servo) -> None:
    assert rig.sim(servo).output == 0
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "brake"}))
    assert rig.sim(servo).output == 2
    json(await rig.call("POST", "/stop", {"mode": "off"}))
    await asyncio.sleep(0.2)
    assert rig.sim(servo).output == 1


@scene(UNKNOWN)
async def test_requests_pass_only_torque_off_and_brake_to_an_unknown_series(rig: Rig, servo: Servo) -> None:
    rows, requests = servo.catalog.by_key, rig.host.requests
    for key, raw in (("torque_mode", 0), ("angle_p_gain", 30), ("command_angle", 0), ("write_rom", 1)):
        with pytest.raises(NotInThisModel):
            await requests.write(servo, rows[key], raw, TORQUE)
    with pytest.raises(NotInThisModel):
        await requests.opcode(servo, 0)
    with pytest.raises(NotInThisModel):
        await requests.restart(servo, 1)
    assert rig.writes() == []
    assert await requests.write(servo, rows["torque_mode"], 1, TORQUE) == 1
