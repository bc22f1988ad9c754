"""Requests are repeated, paired with their answers and given up as the caller asked."""

import asyncio

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import BusDisconnected, NoAnswer
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import NodeStatus
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, integer
from hornbill.wire.transfer import split
from jumping_clock import JumpingLoop, run
from unit.node.asking import now, pair, read
from unit.node.peer import HOST, Peer, participant


def test_an_answer_comes_back_decoded_in_half_a_millisecond_of_bus_time() -> None:
    async def play() -> None:
        _, host, peer = pair()
        await asyncio.sleep(0.01)
        began = now()
        answer = await host.request(42, read("0x38"))
        assert answer == GetSetResponse(integer(0x38), EMPTY, EMPTY, EMPTY, "0x38")
        assert 0.0004 < now() - began < 0.0006
        assert (peer.requests[0].priority, peer.requests[0].source) == (24, HOST)
        await host.close()

    run(play())


def test_without_an_answer_every_try_waits_its_time_and_has_its_own_transfer_id() -> None:
    async def play() -> None:
        _, host, peer = pair(drop=lambda _: True)
        began = now()
        with pytest.raises(NoAnswer, match=r"Node 42 did not answer GetSet in 3 tries of 100 ms\.") as caught:
            await host.request(42, read("0x38"), timeout=0.1, tries=3)
        assert now() - began == pytest.approx(0.3, abs=0.002)
        assert len({each.transfer_id for each in peer.requests}) == 3
        facts = {"node_id": 42, "service": "GetSet", "tries": 3, "timeout_s": 0.1, "cause": "silent_node"}
        assert caught.value.facts == facts
        counters = host.request_counters
        assert (counters.requests, counters.repeats, counters.unanswered, counters.answers) == (1, 2, 1, 0)
        await host.close()

    run(play())


def test_a_loop_that_was_held_up_does_not_take_its_own_delay_for_the_nodes_silence() -> None:
    async def play() -> None:
        _, host, peer = pair()
        await asyncio.sleep(0.01)
        loop = asyncio.get_running_loop()
        assert isinstance(loop, JumpingLoop)
        asking = asyncio.ensure_future(host.request(42, read("0x38"), timeout=0.1))
        await asyncio.sleep(0)
        loop.stall(0.25)
        assert (await asking).value == integer(0x38)
        assert len(peer.requests) == 1
        await host.close()

    run(play())


def test_one_try_is_sent_once() -> None:
    async def play() -> None:
        _, host, peer = pair(drop=lambda _: True)
        with pytest.raises(NoAnswer, match="1 try of 150 ms"):
            await host.request(42, read("0x38"))
        await asyncio.sleep(1)
        assert len(peer.requests) == 1
        await host.close()

    run(play())


def test_a_lost_answer_costs_one_time_out() -> None:
    async def play() -> None:
        _, host, _ = pair(drop=lambda number: number == 0)
        began = now()
        await host.request(42, read("0x38"), timeout=0.1, tries=3)
        assert 0.1 < now() - began < 0.102
        await host.close()

    run(play())


def test_a_late_answer_to_an_earlier_try_counts() -> None:
    async def play() -> None:
        _, host, peer = pair(delay=lambda number: 0.13 if number == 0 else 9.0)
        began = now()
        answer = await host.request(42, read("0x38"), timeout=0.1, tries=3)
        assert answer.name == "0x38"
        assert 0.13 < now() - began < 0.132
        assert len(peer.requests) == 2
        await host.close()

    run(play())


def test_an_answer_after_the_last_try_is_dropped_and_disturbs_nothing() -> None:
    async def play() -> None:
        _, host, _ = pair(delay=lambda number: 0.2 if number == 0 else 0.0)
        with pytest.raises(NoAnswer):
            await host.request(42, read("0x38"), timeout=0.1)
        for register in range(0x20, 0x28):
            answer = await host.request(42, read(f"0x{register:02X}"), timeout=0.1)
            assert answer.value == integer(register)
            await asyncio.sleep(0.02)
        assert host.request_counters.late == 1
        await host.close()

    run(play())


