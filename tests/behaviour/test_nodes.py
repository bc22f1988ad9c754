"""Nodes that are no servos: listed for what they are, asked politely, never written to; and what may be servos."""

import asyncio
import math
import random
from dataclasses import replace
from typing import Any

import pytest

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
SLOW_TO_START = replace(PLAIN, node_id=30, servo_id=3)


async def nodes(rig: Rig) -> dict[int, dict[str, Any]]:
    """GET /nodes by node id."""
    found: list[dict[str, Any]] = json(await rig.call("GET", "/nodes"))
    assert [one["node_id"] for one in found] == sorted({one["node_id"] for one in found})
    return {one["node_id"]: one for one in found}


def starting(rig: Rig, recipe: Recipe = SLOW_TO_START) -> Any:
    """A servo that has no 0x50 yet."""
    sim = rig.bench.add(recipe)
    sim.conditions.refuse_keys.add("model_number")
    return sim


@scene(PLAIN)
async def test_everybody_who_is_heard_is_listed_for_what_they_are(rig: Rig) -> None:
    Neighbour(rig.bus.port("autopilot"), 10, "org.ardupilot", refuse).speak()
    Neighbour(rig.bus.port("gps"), 20, "org.example.gps", None, unique_id=bytes(16)).speak()
    Neighbour(rig.bus.port("silent"), 30, None).speak()
    Neighbour(rig.bus.port("another"), 126, "org.hornbill", refuse).speak()
    mute = Neighbour(rig.bus.port("no status"), 40)
    mute.say(Kind.MESSAGE, ActuatorStatus(1, 0.0, 0.0, 0.0, 0))
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
    assert "0x50" in autopilot["note"]
    assert "not to GetSet" in found[20]["note"]
    assert "did not respond to GetNodeInfo" in found[30]["note"]
    assert (found[40]["online"], found[40]["mode"], found[40]["health"]) == (False, "unknown", "warning")
    assert "never said NodeStatus" in found[40]["note"]
    assert found[0]["mode"] == "initialization"
    assert (found[11]["note"], found[11]["uid"]) == (None, rig.host.fleet.all()[0].uid)
    assert found[127]["name"] == "org.hornbill"
    assert (found[127]["uid"], found[127]["note"]) == (bytes(range(16)).hex(), "This server.")
    assert "nother hornbill" in found[126]["note"]
    rig.bus.loss(100)
    await asyncio.sleep(4)
    assert [one["node_id"] for one in (await nodes(rig)).values() if one["online"]] == [127]


@scene(connect=False)
async def test_without_a_bus_nobody_is_listed(rig: Rig) -> None:
    assert json(await rig.call("GET", "/nodes")) == []


@scene()
async def test_a_restart_is_counted_and_who_it_is_asked_again(rig: Rig) -> None:
    gps = Neighbour(rig.bus.port("gps"), 20).speak()
    await asyncio.sleep(3)
    before = gps.infos
    gps.uptime, gps.name = 0, "org.example.other"
    await asyncio.sleep(3)
    found = (await nodes(rig))[20]
    assert (found["restarts"], found["name"]) == (1, "org.example.other")
    assert gps.infos == before + 1


@scene()
async def test_a_node_that_answers_nothing_costs_a_few_requests_ever_more_rarely(rig: Rig) -> None:
    silent = Neighbour(rig.bus.port("silent"), 30, None).speak()
    await asyncio.sleep(10)
    assert silent.infos <= 9
    await asyncio.sleep(110)
    assert len(silent.asked) == silent.infos <= 15
    assert (await nodes(rig))[30]["kind"] == "unknown"


@scene()
async def test_a_foreign_node_is_asked_who_it_is_once_and_for_its_model_four_times(rig: Rig) -> None:
    autopilot = Neighbour(rig.bus.port("autopilot"), 10, "org.ardupilot", refuse).speak()
    await asyncio.sleep(120)
    assert autopilot.infos == 1
    assert autopilot.reads == [MODEL_NUMBER] * 4
    assert autopilot.writes == []


@scene()
async def test_a_foreign_actuator_is_recognised_and_not_written_to(rig: Rig) -> None:
    esc = Neighbour(rig.bus.port("esc"), 33, "org.example.esc", refuse, actuator=True).speak()
    await asyncio.sleep(30)
    assert (await nodes(rig))[33]["kind"] == "foreign"
    assert len(esc.asked) <= 8
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(5)
    assert esc.writes == []
    assert json(await rig.call("GET", "/stop"))["nodes"] == []


