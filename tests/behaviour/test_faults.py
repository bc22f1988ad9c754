"""Faults of simulated servos in the API: active, past, advice and acknowledgement."""

import asyncio
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.applying import in_order
from behaviour.rig import CATALOG, PLAIN, Rig, Socket, json, play, problem, until
from behaviour.scene import scene
from hornbill.errors import StoreFailed
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid
from hornbill.wire.datatype import Kind
from hornbill.wire.services import GetSetRequest

UID = bytes(range(16))
HERE = replace(PLAIN, uid=UID, rom={"soft_start": 0})
PWM = Recipe("BLA21-06U-AB", "1.300", servo_id=2, node_id=12, rom={"soft_start": 0})
POLLED_S = 2.5
"""Enough to read the overview and the word it points to."""


async def faults(rig: Rig, uid: str = UID.hex()) -> list[dict[str, Any]]:
    return json(await rig.call("GET", f"/servos/{uid}/faults"))


async def fault(rig: Rig, key: str) -> dict[str, Any]:
    return next(one for one in await faults(rig) if one["key"] == key)


async def inject(rig: Rig, servo: Servo, key: str, on: bool = True) -> None:
    rig.sim(servo).faults.inject(key, on)
    await asyncio.sleep(POLLED_S)


async def unacknowledged(rig: Rig) -> int:
    return json(await rig.call("GET", f"/servos/{UID.hex()}"))["unacknowledged"]


@scene(HERE)
async def test_overheating_is_reported_with_advice_cleared_and_counted(rig: Rig, servo: Servo) -> None:
    assert await faults(rig) == []
    started = rig.host.base.utc_now()
    rig.sim(servo).conditions.temperature_c = 90.0
    await asyncio.sleep(10)
    (hot,) = await faults(rig)
    row = next(bit for bit in CATALOG.faults if bit.key == "temperature_high")
    expected = {
        "level": "warning", "group": "software", "bit": 8, "key": row.key, "label": row.label, "advice": row.advice,
        "active": True, "stale": False, "latched": False, "past_event": False, "count": 1,
        "acknowledged_at": None, "acknowledged_by": None,
    }  # fmt: skip
    assert {key: hot[key] for key in expected} == expected
    assert started <= hot["first_seen"] <= started + POLLED_S
    assert hot["last_seen"] >= rig.host.base.utc_now() - POLLED_S
    rig.sim(servo).conditions.temperature_c = 25.0
    await asyncio.sleep(60)
    (hot,) = await faults(rig)
    assert (hot["active"], hot["stale"], hot["count"]) == (False, False, 1)
    assert started + 10 <= hot["last_seen"] <= started + 10 + POLLED_S
    assert [(one.level, one.uid) for one in rig.events("fault")] == [("warning", servo.uid)]
    assert row.advice in rig.events("fault")[0].text
    assert [one.level for one in rig.events("fault_cleared")] == ["info"]
    for temperature_c in (90.0, 25.0) * 2:
        rig.sim(servo).conditions.temperature_c = temperature_c
        await asyncio.sleep(POLLED_S + 2)
    (hot,) = await faults(rig)
    assert (hot["count"], hot["active"]) == (3, False)
    assert len(rig.events("fault")) == len(rig.events("fault_cleared")) == 3


@scene(HERE)
async def test_fault_words_are_read_only_while_the_overview_has_bits(rig: Rig, servo: Servo) -> None:

    def reads() -> Counter[str]:
        names = Counter[str]()
        for transfer in rig.transfers("host"):
            if transfer.kind is Kind.REQUEST and transfer.type_id == GetSetRequest.TYPE.id:
                request = GetSetRequest.decode(transfer.payload)
                assert request is not None
                names[request.name] += 1
        return names

    before = reads()
    await asyncio.sleep(10)
    quiet = reads() - before
    assert quiet["0x18"] == pytest.approx(10, abs=1)
    assert [quiet[word] for word in ("0x19", "0x1A", "0x1B")] == [0, 0, 0]
    rig.sim(servo).faults.inject("sensor_weak", True)
    before = reads()
    await asyncio.sleep(10)
    busy = reads() - before
    assert all(busy[word] >= 8 for word in ("0x18", "0x19", "0x1A", "0x1B"))


