"""RAM values that a power cut took: told once, with what they were, and offered until somebody deals with them."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, Socket, json, play
from behaviour.scene import scene
from behaviour.test_drift import meddle, power
from hornbill.servo.device.servo import Servo

HERE = replace(PLAIN, uid=bytes(range(16)), rom={"speed_limit_cw": 120})
HERE_STILL = replace(HERE, rom={"speed_limit_cw": 120, "soft_start": 0})


async def stage(rig: Rig, servo: Servo, **values: object) -> None:
    """Write rows to RAM only."""
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}))


async def lost(rig: Rig, servo: Servo) -> dict[str, Any]:
    rows = json(await rig.call("GET", f"/servos/{servo.uid}"))["lost"]
    return {row["key"]: row["value"] for row in rows}


async def cut(rig: Rig) -> Servo:
    """A servo that has lost two values."""
    servo = (await rig.ready())[0]
    await stage(rig, servo, angle_p_gain=77, angle_limit_cw=45.5)
    await power(rig, servo)
    assert await lost(rig, servo) == {"angle_limit_cw": 45.5, "angle_p_gain": 77}
    return servo


@pytest.mark.parametrize("off_s", [0.2, 4.0], ids=["a dip nobody could see", "long enough to be offline"])
@scene(HERE)
async def test_what_was_only_in_ram_is_told_and_offered_when_power_fails(rig: Rig, servo: Servo, off_s: float) -> None:
    await asyncio.sleep(3)
    socket = Socket(rig.app)
    socket.say(type="subscribe", topics=["servos", "events"])
    await stage(rig, servo, angle_p_gain=77, angle_limit_cw=45.5, smoothing=False)
    await power(rig, servo, off_s=off_s)
    expected = {"smoothing": False, "angle_p_gain": 77, "angle_limit_cw": 45.5}
    assert await lost(rig, servo) == expected
    (told,) = rig.events("ram_values_lost")
    assert (told.level, told.uid) == ("warning", servo.uid)
    assert {one["key"]: one["value"] for one in told.params["lost"]} == expected  # pyright: ignore[reportGeneralTypeIssues, reportUnknownVariableType]
    assert "3 values that were only in RAM" in told.text
    assert "Angle limit CW 45.5°" in told.text
    last = [one["servos"][0] for one in socket.heard() if one["type"] == "servos"][-1]
    assert {one["key"]: one["value"] for one in last["lost"]} == expected
    assert all(abs(one["at"] - rig.host.base.utc_now()) < 10 for one in last["lost"])
    await power(rig, servo)
    assert len(rig.events("ram_values_lost")) == 1
    assert await lost(rig, servo) == expected
    await socket.close()


@scene(HERE)
async def test_a_row_that_soft_start_overrides_is_judged_when_that_is_over(rig: Rig, servo: Servo) -> None:
    await stage(rig, servo, speed_limit_cw=90)
    await power(rig, servo)
    assert await lost(rig, servo) == {"speed_limit_cw": 90.0}


@scene(HERE_STILL, connect=False)
async def test_rows_of_which_nobody_knows_what_rom_holds_are_offered_too(rig: Rig) -> None:
    await asyncio.sleep(20)  # it has run for long: who knows who wrote what
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    servo = (await rig.ready())[0]
    assert servo.registers["angle_p_gain"].rom is None
    await stage(rig, servo, angle_p_gain=77)
    await power(rig, servo)
    assert await lost(rig, servo) == {"angle_p_gain": 77}


@scene(HERE)
async def test_a_value_leaves_when_ram_holds_it_again(rig: Rig) -> None:
    servo = await cut(rig)
    await stage(rig, servo, angle_p_gain=50)
    assert set(await lost(rig, servo)) == {"angle_limit_cw", "angle_p_gain"}
    await stage(rig, servo, angle_p_gain=77)
    assert set(await lost(rig, servo)) == {"angle_limit_cw"}
    await stage(rig, servo, angle_limit_cw=45.5)
    assert await lost(rig, servo) == {}
    await power(rig, servo)
    assert set(await lost(rig, servo)) == {"angle_limit_cw", "angle_p_gain"}
    assert len(rig.events("ram_values_lost")) == 2


@scene(HERE)
async def test_a_save_and_a_dismissal_end_the_offer(rig: Rig) -> None:
    servo = await cut(rig)
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    assert job["state"] == "succeeded"
    assert await lost(rig, servo) == {}
    await stage(rig, servo, angle_p_gain=88)
    await power(rig, servo)
    assert await lost(rig, servo) == {"angle_p_gain": 88}
    assert (await rig.call("DELETE", f"/servos/{servo.uid}/lost")).status_code == 204
    assert await lost(rig, servo) == {}
    (entry,) = [one for one in json(await rig.call("GET", "/audit?limit=50")) if one["action"] == "lost_values"]
    assert (entry["key"], entry["before"], entry["outcome"]) == ("angle_p_gain", 88, "dismissed")
    await power(rig, servo)
    assert await lost(rig, servo) == {}


@scene(HERE)
async def test_nothing_is_lost_by_a_restart_that_was_asked_for_a_save_or_another_tools_save(
    rig: Rig, servo: Servo
) -> None:
    await stage(rig, servo, angle_p_gain=77)
    json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    assert servo.raw("angle_p_gain") != 77
    await stage(rig, servo, angle_p_gain=66)
    json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    await stage(rig, servo, angle_p_gain=55)
    json(await rig.call("POST", f"/servos/{servo.uid}/factory-reset?wait=true"))
    await asyncio.sleep(3)
    await meddle(rig, servo, angle_p_gain=44)
    assert await lost(rig, servo) == {}
    assert rig.events("ram_values_lost") == []
    await stage(rig, servo, angle_p_gain=33)
    await power(rig, servo)
    assert await lost(rig, servo) == {"angle_p_gain": 33}


@scene(HERE)
async def test_torque_that_a_stop_took_is_no_value_that_was_lost(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(1)
    json(await rig.call("DELETE", "/stop"))
    assert servo.raw("torque_mode") == 1
    await power(rig, servo)
    assert servo.raw("torque_mode") == 0
    assert await lost(rig, servo) == {}


def test_the_offer_outlives_the_server(tmp_path: Path) -> None:
    async def first(rig: Rig) -> None:
        await cut(rig)

    async def later(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        assert await lost(rig, servo) == {"angle_limit_cw": 45.5, "angle_p_gain": 77}

    place = f"sqlite:///{tmp_path / 'hornbill.sqlite3'}"
    play(first, HERE, store=place)
    play(later, HERE, store=place)


@scene(HERE)
async def test_a_servo_that_is_forgotten_is_offered_nothing(rig: Rig) -> None:
    servo = await cut(rig)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(5)
    assert (await rig.call("DELETE", f"/inventory/{servo.uid}")).status_code == 204
    rig.bench.power(servo.uid, True)
    await rig.ready()
    assert await lost(rig, servo) == {}
