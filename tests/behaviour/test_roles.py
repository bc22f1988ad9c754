"""Connection roles beside an autopilot: what host, guest and observer send, and who commands a servo."""

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import pytest

from behaviour.diagnosis import Every
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.node.participant import Participant
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorCommand, AllocationMessage, ArrayCommand, CommandType
from hornbill.wire.services import SoftwareVersion
from hornbill.wire.transfer import Transfer
from unit.node.peer import Peer

TWO = [replace(PLAIN, node_id=20, servo_id=1), replace(PLAIN, node_id=21, servo_id=2)]
AUTOPILOT = 10


def command(servo_id: int, value: float, kind: CommandType = CommandType.UNITLESS) -> ArrayCommand:
    return ArrayCommand([ActuatorCommand(servo_id, kind, value)])


@asynccontextmanager
async def autopilot(rig: Rig, *commands: ArrayCommand, rate_hz: float = 50.0) -> AsyncGenerator[Participant]:
    """Node 10, which repeats these commands."""
    node = Participant(
        rig.bus.port("autopilot"), node_id=AUTOPILOT, name="org.ardupilot:0", unique_id=bytes(range(16)),
        software_version=SoftwareVersion(4, 5),
    )  # fmt: skip
    node.start()

    def send(_count: int) -> None:
        for message in commands:
            node.broadcast(message, priority=16)

    sending = Every(1 / rate_hz, send)
    yield node
    await sending.stop()
    await node.close()


async def connect(rig: Rig, role: str) -> dict[str, Any]:
    return json(await rig.call("PUT", "/bus", {"address": "memory:host", "role": role}))


async def servo_of(rig: Rig, servo: Servo) -> dict[str, Any]:
    return json(await rig.call("GET", f"/servos/{servo.uid}"))


def sent(rig: Rig, since: int = 0) -> list[Transfer]:
    """Transfers of the host from the one with this number on."""
    return rig.transfers("host")[since:]


@scene(*TWO, connect=False)
async def test_an_observer_sends_not_one_frame(rig: Rig) -> None:
    async with autopilot(rig, command(1, 0.25)):
        bus = await connect(rig, "observer")
        assert (bus["role"], bus["listen_only"], bus["allocator"]["state"]) == ("observer", False, "off")
        rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))  # requests a node ID
        await asyncio.sleep(30)
        for verb, path, body in (
            ("GET", "/servos", None), ("GET", "/nodes", None), ("GET", "/bus/doctor", None), ("GET", "/stop", None),
            ("POST", "/stop", {"mode": "off"}), ("DELETE", "/stop", None),
        ):  # fmt: skip
            assert (await rig.call(verb, path, body)).status_code == 200, path
        await rig.cable.unplug()
        await asyncio.sleep(3)
        rig.cable.plug_in()
        await asyncio.sleep(330)  # longer than any request is postponed
    assert rig.host.connected().port.statistics.tx_frames == 0
    assert rig.transfers("host") == []
    nodes = {one["node_id"]: one for one in json(await rig.call("GET", "/nodes"))}
    assert nodes[20]["online"]


@scene(*TWO, connect=False)
async def test_stop_of_an_observer_says_that_nothing_was_sent(rig: Rig) -> None:
    await connect(rig, "observer")
    await asyncio.sleep(2)
    stop = json(await rig.call("POST", "/stop", {"mode": "off"}))
    assert (stop["latched"], stop["reach"], stop["reaches"], stop["servos"], stop["nodes"]) == (
        True,
        "none",
        [],
        [],
        [],
    )
    (event,) = rig.events("stopped")
    assert "sends nothing" in event.text
    assert rig.transfers("host") == []


