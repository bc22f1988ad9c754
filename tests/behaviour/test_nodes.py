"""Foreign nodes: listed with their kind, read rarely and never written; and nodes that may be servos."""

import asyncio
import math
import random
from dataclasses import replace
from typing import Any

import pytest

from behaviour.actions import power_cycle
from behaviour.losing import PAIR
from behaviour.neighbour import Neighbour, refuse
from behaviour.rig import CATALOG, PLAIN, Rig, Socket, json
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.datatype import DataType, Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, NodeHealth, NodeStatus
from hornbill.wire.transfer import Transfer, split

MODEL_NUMBER = CATALOG.by_key["model_number"].name


async def nodes(rig: Rig) -> dict[int, dict[str, Any]]:
    """GET /nodes by node ID."""
    found: list[dict[str, Any]] = json(await rig.call("GET", "/nodes"))
    assert [one["node_id"] for one in found] == sorted({one["node_id"] for one in found})
    return {one["node_id"]: one for one in found}


async def stop(rig: Rig, verb: str = "POST") -> Any:
    return json(await rig.call(verb, "/stop"))


def neighbour(rig: Rig, node_id: int, name: str | None = "org.ardupilot", **more: Any) -> Neighbour:
    """A foreign node without parameters that sends its status from now on."""
    return Neighbour(rig.bus.port(f"neighbour {node_id}"), node_id, name, refuse, **more).start()


def starting(rig: Rig) -> Any:
    """A servo, node 30, that does not respond to 0x50 yet."""
    sim = rig.bench.add(replace(PLAIN, node_id=30, servo_id=3))
    sim.conditions.refuse_keys.add("model_number")
    return sim


@scene(PLAIN)
async def test_every_node_is_listed_with_its_kind(rig: Rig) -> None:
    neighbour(rig, 10)
    Neighbour(rig.bus.port("gps"), 20, "org.example.gps", None, unique_id=bytes(16)).start()
    Neighbour(rig.bus.port("silent"), 30, None).start()
    neighbour(rig, 126, "org.hornbill")
    without_status = Neighbour(rig.bus.port("no status"), 40)
    without_status.send(Kind.MESSAGE, ActuatorStatus(1, 0.0, 0.0, 0.0, 0))
    rig.bench.add(Recipe("BLA21-06U-A0", "1.300"))
    await rig.ready(2)
    await asyncio.sleep(5)
    found = await nodes(rig)
    kinds = {node_id: one["kind"] for node_id, one in found.items()}
    assert kinds == {
        0: "unknown", 10: "foreign", 11: "servo", 20: "foreign", 30: "unknown", 40: "unknown", 125: "servo",
        126: "hornbill", 127: "hornbill",
    }  # fmt: skip
    autopilot = found[10]
    assert (autopilot["name"], autopilot["uid"]) == ("org.ardupilot", bytes(range(100, 116)).hex())
    assert (autopilot["software_version"], autopilot["hardware_version"]) == ("1.4+0000beef", "3.1")
    assert (autopilot["online"], autopilot["health"], autopilot["mode"]) == (True, "ok", "operational")
    assert autopilot["uptime_s"] > 500
    assert autopilot["age_s"] < 1.1
    assert (found[40]["online"], found[40]["mode"], found[40]["health"]) == (False, "unknown", "warning")
    assert found[0]["mode"] == "initialization"
    assert (found[11]["note"], found[11]["uid"]) == (None, rig.host.fleet.all()[0].uid)
    assert found[127]["name"] == "org.hornbill"
    assert found[127]["uid"] == bytes(range(16)).hex()
    for node_id, note in {
        10: "0x50", 20: "not to GetSet", 30: "did not respond to GetNodeInfo", 40: "NodeStatus", 126: "nother hornbill",
        127: "This server.",
    }.items():  # fmt: skip
        assert note in found[node_id]["note"]
    rig.bus.loss(100)
    await asyncio.sleep(4)
    assert [one["node_id"] for one in (await nodes(rig)).values() if one["online"]] == [127]
    json(await rig.call("DELETE", "/bus"))
    assert await nodes(rig) == {}


