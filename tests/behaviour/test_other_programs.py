"""Other programs on the bus: hornbill's own node id in use, who commands servos, and servos that share servo id 0."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.patient import Every, codes, finds, stays, well
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


def position(servo_id: int, value: float = 0.0) -> ArrayCommand:
    return ArrayCommand([ActuatorCommand(servo_id, CommandType.POSITION, value)])


@scene(*TWO)
async def test_requests_of_the_makers_program_to_others_are_noticed_at_once_and_named(rig: Rig) -> None:
    await rig.ready(2)
    other = rig.bus.port("other")
    asking = Every(0.1, lambda _: other.send([READS_0X2C]))
    found = await finds(rig, "makers_program", within_s=0.3)
    assert (found["severity"], found["node_ids"]) == ("failure", [127])
    assert "Futaba's configuration program" in str(found["text"])
    assert "HORNBILL_NODE_ID=126" in str(found["remedy"])
    await asyncio.sleep(0.3)
    (event,) = rig.events("own_node_id")
    assert (event.level, event.params["makers_program"]) == ("warning", True)
    await stays(rig, "makers_program", for_s=10)
    assert len(rig.events("own_node_id")) == 1
    await asking.stop()
    await well(rig, within_s=6)


@scene(*TWO)
async def test_a_program_that_reads_by_index_is_not_taken_for_the_makers(rig: Rig) -> None:
    await rig.ready(2)
    other = rig.bus.port("other")
    asking = Every(0.1, lambda _: other.send([READS_BY_INDEX]))
    found = await finds(rig, "own_node_id", within_s=0.3)
    assert "to other nodes" in str(found["evidence"])
    await asking.stop()


@scene(*TWO)
async def test_a_program_with_the_same_name_reads_that_says_nodestatus_is_not_taken_for_the_makers(rig: Rig) -> None:
    await rig.ready(2)
    other = Peer(rig.bus.port("other"), 127)
    other.say_status(900)
    other.port.send([READS_0X2C])
    await finds(rig, "own_node_id", within_s=0.3)


@scene(*TWO)
async def test_hornbill_gives_no_node_ids_beside_a_program_with_its_node_id_until_a_minute_later(rig: Rig) -> None:
    await rig.ready(2)
    other = rig.bus.port("other")
    asking = Every(0.1, lambda _: other.send([READS_0X2C]))
    await asyncio.sleep(0.3)
    state = json(await rig.call("GET", "/bus"))["allocator"]
    assert (state["state"], state["own_id_shared"], state["competing_node_id"]) == ("standby", True, None)
    new = rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
    await asyncio.sleep(20)
    assert new.node_id == 0
    await asking.stop()
    await asyncio.sleep(SHARED_FOR_S - 2)
    assert new.node_id == 0
    await rig.ready(3)
    assert new.node_id == 125
    (event,) = rig.events("own_node_id_alone")
    assert (event.level, event.params) == ("notice", {"node_id": 127, "allocator": "on"})
    assert json(await rig.call("GET", "/bus"))["allocator"]["own_id_shared"] is False


@scene(*TWO)
async def test_a_stray_frame_is_told_and_does_not_end_the_allocator(rig: Rig) -> None:
    await rig.ready(2)
    Peer(rig.bus.port("stray"), 127).say_status(900)
    await finds(rig, "own_node_id", within_s=0.3)
    assert json(await rig.call("GET", "/bus"))["allocator"]["state"] == "on"
    assert rig.events("own_node_id") == []
    await well(rig, within_s=6)


@scene(*TWO)
async def test_told_to_insist_it_gives_node_ids_all_the_same(rig: Rig) -> None:
    await rig.ready(2)
    other = rig.bus.port("other")
    asking = Every(0.1, lambda _: other.send([READS_0X2C]))
    await asyncio.sleep(0.3)
    answer = json(await rig.call("PUT", "/bus/allocator", {"mode": AllocationMode.FORCE}))
    assert answer["state"] == "on"
    new = rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
    await rig.ready(3)
    assert new.node_id == 125
    await asking.stop()


@scene(*TWO)
async def test_frames_that_the_adapter_returns_are_not_another_program(rig: Rig) -> None:
    returning = rig.bus.port("returning")

    def back(frames: list[Frame]) -> None:
        again = [frame for frame in frames if frame.id & 0x7F == 127]
        if again:
            asyncio.get_running_loop().call_later(0.02, returning.send, again)

    returning.listen(back)
    await rig.ready(2)
    await asyncio.sleep(5)
    assert rig.host.connected().participant.shared_id.frames == 0
    assert rig.events("own_node_id") == []
    assert codes(rig) == []


def autopilot(rig: Rig, node_id: int, name: str) -> Participant:
    it = Participant(
        rig.bus.port("autopilot"),
        node_id=node_id,
        name=name,
        unique_id=bytes(16),
        software_version=SoftwareVersion(4, 5),
    )
    it.start()
    return it


@pytest.mark.parametrize(
    ("node_id", "name", "servo_id", "program"),
    [
        (33, "org.ardupilot:0", 7, "ArduPilot"),
        (34, "org.pixhawk.px4_fmu-v5", 7, "PX4"),
        (35, "org.example", 7, None),
        (10, "org.example", 7, "probably ArduPilot"),
        (1, "org.example", 0, "probably PX4"),
        (10, "org.example", 0, None),
    ],
)
@scene(*TWO)
async def test_who_commands_servos_is_named_by_its_name_or_its_habits(
    rig: Rig, node_id: int, name: str, servo_id: int, program: str | None
) -> None:
    await rig.ready(2)
    it = autopilot(rig, node_id, name)
    await asyncio.sleep(2)
    commanding = Every(0.02, lambda _: it.broadcast(position(servo_id), priority=16))
    found = await finds(rig, "other_commands", within_s=2)
    assert (found["severity"], found["node_ids"]) == ("notice", [node_id])
    told = f"Node {node_id} commands servos"
    assert found["text"] == (told if program is None else f"{told}: {program}")
    assert f"servo ids {servo_id}" in str(found["evidence"])
    await commanding.stop()
    await it.close()


@scene(*NEW)
async def test_servos_without_a_servo_id_are_told_to_move_together(rig: Rig) -> None:
    one, other = await rig.ready(2)
    found = await finds(rig, "servos_without_id", within_s=3)
    assert (found["severity"], found["node_ids"]) == ("notice", [20, 21])
    assert set(found["uids"]) == {one.uid, other.uid}
    peer = Peer(rig.bus.port("px4"), 1)
    commanding = Every(0.1, lambda _: peer.send(Kind.MESSAGE, position(0)))
    await finds(rig, "servos_without_id", "other_commands", within_s=1)
    assert json(await rig.call("GET", "/bus/doctor"))[0]["severity"] == "failure"
    await commanding.stop()
    json(await rig.call("PATCH", f"/servos/{one.uid}/parameters", {"values": {"servo_id": 9}}))
    await well(rig, within_s=7)


@scene(NEW[0], TWO[1])
async def test_one_servo_without_a_servo_id_is_no_finding(rig: Rig) -> None:
    await rig.ready(2)
    await stays(rig, for_s=10)