@scene(*TWO, connect=False)
async def test_a_guest_allocates_nothing_and_reads_little(rig: Rig) -> None:
    bus = await connect(rig, "guest")
    joined = len(rig.transfers("host"))
    await asyncio.sleep(3)
    reads = [one for one in rig.transfers("host")[joined:] if one.destination]
    assert 4 * len(reads) / 3 <= 204, "frames per second while the servos are identified"
    assert (bus["role"], bus["allocator"]["state"]) == ("guest", "off")
    new = rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
    first, second = await rig.ready(2)
    for each in (first, second):
        body = {"channels": ["current_angle", "current_torque"], "rate_hz": 200}
        json(await rig.call("PUT", f"/servos/{each.uid}/telemetry", body))
    await asyncio.sleep(5)
    before = rig.host.connected().port.statistics
    frames = before.rx_frames + before.tx_frames
    own = len(rig.transfers("host"))
    await asyncio.sleep(20)
    requests = [one for one in rig.transfers("host")[own:] if one.destination]
    assert 4 * len(requests) / 20 <= 200, "frames per second of reads"
    assert before.rx_frames + before.tx_frames > frames
    assert new.node_id == 0


@pytest.mark.parametrize("rate_hz", [50, 200, 400])
@scene(*TWO)
async def test_a_commanded_servo_names_node_rate_and_target(rig: Rig, rate_hz: int) -> None:
    first, second = await rig.ready(2)
    async with autopilot(rig, command(1, 0.1234), command(2, 0.25, CommandType.POSITION), rate_hz=rate_hz):
        await asyncio.sleep(4)
        by_unitless = (await servo_of(rig, first))["commanded_by"]
        by_position = (await servo_of(rig, second))["commanded_by"]
        assert [one["node_id"] for one in by_unitless + by_position] == [AUTOPILOT, AUTOPILOT]
        assert [one["type"] for one in by_unitless + by_position] == ["unitless", "position"]
        assert by_unitless[0]["name"] == "org.ardupilot:0"
        assert by_unitless[0]["rate_hz"] == pytest.approx(rate_hz, rel=0.02)
        for by, servo in ((by_unitless[0], first), (by_position[0], second)):
            held = rig.sim(servo).memory.get(0x00) / 10
            assert by["command_deg"] == pytest.approx(held, abs=0.05)
            assert abs(by["error_deg"]) < 1
    await asyncio.sleep(1.2)
    assert (await servo_of(rig, first))["commanded_by"] == []
    assert len(rig.events("commanded_elsewhere")) == 2


@scene(*TWO)
async def test_motion_is_refused_from_the_first_foreign_command_on(rig: Rig) -> None:
    first, second = await rig.ready(2)
    lease = await rig.lease()
    async with autopilot(rig, command(1, 0.0)):
        await asyncio.sleep(1 / 50 + 0.005)
        body = {"type": "angle", "value": 5}
        response = await rig.call("POST", f"/servos/{first.uid}/command", body, lease=lease)
        found = problem(response, "commanded_elsewhere", 409)
        assert found["node_id"] == AUTOPILOT
        json(await rig.call("POST", f"/servos/{second.uid}/torque", {"mode": "on"}, lease=lease))
    await asyncio.sleep(1.1)
    json(await rig.call("POST", f"/servos/{first.uid}/torque", {"mode": "on"}, lease=lease))


@scene(*TWO)
async def test_our_command_ends_when_another_node_begins_and_torque_stays_on(rig: Rig) -> None:
    first, _ = await rig.ready(2)
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{first.uid}/torque", {"mode": "on"}, lease=lease))
    assert rig.host.motion.is_commanded(first.uid)
    async with autopilot(rig, command(1, 0.05)):
        await asyncio.sleep(0.03)
        assert not rig.host.motion.is_commanded(first.uid)
        (event,) = rig.events("motion_yielded")
        assert (event.uid, event.params["node_id"]) == (first.uid, AUTOPILOT)
        writes = len(rig.writes())
        await asyncio.sleep(1)
        assert (await rig.call("DELETE", f"/leases/{lease}")).is_success
        await asyncio.sleep(1)
        assert rig.writes()[writes:] == [], "the end of our lease does not take the servo from the autopilot"
        assert rig.sim(first).memory.get(0x20) == 0
        assert rig.sim(first).angle_deg == pytest.approx(9, abs=1)