@scene()
async def test_foreign_nodes_get_few_requests_and_no_writes_and_delay_no_servo(rig: Rig) -> None:
    silent = Neighbour(rig.bus.port("silent"), 31, None).start()
    autopilot = neighbour(rig, 10)
    esc = neighbour(rig, 33, "org.example.esc", actuator=True, unique_id=bytes(range(16, 32)))
    gps = Neighbour(rig.bus.port("gps"), 20).start()
    await asyncio.sleep(10)
    assert silent.info_requests <= 9
    before = gps.info_requests
    gps.uptime, gps.name = 0, "org.example.other"
    await asyncio.sleep(3)
    restarted = (await nodes(rig))[20]
    assert (restarted["restarts"], restarted["name"]) == (1, "org.example.other")
    assert gps.info_requests == before + 1
    await asyncio.sleep(17)
    assert len(esc.requests) <= 8
    await asyncio.sleep(90)
    assert len(silent.requests) == silent.info_requests <= 15
    assert autopilot.info_requests == 1
    assert autopilot.reads == [MODEL_NUMBER] * 4
    found = await nodes(rig)
    assert {number: found[number]["kind"] for number in (10, 31, 33)} == {10: "foreign", 31: "unknown", 33: "foreign"}
    await stop(rig)
    await asyncio.sleep(5)
    assert autopilot.writes == esc.writes == []
    assert 33 not in {one["node_id"] for one in (await stop(rig, "GET"))["nodes"]}
    for number in range(20):
        Neighbour(rig.bus.port(f"silent{number}"), 60 + number, None, actuator=True).start()
    began = rig.host.base.now()
    rig.bench.add(replace(PLAIN, node_id=50, servo_id=5))
    await rig.ready(2)
    assert rig.host.base.now() - began < 1.5


@pytest.mark.parametrize(("start_s", "kind", "found_s"), [(5, "unknown", 6), (60, "foreign", 80)])
@scene()
async def test_a_servo_that_starts_slowly_is_found(rig: Rig, start_s: float, kind: str, found_s: float) -> None:
    await rig.ready()
    sim = starting(rig)
    await asyncio.sleep(start_s)
    found = (await nodes(rig))[30]
    assert found["kind"] == kind
    assert ("may be a servo" in found["note"]) is (kind == "unknown")
    sim.conditions.refuse_keys.clear()
    await rig.ready(2, within_s=found_s)
    assert (await nodes(rig))[30]["kind"] == "servo"
    sim.conditions.refuse_keys.add("model_number")
    await power_cycle(rig, sim.uid.hex(), 0.5)
    await asyncio.sleep(20)
    assert rig.host.fleet.get(sim.uid.hex()).state is State.IDENTIFYING, "it is busy after a restart, too"
    sim.conditions.refuse_keys.clear()
    await rig.ready(2, within_s=3)


@scene()
async def test_stop_reaches_nodes_that_may_be_servos_and_no_others(rig: Rig) -> None:
    await rig.ready()
    sim = starting(rig)
    autopilot = neighbour(rig, 10)
    gps = Neighbour(rig.bus.port("gps"), 20).start()
    await asyncio.sleep(2)
    state = await stop(rig)
    assert sim.output == 1
    (found,) = state["nodes"]
    assert (found["node_id"], found["confirmed"]) == (30, True)
    assert 0 < found["ms"] < 20
    assert [one["confirmed"] for one in state["servos"]] == [True]
    await asyncio.sleep(5)
    assert autopilot.writes == gps.writes == []
    await stop(rig, "DELETE")
    await asyncio.sleep(2)
    sent = len(rig.writes())
    await asyncio.sleep(5)
    assert len(rig.writes()) == sent, "nothing more once acknowledged and cleared"


@scene()
async def test_stop_is_retried_until_a_silent_node_acknowledges(rig: Rig) -> None:
    sim = starting(rig)
    await asyncio.sleep(2)
    sim.conditions.drop_responses_pct = 100
    await stop(rig)
    await asyncio.sleep(2)
    assert not (await stop(rig, "GET"))["nodes"][0]["confirmed"]
    await stop(rig, "DELETE")
    assert "node 30" in rig.events("stop_cleared")[0].text
    sim.memory.put(0x20, 0)
    sim._device.commander.configured()
    await asyncio.sleep(1)
    assert sim.output == 1


@scene()
async def test_while_stop_is_latched_a_node_is_stopped_before_it_is_identified_and_after_each_start(rig: Rig) -> None:
    await rig.ready()
    await stop(rig)
    sim = starting(rig)
    await asyncio.sleep(1)
    assert sim.output == 1
    await power_cycle(rig, sim.uid.hex(), 0.2)
    await asyncio.sleep(3)
    assert sim.starts == 2
    assert sim.output == 1
    sim.conditions.refuse_keys.clear()
    await asyncio.sleep(12)
    state = await stop(rig, "GET")
    assert [one["confirmed"] for one in state["servos"]] == [True, True]
    assert state["nodes"] == []
    servo = rig.host.fleet.get(sim.uid.hex())
    assert servo.raw("torque_mode") == 1
    assert servo.registers["torque_mode"].rom in (0, None), "we wrote it, so RAM says nothing about ROM"


@pytest.mark.parametrize(("name", "kind"), [("org.example.gps", "foreign"), (None, "unknown")])
@scene()
async def test_a_node_that_takes_over_the_node_id_of_a_servo_is_not_that_servo(
    rig: Rig, servo: Servo, name: str | None, kind: str
) -> None:
    await asyncio.sleep(5)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.5)
    other = Neighbour(rig.bus.port("other"), 11, name, refuse if name else None, uptime=1).start()
    await asyncio.sleep(30)
    assert (servo.state, servo.node_id) == (State.OFFLINE, None)
    assert (await nodes(rig))[11]["kind"] == kind
    assert len(other.requests) < 60
    if name:
        await stop(rig)
        await asyncio.sleep(2)
    assert other.writes == []