@scene()
async def test_a_servo_that_was_busy_starting_is_found(rig: Rig) -> None:
    await rig.ready()
    sim = starting(rig)
    await asyncio.sleep(5)
    assert (await nodes(rig))[30]["kind"] == "unknown"
    assert "may be a servo" in (await nodes(rig))[30]["note"]
    sim.conditions.refuse_keys.clear()
    await rig.ready(2, within_s=6)
    assert (await nodes(rig))[30]["kind"] == "servo"


@scene()
async def test_a_servo_whose_start_took_a_minute_is_found_in_the_end(rig: Rig) -> None:
    sim = starting(rig)
    await asyncio.sleep(60)
    assert (await nodes(rig))[30]["kind"] == "foreign"
    sim.conditions.refuse_keys.clear()
    await rig.ready(2, within_s=80)


@scene()
async def test_stop_reaches_what_may_be_a_servo_and_nobody_else(rig: Rig) -> None:
    await rig.ready()
    sim = starting(rig)
    autopilot = Neighbour(rig.bus.port("autopilot"), 10, "org.ardupilot", refuse).speak()
    gps = Neighbour(rig.bus.port("gps"), 20).speak()
    await asyncio.sleep(2)
    state = json(await rig.call("POST", "/stop"))
    assert sim.output == 1
    (found,) = state["nodes"]
    assert (found["node_id"], found["confirmed"]) == (30, True)
    assert 0 < found["ms"] < 20
    assert [one["confirmed"] for one in state["servos"]] == [True]
    await asyncio.sleep(5)
    assert autopilot.writes == gps.writes == []
    json(await rig.call("DELETE", "/stop"))
    await asyncio.sleep(2)
    sent = len(rig.writes())
    await asyncio.sleep(5)
    assert len(rig.writes()) == sent, "once answered and cleared, nothing more is sent"


@scene()
async def test_stop_goes_on_writing_to_a_node_that_does_not_answer_until_it_does(rig: Rig) -> None:
    sim = starting(rig)
    await asyncio.sleep(2)
    sim.conditions.drop_responses_pct = 100
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(2)
    assert not json(await rig.call("GET", "/stop"))["nodes"][0]["confirmed"]
    json(await rig.call("DELETE", "/stop"))
    assert "node 30" in rig.events("stop_cleared")[0].text
    sim.memory.put(0x20, 0)
    sim._device.commander.configured()
    await asyncio.sleep(1)
    assert sim.output == 1


@scene()
async def test_while_the_latch_is_set_a_node_is_stopped_before_it_is_identified_and_after_each_of_its_starts(
    rig: Rig,
) -> None:
    await rig.ready()
    json(await rig.call("POST", "/stop"))
    sim = starting(rig)
    await asyncio.sleep(1)
    assert sim.output == 1
    rig.bench.power(sim.uid.hex(), False)  # pyright: ignore[reportArgumentType]
    await asyncio.sleep(0.2)
    rig.bench.power(sim.uid.hex(), True)  # pyright: ignore[reportArgumentType]
    await asyncio.sleep(3)
    assert sim.starts == 2
    assert sim.output == 1
    sim.conditions.refuse_keys.clear()
    await asyncio.sleep(12)
    state = json(await rig.call("GET", "/stop"))
    assert [one["confirmed"] for one in state["servos"]] == [True, True]
    assert state["nodes"] == []
    servo = rig.host.fleet.get(sim.uid.hex())
    assert servo.raw("torque_mode") == 1
    assert servo.registers["torque_mode"].rom in (0, None), "we wrote it: RAM says nothing about ROM"


@scene()
async def test_a_node_that_takes_the_node_id_of_a_servo_is_not_taken_for_it(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(5)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.5)
    other = Neighbour(rig.bus.port("other"), 11, "org.example.gps", refuse, uptime=1).speak()
    await asyncio.sleep(4)
    assert (servo.state, servo.node_id) == (State.OFFLINE, None)
    assert (await nodes(rig))[11]["kind"] == "foreign"
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(2)
    assert other.writes == []


@scene()
async def test_nor_is_one_that_does_not_even_say_who_it_is(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(5)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.5)
    other = Neighbour(rig.bus.port("other"), 11, None, uptime=1).speak()
    await asyncio.sleep(30)
    assert (servo.state, servo.node_id) == (State.OFFLINE, None)
    assert (await nodes(rig))[11]["kind"] == "unknown"
    assert len(other.asked) < 60
    assert other.writes == []


@scene()
async def test_a_servo_that_is_busy_after_a_restart_is_read_again_when_it_is_not(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(4)
    rig.sim(servo).conditions.refuse_keys.add("model_number")
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.5)
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(20)
    assert servo.state is State.IDENTIFYING
    rig.sim(servo).conditions.refuse_keys.clear()
    await rig.ready(within_s=3)


