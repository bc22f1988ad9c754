"""An observer identifies servos from what other nodes request, shows what it cannot identify, and sends nothing."""

import asyncio
import logging
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, until
from behaviour.scene import scene
from behaviour.test_roles import AUTOPILOT, autopilot, command, connect, servo_of
from hornbill.errors import NoResponse
from hornbill.node.participant import Participant
from hornbill.wire.services import EMPTY, GetNodeInfoRequest, GetSetRequest, integer

TWO = [replace(PLAIN, node_id=20, servo_id=1), replace(PLAIN, node_id=21, servo_id=2)]
IDENTITY = ("0x50", "0x53", "0x52", "0x51")


async def read(node: Participant, to: int, *names: str) -> None:
    """Requests of another node, as its tool sends them."""
    for name in names:
        await node.request(to, GetSetRequest(0, EMPTY, name))


async def node_of(rig: Rig, node_id: int) -> dict[str, Any]:
    return next(one for one in json(await rig.call("GET", "/nodes")) if one["node_id"] == node_id)


@scene(*TWO, connect=False)
async def test_a_node_that_is_not_identified_shows_its_servo_id_angle_and_commander(rig: Rig) -> None:
    async with autopilot(rig, command(2, 0.1)):
        await connect(rig, "observer")
        await asyncio.sleep(5)
        one, other = await node_of(rig, 20), await node_of(rig, 21)
        assert (one["kind"], one["actuator_id"], one["commanded_by"]) == ("unknown", 1, [])
        assert (other["kind"], other["actuator_id"], other["note_code"]) == ("unknown", 2, "identity_not_received")
        assert other["angle_deg"] == pytest.approx(18, abs=0.5)
        (by,) = other["commanded_by"]
        assert (by["node_id"], by["type"], by["command_deg"]) == (AUTOPILOT, "unitless", 18.0)
        assert by["rate_hz"] == pytest.approx(50, rel=0.02)
        assert abs(by["error_deg"]) < 1
        assert json(await rig.call("GET", "/servos")) == []
        pilot = await node_of(rig, AUTOPILOT)
        assert (pilot["actuator_id"], pilot["angle_deg"], pilot["commanded_by"]) == (None, None, [])
    assert rig.transfers("host") == []


@scene(*TWO, connect=False)
async def test_a_servo_is_identified_once_its_unique_id_and_model_were_heard(rig: Rig) -> None:
    async with autopilot(rig, command(1, 0.1)) as node:
        await connect(rig, "observer")
        await asyncio.sleep(3)
        await read(node, 20, "0x50", "0x45", "0x41")
        assert rig.host.fleet.all() == [], "a model number without a unique ID is no identity"
        await node.request(20, GetNodeInfoRequest())
        (servo,) = await rig.ready()
        await asyncio.sleep(0.05)
        found = await servo_of(rig, servo)
        assert (found["node_id"], found["servo_id"], found["serial"]) == (20, 1, None)
        (by,) = found["commanded_by"]
        assert (by["node_id"], by["command_deg"]) == (AUTOPILOT, 18.0)
        await read(node, 20, *IDENTITY)
        found = await servo_of(rig, servo)
        assert (found["model"], found["firmware"]) == ("BLA21-06U-A0", "1.300")
        assert found["serial"] is not None
        assert (await node_of(rig, 20))["kind"] == "servo"
        assert [one.uid for one in rig.events("ready")] == [servo.uid]
    assert rig.transfers("host") == []


@scene(*TWO, connect=False)
async def test_registers_follow_the_responses_to_other_nodes(rig: Rig) -> None:
    async with autopilot(rig) as node:
        await connect(rig, "observer")
        await asyncio.sleep(2)
        await node.request(20, GetNodeInfoRequest())
        await read(node, 20, *IDENTITY, "0x45")
        (servo,) = await rig.ready()
        await node.request(20, GetSetRequest(0, integer(500), "0x38"))
        values = json(await rig.call("GET", f"/servos/{servo.uid}/parameters"))["parameters"]
        assert (values["angle_limit_cw"]["raw"], values["angle_limit_cw"]["stale"]) == (500, False)
        assert values["angle_limit_ccw"]["raw"] is None
        await read(node, 21, "0x38")
        assert servo.raw("angle_limit_cw") == 500, "a response of another node"


