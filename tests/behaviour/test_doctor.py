"""The bus doctor: each condition is caused, reported by its own code alone, and gone when it has ended."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

import pytest

from behaviour.diagnosis import Applicant, Every, codes, finds, stays, well
from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from hornbill.node.allocation import serve_allocation
from hornbill.node.allocator import AllocationMode, Allocator
from hornbill.node.directory import Directory
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.units import Uid
from hornbill.wire.frame import Frame
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse
from unit.node.peer import Peer, participant

SIX = [replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(6)]
TWO = SIX[:2]
REFUSED = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")
DEAF_UID = bytes.fromhex("4f0a") + bytes(12) + bytes.fromhex("91c3")
TWIN_UID = Uid("7e" * 16)
TWIN = replace(PLAIN, node_id=10, servo_id=30, uid=bytes.fromhex(TWIN_UID))


@scene(*TWO)
async def test_without_a_bus_the_last_failed_attempt_is_reported_until_a_success_or_a_disconnect(rig: Rig) -> None:
    await rig.ready(2)
    assert codes(rig) == []
    json(await rig.call("DELETE", "/bus"))
    await finds(rig, "no_bus", within_s=1, remedy="PUT /api/v1/bus")
    broken = {"address": "memory:broken"}
    problem(await rig.call("PUT", "/bus", broken), "bus_open_failed", 502)
    await finds(
        rig, "adapter_failed", within_s=1, severity="failure", evidence="The adapter is broken. Take another."
    )  # fmt: skip
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await well(rig, within_s=1)
    json(await rig.call("DELETE", "/bus"))
    assert codes(rig) == ["no_bus"], "that failure is over"
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    problem(await rig.call("PUT", "/bus", broken), "bus_open_failed", 502)
    json(await rig.call("DELETE", "/bus"))
    assert codes(rig) == ["no_bus"]


async def unplug(rig: Rig) -> Callable[[], object]:
    await rig.cable.unplug()
    return rig.cable.plug_in


async def mute(rig: Rig) -> Callable[[], object]:
    everyone = [one.conditions for one in rig.bench.servos.values()]

    def set_mute(on: bool) -> None:
        for conditions in everyone:
            conditions.mute = on

    set_mute(True)
    return lambda: set_mute(False)


async def corrupt(rig: Rig) -> Callable[[], object]:
    rig.bus.corruption(4)
    return lambda: rig.bus.corruption(0)


async def deafen(rig: Rig) -> Callable[[], object]:
    rig.cable.deafen(5)
    return lambda: rig.cable.deafen(0)


@pytest.mark.parametrize(
    ("cause", "code", "within_s", "severity", "evidence", "remedy", "gone_s"),
    [
        (unplug, "adapter_lost", 1, "failure", "", "", 8),
        (mute, "no_traffic", 4, "failure", "0 frames and 0 errors", "120 Ω", 1),
        (corrupt, "errors_rising", 8, "warning", "", "", 12),
        (deafen, "frames_dropped", 5, "warning", "% of the received frames", "", 12),
    ],
)
@scene(*TWO)
async def test_a_condition_of_the_wire(
    rig: Rig, cause: Callable[[Rig], Awaitable[Callable[[], object]]], code: str, within_s: float, severity: str,
    evidence: str, remedy: str, gone_s: float,
) -> None:  # fmt: skip
    await rig.ready(2)
    end = await cause(rig)
    await finds(rig, code, within_s=within_s, for_s=12, severity=severity, evidence=evidence, remedy=remedy)
    end()
    await well(rig, within_s=gone_s)


@scene(*SIX)
async def test_our_wrong_bit_rate_is_only_error_frames_and_names_the_rate(rig: Rig) -> None:
    await rig.ready(6)
    json(await rig.call("PUT", "/bus", {"address": "memory:host", "bitrate": 500_000}))
    await finds(rig, "only_errors", "bus_off", "bit_rate", within_s=10)
    await asyncio.sleep(10)
    await finds(rig, "only_errors", "bus_off", "bit_rate", within_s=2, evidence="at 0.5 Mbit/s")
    json(await rig.call("PUT", "/bus", {"address": "memory:host", "bitrate": 1_000_000}))
    await well(rig, within_s=1)


@scene(*TWO)
async def test_alone_on_the_bus_frames_are_unacknowledged(rig: Rig) -> None:
    for servo in await rig.ready(2):
        await rig.bench.remove(servo.uid)
    await finds(
        rig, "unacknowledged", within_s=4, for_s=15, severity="failure",
        evidence="without acknowledgement and 0 frames",
    )  # fmt: skip
    rig.bench.add(replace(PLAIN, node_id=20, servo_id=9))
    await finds(rig, "servo_offline", "servo_offline", within_s=5)
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await well(rig, within_s=3)


@scene(*TWO)
async def test_bus_off_is_a_failure_and_a_warning_for_a_while_after_it(rig: Rig) -> None:
    await rig.ready(2)
    rig.cable.bus_off()
    await finds(rig, "bus_off", within_s=0.5, severity="failure", evidence="1 time since connecting")
    await asyncio.sleep(2)  # it was reopened meanwhile
    await finds(rig, "bus_off", within_s=1, severity="warning")
    await well(rig, within_s=31)


@scene(*TWO)
async def test_a_foreign_node_that_fills_the_bus_exceeds_the_budget(rig: Rig) -> None:
    await rig.ready(2)
    foreign = rig.bus.port("foreign")
    frames = [Frame(0x1F00_1155, bytes(8))] * 4
    flood = Every(0.001, lambda _: foreign.send(frames))
    await finds(rig, "load_over_budget", within_s=7, for_s=3, severity="warning", evidence="limit 40 %")
    await flood.stop()
    await well(rig, within_s=5)


@pytest.mark.parametrize("apart_s", [None, 0.37, 7.6])
@scene(lambda apart_s: (*TWO, TWIN) if apart_s is None else TWO)
async def test_two_nodes_with_one_node_id(rig: Rig, apart_s: float | None) -> None:
    """The second is there from the start, or added later."""
    if apart_s is not None:
        await rig.ready(2)
        await asyncio.sleep(apart_s)
        rig.bench.add(TWIN)
    await finds(rig, "duplicate_node_id", within_s=8, for_s=10, severity="failure", node_ids=[10], remedy="0x46")
    if apart_s is None:
        return
    await rig.bench.remove(TWIN_UID)
    if rig.host.fleet.knows(TWIN_UID):  # it identified itself last
        silent = await finds(rig, "servo_offline", within_s=15)
        assert silent["uids"] == [TWIN_UID]
    else:
        await well(rig, within_s=15)


@scene(*TWO)
async def test_a_node_with_our_own_node_id(rig: Rig) -> None:
    await rig.ready(2)
    peer = Peer(rig.bus.port("foreign"), 127)
    sending = Every(1.0, peer.say_status)
    await finds(rig, "own_node_id", within_s=2, for_s=10, node_ids=[127], remedy="HORNBILL_NODE_ID=126")
    await sending.stop()
    await well(rig, within_s=6)


@scene(*TWO)
async def test_two_servos_with_one_servo_id(rig: Rig) -> None:
    one, other = await rig.ready(2)
    # as another tool would: hornbill itself rejects it
    row = other.registers["servo_id"].parameter
    await rig.host.requests.write(other, row, 1)
    found = await finds(rig, "duplicate_servo_id", within_s=2, for_s=10, severity="failure", node_ids=[10, 11])
    assert set(found["uids"]) == {one.uid, other.uid}  # pyright: ignore[reportArgumentType]
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
    found = await finds(rig, "second_allocator", within_s=8, for_s=10, node_ids=[126])
    assert found["severity"] == ("warning" if mode is AllocationMode.ON else "failure")
    await other.close()
    await other.port.close()
    await well(rig, within_s=4)
    store.close()


@pytest.mark.parametrize(("stage", "node_ids"), [(1, []), (2, []), (3, [125])])
@scene(*TWO)
async def test_a_node_stuck_in_its_allocation(rig: Rig, stage: int, node_ids: list[int]) -> None:
    await rig.ready(2)
    applicant = Applicant(rig.bus.port("applicant"), DEAF_UID, stage)
    facts: dict[str, Any] = {"severity": "warning", "node_ids": node_ids, "uids": [DEAF_UID[: 6 * stage].hex()]}
    found = await finds(rig, "allocation_stuck", within_s=6, for_s=10, **facts)
    if stage < 3:
        assert f"{stage} part" in found["evidence"]
        assert f"never part {stage + 1}" in found["evidence"]
    await applicant.leave()
    await well(rig, within_s=6)


@scene(*TWO)
async def test_a_node_waiting_for_an_allocator_that_is_off(rig: Rig) -> None:
    await rig.ready(2)
    allocator = rig.host.connected().allocator
    allocator.mode = AllocationMode.OFF
    rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
    await finds(rig, "allocator_off", within_s=5, for_s=10, remedy='"mode": "on"')
    allocator.mode = AllocationMode.ON
    await well(rig, within_s=3)


@scene(*TWO)
async def test_no_node_id_is_left(rig: Rig) -> None:
    await rig.ready(2)
    table = rig.host.store.allocations
    for number in range(1, 126):
        table.record(Uid(f"{number:032x}"), number)  # pyright: ignore[reportArgumentType]
    servo = rig.bench.add(Recipe("BLA21-06U-A0", "1.300", servo_id=5))
    found = await finds(rig, "allocation_refused", within_s=5, for_s=10, severity="failure")
    assert found["uids"] == [servo.uid.hex()]
    table.drop(Uid(f"{77:032x}"))
    await well(rig, within_s=5)


@pytest.mark.parametrize(
    ("dropped_pct", "code", "within_s", "for_s"), [(100, "silent_node", 5, 10), (25, "responses_lost", 15, 0)]
)
@scene(*TWO)
async def test_a_servo_whose_responses_are_lost(
    rig: Rig, dropped_pct: float, code: str, within_s: float, for_s: float
) -> None:
    one, _ = await rig.ready(2)
    rig.sim(one).conditions.drop_responses_pct = dropped_pct
    found = await finds(rig, code, within_s=within_s, for_s=for_s, severity="warning", node_ids=[10])
    if dropped_pct == 100:
        assert found["uids"] == [one.uid]
        assert "without a response" in found["evidence"]
    rig.sim(one).conditions.drop_responses_pct = 0
    await well(rig, within_s=12)
    rig.bench.power(one.uid, False)
    await finds(rig, "servo_offline", within_s=4, for_s=10, severity="warning", uids=[one.uid])
    rig.bench.power(one.uid, True)
    await well(rig, within_s=3)


@scene(*TWO, replace(PLAIN, node_id=40, servo_id=9, uid=bytes(range(16))))
async def test_a_servo_that_never_responded(rig: Rig) -> None:
    servo = rig.bench.servo(Uid(bytes(range(16)).hex()))
    servo.conditions.drop_responses_pct = 100
    await finds(rig, "silent_node", within_s=6, for_s=30, node_ids=[40])
    servo.conditions.drop_responses_pct = 0
    await well(rig, within_s=35)


@scene(*TWO)
async def test_foreign_nodes_that_never_respond_are_found_and_those_that_reject_requests_are_not(rig: Rig) -> None:
    await rig.ready(2)
    silent = Peer(rig.bus.port("silent"), 52, drop=lambda _: True)
    sending = Every(1.0, silent.say_status)
    await finds(rig, "silent_node", within_s=8, for_s=10, node_ids=[52])
    await sending.stop()
    await well(rig, within_s=4)
    foreign = participant(rig.bus.port("foreign"), node_id=50)  # it responds to GetNodeInfo, and never to GetSet
    foreign.start()
    refusing = Peer(rig.bus.port("refusing"), 51, reply=lambda _: REFUSED)
    info = participant(rig.bus.port("info"), node_id=51)
    info.start()
    await stays(rig, for_s=20)
    assert refusing.requests
    await foreign.close()
    await info.close()


@scene(*TWO)
async def test_late_responses(rig: Rig) -> None:
    await rig.ready(2)
    late = [0.08]
    peer = Peer(rig.bus.port("foreign"), 50, delay=lambda _: late[0])
    info = participant(rig.bus.port("info"), node_id=50)
    info.start()

    async def read() -> None:
        while True:
            await rig.host.connected().participant.request(50, GetSetRequest(0, EMPTY, "0x08"))

    reading = asyncio.create_task(read())
    found = await finds(rig, "responses_slow", within_s=5, node_ids=[50])
    assert "80.5 ms" in str(found["evidence"]) or "slowest 8" in str(found["evidence"])
    reading.cancel()
    late[0] = 0.001  # it is a servo of an unknown series, which is read all the time
    await asyncio.gather(reading, return_exceptions=True)
    await well(rig, within_s=11)
    assert len(peer.requests) > 10
    await info.close()
