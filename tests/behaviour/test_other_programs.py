"""Other programs on the bus: hornbill's own node ID in use, who commands servos, and servos that share servo ID 0."""

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from behaviour.diagnosis import Every, codes, finds, stays, well
from behaviour.rig import PLAIN, Rig, json
from behaviour.scene import scene
from hornbill.node.allocator import AllocationMode
from hornbill.node.participant import Participant
from hornbill.servo.monitoring.node_id_table import SHARED_FOR_S
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType
from hornbill.wire.services import SoftwareVersion
from unit.node.peer import Peer

TWO = [replace(PLAIN, node_id=20, servo_id=1), replace(PLAIN, node_id=21, servo_id=2)]
NEW = [replace(PLAIN, node_id=20, servo_id=0), replace(PLAIN, node_id=21, servo_id=0)]

READS_0X2C = Frame(0x1E0B94FF, bytes.fromhex("000030783243c5"))
"""A read of the maker's program: GetSet from node 127 to node 20 at priority 30, by index 0 and a name."""
READS_BY_INDEX = Frame(0x1E0B94FF, bytes.fromhex("0000c5"))


def position(servo_id: int) -> ArrayCommand:
    return ArrayCommand([ActuatorCommand(servo_id, CommandType.POSITION, 0.0)])


@asynccontextmanager
async def program(rig: Rig, frame: Frame = READS_0X2C) -> AsyncGenerator[None]:
    """A program with our node ID that reads from a servo ten times a second."""
    await rig.ready(2)
    port = rig.bus.port("other")
    reading = Every(0.1, lambda _: port.send([frame]))
    yield
    await reading.stop()


@scene(*TWO)
async def test_the_makers_program_is_reported_at_once_and_named(rig: Rig) -> None:
    async with program(rig):
        found = await finds(
            rig, "makers_program", within_s=0.3, severity="failure", node_ids=[127], remedy="HORNBILL_NODE_ID=126"
        )
        assert "Futaba's configuration program" in str(found["text"])
        await asyncio.sleep(0.3)
        (event,) = rig.events("own_node_id")
        assert (event.level, event.params["makers_program"]) == ("warning", True)
        await stays(rig, "makers_program", for_s=10)
        assert len(rig.events("own_node_id")) == 1
    await well(rig, within_s=6)


@scene(*TWO)
async def test_a_program_that_reads_by_index_is_not_the_makers(rig: Rig) -> None:
    async with program(rig, READS_BY_INDEX):
        await finds(rig, "own_node_id", within_s=0.3, evidence="to other nodes")


@scene(*TWO)
async def test_no_node_ids_are_allocated_until_a_minute_after_a_program_with_our_node_id(rig: Rig) -> None:
    async with program(rig):
        await asyncio.sleep(0.3)
        state = json(await rig.call("GET", "/bus"))["allocator"]
        assert (state["state"], state["own_id_shared"], state["competing_node_id"]) == ("standby", True, None)
        new = rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
        await asyncio.sleep(20)
        assert new.node_id == 0
    await asyncio.sleep(SHARED_FOR_S - 2)
    assert new.node_id == 0
    await rig.ready(3)
    assert new.node_id == 125
    (event,) = rig.events("own_node_id_alone")
    assert (event.level, event.params) == ("notice", {"node_id": 127, "allocator": "on"})
    assert json(await rig.call("GET", "/bus"))["allocator"]["own_id_shared"] is False


@scene(*TWO)
async def test_a_single_frame_is_reported_and_does_not_stop_the_allocator(rig: Rig) -> None:
    await rig.ready(2)
    Peer(rig.bus.port("stray"), 127).say_status(900)
    await finds(rig, "own_node_id", within_s=0.3)
    assert json(await rig.call("GET", "/bus"))["allocator"]["state"] == "on"
    assert rig.events("own_node_id") == []
    await well(rig, within_s=6)


@scene(*TWO)
async def test_a_forced_allocator_allocates_beside_it(rig: Rig) -> None:
    async with program(rig):
        await asyncio.sleep(0.3)
        state = json(await rig.call("PUT", "/bus/allocator", {"mode": AllocationMode.FORCE}))
        assert state["state"] == "on"
        new = rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
        await rig.ready(3)
        assert new.node_id == 125


@scene(*TWO)
async def test_frames_echoed_by_the_adapter_are_not_another_program(rig: Rig) -> None:
    echoing = rig.bus.port("echoing")

    def echo(frames: list[Frame]) -> None:
        own = [frame for frame in frames if frame.id & 0x7F == 127]
        if own:
            asyncio.get_running_loop().call_later(0.02, echoing.send, own)

    echoing.listen(echo)
    await rig.ready(2)
    await asyncio.sleep(5)
    assert rig.host.connected().participant.shared_id.frames == 0
    assert rig.events("own_node_id") == []
    assert codes(rig) == []


@pytest.mark.parametrize(
    ("node_id", "name", "servo_id", "named"),
    [
        (33, "org.ardupilot:0", 7, ": ArduPilot"),
        (34, "org.pixhawk.px4_fmu-v5", 7, ": PX4"),
        (35, "org.example", 7, ""),
        (10, "org.example", 7, ": probably ArduPilot"),
        (1, "org.example", 0, ": probably PX4"),
        (10, "org.example", 0, ""),
    ],
)
@scene(*TWO)
async def test_a_program_that_commands_servos_is_identified_by_its_name_or_its_habits(
    rig: Rig, node_id: int, name: str, servo_id: int, named: str
) -> None:
    await rig.ready(2)
    version = SoftwareVersion(4, 5)
    autopilot = Participant(
        rig.bus.port("autopilot"), node_id=node_id, name=name, unique_id=bytes(16), software_version=version
    )
    autopilot.start()
    await asyncio.sleep(2)
    commanding = Every(0.02, lambda _: autopilot.broadcast(position(servo_id), priority=16))
    text = f"Node {node_id} commands servos{named}"
    evidence = f"servo IDs {servo_id}"
    await finds(rig, "other_commands", within_s=2, severity="notice", node_ids=[node_id], text=text, evidence=evidence)
    await commanding.stop()
    await autopilot.close()


@scene(*NEW)
async def test_servos_without_a_servo_id_are_reported_as_moving_together_but_not_a_single_one(rig: Rig) -> None:
    one, other = await rig.ready(2)
    found = await finds(rig, "servos_without_id", within_s=3, severity="notice", node_ids=[20, 21])
    assert set(found["uids"]) == {one.uid, other.uid}
    peer = Peer(rig.bus.port("px4"), 1)
    commanding = Every(0.1, lambda _: peer.send(Kind.MESSAGE, position(0)))
    await finds(rig, "servos_without_id", "other_commands", within_s=1, severity="failure")
    await commanding.stop()
    json(await rig.call("PATCH", f"/servos/{one.uid}/parameters", {"values": {"servo_id": 9}}))
    await well(rig, within_s=7)
