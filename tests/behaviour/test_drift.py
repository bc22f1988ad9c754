"""ROM changed by another tool: reported with the difference, restored in one step, or accepted."""

import asyncio
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.actions import power_cycle, write
from behaviour.restarting import ended, run, succeeded
from behaviour.rig import PLAIN, Rig, json, play, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.units import Uid

UID = bytes(range(16))
HERE = replace(PLAIN, uid=UID, rom={"angle_limit_cw": 600, "speed_limit_cw": 200, "soft_start": 0})


async def power(rig: Rig, servo: Servo, *, off_s: float = 4.0) -> None:
    """Switch it off and on, and wait until it is ready."""
    boot_count = servo.boot_count
    await power_cycle(rig, servo.uid, off_s)
    await until(lambda: servo.boot_count != boot_count and servo.state is State.READY)
    await asyncio.sleep(1)


async def meddle(rig: Rig, servo: Servo, **rom: int) -> None:
    """Change and save rows as another tool does, unseen by the host."""
    sim = rig.sim(servo)
    for key, raw in rom.items():
        row = servo.registers[key].parameter
        sim.memory.put(row.address, raw)
    sim.memory.save(sim.behaviour)
    await power(rig, servo)


async def drift(rig: Rig, servo: Servo) -> dict[str, tuple[Any, Any]]:
    rows = json(await rig.call("GET", f"/servos/{servo.uid}/drift"))["rows"]
    shown = json(await rig.call("GET", f"/servos/{servo.uid}"))["drift"]
    assert shown == [row["key"] for row in rows]
    return {row["key"]: (row["was"], row["now"]) for row in rows}


@scene(HERE)
async def test_rom_saved_by_another_tool_is_reported_once_with_the_oldest_value(rig: Rig, servo: Servo) -> None:
    assert await drift(rig, servo) == {}
    await meddle(rig, servo, angle_limit_cw=450, servo_id=9)
    assert await drift(rig, servo) == {"angle_limit_cw": (60.0, 45.0), "servo_id": (1, 9)}
    (event,) = rig.events("drift")
    assert event.level == "warning"
    assert "Angle limit CW 60.0° → 45.0°" in event.text
    assert "Servo ID 1 → 9" in event.text
    await power(rig, servo)
    assert await drift(rig, servo) == {"angle_limit_cw": (60.0, 45.0), "servo_id": (1, 9)}
    assert len(rig.events("drift")) == 1
    await meddle(rig, servo, angle_limit_cw=300, servo_id=1)
    assert await drift(rig, servo) == {"angle_limit_cw": (60.0, 30.0)}, "a reverted change is no drift"
    assert len(rig.events("drift")) == 2
    await meddle(rig, servo, angle_limit_cw=600)
    assert await drift(rig, servo) == {}


@scene(replace(HERE, rom={"speed_limit_cw": 200, "soft_start": 1}, angle_deg=60.0))
async def test_rows_hidden_by_soft_start_are_compared_afterwards(rig: Rig, servo: Servo) -> None:
    await meddle(rig, servo, speed_limit_cw=150)
    assert await drift(rig, servo) == {"speed_limit_cw": (200, 150)}


@pytest.mark.parametrize("soft_start", [0, 1])
@scene(lambda soft_start: replace(HERE, rom={**HERE.rom, "soft_start": soft_start}))
async def test_our_own_save_is_no_drift(rig: Rig, servo: Servo, soft_start: int) -> None:
    await write(rig, servo, angle_limit_cw=30, speed_limit_cw=120, torque_limit_cw=50)
    succeeded(await run(rig, servo, "save"))
    await power(rig, servo)
    assert await drift(rig, servo) == {}
    assert rig.events("drift") == []


@scene(HERE)
async def test_restore_or_a_save_of_the_same_row_ends_drift_once_proved(rig: Rig, servo: Servo) -> None:
    await meddle(rig, servo, angle_limit_cw=450, servo_id=9, timeout_action=2)
    restored = json(await rig.call("POST", f"/servos/{servo.uid}/drift/restore"))
    assert restored["outcome"] == "applied"
    assert {change["key"] for change in restored["changes"]} == {"angle_limit_cw", "servo_id", "timeout_action"}
    assert servo.raw("servo_id") == 1
    assert set(await drift(rig, servo)) == {"angle_limit_cw", "servo_id", "timeout_action"}  # RAM alone
    restored = json(await rig.call("POST", f"/servos/{servo.uid}/drift/restore", {"save": True}))
    succeeded(await ended(rig, restored["job"]))
    assert await drift(rig, servo) == {}
    assert (rig.sim(servo).memory.stored(0x38), rig.sim(servo).memory.stored(0x45)) == (600, 1)
    await meddle(rig, servo, angle_limit_cw=450)
    await write(rig, servo, angle_p_gain=50)
    succeeded(await run(rig, servo, "save"))
    assert await drift(rig, servo) == {"angle_limit_cw": (60.0, 45.0)}
    await write(rig, servo, angle_limit_cw=20)
    succeeded(await run(rig, servo, "save"))
    assert await drift(rig, servo) == {}


