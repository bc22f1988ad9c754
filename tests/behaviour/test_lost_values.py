"""RAM values lost in a power cut: reported once, with the values, and offered until restored or dismissed."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.actions import write
from behaviour.restarting import run, succeeded
from behaviour.rig import PLAIN, Rig, Socket, json, play
from behaviour.scene import scene
from behaviour.test_drift import meddle, power
from hornbill.servo.device.servo import Servo

HERE = replace(PLAIN, uid=bytes(range(16)), rom={"speed_limit_cw": 120})
LOST: dict[str, Any] = {"angle_limit_cw": 45.5, "angle_p_gain": 77}


async def lost(rig: Rig, servo: Servo) -> dict[str, Any]:
    rows = json(await rig.call("GET", f"/servos/{servo.uid}"))["lost"]
    return {row["key"]: row["value"] for row in rows}


@pytest.mark.parametrize("off_s", [0.2, 4.0], ids=["brief", "long enough to be offline"])
@scene(HERE)
async def test_ram_values_are_reported_and_offered_after_a_power_cut(rig: Rig, servo: Servo, off_s: float) -> None:
    await asyncio.sleep(3)
    socket = Socket(rig.app)
    socket.send(type="subscribe", topics=["servos", "events"])
    expected: dict[str, Any] = {"smoothing": False, **LOST, "speed_limit_cw": 90.0}  # soft start overrides the last
    await write(rig, servo, **expected)
    await power(rig, servo, off_s=off_s)
    assert await lost(rig, servo) == expected
    (event,) = rig.events("ram_values_lost")
    assert (event.level, event.uid) == ("warning", servo.uid)
    rows: Any = event.params["lost"]
    assert {one["key"]: one["value"] for one in rows} == expected
    assert "Angle limit CW 45.5°" in event.text
    last = [one["servos"][0] for one in socket.received() if one["type"] == "servos"][-1]
    assert {one["key"]: one["value"] for one in last["lost"]} == expected
    assert all(abs(one["at"] - rig.host.base.utc_now()) < 10 for one in last["lost"])
    await power(rig, servo)
    assert len(rig.events("ram_values_lost")) == 1
    assert await lost(rig, servo) == expected
    await socket.close()


@scene(replace(HERE, rom={"speed_limit_cw": 120, "soft_start": 0}), connect=False)
async def test_rows_whose_rom_value_is_unknown_are_offered(rig: Rig) -> None:
    await asyncio.sleep(20)  # another tool may have written RAM in this time
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    servo = (await rig.ready())[0]
    assert servo.registers["angle_p_gain"].rom is None
    await write(rig, servo, angle_p_gain=77)
    await power(rig, servo)
    assert await lost(rig, servo) == {"angle_p_gain": 77}


@scene(HERE)
async def test_a_value_is_offered_until_ram_has_it_again_a_save_or_a_dismissal(rig: Rig, servo: Servo) -> None:
    await write(rig, servo, **LOST)
    await power(rig, servo)
    await write(rig, servo, angle_p_gain=50)
    assert set(await lost(rig, servo)) == {"angle_limit_cw", "angle_p_gain"}
    await write(rig, servo, angle_p_gain=77)
    assert set(await lost(rig, servo)) == {"angle_limit_cw"}
    await write(rig, servo, angle_limit_cw=45.5)
    assert await lost(rig, servo) == {}
    await power(rig, servo)
    assert await lost(rig, servo) == LOST
    assert len(rig.events("ram_values_lost")) == 2

    succeeded(await run(rig, servo, "save"))
    assert await lost(rig, servo) == {}

    await write(rig, servo, angle_p_gain=88)
    await power(rig, servo)
    assert await lost(rig, servo) == {"angle_p_gain": 88}
    assert (await rig.call("DELETE", f"/servos/{servo.uid}/lost")).status_code == 204
    assert await lost(rig, servo) == {}
    (entry,) = [one for one in json(await rig.call("GET", "/audit?limit=50")) if one["action"] == "lost_values"]
    assert (entry["key"], entry["before"], entry["outcome"]) == ("angle_p_gain", 88, "dismissed")
    await power(rig, servo)
    assert await lost(rig, servo) == {}


@scene(HERE)
async def test_nothing_is_lost_by_a_requested_restart_a_save_or_a_stop(rig: Rig, servo: Servo) -> None:
    for value, action in ((77, "restart"), (66, "save"), (55, "factory-reset")):
        await write(rig, servo, angle_p_gain=value)
        json(await rig.call("POST", f"/servos/{servo.uid}/{action}?wait=true"))
        assert action == "save" or servo.raw("angle_p_gain") != value
    await asyncio.sleep(3)
    await meddle(rig, servo, angle_p_gain=44)
    assert await lost(rig, servo) == {}
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(1)
    json(await rig.call("DELETE", "/stop"))
    assert servo.raw("torque_mode") == 1
    await power(rig, servo)
    assert servo.raw("torque_mode") == 0
    assert await lost(rig, servo) == {}
    assert rig.events("ram_values_lost") == []
    await write(rig, servo, angle_p_gain=33)
    await power(rig, servo)
    assert await lost(rig, servo) == {"angle_p_gain": 33}


def test_the_offer_is_stored_over_a_restart_of_the_server_and_removed_with_the_servo(tmp_path: Path) -> None:
    async def first(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        await write(rig, servo, **LOST)
        await power(rig, servo)

    async def later(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        assert await lost(rig, servo) == LOST
        rig.bench.power(servo.uid, False)
        await asyncio.sleep(5)
        assert (await rig.call("DELETE", f"/inventory/{servo.uid}")).status_code == 204
        rig.bench.power(servo.uid, True)
        await rig.ready()
        assert await lost(rig, servo) == {}

    store = f"sqlite:///{tmp_path / 'hornbill.sqlite3'}"
    play(first, HERE, store=store)
    play(later, HERE, store=store)