@scene(HERE)
async def test_faults_are_sorted_by_level_and_active_ones_first(rig: Rig, servo: Servo) -> None:
    for key in ("angle_limit_cw_reached", "sensor_weak", "motor_driver"):
        await inject(rig, servo, key)
        await inject(rig, servo, key, False)
    for key in ("angle_limit_ccw_reached", "sensor_strong", "sensor_failure"):
        await inject(rig, servo, key)
    assert [(one["key"], one["active"]) for one in await faults(rig)] == [
        ("sensor_failure", True), ("motor_driver", False), ("sensor_strong", True), ("sensor_weak", False),
        ("angle_limit_ccw_reached", True), ("angle_limit_cw_reached", False),
    ]  # fmt: skip
    assert Counter(one.level for one in rig.events("fault")) == {"notice": 2, "warning": 2, "failure": 2}
    rig.sim(servo).faults.words = (0, 0, 1 << 31)
    await asyncio.sleep(POLLED_S)
    one = await fault(rig, "failure_bit_31")
    shown = {key: one[key] for key in ("label", "group", "bit", "level")}
    assert shown == {"label": "Bit 31 (undocumented)", "group": "other", "bit": 31, "level": "failure"}


@scene(HERE)
async def test_lost_rom_is_a_fault_from_the_start(rig: Rig, servo: Servo) -> None:
    boot_count = servo.boot_count
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    rig.sim(servo).memory.rom_sound = False
    rig.bench.power(servo.uid, True)
    await until(lambda: servo.boot_count > boot_count and servo.identified)
    lost = await fault(rig, "rom_lost")
    assert (lost["active"], lost["latched"], lost["past_event"], lost["level"]) == (True, True, True, "warning")
    assert [one.level for one in rig.events("fault")] == ["warning"]


@scene(HERE)
async def test_a_watchdog_restart_is_one_failure_and_a_lasting_fault_counted_at_each_start(
    rig: Rig, servo: Servo
) -> None:
    await asyncio.sleep(5)  # so that its uptime shows a restart
    await inject(rig, servo, "sensor_weak")
    boot_count = servo.boot_count
    rig.sim(servo).faults.inject("watchdog_restart", True)
    await until(lambda: servo.boot_count > boot_count and servo.state is State.READY)
    await asyncio.sleep(10)
    now = await fault(rig, "watchdog_restart")
    assert (now["active"], now["latched"], now["past_event"], now["count"]) == (True, True, True, 1)
    assert (await fault(rig, "sensor_weak"))["count"] == 2
    assert [one.level for one in rig.events("fault")].count("failure") == 1
    boot_count = servo.boot_count
    json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    await until(lambda: servo.boot_count > boot_count and servo.state is State.READY)
    await asyncio.sleep(POLLED_S)
    now = await fault(rig, "watchdog_restart")
    assert (now["active"], now["latched"], now["count"]) == (False, False, 1)
    assert (await fault(rig, "sensor_weak"))["count"] == 3
    assert Counter(one.level for one in rig.events("fault")) == {"failure": 1, "warning": 3}