@scene()
async def test_unknown_or_incomplete_transfers_do_not_accumulate(rig: Rig) -> None:
    """A GNSS receiver's Fix2 (type 1063, 62 bytes), an unknown service and frames of another bus, never complete."""
    gps = Neighbour(rig.bus.port("gps"), 20).start()
    fix = DataType("uavcan.equipment.gnss.Fix2", 1063, 0xCA41E7000F37435F, service=False)
    unknown = DataType("org.example.Service", 99, 0x1122334455667788, service=True)
    assert rig.host.connection is not None
    reassembler = rig.host.connection.participant._reassembler  # pyright: ignore[reportPrivateUsage]
    most = 0
    for number in range(250):
        gps.send_payload(fix, bytes(62), transfer_id=number & 31)
        gps.send_payload(unknown, bytes(30), Kind.REQUEST, 127, number & 31)
        gps.port.send([Frame(0x1842_7F14 | number << 8 & 0xFFFF00, bytes((number & 255, 0x80 | number & 31)))])
        await asyncio.sleep(0.01)
        most = max(most, reassembler.sessions)
    assert most <= 8
    assert reassembler.counters.unknown_type >= 500
    assert (await nodes(rig))[20]["kind"] == "foreign"
    await asyncio.sleep(5)
    assert reassembler.sessions <= 1
    assert len(reassembler._routes) < 8192  # pyright: ignore[reportPrivateUsage]


PATHS = ("/servos", "/nodes", "/allocations", "/bus", "/bus/doctor?all=true", "/health", "/stop")


def status(source: int, uptime: int, mode: int) -> list[Frame]:
    payload = NodeStatus(uptime, NodeHealth.OK, mode, 0, 0).encode()
    return split(Transfer(Kind.MESSAGE, NodeStatus.TYPE.id, source, 0, 24, uptime % 32, payload), NodeStatus.TYPE)


@pytest.mark.parametrize("source", [11, 60])
@scene(*PAIR)
async def test_a_node_in_any_mode_is_listed(rig: Rig, source: int) -> None:
    servo = next(one for one in await rig.ready(2) if one.node_id == 11)
    port = rig.bus.port("foreign")
    for mode in range(8):
        uptime = 0 if servo.status is None else servo.status.uptime_sec
        port.send(status(source, uptime, mode))
        await asyncio.sleep(0.1)
        node = (await nodes(rig))[source]
        assert node["mode"]
        assert len(json(await rig.call("GET", "/servos"))) == 2
        if mode in (4, 5, 6):
            assert node["mode"] == f"reserved_{mode}"


@pytest.mark.parametrize("seed", range(2))
@scene(*PAIR)
async def test_random_transfers_break_no_response(rig: Rig, seed: int) -> None:
    dice = random.Random(seed)

    def noise() -> Frame:
        source, destination = dice.choice([0, 11, 12, 60, dice.randrange(128)]), dice.choice([11, 12, 127])
        message = dice.choice([1, 341, 1010, 1011, 20000]) << 8 | source
        service = dice.choice([1, 5, 10, 11]) << 16 | dice.randrange(2) << 15 | destination << 8 | 0x80 | source
        identifier = dice.choice([message, service, dice.getrandbits(24)]) | dice.randrange(32) << 24
        data = dice.randbytes(dice.randrange(8))
        return Frame(identifier, data + bytes([0xC0 | dice.randrange(32)]) if dice.random() < 0.8 else data)

    await rig.ready(2)
    pages = [Socket(rig.app) for _ in range(3)]
    pages[0].send(type="subscribe", topics=["frames", "servos"])
    pages[1].send(type="subscribe", topics=["frames"], frames={"view": "raw", "problems_only": True})
    pages[2].send(type="subscribe", topics=["frames"], frames={"text": "\0(([*\\", "type": "", "node_id": 0})
    port = rig.bus.port("odd")
    for value in (math.nan, math.inf, -math.inf, 65504.0):
        payload = ActuatorStatus(1, value, value, value, 0).encode()
        port.send(split(Transfer(Kind.MESSAGE, ActuatorStatus.TYPE.id, 11, 0, 16, 0, payload), ActuatorStatus.TYPE))
    for _ in range(60):
        port.send([noise() for _ in range(50)])
        await asyncio.sleep(0.02)
    await asyncio.sleep(1)
    for path in PATHS:
        response = await rig.call("GET", path)
        assert response.status_code == 200
        assert b"NaN" not in response.content
        assert b"Infinity" not in response.content
    for page in pages[:2]:
        assert sum(len(one.get("transfers", [])) + len(one.get("frames", [])) for one in page.received()) > 100
    for page in pages:
        await page.close()