def test_a_late_answer_is_never_taken_for_one_to_a_later_request() -> None:
    """The servo takes 0.15 s over the first read; meanwhile 40 more are made, more than there are transfer ids."""

    async def play() -> None:
        _, host, peer = pair(delay=lambda number: 0.15 if number == 0 else 0.0)
        with pytest.raises(NoAnswer):
            await host.request(42, read("0x00"), timeout=0.1)
        for number in range(1, 41):
            answer = await host.request(42, read(f"0x{number:02X}"), timeout=0.1)
            assert answer.value == integer(number)
        first = peer.requests[0].transfer_id
        assert first not in {each.transfer_id for each in peer.requests[1:]}
        await host.close()

    run(play())


def test_an_answer_that_names_another_register_is_waited_past_however_late_it_comes() -> None:
    """So late that its transfer id rests no more and has come round, as on a bus whose host had no time."""

    async def play() -> None:
        _, host, peer = pair(delay=lambda number: {0: 2.26, 32: 0.09}.get(number, 0.0))
        with pytest.raises(NoAnswer):
            await host.request(42, read("0x00"), timeout=0.1)
        await asyncio.sleep(2.1)
        for number in range(1, 33):
            answer = await host.request(42, read(f"0x{number:02X}"), timeout=0.1)
            assert (answer.name, answer.value) == (f"0x{number:02X}", integer(number))
        assert peer.requests[0].transfer_id == peer.requests[32].transfer_id
        assert host.request_counters.late == 1
        await host.close()

    run(play())


def test_repeated_answers_are_ignored() -> None:
    async def play() -> None:
        _, host, _ = pair(copies=3)
        for register in range(0x20, 0x28):
            answer = await host.request(42, read(f"0x{register:02X}"))
            assert answer.value == integer(register)
        await asyncio.sleep(0.01)
        assert host.request_counters.answers == 8
        assert host.request_counters.late == 16
        await host.close()

    run(play())


def test_answers_of_another_node_or_service_or_number_do_not_count() -> None:
    async def play() -> None:
        bus, host, peer = pair(drop=lambda _: True)
        stranger = Peer(bus.port("stranger"), 43)
        waiting = asyncio.ensure_future(host.request(42, read("0x38"), timeout=0.1))
        await asyncio.sleep(0.01)
        right = peer.requests[0].transfer_id
        answer = GetSetResponse(integer(1), EMPTY, EMPTY, EMPTY, "0x38")
        stranger.send(Kind.RESPONSE, answer, destination=HOST, transfer_id=right)
        peer.send(Kind.RESPONSE, answer, destination=HOST, transfer_id=right ^ 1)
        peer.send(Kind.RESPONSE, answer, destination=99, transfer_id=right)
        with pytest.raises(NoAnswer):
            await waiting
        await host.close()

    run(play())


def test_an_answer_that_cannot_be_decoded_is_counted_and_not_taken() -> None:
    async def play() -> None:
        _, host, peer = pair(drop=lambda _: True)
        waiting = asyncio.ensure_future(host.request(42, read("0x38"), timeout=0.1))
        await asyncio.sleep(0.01)
        asked = peer.requests[0]
        bad = asked._replace(kind=Kind.RESPONSE, source=42, destination=HOST, payload=b"\1\2")
        peer.port.send(split(bad, GetSetResponse.TYPE))
        with pytest.raises(NoAnswer):
            await waiting
        assert host.request_counters.malformed == 1
        await host.close()

    run(play())


