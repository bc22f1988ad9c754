"""Whatever brings a row into effect or out of it, every open page hears of it at once, without asking."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, Socket, json
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo

ON = replace(PLAIN, rom={"speed_torque_control": 1, "soft_start": 0})
Heard = dict[str, tuple[bool | None, str | None]]


class Page:
    """A page that believes what it is told."""

    def __init__(self, rig: Rig) -> None:
        self.socket = Socket(rig.app)
        self.socket.say(type="subscribe", topics=["servos"])
        self.shown: Heard = {}
        self.messages = 0

    def listen(self) -> Heard:
        """What it was told since it last listened."""
        told: Heard = {}
        for message in self.socket.heard():
            if message["type"] == "parameter":
                one = message["reading"]
                told[one["key"]] = (one["in_effect"], one["why_not"])
                self.messages += 1
        self.shown |= told
        return told


async def pages(rig: Rig) -> tuple[Servo, list[Page]]:
    servo = (await rig.ready())[0]
    both = [Page(rig), Page(rig)]
    await asyncio.sleep(1)
    for page in both:
        page.listen()
    return servo, both


def without_effect(told: Heard) -> set[str]:
    return {key for key, (in_effect, _) in told.items() if in_effect is False}


async def truth(rig: Rig, servo: Servo) -> Heard:
    shown: dict[str, Any] = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    return {key: (one["in_effect"], one["why_not"]) for key, one in shown.items()}


async def write(rig: Rig, servo: Servo, **values: object) -> None:
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))


@scene(ON)
async def test_turning_0x25_off_and_on_reaches_two_pages_row_by_row(rig: Rig) -> None:
    servo, both = await pages(rig)
    before = await truth(rig, servo)
    await write(rig, servo, speed_torque_control=False)
    await asyncio.sleep(0.1)
    after = await truth(rig, servo)
    changed = {key for key in after if after[key] != before[key]}
    assert {"speed_limit_cw", "torque_limit_ccw", "angle_d_gain", "command_speed"} <= changed
    for page in both:
        told = page.listen()
        assert {key: told[key] for key in changed} == {key: after[key] for key in changed}
        assert set(told) <= changed | {"speed_torque_control"}, "nobody is told what did not change"
    await write(rig, servo, speed_torque_control=True)
    await asyncio.sleep(0.1)
    for page in both:
        told = page.listen()
        assert {key: told[key] for key in changed} == {key: before[key] for key in changed}
    for page in both:
        await page.socket.close()


@pytest.mark.parametrize(
    ("cause", "word"), [({"temperature_c": 110.0}, "temperature (0x0B)"), ({"voltage_v": 12.5}, "voltage (0x0C)")]
)
@scene(ON)
async def test_protection_takes_command_gains_and_limits_out_of_effect_and_gives_them_back(
    rig: Rig, cause: dict[str, float], word: str
) -> None:
    servo, both = await pages(rig)
    conditions = rig.sim(servo).conditions
    normal = {key: getattr(conditions, key) for key in cause}
    for key, value in cause.items():
        setattr(conditions, key, value)
    await asyncio.sleep(3)
    for page in both:
        told = page.listen()
        assert {"command_angle", "angle_p_gain", "speed_limit_cw", "torque_limit_cw"} <= without_effect(told)
        assert word in (told["command_angle"][1] or "")
        assert "temperature_limit_upper" not in without_effect(told)
    assert {key: both[0].shown[key] for key in both[0].shown} == {
        key: one for key, one in (await truth(rig, servo)).items() if key in both[0].shown
    }
    for key, value in normal.items():
        setattr(conditions, key, value)
    await asyncio.sleep(3)
    for page in both:
        assert page.listen()["speed_limit_cw"] == (True, None)
        await page.socket.close()


@scene(replace(ON, rom={"speed_torque_control": 1}, angle_deg=150.0))
async def test_soft_start_holds_five_rows_of_its_own_and_gives_them_back_at_its_end(rig: Rig) -> None:
    while not (found := rig.host.fleet.all()) or not found[0].soft_starting:
        await asyncio.sleep(0.05)
    servo = found[0]
    both = [Page(rig), Page(rig)]
    await asyncio.sleep(0.2)
    now = await truth(rig, servo)
    soft_start_rows = servo.soft_start_rows
    for key in soft_start_rows:
        assert now[key][0] is False
        assert "soft start (0x21)" in (now[key][1] or "")
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    assert {shown[key]["unsaved"] for key in soft_start_rows} == {None}
    assert {shown[key]["differs_from_default"] for key in soft_start_rows} == {None}
    for page in both:
        page.listen()
    assert servo.soft_starting
    await rig.ready()
    await asyncio.sleep(0.3)
    for page in both:
        told = page.listen()
        assert set(told) >= soft_start_rows.keys()
        assert {told[key] for key in soft_start_rows} == {(True, None)}
        await page.socket.close()


@scene(ON)
async def test_torque_off_leaves_gains_and_limits_without_effect(rig: Rig) -> None:
    servo, (page, other) = await pages(rig)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    await asyncio.sleep(0.1)
    told = page.listen()
    assert {"command_angle", "angle_p_gain", "angle_limit_cw", "torque_limit_cw"} <= without_effect(told)
    assert told["angle_p_gain"][1] == "No effect now: torque (0x20) is not on, so no angle is held."
    assert other.listen() == told
    await page.socket.close()
    await other.socket.close()


@scene(ON)
async def test_a_new_node_id_acts_when_it_was_saved_and_the_servo_started_again(rig: Rig) -> None:
    servo, (page, other) = await pages(rig)
    await write(rig, servo, node_id=40, soft_start=True)
    await asyncio.sleep(0.1)
    told = page.listen()
    for key in ("node_id", "soft_start"):
        assert told[key] == (False, "No effect now: takes effect at the next start after a save.")
    assert json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))["state"] == "succeeded"
    await asyncio.sleep(0.1)
    told = page.listen()
    assert (told["node_id"], servo.node_id) == ((True, None), 40)
    assert other.listen()["node_id"] == (True, None)
    await page.socket.close()
    await other.socket.close()


@scene(ON)
async def test_of_a_servo_that_went_silent_or_into_software_update_it_is_said_why(rig: Rig) -> None:
    servo, (page, other) = await pages(rig)
    rig.sim(servo).conditions.software_update = True
    await asyncio.sleep(2)
    told = page.listen()
    assert told["angle_p_gain"] == (False, "No effect now: the servo's software is being replaced.")
    assert "current_angle" not in told
    rig.sim(servo).conditions.software_update = False
    await asyncio.sleep(2)
    assert page.listen()["angle_p_gain"] == (True, None)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(5)
    assert page.listen()["angle_p_gain"] == (None, "Effect unknown: the servo is offline.")
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(10)
    for seen in (page, other):
        seen.listen()
        assert seen.shown["angle_p_gain"] == (True, None)
        await seen.socket.close()


@scene(replace(ON, rom_sound=False))
async def test_lost_configuration_and_a_failure_leave_commands_without_effect(rig: Rig) -> None:
    servo, (page, other) = await pages(rig)
    assert "could not be loaded (0x1A)" in ((await truth(rig, servo))["command_angle"][1] or "")
    key = next(bit.key for bit in rig.host.catalog.faults if bit.parameter == "fault_failure" and bit.bit == 0)
    rig.sim(servo).faults.inject(key, True)
    await asyncio.sleep(3)
    told = page.listen()
    assert "failure (0x1B)" in (told["torque_limit_cw"][1] or "")
    assert other.listen()["torque_limit_cw"] == told["torque_limit_cw"]
    await page.socket.close()
    await other.socket.close()


@scene(ON)
async def test_every_row_says_whether_it_differs_from_default_and_is_unsaved_or_that_it_is_not_known(rig: Rig) -> None:
    servo, both = await pages(rig)
    await write(rig, servo, angle_p_gain=41)
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    said = {key: (one["differs_from_default"], one["unsaved"]) for key, one in shown.items()}
    assert said["angle_p_gain"] == (True, True)
    assert said["speed_torque_control"] == (True, False)
    assert said["angle_d_gain"] == (False, False)
    assert said["current_angle"] == said["command_angle"] == (None, None)
    servo.registers["angle_d_gain"].rom = None
    again = json(await rig.call("GET", f"/servos/{servo.uid}/parameters/angle_d_gain"))
    assert (again["differs_from_default"], again["unsaved"]) == (False, None)
    for page in both:
        await page.socket.close()
