"""Changes of `in_effect` reach every open page immediately."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.actions import torque, write
from behaviour.restarting import run, succeeded
from behaviour.rig import PLAIN, Rig, Socket, json, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo

ON = replace(PLAIN, rom={"speed_torque_control": 1, "soft_start": 0})
Effects = dict[str, tuple[bool | None, str | None]]


class Page:
    """A page that shows what the socket reports."""

    def __init__(self, rig: Rig) -> None:
        self.socket = Socket(rig.app)
        self.socket.send(type="subscribe", topics=["servos"])
        self.shown: Effects = {}

    def update(self) -> Effects:
        """What it received since the last call."""
        news: Effects = {}
        for message in self.socket.received():
            if message["type"] == "parameter":
                one = message["reading"]
                news[one["key"]] = (one["in_effect"], one["why_not"])
        self.shown |= news
        return news


async def pages(rig: Rig) -> tuple[Servo, list[Page]]:
    servo = (await rig.ready())[0]
    both = [Page(rig), Page(rig)]
    await asyncio.sleep(1)
    for page in both:
        page.update()
    return servo, both


def without_effect(news: Effects) -> set[str]:
    return {key for key, (in_effect, _) in news.items() if in_effect is False}


async def truth(rig: Rig, servo: Servo) -> Effects:
    shown: dict[str, Any] = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    return {key: (one["in_effect"], one["why_not"]) for key, one in shown.items()}


@scene(ON)
async def test_0x25_off_and_on_updates_every_page(rig: Rig) -> None:
    servo, both = await pages(rig)
    before = await truth(rig, servo)
    await write(rig, servo, speed_torque_control=False)
    await asyncio.sleep(0.1)
    after = await truth(rig, servo)
    changed = {key for key in after if after[key] != before[key]}
    assert {"speed_limit_cw", "torque_limit_ccw", "angle_d_gain", "command_speed"} <= changed
    for page in both:
        news = page.update()
        assert {key: news[key] for key in changed} == {key: after[key] for key in changed}
        assert set(news) <= changed | {"speed_torque_control"}, "unchanged rows are not reported"
    await write(rig, servo, speed_torque_control=True)
    await asyncio.sleep(0.1)
    for page in both:
        news = page.update()
        assert {key: news[key] for key in changed} == {key: before[key] for key in changed}


@pytest.mark.parametrize(
    ("condition", "value", "word"),
    [("temperature_c", 110.0, "temperature (0x0B)"), ("voltage_v", 12.5, "voltage (0x0C)")],
)
@scene(ON)
async def test_protection_suspends_commands_gains_and_limits(rig: Rig, condition: str, value: float, word: str) -> None:
    servo, both = await pages(rig)
    conditions = rig.sim(servo).conditions
    normal = getattr(conditions, condition)
    setattr(conditions, condition, value)
    await asyncio.sleep(3)
    now = await truth(rig, servo)
    for page in both:
        news = page.update()
        assert {"command_angle", "angle_p_gain", "speed_limit_cw", "torque_limit_cw"} <= without_effect(news)
        assert word in (news["command_angle"][1] or "")
        assert "temperature_limit_upper" not in without_effect(news)
        assert page.shown == {key: now[key] for key in page.shown}
    setattr(conditions, condition, normal)
    await asyncio.sleep(3)
    assert [page.update()["speed_limit_cw"] for page in both] == [(True, None)] * 2


@scene(replace(ON, rom={"speed_torque_control": 1}, angle_deg=150.0))
async def test_soft_start_overrides_its_rows_until_it_ends(rig: Rig) -> None:
    await until(lambda: any(one.soft_starting for one in rig.host.fleet.all()), every_s=0.05)
    (servo,) = rig.host.fleet.all()
    both = [Page(rig), Page(rig)]
    await asyncio.sleep(0.2)
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    for key in servo.soft_start_rows:
        assert shown[key]["in_effect"] is False
        assert "soft start (0x21)" in shown[key]["why_not"]
        assert shown[key]["unsaved"] is shown[key]["differs_from_default"] is None
    soft_start_rows = servo.soft_start_rows
    for page in both:
        page.update()
    assert servo.soft_starting
    await rig.ready()
    await asyncio.sleep(0.3)
    for page in both:
        news = page.update()
        assert set(news) >= soft_start_rows.keys()
        assert {news[key] for key in soft_start_rows} == {(True, None)}


@scene(ON)
async def test_torque_off_suspends_gains_and_a_new_node_id_takes_effect_after_a_save(rig: Rig) -> None:
    servo, (page, other) = await pages(rig)
    await torque(rig, servo, "off")
    await asyncio.sleep(0.1)
    news = page.update()
    assert {"command_angle", "angle_p_gain", "angle_limit_cw", "torque_limit_cw"} <= without_effect(news)
    assert news["angle_p_gain"][1] == "No effect now: torque (0x20) is not on, so no angle is held."
    assert other.update() == news

    await write(rig, servo, node_id=40, soft_start=True)
    await asyncio.sleep(0.1)
    news = page.update()
    for key in ("node_id", "soft_start"):
        assert news[key] == (False, "No effect now: takes effect at the next start after a save.")
    succeeded(await run(rig, servo, "save"))
    await asyncio.sleep(0.1)
    news = page.update()
    assert (news["node_id"], servo.node_id) == ((True, None), 40)
    assert other.update()["node_id"] == (True, None)


@scene(ON)
async def test_offline_and_software_update_are_given_as_reasons(rig: Rig) -> None:
    servo, (page, other) = await pages(rig)
    rig.sim(servo).conditions.software_update = True
    await asyncio.sleep(2)
    news = page.update()
    assert news["angle_p_gain"] == (False, "No effect now: the servo's software is being replaced.")
    assert "current_angle" not in news
    rig.sim(servo).conditions.software_update = False
    await asyncio.sleep(2)
    assert page.update()["angle_p_gain"] == (True, None)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(5)
    assert page.update()["angle_p_gain"] == (None, "Effect unknown: the servo is offline.")
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(10)
    for each in (page, other):
        each.update()
        assert each.shown["angle_p_gain"] == (True, None)

    await write(rig, servo, angle_p_gain=41)
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    shown = {key: (one["differs_from_default"], one["unsaved"]) for key, one in shown.items()}
    assert shown["angle_p_gain"] == (True, True)
    assert shown["speed_torque_control"] == (True, False)
    assert shown["angle_d_gain"] == (False, False)
    assert shown["current_angle"] == shown["command_angle"] == (None, None)
    servo.registers["angle_d_gain"].rom = None
    again = json(await rig.call("GET", f"/servos/{servo.uid}/parameters/angle_d_gain"))
    assert (again["differs_from_default"], again["unsaved"]) == (False, None)


@scene(replace(ON, rom_sound=False))
async def test_lost_configuration_and_failures_suspend_commands(rig: Rig) -> None:
    servo, (page, other) = await pages(rig)
    assert "could not be loaded (0x1A)" in ((await truth(rig, servo))["command_angle"][1] or "")
    key = next(bit.key for bit in rig.host.catalog.faults if bit.parameter == "fault_failure" and bit.bit == 0)
    rig.sim(servo).faults.inject(key, True)
    await asyncio.sleep(3)
    news = page.update()
    assert "failure (0x1B)" in (news["torque_limit_cw"][1] or "")
    assert other.update()["torque_limit_cw"] == news["torque_limit_cw"]