@scene(HERE, replace(PLAIN, servo_id=2, node_id=12, uid=bytes(range(1, 17))))
async def test_faults_of_several_servos_come_in_the_requested_order(rig: Rig) -> None:
    first, second = await rig.ready(2)
    body = {"model": PLAIN.model, "servo_id": 3, "node_id": 13}
    new = json(await rig.call("POST", "/sim/servos", body), 201)["uid"]
    await until(lambda: rig.host.fleet.knows(Uid(new)), every_s=0.001)
    assert not rig.host.fleet.get(Uid(new)).identified
    rig.bench.servo(Uid(new)).conditions.drop_responses_pct = 100
    await inject(rig, first, "sensor_weak")
    rig.sim(first).conditions.mute = True
    await until(lambda: not first.online)
    listed = [second.uid, "0" * 32, new, first.uid]
    found = json(await rig.call("GET", f"/faults?uids={','.join([*listed, second.uid])}"))["servos"]
    assert list(found) == listed, "in the requested order, each once"
    assert found[first.uid]["faults"] == await faults(rig, first.uid)
    shown = [(one["key"], one["active"], one["stale"]) for one in found[first.uid]["faults"]]
    assert shown == [("sensor_weak", False, True)]
    assert found[second.uid] == found[new] == {"faults": [], "problem": None}
    unknown = found["0" * 32]
    assert (unknown["faults"], unknown["problem"]["code"]) == ([], "unknown_servo")
    assert list(json(await rig.call("GET", "/faults"))["servos"]) == [one.uid for one in rig.host.fleet.all()]
    rig.sim(first).conditions.mute = False
    await until(lambda: first.state is State.READY)
    (weak,) = await faults(rig, first.uid)
    assert (weak["active"], weak["stale"], weak["count"]) == (True, False, 1)
    assert len(rig.events("fault")) == 1


@scene(PLAIN, PWM)
async def test_a_missing_pulse_needs_a_pwm_input(rig: Rig) -> None:
    servos = await in_order(rig, 2)
    for servo in servos:
        word = rig.sim(servo).faults
        word.words = (word.words[0] | 1 << 20, *word.words[1:])
    await asyncio.sleep(POLLED_S)
    for servo, keys in zip(servos, ([], ["pwm_missing"]), strict=True):
        assert servo.raw("fault_notification") == 1 << 20
        assert [one["key"] for one in await faults(rig, servo.uid)] == keys


