"""Temporary values: restored and verified, even if the server is killed or the servo is away, and never saved."""

import asyncio
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.actions import move, power_cycle
from behaviour.losing import Loss, back, each_loss
from behaviour.rig import PLAIN, Rig, json, play, problem, until
from behaviour.scene import scene, settled
from hornbill.errors import HornbillError
from hornbill.servo.device.servo import Servo
from hornbill.servo.device.temporary_values import TemporaryValues
from hornbill.store.tables import Json

ON = replace(PLAIN, rom={"soft_start": 0, "timeout_action": 0})
LIMITS: Mapping[str, int] = {"torque_limit_cw": 30, "torque_limit_ccw": -30, "angle_p_gain": 77}
KEY = "temporary_values.{}"


def at(folder: Path) -> str:
    return f"sqlite:///{folder / 'store.sqlite'}"


def ram(rig: Rig, servo: Servo) -> dict[str, int]:
    """RAM of all rows stored in ROM, as the servo itself has it."""
    memory = rig.sim(servo).memory
    return {key: memory.get(one.parameter.address) for key, one in servo.registers.items() if one.parameter.rom}


async def borrow(rig: Rig, servo: Servo, values: Mapping[str, int] = LIMITS) -> TemporaryValues:
    """Write temporary values. The caller leaves them, as a process that is killed does."""
    temporary = TemporaryValues(rig.host.owed, rig.host.requests, servo)
    async with servo.changing:
        await temporary.set(values)
    assert {key: ram(rig, servo)[key] for key in values} == values
    return temporary


async def kill_server(rig: Rig, folder: Path) -> None:
    """Start another server on the store of one that was killed: it restores nothing and notes nothing more."""
    store = rig.host.store
    await store.settled()
    settings = {key: store.settings.get(key) for key in (KEY.format(one.uid) for one in rig.host.fleet.all())}
    await rig.host.owed.close()

    async def killed(*_arguments: object) -> list[str]:
        return ["none"]

    rig.host.owed.restore = killed  # pyright: ignore[reportAttributeAccessIssue]
    new = await rig.restart_server(at(folder))
    for key, value in settings.items():
        new.settings.put(key, value)


async def again(rig: Rig) -> Servo:
    """The servo, ready on the bus of the new server."""
    await rig.host.connect("memory:host", 1_000_000)
    return (await rig.ready(within_s=120))[0]


@scene(ON)
async def test_what_is_owed_is_in_the_database_before_the_first_write(rig: Rig, servo: Servo) -> None:
    before, stored = ram(rig, servo), list[Json]()
    write = rig.host.requests.write

    async def watched(*args: Any, **options: Any) -> int:
        stored.append(rig.host.store.settings.get(KEY.format(servo.uid)))
        return await write(*args, **options)

    rig.host.requests.write = watched  # pyright: ignore[reportAttributeAccessIssue]
    temporary = await borrow(rig, servo)
    originals = [one["original"] for one in stored if isinstance(one, dict)]
    assert originals == [{key: before[key] for key in LIMITS}] * 3
    assert servo.overridden == {key: before[key] for key in LIMITS}
    assert servo.unsaved() == []
    assert await temporary.restore() == []
    assert ram(rig, servo) == before
    assert rig.host.store.settings.get(KEY.format(servo.uid)) is None
    assert servo.overridden == {}


@scene(ON)
async def test_nothing_is_written_if_it_cannot_be_stored(rig: Rig, servo: Servo) -> None:
    def full(*_args: object) -> None:
        raise OSError("no space left on device")

    rig.host.store.settings.put = full  # pyright: ignore[reportAttributeAccessIssue]
    written = len(rig.writes())
    with pytest.raises(HornbillError) as failure:
        await borrow(rig, servo)
    assert failure.value.code == "store_failed"
    job = json(await rig.call("POST", f"/servos/{servo.uid}/identify?wait=true"))
    assert (job["state"], job["error"]["code"]) == ("failed", "store_failed")
    assert {name for _, name, _ in rig.writes()[written:]} <= {"0x20"}