@scene()
async def test_long_transfers_of_unknown_types_and_frames_of_other_buses_leave_nothing_behind(rig: Rig) -> None:
    """A GNSS receiver's Fix2 (type 1063, 62 bytes) and a stranger's service, never completed either."""
    gps = Neighbour(rig.bus.port("gps"), 20).speak()
    fix = DataType("uavcan.equipment.gnss.Fix2", 1063, 0xCA41E7000F37435F, service=False)
    unknown = DataType("org.example.Service", 99, 0x1122334455667788, service=True)
    assert rig.host.connection is not None
    reassembler = rig.host.connection.participant._reassembler  # pyright: ignore[reportPrivateUsage]
    most = 0
    for number in range(2000):
        gps.send(fix, bytes(62), transfer_id=number & 31)
        gps.send(unknown, bytes(30), Kind.REQUEST, 127, number & 31)
        gps.port.send([Frame(0x1842_7F14 | number << 8 & 0xFFFF00, bytes((number & 255, 0x80 | number & 31)))])
        await asyncio.sleep(0.01)
        most = max(most, reassembler.sessions)
    assert most <= 8, "what is known and never ends"
    assert reassembler.counters.unknown_type >= 4000
    assert (await nodes(rig))[20]["kind"] == "foreign"
    await asyncio.sleep(5)
    assert reassembler.sessions <= 1
    assert len(reassembler._routes) < 8192  # pyright: ignore[reportPrivateUsage]


@scene()
async def test_identification_is_not_held_up_by_nodes_that_do_not_answer(rig: Rig) -> None:
    for number in range(20):
        Neighbour(rig.bus.port(f"silent{number}"), 60 + number, None, actuator=True).speak()
    loop = asyncio.get_running_loop()
    began = loop.time()
    rig.bench.add(replace(PLAIN, node_id=50, servo_id=5))
    await rig.ready(2)
    assert loop.time() - began < 1.5


PATHS = ("/servos", "/nodes", "/allocations", "/bus", "/bus/doctor?all=true", "/health", "/stop")


def status(source: int, uptime: int, mode: int) -> list[Frame]:
    payload = NodeStatus(uptime, NodeHealth.OK, mode, 0, 0).encode()
    return split(Transfer(Kind.MESSAGE, NodeStatus.TYPE.id, source, 0, 24, uptime % 32, payload), NodeStatus.TYPE)


@pytest.mark.parametrize("source", [11, 60])
@pytest.mark.parametrize("mode", range(8))
@scene(*PAIR)
async def test_a_node_in_any_mode_reserved_ones_too_is_listed(rig: Rig, source: int, mode: int) -> None:
    servo = next(one for one in await rig.ready(2) if one.node_id == 11)
    page = Socket(rig.app)
    page.say(type="subscribe", topics=["servos"])
    await asyncio.sleep(0.1)
    at = 0 if servo.status is None else servo.status.uptime_sec
    rig.bus.port("odd").send(status(source, at, mode))
    await asyncio.sleep(0.1)
    [node] = [one for one in json(await rig.call("GET", "/nodes")) if one["node_id"] == source]
    assert node["mode"]
    assert len(json(await rig.call("GET", "/servos"))) == 2
    if mode in (4, 5, 6):
        assert node["mode"] == f"reserved_{mode}"
    await page.close()


@pytest.mark.parametrize("seed", range(3))
@scene(*PAIR)
async def test_noise_in_the_form_of_transfers_breaks_no_answer(rig: Rig, seed: int) -> None:
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
    pages[0].say(type="subscribe", topics=["frames", "servos"])
    pages[1].say(type="subscribe", topics=["frames"], frames={"view": "raw", "problems_only": True})
    pages[2].say(type="subscribe", topics=["frames"], frames={"text": "\0(([*\\", "type": "", "node_id": 0})
    port = rig.bus.port("odd")
    for value in (math.nan, math.inf, -math.inf, 65504.0):
        payload = ActuatorStatus(1, value, value, value, 0).encode()
        port.send(split(Transfer(Kind.MESSAGE, ActuatorStatus.TYPE.id, 11, 0, 16, 0, payload), ActuatorStatus.TYPE))
    for _ in range(60):
        port.send([noise() for _ in range(50)])
        await asyncio.sleep(0.02)
    await asyncio.sleep(1)
    for path in PATHS:
        answer = await rig.call("GET", path)
        assert answer.status_code == 200
        assert b"NaN" not in answer.content
        assert b"Infinity" not in answer.content
    for page in pages[:2]:
        assert sum(len(one.get("transfers", [])) + len(one.get("frames", [])) for one in page.heard()) > 100
    for page in pages:
        await page.close()