def test_closing_ends_every_waiting_request_at_once() -> None:
    async def play() -> None:
        _, host, _ = pair(drop=lambda _: True)
        tasks = [asyncio.ensure_future(host.request(42, read("0x20"), timeout=5, tries=3)) for _ in range(4)]
        tasks.append(asyncio.ensure_future(host.request(42, read("0x20"), timeout=5, urgent=True)))
        await asyncio.sleep(0.01)
        began = now()
        await host.close()
        results = await asyncio.gather(*tasks, return_exceptions=True)
        assert now() == began
        assert [type(each) for each in results] == [BusDisconnected] * 5
        with pytest.raises(BusDisconnected):
            await host.request(42, read("0x20"))
        await host.close()

    run(play())


def test_losing_the_port_ends_every_waiting_request() -> None:
    async def play() -> None:
        _, host, _ = pair(drop=lambda _: True)
        tasks = [asyncio.ensure_future(host.request(42, read("0x20"), timeout=5, tries=3)) for _ in range(4)]
        await asyncio.sleep(0.3)
        began = now()
        await host.port.close()
        results = await asyncio.gather(*tasks, return_exceptions=True)
        assert now() - began <= 0.05
        assert [type(each) for each in results] == [BusDisconnected] * 4
        with pytest.raises(BusDisconnected):
            await host.request(42, read("0x20"))
        await host.close()

    run(play())


def test_with_a_fifth_of_all_frames_lost_five_tries_read_nearly_everything() -> None:
    async def play() -> None:
        bus, host, _ = pair()
        bus.loss(20, seed=7)
        jobs = [host.request(42, read("0x20"), timeout=0.02, tries=8) for _ in range(200)]
        results = await asyncio.gather(*jobs, return_exceptions=True)
        # A try succeeds with 0.8 for the request and 0.8 ** 3 for the answer: 0.41; eight of them with 0.985.
        answered = sum(isinstance(each, GetSetResponse) for each in results)
        assert answered >= 190
        assert answered + sum(isinstance(each, NoAnswer) for each in results) == 200
        await host.close()

    run(play())


def test_a_value_that_does_not_fit_is_told_before_anything_is_sent() -> None:
    async def play() -> None:
        _, host, peer = pair()
        with pytest.raises(ValueError, match="does not fit"):
            await host.request(42, GetSetRequest(0, integer(2**63), "0x20"))
        for node_id in (0, 128, HOST):
            with pytest.raises(ValueError, match="another node's id, 1 to 127"):
                await host.request(node_id, read("0x20"))
        with pytest.raises(ValueError, match="16 to 31"):
            await host.request(42, read("0x20"), priority=15)
        with pytest.raises(ValueError, match="must be above 0"):
            await host.request(42, read("0x20"), tries=0)
        assert peer.requests == []
        await host.close()

    run(play())


def test_a_participant_made_again_does_not_begin_with_the_same_transfer_id() -> None:
    """A node remembers the last one for two seconds and would take the same number for a repetition."""

    async def play() -> None:
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

    run(play())


def test_round_trips_are_told_per_node() -> None:
    async def play() -> None:
        _, host, _ = pair(delay=lambda _: 0.01, drop=lambda number: number == 0)
        told: list[tuple[int, float]] = []
        host.on_round_trip.append(lambda node_id, seconds: told.append((node_id, seconds)))
        await host.request(42, read("0x20"), timeout=0.1, tries=2)
        assert [node_id for node_id, _ in told] == [42]
        assert told[0][1] == pytest.approx(0.0105, abs=0.0005)
        await host.close()

    run(play())


def test_messages_pass_while_requests_wait() -> None:
    async def play() -> None:
        _, host, peer = pair(drop=lambda _: True)
        heard: list[int] = []
        host.subscribe(NodeStatus, lambda transfer, _: heard.append(transfer.source))
        waiting = asyncio.ensure_future(host.request(42, read("0x20")))
        await asyncio.sleep(0.01)
        peer.say_status(1)
        await asyncio.sleep(0.01)
        assert heard == [42]
        with pytest.raises(NoAnswer):
            await waiting
        await host.close()

    run(play())
