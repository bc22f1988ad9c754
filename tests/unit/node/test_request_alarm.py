"""One alarm for all requests under way: each is still given up at its own instant."""

import asyncio

import jumping_clock as clock
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import NoAnswer
from hornbill.node.participant import Participant
from unit.node.asking import now, pair, read
from unit.node.peer import participant


def test_each_request_is_given_up_at_its_own_instant() -> None:
    async def scene() -> dict[int, float]:
        bus = MemoryBus()
        host = participant(bus.port("host"))
        bus.port("nobody").listen(lambda _frames: None)
        host.start()
        began = now()

        async def ask(node: int, timeout_s: float, tries: int) -> float:
            try:
                await host.request(node, read("0x38"), timeout=timeout_s, tries=tries)
            except NoAnswer:
                return now() - began
            raise AssertionError("there is nobody to answer")

        wished = {11: (0.5, 1), 12: (0.05, 1), 13: (0.05, 4), 14: (0.2, 1), 15: (0.12, 3)}
        took = await asyncio.gather(*(ask(node, *patience) for node, patience in wished.items()))
        await host.close()
        return {
            node: took - timeout * tries for (node, (timeout, tries)), took in zip(wished.items(), took, strict=True)
        }

    for late in clock.run(scene()).values():
        assert 0 <= late < 0.003


def test_an_answer_in_time_is_taken_though_an_older_alarm_rings() -> None:
    async def scene() -> int:
        _, host, peer = pair(delay=lambda number: 0.09 if number else 0.0)
        for _ in range(3):  # the first sets the alarm for 100 ms, the others are answered after it has rung
            await host.request(42, read("0x38"), timeout=0.1)
        await host.close()
        return len(peer.requests)

    assert clock.run(scene()) == 3


def test_a_closed_participant_leaves_no_alarm_that_matters() -> None:
    async def scene() -> Participant:
        _, host, _ = pair(drop=lambda _: True)
        asking = asyncio.create_task(host.request(42, read("0x38"), timeout=0.1))
        await asyncio.sleep(0.01)
        await host.close()
        await asyncio.gather(asking, return_exceptions=True)
        await asyncio.sleep(1.0)
        return host

    host = clock.run(scene())
    assert (host.request_counters.repeats, host.request_counters.unanswered) == (0, 0)
