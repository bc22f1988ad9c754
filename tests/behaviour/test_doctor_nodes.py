"""The bus doctor on who is there: each condition is injected, named by its cause alone, and gone when it has ended."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.patient import Applicant, Every, finds, stays, well
from behaviour.rig import PLAIN, Rig, json
from behaviour.scene import scene
from hornbill.node.allocation import serve_allocation
from hornbill.node.allocator import AllocationMode, Allocator
from hornbill.node.directory import Directory
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.units import Uid
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse
from unit.node.peer import Peer, participant

SIX = [replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(6)]
TWO = SIX[:2]
REFUSED = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")
DEAF_UID = bytes.fromhex("4f0a") + bytes(12) + bytes.fromhex("91c3")


@pytest.mark.parametrize("apart_s", [0.0, 0.37, 7.6])
@scene(*TWO)
async def test_two_nodes_with_one_node_id(rig: Rig, apart_s: float) -> None:
    await rig.ready(2)
    await asyncio.sleep(apart_s)
    twin = rig.bench.add(replace(PLAIN, node_id=10, servo_id=30, serial=99))
    found = await finds(rig, "duplicate_node_id", within_s=8)
    assert (found["severity"], found["node_ids"]) == ("failure", [10])
    assert "0x46" in str(found["remedy"])
    await stays(rig, "duplicate_node_id", for_s=10)
    await rig.bench.remove(Uid(twin.uid.hex()))
    if rig.host.fleet.knows(twin.uid.hex()):  # the last of the two that said who it is
        silent = await finds(rig, "servo_offline", within_s=15)
        assert silent["uids"] == [twin.uid.hex()]
    else:
        await well(rig, within_s=15)


@scene(PLAIN, replace(PLAIN, servo_id=2), replace(PLAIN, node_id=12, servo_id=3))
async def test_two_nodes_with_one_node_id_that_were_switched_on_together(rig: Rig) -> None:
    found = await finds(rig, "duplicate_node_id", within_s=8)
    assert found["node_ids"] == [11]
    await stays(rig, "duplicate_node_id", for_s=10)


@scene(*TWO)
async def test_another_node_with_hornbills_own_node_id(rig: Rig) -> None:
    await rig.ready(2)
    peer = Peer(rig.bus.port("stranger"), 127)
    saying = Every(1.0, peer.say_status)
    found = await finds(rig, "own_node_id", within_s=2)
    assert found["node_ids"] == [127]
    assert "HORNBILL_NODE_ID=126" in str(found["remedy"])
    await stays(rig, "own_node_id", for_s=10)
    await saying.stop()
    await well(rig, within_s=6)


@scene(*TWO)
async def test_two_servos_with_one_servo_id(rig: Rig) -> None:
    one, other = await rig.ready(2)
    # hornbill itself gives no id twice: another tool does
    row = other.registers["servo_id"].parameter
    await rig.host.requests.write(other, row, 1)
    found = await finds(rig, "duplicate_servo_id", within_s=2)
    assert found["severity"] == "failure"
    assert found["node_ids"] == [10, 11]
    assert set(found["uids"]) == {one.uid, other.uid}  # pyright: ignore[reportArgumentType]
    await stays(rig, "duplicate_servo_id", for_s=10)
    json(await rig.call("PATCH", f"/servos/{other.uid}/parameters", {"values": {"servo_id": 2}}))
    await well(rig, within_s=1)


@pytest.mark.parametrize("mode", [AllocationMode.ON, AllocationMode.FORCE])
@scene(PLAIN)
async def test_a_second_allocator(rig: Rig, mode: AllocationMode) -> None:
    await rig.ready(1)
    rig.host.connected().allocator.mode = mode
    store = Store("sqlite://")
    other = participant(rig.bus.port("other"), node_id=126)
    directory = Directory()
    allocator = Allocator(store.allocations, own_ids=frozenset({126}), known_nodes=directory, mode=AllocationMode.FORCE)
    other.start()
    directory.follow(other)
    serve_allocation(other, allocator)
    await asyncio.sleep(2)
    rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
    found = await finds(rig, "second_allocator", within_s=8)
    assert found["severity"] == ("warning" if mode is AllocationMode.ON else "failure")
    assert found["node_ids"] == [126]
    await stays(rig, "second_allocator", for_s=10)
    await other.close()
    await other.port.close()
    await well(rig, within_s=4)
    store.close()


@pytest.mark.parametrize("stage", [1, 2])
@scene(*TWO)
async def test_a_node_stuck_while_it_asks_for_a_node_id(rig: Rig, stage: int) -> None:
    await rig.ready(2)
    applicant = Applicant(rig.bus.port("applicant"), DEAF_UID, stage)
    found = await finds(rig, "allocation_stuck", within_s=5)
    assert found["severity"] == "warning"
    assert f"{stage} part" in str(found["evidence"])
    assert f"never part {stage + 1}" in str(found["evidence"])
    assert found["uids"] == [DEAF_UID[: 6 * stage].hex()]
    await stays(rig, "allocation_stuck", for_s=10)
    await applicant.leave()
    await well(rig, within_s=6)


@scene(*TWO)
async def test_a_node_that_does_not_take_the_id_it_is_given(rig: Rig) -> None:
    await rig.ready(2)
    applicant = Applicant(rig.bus.port("applicant"), DEAF_UID, 3)
    found = await finds(rig, "allocation_stuck", within_s=6)
    assert found["node_ids"] == [125]
    assert found["uids"] == [DEAF_UID.hex()]
    await stays(rig, "allocation_stuck", for_s=10)
    await applicant.leave()
    await well(rig, within_s=6)


@scene(*TWO)
async def test_a_node_that_waits_while_the_allocator_is_off(rig: Rig) -> None:
    await rig.ready(2)
    allocator = rig.host.connected().allocator
    allocator.mode = AllocationMode.OFF
    rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
    found = await finds(rig, "allocator_off", within_s=5)
    assert '"mode": "on"' in str(found["remedy"])
    await stays(rig, "allocator_off", for_s=10)
    allocator.mode = AllocationMode.ON
    await well(rig, within_s=3)


@scene(*TWO)
async def test_a_node_for_which_no_node_id_is_left(rig: Rig) -> None:
    await rig.ready(2)
    table = rig.host.store.allocations
    for number in range(1, 126):
        table.record(Uid(f"{number:032x}"), number)  # pyright: ignore[reportArgumentType]
    servo = rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
    found = await finds(rig, "allocation_refused", within_s=5)
    assert found["severity"] == "failure"
    assert found["uids"] == [servo.uid.hex()]
    await stays(rig, "allocation_refused", for_s=10)
    table.drop(Uid(f"{77:032x}"))
    await well(rig, within_s=5)


@scene(*TWO)
async def test_a_servo_that_goes_on_talking_and_does_not_answer(rig: Rig) -> None:
    one, _ = await rig.ready(2)
    rig.sim(one).conditions.drop_responses_pct = 100
    found = await finds(rig, "silent_node", within_s=5)
    assert (found["severity"], found["node_ids"], found["uids"]) == ("warning", [10], [one.uid])
    assert "without a response" in str(found["evidence"])
    await stays(rig, "silent_node", for_s=10)
    rig.sim(one).conditions.drop_responses_pct = 0
    await well(rig, within_s=12)


@scene(*TWO, replace(PLAIN, node_id=40, servo_id=9, uid=bytes(range(16))))
async def test_a_servo_that_never_answered_is_found_as_well(rig: Rig) -> None:
    servo = rig.bench.servo(Uid(bytes(range(16)).hex()))
    servo.conditions.drop_responses_pct = 100
    found = await finds(rig, "silent_node", within_s=6)
    assert found["node_ids"] == [40]
    await stays(rig, "silent_node", for_s=60)
    servo.conditions.drop_responses_pct = 0
    await well(rig, within_s=35)


@scene(*TWO)
async def test_a_node_that_says_nodestatus_and_answers_nothing(rig: Rig) -> None:
    await rig.ready(2)
    peer = Peer(rig.bus.port("stranger"), 50, drop=lambda _: True)
    saying = Every(1.0, peer.say_status)
    found = await finds(rig, "silent_node", within_s=8)
    assert found["node_ids"] == [50]
    await stays(rig, "silent_node", for_s=10)
    await saying.stop()
    await well(rig, within_s=4)


@scene(*TWO)
async def test_a_foreign_node_that_refuses_is_no_finding(rig: Rig) -> None:
    await rig.ready(2)
    stranger = participant(rig.bus.port("stranger"), node_id=50)  # it answers GetNodeInfo, and never GetSet
    stranger.start()
    refusing = Peer(rig.bus.port("refusing"), 51, reply=lambda _: REFUSED)
    info = participant(rig.bus.port("info"), node_id=51)
    info.start()
    await stays(rig, for_s=40)
    assert refusing.requests
    await stranger.close()
    await info.close()


@scene(*TWO)
async def test_a_servo_that_goes_silent_while_the_bus_goes_on(rig: Rig) -> None:
    one, _ = await rig.ready(2)
    rig.bench.power(one.uid, False)
    found = await finds(rig, "servo_offline", within_s=4)
    assert (found["severity"], found["uids"]) == ("warning", [one.uid])
    await stays(rig, "servo_offline", for_s=10)
    rig.bench.power(one.uid, True)
    await well(rig, within_s=3)


@scene(*TWO)
async def test_answers_that_get_lost(rig: Rig) -> None:
    one, _ = await rig.ready(2)
    rig.sim(one).conditions.drop_responses_pct = 25
    found = await finds(rig, "responses_lost", within_s=15)
    assert (found["severity"], found["node_ids"]) == ("warning", [10])
    rig.sim(one).conditions.drop_responses_pct = 0
    await well(rig, within_s=12)


@scene(*TWO)
async def test_answers_that_come_late(rig: Rig) -> None:
    await rig.ready(2)
    late = [0.08]
    peer = Peer(rig.bus.port("stranger"), 50, delay=lambda _: late[0])
    info = participant(rig.bus.port("info"), node_id=50)
    info.start()

    async def read() -> None:
        while True:
            await rig.host.connected().participant.request(50, GetSetRequest(0, EMPTY, "0x08"))

    reading = asyncio.create_task(read())
    found = await finds(rig, "responses_slow", within_s=5)
    assert found["node_ids"] == [50]
    assert "80.5 ms" in str(found["evidence"]) or "slowest 8" in str(found["evidence"])
    reading.cancel()
    late[0] = 0.001  # it is a servo of an unknown series, which is read all the time
    await asyncio.gather(reading, return_exceptions=True)
    await well(rig, within_s=11)
    assert len(peer.requests) > 10
    await info.close()