@pytest.mark.parametrize("loss_pct", [0, 20])
def test_a_killed_server_restores_them_at_its_next_start(tmp_path: Path, loss_pct: float) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        before = ram(rig, servo)
        await borrow(rig, servo)
        await kill_server(rig, tmp_path)
        rig.bus.loss(loss_pct, seed=3)
        assert ram(rig, servo)["angle_p_gain"] == 77
        servo = await again(rig)
        await until(lambda: not servo.owed, 60)
        assert ram(rig, servo) == before
        assert {key: servo.raw(key) for key in before} == before
        assert servo.unsaved() == []
        await until(lambda: rig.events("restored_later"))
        assert set(rig.events("restored_later")[0].params["keys"]) == set(LIMITS)  # pyright: ignore[reportArgumentType]
        assert rig.host.store.settings.get(KEY.format(servo.uid)) is None
        rig.host.store.close()

    play(scene, ON, store=at(tmp_path))


@pytest.mark.parametrize("away_s", [1, 30])
def test_after_a_restart_of_the_servo_its_rom_is_in_effect(tmp_path: Path, away_s: float) -> None:
    """Also if it has been running for longer than before, and one value in ROM is the temporary one."""

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        await asyncio.sleep(3)
        json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 60}}))
        await borrow(rig, servo)
        await kill_server(rig, tmp_path)
        await power_cycle(rig, servo.uid, 1)
        await asyncio.sleep(away_s)
        written = len(rig.writes())
        servo = await again(rig)
        await until(lambda: not servo.restoring, 60)
        assert ram(rig, servo)["angle_p_gain"] == 77
        assert len(rig.writes()) == written
        assert (servo.owed, servo.overridden) == ([], {})
        assert rig.host.store.settings.get(KEY.format(servo.uid)) is None
        rig.host.store.close()

    play(scene, replace(ON, rom={**(ON.rom or {}), "angle_p_gain": 77}), store=at(tmp_path))


def test_a_clock_that_is_set_meanwhile_does_not_count_as_a_restart(tmp_path: Path) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        await asyncio.sleep(10)
        before = ram(rig, servo)
        await borrow(rig, servo)
        await kill_server(rig, tmp_path)
        rig.walls.wrong_s += 50 * 365 * 86_400
        servo = await again(rig)
        await until(lambda: not servo.restoring, 60)
        assert ram(rig, servo) == before
        rig.host.store.close()

    play(scene, ON, store=at(tmp_path))


def test_a_value_written_since_is_not_overwritten(tmp_path: Path) -> None:
    """A record may remain if the server is killed just after it restored."""

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        temporary = await borrow(rig, servo)
        record = rig.host.store.settings.get(KEY.format(servo.uid))
        await temporary.restore()
        json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 55}}))
        rig.host.store.settings.put(KEY.format(servo.uid), record)
        await kill_server(rig, tmp_path)
        servo = await again(rig)
        await until(lambda: not servo.restoring, 60)
        assert servo.configured("angle_p_gain") == ram(rig, servo)["angle_p_gain"] == 55
        rig.host.store.close()

    play(scene, ON, store=at(tmp_path))


@each_loss
@pytest.mark.parametrize("restarted", [False, True], ids=["ran on", "restarted"])
@settled(ON)
async def test_after_a_lost_bus_they_are_restored_when_the_servo_is_back(
    rig: Rig, servo: Servo, lose: Loss, restarted: bool
) -> None:
    before = ram(rig, servo)
    async with servo.changing:
        temporary = TemporaryValues(rig.host.owed, rig.host.requests, servo)
        await temporary.set(LIMITS)
        await lose(rig)
        assert set(await temporary.restore()) == set(LIMITS)
    shown = json(await rig.call("GET", f"/servos/{servo.uid}"))
    assert set(shown["owed"]) == set(LIMITS)
    assert shown["unsaved"] == []
    written = len(rig.writes())
    if restarted:
        await power_cycle(rig, servo.uid, 1)
    else:
        await asyncio.sleep(5)
    await back(rig, 60)
    await until(lambda: servo.online and servo.identified and not servo.restoring, 60)
    assert ram(rig, servo) == before
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["owed"] == []
    names = {name for _, name, _ in rig.writes()[written:]}
    assert names == (set() if restarted else {"0x3C", "0x3D", "0x2C"})
    assert len(rig.events("restored_later")) == (not restarted)
    assert len(rig.events("not_restored")) == 1