@scene(*TWO, connect=False)
async def test_a_restarted_node_is_not_taken_for_the_servo_it_was(rig: Rig) -> None:
    async with autopilot(rig) as node:
        await connect(rig, "observer")
        await asyncio.sleep(8)
        await node.request(20, GetNodeInfoRequest())
        await read(node, 20, *IDENTITY, "0x45")
        (servo,) = await rig.ready()
        rig.bench.power(servo.uid, on=False)
        rig.bench.power(servo.uid, on=True)
        await until(lambda: not servo.identified, 5)
        await read(node, 20, "0x50")
        await asyncio.sleep(2)
        assert not servo.identified
        await node.request(20, GetNodeInfoRequest())
        await until(lambda: servo.identified, 2)
        assert servo.raw("servo_id") == 1
    assert rig.transfers("host") == []


@scene(*TWO)
async def test_a_stored_servo_is_identified_by_its_unique_id_alone(rig: Rig) -> None:
    first, second = sorted(await rig.ready(2), key=lambda one: one.node_id or 0)
    known = await servo_of(rig, first)
    await connect(rig, "observer")
    async with autopilot(rig) as node:
        await asyncio.sleep(3)
        assert not first.online
        await node.request(20, GetNodeInfoRequest())
        await until(lambda: first.online, 2)
        found = await servo_of(rig, first)
        assert [found[key] for key in ("model", "serial", "firmware", "label")] == [
            known[key] for key in ("model", "serial", "firmware", "label")
        ]
        assert not second.online


@scene(*TWO)
async def test_nothing_is_tried_as_observer_after_a_time_as_host(rig: Rig, caplog: pytest.LogCaptureFixture) -> None:
    first, second = await rig.ready(2)
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{first.uid}/torque", {"mode": "on"}, lease=lease))
    body = {"channels": ["current_angle"], "rate_hz": 50}
    json(await rig.call("PUT", f"/servos/{second.uid}/telemetry", body))
    rig.bench.power(second.uid, on=False)
    json(await rig.call("POST", "/stop", {"mode": "off"}))
    await asyncio.sleep(1)
    await connect(rig, "observer")
    count, requests = len(rig.transfers("host")), rig.host.requests.outcomes.total()
    rig.bench.power(second.uid, on=True)
    async with autopilot(rig) as node:
        await asyncio.sleep(2)
        for to in (20, 21):
            await node.request(to, GetNodeInfoRequest())
        await until(lambda: first.online and second.online, 2)
        with caplog.at_level(logging.INFO):
            await asyncio.sleep(60)
        grant = json(await rig.call("PUT", f"/servos/{second.uid}/telemetry", body))
    assert grant["note_code"] == "not_polled_as_observer"
    assert caplog.records == []
    assert rig.host.requests.outcomes.total() == requests
    assert len(rig.transfers("host")) == count
    json(await rig.call("PUT", "/bus/role", {"role": "host"}))
    await until(lambda: rig.sim(second).memory.get(0x20) == 1, 10)


@scene(*TWO, connect=False)
async def test_a_node_without_response_stays_unidentified(rig: Rig) -> None:
    async with autopilot(rig) as node:
        await connect(rig, "observer")
        await asyncio.sleep(2)
        with pytest.raises(NoResponse):
            await node.request(22, GetNodeInfoRequest())
        await read(node, 20, "0x50")
        await node.request(21, GetNodeInfoRequest())
        await asyncio.sleep(2)
    assert rig.host.fleet.all() == []