@scene(HERE)
async def test_an_acknowledgement_names_its_client_until_the_fault_recurs(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/faults"
    for key in ("sensor_weak", "nonsense"):
        refused = await rig.call("POST", f"{path}/{key}/acknowledge")
        assert key in problem(refused, "unknown_fault", 404)["detail"]
    for uid in ("f" * 32, "none"):
        problem(await rig.call("GET", f"/servos/{uid}/faults"), "unknown_servo", 404)
        problem(await rig.call("POST", f"/servos/{uid}/faults/acknowledge"), "unknown_servo", 404)
    assert rig.host.store.audit.rows(action="acknowledge") == []
    await inject(rig, servo, "sensor_weak")
    await inject(rig, servo, "motor_driver")
    assert await unacknowledged(rig) == 2
    seen = json(await rig.call("POST", f"{path}/sensor_weak/acknowledge?by=Ada"))
    assert (seen["key"], seen["acknowledged_by"], seen["active"]) == ("sensor_weak", "Ada", True)
    assert seen["acknowledged_at"] == pytest.approx(rig.host.base.utc_now(), abs=0.1)
    assert await unacknowledged(rig) == 1
    json(await rig.call("POST", f"{path}/sensor_weak/acknowledge?by=Bob"))
    assert (await fault(rig, "sensor_weak"))["acknowledged_by"] == "Ada"
    every = json(await rig.call("POST", f"{path}/acknowledge", lease=await rig.lease()))
    assert [(one["key"], one["acknowledged_by"]) for one in every] == [
        ("motor_driver", "test"), ("sensor_weak", "Ada")
    ]  # fmt: skip
    assert await unacknowledged(rig) == 0
    rows = [row.entry for row in rig.host.store.audit.rows(action="acknowledge")]
    assert [(row.by, row.outcome, row.uid, row.key) for row in reversed(rows)] == [
        ("Ada", "succeeded", servo.uid, "sensor_weak"), ("Bob", "unchanged", servo.uid, "sensor_weak"),
        ("test", "succeeded", servo.uid, "motor_driver"),
    ]  # fmt: skip
    await inject(rig, servo, "sensor_weak", False)
    assert await unacknowledged(rig) == 0
    await inject(rig, servo, "sensor_weak")
    again = await fault(rig, "sensor_weak")
    assert (again["count"], again["acknowledged_at"], again["acknowledged_by"]) == (2, None, None)
    assert await unacknowledged(rig) == 1


@scene(HERE)
async def test_a_socket_is_notified_of_faults_and_acknowledgements(rig: Rig, servo: Servo) -> None:
    socket = Socket(rig.app)
    socket.send(type="subscribe", topics=["servos", "events"])
    rig.sim(servo).faults.inject("motor_driver", True)
    while (event := await socket.receive("event"))["code"] != "fault":
        pass
    assert (event["level"], event["uid"]) == ("failure", servo.uid)

    async def shown(count: int) -> dict[str, Any]:
        while (one := (await socket.receive("servos"))["servos"][0])["unacknowledged"] != count:
            pass
        return one

    await asyncio.sleep(POLLED_S)
    socket.received()
    rig.sim(servo).faults.inject("sensor_failure", True)
    assert (await shown(2))["faults"]["failure"] == 0b100001
    json(await rig.call("POST", f"/servos/{servo.uid}/faults/acknowledge?by=Ada"))
    async with asyncio.timeout(0.5):
        await shown(0)


def test_faults_of_an_offline_servo_survive_a_server_restart(tmp_path: Path) -> None:
    async def first(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        await inject(rig, servo, "sensor_weak")
        await inject(rig, servo, "motor_driver")
        await inject(rig, servo, "motor_driver", False)
        json(await rig.call("POST", f"/servos/{servo.uid}/faults/motor_driver/acknowledge?by=Ada"))

    async def later(rig: Rig) -> None:
        driver, weak = await faults(rig)
        assert (driver["key"], driver["count"], driver["acknowledged_by"]) == ("motor_driver", 1, "Ada")
        assert (driver["active"], driver["stale"]) == (False, False)
        assert (weak["key"], weak["active"], weak["stale"]) == ("sensor_weak", False, True)
        json(await rig.call("POST", f"/servos/{UID.hex()}/faults/acknowledge?by=Bob"))
        assert (await fault(rig, "sensor_weak"))["acknowledged_by"] == "Bob"

    where = str(tmp_path / "data")
    play(first, HERE, store=where)
    play(later, replace(PLAIN, uid=bytes(16)), store=where)


@scene(HERE, store=lambda tmp_path: str(tmp_path / "data"))
async def test_faults_of_a_running_servo_continue_after_a_server_restart(
    rig: Rig, servo: Servo, tmp_path: Path
) -> None:
    await inject(rig, servo, "sensor_weak")
    json(await rig.call("POST", f"/servos/{servo.uid}/faults/acknowledge?by=Ada"))
    before = await fault(rig, "sensor_weak")
    with await rig.restart_server(str(tmp_path / "data")):
        rig.changes.clear()
        await rig.host.connect("memory:again", 1_000_000)
        await rig.ready()
        await asyncio.sleep(POLLED_S)
        after = await fault(rig, "sensor_weak")
        same = ("first_seen", "count", "acknowledged_at", "acknowledged_by", "active")
        assert {key: after[key] for key in same} == {key: before[key] for key in same}
        assert rig.events("fault") == []
        await rig.host.close()


@scene(HERE)
async def test_a_failing_store_hides_no_fault(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise StoreFailed("The disk is full. Make room.", cause=None)

    servo = (await rig.ready())[0]
    monkeypatch.setattr(rig.host.store.faults, "record", fail)
    monkeypatch.setattr(rig.host.store.faults, "acknowledge", fail)
    await inject(rig, servo, "motor_driver")
    await inject(rig, servo, "sensor_weak")
    assert [one["active"] for one in await faults(rig)] == [True, True]
    assert len(rig.events("store_failed")) == 1
    problem(await rig.call("POST", f"/servos/{servo.uid}/faults/acknowledge"), "store_failed", 500)
    assert await unacknowledged(rig) == 2
