"""Whose request goes when: one a node, nodes in turn, urgent ones at once."""

import asyncio
from collections.abc import Awaitable
from typing import Any

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import Busy, ForbiddenParameter, NoAnswer
from hornbill.node.guard import GuardedPort
from hornbill.wire.services import GetSetRequest, GetSetResponse, integer
from jumping_clock import run
from unit.node.asking import now, pair, read, turns
from unit.node.peer import Peer, participant


def test_one_request_a_node_is_under_way_and_the_rest_go_by_priority_then_in_order() -> None:
    async def play() -> None:
        _, host, peer = pair(delay=lambda _: 0.02)
        asked = [("0x21", 24), ("0x22", 20), ("0x23", 24), ("0x24", 17), ("0x25", 20)]
        await asyncio.sleep(0.01)
        began = now()
        tasks = [asyncio.ensure_future(host.request(42, read("0x20"), priority=24))]
        await turns()
        tasks += [asyncio.ensure_future(host.request(42, read(name), priority=p)) for name, p in asked]
        await asyncio.sleep(0.01)
        assert len(peer.requests) == 1
        await asyncio.gather(*tasks)
        assert peer.names == ["0x20", "0x24", "0x22", "0x25", "0x21", "0x23"]
        assert now() - began > 6 * 0.02
        await host.close()

    run(play())


def test_of_what_is_asked_at_once_the_lowest_priority_number_goes_first() -> None:
    async def play() -> None:
        _, host, peer = pair()
        asked = [("0x20", 24), ("0x21", 20), ("0x22", 17), ("0x23", 24)]
        await asyncio.gather(*(host.request(42, read(name), priority=p) for name, p in asked))
        assert peer.names == ["0x22", "0x21", "0x20", "0x23"]
        await host.close()

    run(play())


def test_nodes_do_not_wait_for_each_other() -> None:
    async def play() -> None:
        bus, host, _ = pair(drop=lambda _: True)
        others = [Peer(bus.port(f"p{n}"), n, delay=lambda _: 0.01) for n in range(1, 17)]
        dead = asyncio.ensure_future(host.request(42, read("0x20"), timeout=1.0))
        began = now()
        jobs: list[Awaitable[Any]] = []
        for peer in others:
            jobs.extend(host.request(peer.node_id, read(f"0x{r:02X}")) for r in range(0x20, 0x25))
        await asyncio.gather(*jobs)
        # Five rounds of 10 ms and 16 answers on the wire each: nobody waited for a neighbour's servo.
        assert now() - began < 5 * (0.010 + 16 * 0.0006)
        assert all(peer.names == ["0x20", "0x21", "0x22", "0x23", "0x24"] for peer in others)
        with pytest.raises(NoAnswer):
            await dead
        await host.close()

    run(play())


def test_on_a_saturated_bus_nodes_take_turns() -> None:
    """Lowest identifier first would serve node 1 until it is done, then node 2: the last would wait for 0.4 s."""

    async def play() -> None:
        bus = MemoryBus()
        host = participant(bus.port("host"))
        peers = [Peer(bus.port(f"p{n}"), n) for n in range(1, 17)]
        host.start()
        await asyncio.sleep(0.01)
        began = now()
        jobs = [host.request(peer.node_id, read("0x20"), timeout=0.05) for peer in peers for _ in range(55)]
        tasks = [asyncio.ensure_future(each) for each in jobs]
        await asyncio.sleep(0.1)
        counts = [len(peer.requests) for peer in peers]
        assert max(counts) - min(counts) <= 1
        await asyncio.gather(*tasks)
        assert now() - began < 0.475  # the bus needs 0.470 s for them: it never waited for us
        assert host.request_counters.repeats == 0
        await host.close()

    run(play())


def test_a_long_queue_for_one_node_does_not_hold_up_another() -> None:
    async def play() -> None:
        bus, host, _ = pair()
        quiet = Peer(bus.port("quiet"), 43)
        flood = [asyncio.ensure_future(host.request(42, read("0x20"))) for _ in range(500)]
        await asyncio.sleep(0.005)
        began = now()
        await host.request(43, read("0x21"))
        assert now() - began < 0.003
        assert len(quiet.requests) == 1
        for each in flood:
            each.cancel()
        await asyncio.gather(*flood, return_exceptions=True)
        await host.close()

    run(play())


def test_a_dead_node_does_not_hold_up_the_others() -> None:
    async def play() -> None:
        bus, host, _ = pair(drop=lambda _: True)
        alive = Peer(bus.port("alive"), 43)
        dead = [asyncio.ensure_future(host.request(n, read("0x20"), timeout=1.0)) for n in range(44, 120)]
        await asyncio.sleep(0.05)
        began = now()
        for _ in range(20):
            await host.request(43, read("0x21"))
        assert now() - began < 0.03
        assert len(alive.requests) == 20
        await asyncio.gather(*dead, return_exceptions=True)
        await host.close()

    run(play())


