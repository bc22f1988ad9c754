"""Servos on the bus: identified by UID through node ID changes, restarts and silence (sections 2.1 to 2.3)."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.actions import by_servo_id, power_cycle, write
from behaviour.restarting import run, succeeded
from behaviour.rig import CATALOG, PLAIN, Rig, json, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.bench.bench import demo_fleet
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorStatus
from hornbill.wire.transfer import Transfer


@scene(*demo_fleet(CATALOG, 6, 3), seed=3)
async def test_the_demo_is_identified_and_read_within_12_s(rig: Rig) -> None:
    began = asyncio.get_running_loop().time()
    servos = await rig.ready(6, within_s=12)
    for servo in servos:
        shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
        assert servo.model is not None
        assert set(shown) == set(servo.model.rows(servo.firmware))
        assert all(reading["raw"] is not None for reading in shown.values())
    assert asyncio.get_running_loop().time() - began < 12
    assert len({servo.model.name for servo in servos if servo.model}) >= 4
    assert len({servo.firmware for servo in servos}) >= 3
    dynamic = json(await rig.call("GET", "/allocations"))["allocations"]
    assert 0 < len(dynamic) < 6


@pytest.mark.parametrize("model", sorted(CATALOG.models))
@scene(
    lambda model: [
        Recipe(model, firmware, servo_id=n, node_id=20 + n, any_firmware=True)
        for n, firmware in enumerate(CATALOG.firmware_steps, start=1)
    ],
    fast=True,
)
async def test_every_model_and_firmware_has_its_rows(rig: Rig, model: str) -> None:
    servos = by_servo_id(await rig.ready(len(CATALOG.firmware_steps)))
    assert [servo.firmware_text for servo in servos] == list(CATALOG.firmware_steps)
    for servo in servos:
        assert servo.model is not None
        assert servo.model.name == model
        assert all(register.raw is not None for register in servo.registers.values())


@scene()
async def test_a_servo_with_a_new_node_id_is_the_same_servo(rig: Rig, servo: Servo) -> None:
    json(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "Elevator L"}))
    await write(rig, servo, node_id=42)
    assert servo.registers["node_id"].rom != 42
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await rig.ready()
    assert servo.registers["node_id"].rom != 42, "a written value is not taken for ROM after reconnecting"
    job = succeeded(await run(rig, servo, "save"))
    assert job["result"]["node_id"] == 42
    for query in ("", "?label=Elevator L"):
        shown = json(await rig.call("GET", f"/servos{query}"))
        assert [(one["uid"], one["node_id"], one["label"]) for one in shown] == [(servo.uid, 42, "Elevator L")]


@scene()
async def test_three_missed_status_messages_make_a_servo_offline(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(2)
    rig.sim(servo).conditions.mute = True
    await asyncio.sleep(2.5)
    assert servo.online
    await asyncio.sleep(1.5)
    assert servo.state is State.OFFLINE
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
    assert all(reading["stale"] for reading in shown.values())
    assert rig.events("offline")
    rig.sim(servo).conditions.mute = False
    await rig.ready()
    assert not json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]["angle_p_gain"]["stale"]


@scene(PLAIN, replace(PLAIN, node_id=12, servo_id=2))
async def test_two_servos_that_swap_node_ids_are_distinguished(rig: Rig) -> None:
    one, other = await rig.ready(2)
    ids = {one.uid: one.node_id, other.uid: other.node_id}
    swapped = {one.uid: {"node_id": other.node_id}, other.uid: {"node_id": one.node_id}}
    response = json(await rig.call("PATCH", "/parameters", {"servos": swapped}))
    assert [each["outcome"] for each in response["servos"]] == ["applied", "applied"]
    await asyncio.sleep(2)
    for servo in (one, other):
        rig.sim(servo).memory.save(rig.sim(servo).behaviour)
    await asyncio.gather(*(power_cycle(rig, servo.uid, 1) for servo in (one, other)))  # both change at once
    await asyncio.sleep(5)
    assert {one.uid: other.node_id, other.uid: one.node_id} == ids
    assert rig.sim(one).node_id == one.node_id
    assert (one.state, other.state) == (State.READY, State.READY)


@scene(connect=False)
async def test_rom_is_unknown_when_the_servo_ran_before_connecting_or_unseen(rig: Rig) -> None:
    await asyncio.sleep(30)
    await rig.host.connect("memory:host", 1_000_000)
    servo = (await rig.ready())[0]
    reading = json(await rig.call("GET", f"/servos/{servo.uid}/parameters/angle_p_gain"))
    assert (reading["value"], reading["rom"]) == (40, None)
    assert servo.unsaved() == []
    await power_cycle(rig, servo.uid, 0.3)
    await asyncio.sleep(5)
    assert servo.registers["angle_p_gain"].rom == 40
    sim = rig.sim(servo)
    sim.conditions.mute = True
    await power_cycle(rig, servo.uid, 0.3)
    await asyncio.sleep(60)
    sim.memory.put(0x2C, 77)  # another tool wrote RAM meanwhile
    sim.conditions.mute = False
    await asyncio.sleep(5)
    assert servo.raw("angle_p_gain") == 77
    assert servo.registers["angle_p_gain"].rom is None


@scene()
async def test_a_servo_back_online_is_ready_only_after_it_was_read(rig: Rig, servo: Servo) -> None:
    sim = rig.sim(servo)
    await asyncio.sleep(5)
    sim.conditions.mute = True
    await asyncio.sleep(10)
    assert servo.state is State.OFFLINE
    sim.memory.put(0x2C, 77)  # another tool
    sim.conditions.mute = False
    await until(lambda: servo.online, every_s=0.0005)
    sim.conditions.drop_responses_pct = 100
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]["angle_p_gain"]
    assert shown["value"] == 77 or shown["stale"]
    assert servo.state is State.IDENTIFYING
    await asyncio.sleep(3)
    sim.conditions.drop_responses_pct = 0
    await asyncio.sleep(4)
    assert servo.raw("angle_p_gain") == 77
    assert servo.state is State.READY


@scene()
async def test_a_failing_store_stops_no_monitoring(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_args: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(rig.host.store.servos, "seen", fail)
    servo = (await rig.ready())[0]
    await asyncio.sleep(3)
    reading = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]["current_voltage"]
    assert reading["stale"] is False
    assert reading["age_s"] < 2.5


@scene()
async def test_an_infinite_position_in_a_status_is_ignored(rig: Rig, servo: Servo) -> None:
    status = bytearray(ActuatorStatus(1, 0.0, 0.0, 0.0, 0).encode())
    status[1:3] = b"\x00\x7c"  # a float16 of that value
    kind, now = ActuatorStatus.TYPE.id, asyncio.get_running_loop().time()
    transfer = Transfer(Kind.MESSAGE, kind, 11, 0, 16, 0, bytes(status), now)
    rig.host.connected().participant.subscriptions.dispatch(transfer)
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["angle_deg"] < 1
