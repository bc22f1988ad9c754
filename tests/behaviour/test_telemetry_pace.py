"""Telemetry of a crowd over one socket: fewer and larger messages, and no sample lost."""

import asyncio

import orjson

from behaviour.rig import Rig, play
from hornbill.api.live.event_log import EventLog
from hornbill.api.live.socket_queue import SocketQueue
from hornbill.api.live.telemetry_batches import BATCH_S, TELEMETRY_PER_S
from hornbill.servo.runtime.hub import Sampled
from hornbill.units import Uid

SECONDS = 10
STATUS_HZ = 10


def messages_of(count: int) -> tuple[int, int, float]:
    """Messages, samples, and the longest a sample waited, when so many servos stream for ten seconds."""

    async def scene(rig: Rig) -> tuple[int, int, float]:
        box = SocketQueue(EventLog(rig.host, demo=False))
        loop = asyncio.get_running_loop()
        uids = [Uid(f"{number:032x}") for number in range(count)]
        box.subscribe(["telemetry"], list(uids))

        async def stream(uid: Uid, phase: float) -> None:
            await asyncio.sleep(phase / STATUS_HZ)
            for _ in range(SECONDS * STATUS_HZ):
                rig.host.hub.publish(Sampled(uid, "current_angle", loop.time(), 1.0))
                await asyncio.sleep(1 / STATUS_HZ)

        streams = asyncio.gather(*(stream(uid, place / count) for place, uid in enumerate(uids)))
        sent = samples = 0
        longest = 0.0
        while samples < count * SECONDS * STATUS_HZ:
            await box.waiting.wait()
            for packed in box.take():
                message = orjson.loads(packed)
                if message["type"] == "telemetry":
                    sent += 1
                    column = message["channels"]["current_angle"]
                    samples += len(column["t"])
                    longest = max(longest, loop.time() - column["t"][0])
                    assert message["dropped"] == 0
            await asyncio.sleep(BATCH_S)
        await streams
        return sent, samples, longest

    return play(scene)


def test_samples_of_a_few_servos_are_sent_at_once() -> None:
    sent, samples, longest = messages_of(10)
    assert samples == 10 * SECONDS * STATUS_HZ
    assert sent > 0.95 * samples
    assert longest < 2 * BATCH_S


def test_samples_of_a_crowd_are_sent_in_larger_messages() -> None:
    sent, samples, longest = messages_of(125)
    assert samples == 125 * SECONDS * STATUS_HZ
    assert sent < 1.1 * TELEMETRY_PER_S * SECONDS
    assert longest < 125 / TELEMETRY_PER_S + 3 * BATCH_S