def test_what_is_more_urgent_waits_for_one_try_of_a_read_and_not_for_all_of_them() -> None:
    async def play() -> None:
        _, host, peer = pair(drop=lambda number: number < 2)
        reading = asyncio.ensure_future(host.request(42, read("0x38"), timeout=0.1, tries=25))
        later = asyncio.ensure_future(host.request(42, read("0x39"), timeout=0.1))
        await asyncio.sleep(0.01)
        began = now()
        with pytest.raises(NoAnswer):
            await host.request(42, read("0x00"), priority=17, timeout=0.05)
        assert now() - began == pytest.approx(0.09 + 0.05, abs=0.002)
        assert (await reading).name == "0x38"
        assert (await later).name == "0x39"
        assert peer.names == ["0x38", "0x00", "0x38", "0x39"]
        assert host.request_counters.repeats == 1
        await host.close()

    run(play())


def test_the_late_answer_of_a_read_that_gave_way_counts_and_it_is_not_sent_again() -> None:
    async def play() -> None:
        _, host, peer = pair(delay=lambda number: 0.12 if number == 0 else 0.05)
        reading = asyncio.ensure_future(host.request(42, read("0x38"), timeout=0.1, tries=25))
        await asyncio.sleep(0.01)
        urgent = asyncio.ensure_future(host.request(42, read("0x00"), priority=17, timeout=0.1))
        assert (await reading).name == "0x38"
        assert (await urgent).name == "0x00"
        assert (await host.request(42, read("0x39"))).name == "0x39"
        assert peer.names == ["0x38", "0x00", "0x39"]
        await host.close()

    run(play())


def test_an_urgent_request_goes_at_once_with_a_transfer_id_of_its_own() -> None:
    async def play() -> None:
        _, host, peer = pair(drop=lambda number: number == 0)
        slow = asyncio.ensure_future(host.request(42, read("0x20"), timeout=0.5))
        queued = [asyncio.ensure_future(host.request(42, read("0x21"), timeout=0.5)) for _ in range(10)]
        await asyncio.sleep(0.1)
        began = now()
        answer = await host.request(42, GetSetRequest(0, integer(1), "0x20"), priority=16, urgent=True)
        assert answer.value == integer(1)
        assert now() - began < 0.002
        assert len({each.transfer_id for each in peer.requests}) == 2
        with pytest.raises(NoAnswer):
            await slow
        await asyncio.gather(*queued)
        await host.close()

    run(play())


def test_urgent_requests_never_share_a_transfer_id_and_the_33rd_is_refused() -> None:
    async def play() -> None:
        _, host, peer = pair(drop=lambda _: True)
        tasks = [asyncio.ensure_future(host.request(42, read("0x20"), urgent=True, timeout=0.5)) for _ in range(32)]
        await turns()
        with pytest.raises(Busy):
            await host.request(42, read("0x20"), urgent=True)
        await asyncio.sleep(0.1)
        assert sorted(each.transfer_id for each in peer.requests) == list(range(32))
        results = await asyncio.gather(*tasks, return_exceptions=True)
        assert all(isinstance(each, NoAnswer) for each in results)
        await host.close()

    run(play())


def test_cancelling_the_caller_frees_the_node_at_once() -> None:
    async def play() -> None:
        _, host, peer = pair(drop=lambda number: number == 0)
        stuck = asyncio.ensure_future(host.request(42, read("0x20"), timeout=10, tries=3))
        queued = asyncio.ensure_future(host.request(42, read("0x21"), timeout=10))
        following = asyncio.ensure_future(host.request(42, read("0x22")))
        await asyncio.sleep(0.01)
        queued.cancel()
        await turns()
        began = now()
        stuck.cancel()
        answer = await following
        assert answer.name == "0x22"
        assert now() - began < 0.002
        await asyncio.sleep(40)
        assert peer.names == ["0x20", "0x22"]
        await host.close()

    run(play())


def test_a_request_given_up_while_it_waits_is_never_sent() -> None:
    async def play() -> None:
        _, host, peer = pair(drop=lambda _: True)
        stuck = asyncio.ensure_future(host.request(42, read("0x20")))
        await turns()
        waiting = host.request(42, read("0x21"))
        waiting.send(None)
        waiting.close()
        with pytest.raises(NoAnswer):
            await stuck
        await asyncio.sleep(1)
        assert peer.names == ["0x20"]
        await host.close()

    run(play())


def test_what_the_guard_refuses_comes_to_its_caller_and_nobody_else() -> None:
    async def play() -> None:
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
        await host.close()

    run(play())