@scene(ON)
async def test_while_values_are_owed_nothing_is_saved_changed_or_moved(rig: Rig, servo: Servo) -> None:
    lease, path, before = await rig.lease(), f"/servos/{servo.uid}", ram(rig, servo)
    rig.sim(servo).conditions.refuse_keys.add("angle_p_gain")
    memory = rig.sim(servo).memory
    rig.sim(servo).conditions.refuse_keys.clear()
    async with servo.changing:
        temporary = TemporaryValues(rig.host.owed, rig.host.requests, servo)
        await temporary.set(LIMITS)
        rig.sim(servo).conditions.refuse_keys.add("angle_p_gain")
        assert await temporary.restore() == ["angle_p_gain"]
    assert memory.get(0x2C) == 77
    for verb, where, body in [
        ("POST", "/save", None),
        ("PATCH", "/parameters", {"values": {"angle_p_gain": 60}}),
        ("POST", "/command", {"type": "angle", "value": 5}),
        ("POST", "/factory-reset", {"confirm": True}),
    ]:
        response = await rig.call(verb, path + where, body, lease=lease)
        if response.status_code != 422:
            assert problem(response, "busy", 409)["cause"] == "values_owed", where
    snapshot = json(await rig.call("POST", f"{path}/snapshots", {"reason": "test"}), 201)
    assert snapshot is not None
    assert servo.configured("angle_p_gain") == before["angle_p_gain"]
    assert servo.unsaved() == []
    rig.sim(servo).conditions.refuse_keys.clear()
    await until(lambda: not servo.owed, 10)
    assert ram(rig, servo) == before
    await move(rig, servo, lease, 5)
    job = json(await rig.call("POST", f"{path}/restart", lease=lease), 409)
    assert job["cause"] == "under_command"


@scene(ON)
async def test_a_restart_resolves_what_is_owed(rig: Rig, servo: Servo) -> None:
    before = ram(rig, servo)
    async with servo.changing:
        temporary = TemporaryValues(rig.host.owed, rig.host.requests, servo)
        await temporary.set(LIMITS)
        rig.sim(servo).conditions.refuse_keys.add("angle_p_gain")
        await temporary.restore()
    job = json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    assert job["state"] == "succeeded", job
    rig.sim(servo).conditions.refuse_keys.clear()
    await asyncio.sleep(6)
    assert (servo.owed, servo.overridden, ram(rig, servo)) == ([], {}, before)
    with pytest.raises(HornbillError) as failure:
        async with servo.changing:
            await temporary.set({"angle_p_gain": 80})
    assert failure.value.facts["cause"] == "servo_restarted"
    assert ram(rig, servo) == before


@scene(ON)
async def test_kept_values_are_configuration(rig: Rig, servo: Servo) -> None:
    before = ram(rig, servo)
    temporary = await borrow(rig, servo)
    temporary.keep(["angle_p_gain"])
    assert await temporary.restore() == []
    assert ram(rig, servo) == {**before, "angle_p_gain": 77}
    assert servo.unsaved() == ["angle_p_gain"]
    assert rig.host.store.settings.get(KEY.format(servo.uid)) is None


@scene(ON)
async def test_several_temporary_values_of_one_row_leave_its_original_value(rig: Rig, servo: Servo) -> None:
    before = ram(rig, servo)
    async with servo.changing:
        temporary = TemporaryValues(rig.host.owed, rig.host.requests, servo)
        for gain in (77, 20, 77, 90):
            await temporary.set({"angle_p_gain": gain})
            assert servo.overridden == {"angle_p_gain": before["angle_p_gain"]}
        await temporary.restore()
    assert ram(rig, servo) == before


def test_an_unreadable_record_counts_as_none(tmp_path: Path) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        before = ram(rig, servo)
        rig.host.store.settings.put(KEY.format(servo.uid), {"at": 1.0, "original": [], "sent": 3})
        await kill_server(rig, tmp_path)
        servo = await again(rig)
        assert (servo.owed, ram(rig, servo)) == ([], before)
        rig.host.store.close()

    play(scene, ON, store=at(tmp_path))
