"""Requests: retries, matching of responses, timeouts, priorities and turns."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import BusDisconnected, Busy, ForbiddenParameter, NoResponse
from hornbill.node.guard import GuardedPort
from hornbill.wire.datatype import Kind
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, integer
from hornbill.wire.transfer import split
from jumping_clock import stall
from unit.node.peer import HOST, Peer, participant
from unit.node.requesting import now, pair, read, turns


async def test_a_response_arrives_decoded_in_half_a_millisecond_of_bus_time() -> None:
    _, host, peer = pair()
    await asyncio.sleep(0.01)
    began = now()
    response = await host.request(42, read("0x38"))
    assert response == GetSetResponse(integer(0x38), EMPTY, EMPTY, EMPTY, "0x38")
    assert 0.0004 < now() - began < 0.0006
    assert (peer.requests[0].priority, peer.requests[0].source) == (24, HOST)


@pytest.mark.parametrize(
    ("asked", "tries", "timeout_s", "words"),
    [({}, 1, 0.15, "1 try of 150 ms"), ({"timeout": 0.1, "tries": 3}, 3, 0.1, "3 tries of 100 ms")],
)
async def test_without_a_response_every_try_times_out_and_has_its_own_transfer_id(
    asked: dict[str, Any], tries: int, timeout_s: float, words: str
) -> None:
    _, host, peer = pair(drop=lambda _: True)
    began = now()
    with pytest.raises(NoResponse, match=rf"Node 42 did not respond to GetSet in {words}\.") as caught:
        await host.request(42, read("0x38"), **asked)
    assert now() - began == pytest.approx(tries * timeout_s, abs=0.002)
    await asyncio.sleep(1)
    assert len({each.transfer_id for each in peer.requests}) == len(peer.requests) == tries
    facts = {"node_id": 42, "service": "GetSet", "tries": tries, "timeout_s": timeout_s}
    assert caught.value.facts == facts | {"cause": "node_not_responding"}
    counters = host.request_counters
    assert (counters.requests, counters.retries, counters.timeouts, counters.responses) == (1, tries - 1, 1, 0)


async def test_a_stalled_loop_does_not_time_out_requests() -> None:
    _, host, peer = pair()
    await asyncio.sleep(0.01)
    pending = asyncio.ensure_future(host.request(42, read("0x38"), timeout=0.1))
    await asyncio.sleep(0)
    stall(0.25)
    assert (await pending).value == integer(0x38)
    assert len(peer.requests) == 1


def is_first(number: int) -> bool:
    return number == 0


def first_after(delay_s: float, later_s: float = 0.0) -> Callable[[int], float]:
    """A delay of the first response, and of all later ones."""
    return lambda number: later_s if number else delay_s


@pytest.mark.parametrize(
    ("behaviour", "took_s"),
    [({"drop": is_first}, 0.1), ({"delay": first_after(0.13, 9.0)}, 0.13)],
    ids=["a lost response costs one timeout", "a late response to an earlier try counts"],
)
async def test_a_request_is_repeated_until_a_response(behaviour: dict[str, Any], took_s: float) -> None:
    _, host, peer = pair(**behaviour)
    began = now()
    assert (await host.request(42, read("0x38"), timeout=0.1, tries=3)).name == "0x38"
    assert took_s < now() - began < took_s + 0.002
    assert len(peer.requests) == 2


def after_its_quarantine(number: int) -> float:
    """A delay until the transfer ID of the first request is in use again."""
    return {0: 2.26, 32: 0.09}.get(number, 0.0)


@pytest.mark.parametrize(
    ("behaviour", "fails_first", "quiet_s", "reads", "late"),
    [
        ({"delay": first_after(0.2)}, True, 0.1, 8, 1),
        ({"delay": first_after(0.15)}, True, 0.0, 40, 1),  # more than there are transfer IDs
        ({"delay": after_its_quarantine}, True, 2.1, 32, 1),
        ({"copies": 3}, False, 0.0, 8, 16),
    ],
    ids=["after the last try", "never for another request", "later than its quarantine", "repeated"],
)
async def test_a_late_or_repeated_response_is_dropped_and_matches_no_other_request(
    behaviour: dict[str, Any], fails_first: bool, quiet_s: float, reads: int, late: int
) -> None:
    _, host, peer = pair(**behaviour)
    if fails_first:
        with pytest.raises(NoResponse):
            await host.request(42, read("0x00"), timeout=0.1)
    await asyncio.sleep(quiet_s)
    for number in range(1, reads + 1):
        response = await host.request(42, read(f"0x{number:02X}"), timeout=0.1)
        assert (response.name, response.value) == (f"0x{number:02X}", integer(number))
    await asyncio.sleep(0.2)
    assert (host.request_counters.responses, host.request_counters.late) == (reads, late)
    quarantined = fails_first and quiet_s < 2
    reused = peer.requests[0].transfer_id in {each.transfer_id for each in peer.requests[1:]}
    assert reused is (not quarantined and reads >= 32)


async def test_malformed_responses_and_those_of_another_node_or_transfer_id_are_ignored() -> None:
    bus, host, peer = pair(drop=lambda _: True)
    other = Peer(bus.port("other"), 43)
    waiting = asyncio.ensure_future(host.request(42, read("0x38"), timeout=0.1))
    await asyncio.sleep(0.01)
    requested = peer.requests[0]
    right = requested.transfer_id
    response = GetSetResponse(integer(1), EMPTY, EMPTY, EMPTY, "0x38")
    other.send(Kind.RESPONSE, response, destination=HOST, transfer_id=right)
    peer.send(Kind.RESPONSE, response, destination=HOST, transfer_id=right ^ 1)
    peer.send(Kind.RESPONSE, response, destination=99, transfer_id=right)
    bad = requested._replace(kind=Kind.RESPONSE, source=42, destination=HOST, payload=b"\1\2")
    peer.port.send(split(bad, GetSetResponse.TYPE))
    with pytest.raises(NoResponse):
        await waiting
    assert host.request_counters.malformed == 1


@pytest.mark.parametrize(("closing", "within_s"), [("host", 0.0), ("port", 0.05)])
async def test_closing_or_losing_the_port_ends_every_pending_request(closing: str, within_s: float) -> None:
    _, host, _ = pair(drop=lambda _: True)
    tasks = [asyncio.ensure_future(host.request(42, read("0x20"), timeout=5, tries=3)) for _ in range(4)]
    tasks.append(asyncio.ensure_future(host.request(42, read("0x20"), timeout=5, urgent=True)))
    await asyncio.sleep(0.3)
    began = now()
    await (host if closing == "host" else host.port).close()
    results = await asyncio.gather(*tasks, return_exceptions=True)
    assert now() - began <= within_s
    assert [type(each) for each in results] == [BusDisconnected] * 5
    with pytest.raises(BusDisconnected):
        await host.request(42, read("0x20"))
    await host.close()
    await asyncio.sleep(10)
    assert (host.request_counters.retries, host.request_counters.timeouts) == (0, 0)


async def test_invalid_requests_are_refused_before_anything_is_sent() -> None:
    _, host, peer = pair()
    with pytest.raises(ValueError, match="does not fit"):
        await host.request(42, GetSetRequest(0, integer(2**63), "0x20"))
    for node_id in (0, 128, HOST):
        with pytest.raises(ValueError, match="another node, 1 to 127"):
            await host.request(node_id, read("0x20"))
    with pytest.raises(ValueError, match="16 to 31"):
        await host.request(42, read("0x20"), priority=15)
    with pytest.raises(ValueError, match="must be above 0"):
        await host.request(42, read("0x20"), tries=0)
    assert peer.requests == []


async def test_a_recreated_participant_begins_with_another_transfer_id() -> None:
    """A node remembers the last one for two seconds and would ignore the same ID as a repetition."""
    bus = MemoryBus()
    peer = Peer(bus.port("peer"), 42)
    for number in range(2):
        port = bus.port(f"host{number}")
        host = participant(port)
        host.start()
        await host.request(42, read("0x20"))
        await host.close()
        await port.close()
        await asyncio.sleep(0.05)
    first, second = peer.requests
    assert first.transfer_id != second.transfer_id


async def test_round_trip_times_are_reported_per_node() -> None:
    _, host, _ = pair(delay=lambda _: 0.01, drop=is_first)
    reported: list[tuple[int, float]] = []
    host.on_round_trip.append(lambda node_id, seconds: reported.append((node_id, seconds)))
    await host.request(42, read("0x20"), timeout=0.1, tries=2)
    assert [node_id for node_id, _ in reported] == [42]
    assert reported[0][1] == pytest.approx(0.0105, abs=0.0005)


async def test_each_request_times_out_at_its_own_instant() -> None:
    _, host, _ = pair(drop=lambda _: True)
    began = now()

    async def took(node: int, timeout_s: float, tries: int) -> float:
        with pytest.raises(NoResponse):
            await host.request(node, read("0x38"), timeout=timeout_s, tries=tries)
        return now() - began - timeout_s * tries

    settings = ((11, 0.5, 1), (12, 0.05, 1), (13, 0.05, 4), (14, 0.2, 1), (15, 0.12, 3))
    for late in await asyncio.gather(*(took(*setting) for setting in settings)):
        assert 0 <= late < 0.003


async def test_a_response_in_time_counts_although_an_older_timer_fires() -> None:
    _, host, peer = pair(delay=first_after(0.0, 0.09))
    for _ in range(3):  # the first sets a timer for 100 ms, the others get their responses after it fired
        await host.request(42, read("0x38"), timeout=0.1)
    assert len(peer.requests) == 3


async def test_one_request_per_node_is_active_and_the_rest_follow_by_priority_then_order() -> None:
    _, host, peer = pair(delay=lambda _: 0.02)
    requested = [("0x21", 24), ("0x22", 20), ("0x23", 24), ("0x24", 17), ("0x25", 20)]
    await asyncio.sleep(0.01)
    began = now()
    tasks = [asyncio.ensure_future(host.request(42, read("0x20"), priority=24))]
    await turns()
    tasks += [asyncio.ensure_future(host.request(42, read(name), priority=p)) for name, p in requested]
    await asyncio.sleep(0.01)
    assert len(peer.requests) == 1
    await asyncio.gather(*tasks)
    assert peer.names == ["0x20", "0x24", "0x22", "0x25", "0x21", "0x23"]
    assert now() - began > 6 * 0.02


async def test_nodes_do_not_wait_for_each_other() -> None:
    bus, host, _ = pair(drop=lambda _: True)
    others = [Peer(bus.port(f"p{n}"), n, delay=lambda _: 0.01) for n in range(1, 17)]
    dead = asyncio.ensure_future(host.request(42, read("0x20"), timeout=1.0))
    began = now()
    jobs: list[Awaitable[Any]] = []
    for peer in others:
        jobs.extend(host.request(peer.node_id, read(f"0x{r:02X}")) for r in range(0x20, 0x25))
    await asyncio.gather(*jobs)
    # Five rounds of 10 ms and 16 responses on the wire each: no node waited for another.
    assert now() - began < 5 * (0.010 + 16 * 0.0006)
    assert all(peer.names == ["0x20", "0x21", "0x22", "0x23", "0x24"] for peer in others)
    with pytest.raises(NoResponse):
        await dead


async def test_on_a_saturated_bus_nodes_take_turns() -> None:
    """In order of identifiers, node 1 would be served first, then node 2: the last would wait for 0.15 s."""
    bus = MemoryBus()
    host = participant(bus.port("host"))
    peers = [Peer(bus.port(f"p{n}"), n) for n in range(1, 17)]
    host.start()
    await asyncio.sleep(0.01)
    began = now()
    jobs = [host.request(peer.node_id, read("0x20"), timeout=0.05) for peer in peers for _ in range(20)]
    tasks = [asyncio.ensure_future(each) for each in jobs]
    await asyncio.sleep(0.05)
    counts = [len(peer.requests) for peer in peers]
    assert max(counts) - min(counts) <= 1
    await asyncio.gather(*tasks)
    assert now() - began < 0.173  # the bus needs 0.171 s for them: it is never idle
    assert host.request_counters.retries == 0


async def test_a_higher_priority_waits_for_one_try_of_a_read_only() -> None:
    _, host, peer = pair(drop=lambda number: number < 2)
    reading = asyncio.ensure_future(host.request(42, read("0x38"), timeout=0.1, tries=25))
    later = asyncio.ensure_future(host.request(42, read("0x39"), timeout=0.1))
    await asyncio.sleep(0.01)
    began = now()
    with pytest.raises(NoResponse):
        await host.request(42, read("0x00"), priority=17, timeout=0.05)
    assert now() - began == pytest.approx(0.09 + 0.05, abs=0.002)
    assert (await reading).name == "0x38"
    assert (await later).name == "0x39"
    assert peer.names == ["0x38", "0x00", "0x38", "0x39"]
    assert host.request_counters.retries == 1


async def test_a_late_response_to_a_preempted_read_counts() -> None:
    _, host, peer = pair(delay=first_after(0.12, 0.05))
    reading = asyncio.ensure_future(host.request(42, read("0x38"), timeout=0.1, tries=25))
    await asyncio.sleep(0.01)
    urgent = asyncio.ensure_future(host.request(42, read("0x00"), priority=17, timeout=0.1))
    assert (await reading).name == "0x38"
    assert (await urgent).name == "0x00"
    assert (await host.request(42, read("0x39"))).name == "0x39"
    assert peer.names == ["0x38", "0x00", "0x39"]


async def test_an_urgent_request_is_sent_at_once_with_its_own_transfer_id() -> None:
    _, host, peer = pair(drop=is_first)
    slow = asyncio.ensure_future(host.request(42, read("0x20"), timeout=0.5))
    queued = [asyncio.ensure_future(host.request(42, read("0x21"), timeout=0.5)) for _ in range(10)]
    await asyncio.sleep(0.1)
    began = now()
    response = await host.request(42, GetSetRequest(0, integer(1), "0x20"), priority=16, urgent=True)
    assert response.value == integer(1)
    assert now() - began < 0.002
    assert len({each.transfer_id for each in peer.requests}) == 2
    with pytest.raises(NoResponse):
        await slow
    await asyncio.gather(*queued)


async def test_urgent_requests_never_share_a_transfer_id_and_the_33rd_is_refused() -> None:
    _, host, peer = pair(drop=lambda _: True)
    tasks = [asyncio.ensure_future(host.request(42, read("0x20"), urgent=True, timeout=0.5)) for _ in range(32)]
    await turns()
    with pytest.raises(Busy):
        await host.request(42, read("0x20"), urgent=True)
    await asyncio.sleep(0.1)
    assert sorted(each.transfer_id for each in peer.requests) == list(range(32))
    results = await asyncio.gather(*tasks, return_exceptions=True)
    assert all(isinstance(each, NoResponse) for each in results)
    with pytest.raises(NoResponse):  # all are in quarantine, none is in use
        await host.request(42, read("0x20"), urgent=True)


async def test_cancelling_the_caller_frees_the_node_at_once() -> None:
    _, host, peer = pair(drop=is_first)
    stuck = asyncio.ensure_future(host.request(42, read("0x20"), timeout=10, tries=3))
    queued = asyncio.ensure_future(host.request(42, read("0x21"), timeout=10))
    following = asyncio.ensure_future(host.request(42, read("0x22")))
    abandoned = host.request(42, read("0x23"))
    abandoned.send(None)
    abandoned.close()
    await asyncio.sleep(0.01)
    queued.cancel()
    await turns()
    began = now()
    stuck.cancel()
    response = await following
    assert response.name == "0x22"
    assert now() - began < 0.002
    await asyncio.sleep(40)
    assert peer.names == ["0x20", "0x22"]


async def test_a_refusal_by_the_guard_is_raised_to_its_caller_only() -> None:
    bus = MemoryBus()
    host = participant(GuardedPort(bus.port("host"), writable=frozenset({"0x20"})))
    peer = Peer(bus.port("peer"), 42, delay=lambda _: 0.01)
    host.start()
    before = asyncio.ensure_future(host.request(42, read("0x20")))
    forbidden = asyncio.ensure_future(host.request(42, GetSetRequest(0, integer(1), "0x49")))
    after = asyncio.ensure_future(host.request(42, read("0x21")))
    results = await asyncio.gather(before, forbidden, after, return_exceptions=True)
    assert [type(each) for each in results] == [GetSetResponse, ForbiddenParameter, GetSetResponse]
    assert peer.names == ["0x20", "0x21"]