@scene(*TWO, connect=False)
async def test_stop_of_a_guest_reaches_only_what_hornbill_commands_unless_confirmed(rig: Rig) -> None:
    await connect(rig, "guest")
    first, second = await rig.ready(2)
    lease = await rig.lease()
    async with autopilot(rig, command(1, 0.1)):
        json(await rig.call("POST", f"/servos/{second.uid}/torque", {"mode": "on"}, lease=lease))
        await asyncio.sleep(0.5)
        assert json(await rig.call("GET", "/stop"))["reaches"] == [second.uid]
        before = len(rig.writes())
        stop = json(await rig.call("POST", "/stop", {"mode": "off"}))
        assert (stop["reach"], [one["uid"] for one in stop["servos"]]) == ("own", [second.uid])
        await asyncio.sleep(2)
        assert {node for node, name, _ in rig.writes()[before:] if name == "0x20"} == {21}
        assert rig.sim(first).memory.get(0x20) == 0
        assert rig.sim(second).memory.get(0x20) == 1
        stop = json(await rig.call("POST", "/stop", {"mode": "off", "everyone": True}))
        assert (stop["reach"], len(stop["servos"])) == ("all", 2)
        assert rig.sim(first).memory.get(0x20) == 1


@pytest.mark.parametrize(
    ("heard", "role", "what"),
    [("commands", "guest", "commands"), ("allocates", "guest", "allocates"), ("nothing", "host", None)],
)
@scene(*TWO, connect=False)
async def test_auto_listens_first_and_is_a_guest_beside_an_autopilot(
    rig: Rig, heard: str, role: str, what: str | None
) -> None:
    peer = Peer(rig.bus.port("peer"), AUTOPILOT)
    messages = {"commands": command(7, 0.0), "allocates": AllocationMessage(0, False, bytes(6))}
    sending = Every(0.5, lambda _: peer.send(Kind.MESSAGE, messages[heard]) if heard in messages else None)
    await asyncio.sleep(0.1)
    began = asyncio.get_running_loop().time()
    connecting = asyncio.create_task(rig.host.connect("memory:host", 1_000_000, None))
    await asyncio.sleep(1.4)
    assert rig.transfers("host") == [], "nothing is sent while listening"
    connection = await connecting
    assert asyncio.get_running_loop().time() - began == pytest.approx(1.5, abs=0.05)
    assert connection.role == role
    reason = connection.role_reason
    assert (None if reason is None else reason.params["what"]) == what
    await sending.stop()


@scene(*TWO)
async def test_a_role_is_remembered_for_its_adapter_and_changed_without_motion(rig: Rig) -> None:
    await rig.ready(2)
    assert rig.host.roles.choose("socketcan:can0", None) is None
    assert rig.host.roles.choose("socketcan:can0", "observer") == "observer"
    assert rig.host.roles.choose("socketcan:can0?frame_gap_ms=2", None) == "observer"
    assert rig.host.roles.choose("socketcan:can0", "auto") is None
    assert json(await rig.call("PUT", "/bus/role", {"role": "guest"}))["role"] == "guest"
    await rig.ready(2)
    count = len(rig.transfers("host"))
    assert json(await rig.call("PUT", "/bus/role", {"role": "observer"}))["role"] == "observer"
    await asyncio.sleep(5)
    assert sent(rig, count) == []
    problem(await rig.call("PUT", "/bus/role", {"role": "auto"}), "invalid_value", 422)


@scene(TWO[0])
async def test_a_gap_longer_than_the_timeout_is_reported_with_what_the_servo_does(rig: Rig) -> None:
    (servo,) = await rig.ready(1)
    async with autopilot(rig, command(1, 0.05)):
        await asyncio.sleep(2)
    await asyncio.sleep(0.9)
    assert rig.events("command_lost") == []
    await until(lambda: bool(rig.events("command_lost")), 0.5)
    (event,) = rig.events("command_lost")
    assert event.params == {"servo": servo.title, "node_id": AUTOPILOT, "timeout_s": 1.0, "action": "off"}
    await asyncio.sleep(0.2)
    assert (await servo_of(rig, servo))["output"]["reason"] == "timeout"