@scene(HERE)
async def test_accepted_drift_is_stored_and_in_the_audit(rig: Rig, servo: Servo) -> None:
    await meddle(rig, servo, angle_limit_cw=450)
    assert (await rig.call("DELETE", f"/servos/{servo.uid}/drift", lease=await rig.lease())).status_code == 204
    assert await drift(rig, servo) == {}
    entry = rig.host.store.audit.rows(action="drift")[0].entry
    assert (entry.by, entry.outcome, entry.key, entry.before, entry.after) == (
        "test", "accepted", "angle_limit_cw", 60.0, 45.0,
    )  # fmt: skip
    await power(rig, servo)
    assert await drift(rig, servo) == {}
    assert len(rig.events("drift")) == 1


@scene(HERE)
async def test_lost_rom_is_no_drift(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).memory.rom_sound = False
    await power(rig, servo)
    assert servo.rom_lost
    assert await drift(rig, servo) == {}
    assert rig.events("drift") == []
    stored = json(await rig.call("GET", f"/inventory/{servo.uid}"))
    assert stored["rom"]["angle_limit_cw"] == 60.0  # the last configuration is not lost with it


async def first(rig: Rig) -> None:
    await rig.ready()


def long_ago(tmp_path: Path) -> None:
    """Record that the servo was last seen an hour ago."""
    with Store(tmp_path / "data", wall=lambda: time.time() - 3600) as store:
        store.servos.seen(Uid(UID.hex()))


def later(recipe: Recipe, tmp_path: Path, *, running: bool = False) -> tuple[dict[str, tuple[Any, Any]], int]:
    """The drift that a later server finds, and the number of events; `running`: the servo ran before it started."""

    async def scene(rig: Rig) -> tuple[dict[str, tuple[Any, Any]], int]:
        if running:
            await asyncio.sleep(30)
            await rig.host.connect("memory:host", 1_000_000)
        servo = (await rig.ready())[0]
        await asyncio.sleep(2)
        rows = json(await rig.call("GET", f"/servos/{servo.uid}/drift"))["rows"]
        assert all(row["proved"] is not running for row in rows)
        return await drift(rig, servo), len(rig.events("drift"))

    return play(scene, recipe, store=str(tmp_path / "data"), connect=not running)


def test_a_change_while_the_server_was_away_is_found_and_stored(tmp_path: Path) -> None:
    play(first, HERE, store=str(tmp_path / "data"))
    changed = replace(HERE, rom={**HERE.rom, "angle_limit_cw": 450}, node_id=12)
    expected = {"angle_limit_cw": (60.0, 45.0), "node_id": (11, 12)}
    assert later(changed, tmp_path) == (expected, 1)
    assert later(changed, tmp_path) == (expected, 0)
    assert later(HERE, tmp_path) == ({}, 0)


def test_a_servo_that_ran_on_is_reported_without_proof_if_it_restarted_unseen(tmp_path: Path) -> None:
    play(first, HERE, store=str(tmp_path / "data"))
    long_ago(tmp_path)
    assert later(HERE, tmp_path, running=True) == ({}, 0)
    assert later(HERE, tmp_path) == ({}, 0)
    long_ago(tmp_path)
    changed = replace(HERE, rom={**HERE.rom, "angle_limit_cw": 450})
    assert later(changed, tmp_path, running=True) == ({"angle_limit_cw": (60.0, 45.0)}, 1)
    assert later(changed, tmp_path, running=True) == ({"angle_limit_cw": (60.0, 45.0)}, 0)
    assert later(HERE, tmp_path) == ({}, 0)


def test_a_firmware_change_is_reported(tmp_path: Path) -> None:
    play(first, replace(HERE, firmware="1.010", serial=7), store=str(tmp_path / "data"))

    async def scene(rig: Rig) -> list[str]:
        await rig.ready()
        return [event.text for event in rig.events("drift")]

    (text,) = play(scene, replace(HERE, firmware="1.300", serial=7), store=str(tmp_path / "data"))
    assert "firmware 1.010 → 1.300" in text
