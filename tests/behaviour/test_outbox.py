"""Socket queues: messages are encoded once for all, a slow reader gets fewer, and a fleet is sent in batches."""

import asyncio
from collections.abc import Callable
from typing import Any

import orjson
import pytest
from pydantic import TypeAdapter

from behaviour.rig import Rig
from behaviour.scene import scene
from hornbill.api import present
from hornbill.api.live import event_log, socket_queue
from hornbill.api.live.event_log import EventLog
from hornbill.api.live.messages import ServerMessage
from hornbill.api.live.socket_queue import SocketQueue
from hornbill.api.live.telemetry_batches import ALL_PER_S, BATCH_S, KEPT_S, TELEMETRY_PER_S
from hornbill.errors import Busy
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.servo.runtime.hub import ReadingChanged, Sampled, ServoChanged
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid

MESSAGE: TypeAdapter[Any] = TypeAdapter(ServerMessage)
UID = Uid("0a" * 16)


def queue_of(log: EventLog, *topics: Any, uids: list[str] | None = None) -> SocketQueue:
    queue = SocketQueue(log)
    queue.subscribe(list(topics), uids)
    return queue


async def drain(queue: SocketQueue) -> list[str]:
    """What waits, and what is queued in the next ten batches."""
    found: list[str] = []
    for _ in range(10):
        found += queue.take()
        await asyncio.sleep(BATCH_S)
    return found


def telemetry(taken: list[str]) -> list[dict[str, Any]]:
    return [message for one in taken if (message := orjson.loads(one))["type"] == "telemetry"]


def times(messages: list[dict[str, Any]]) -> list[float]:
    return [t for message in messages for t in message["channels"]["current_angle"]["t"]]


async def stream(rig: Rig, seconds: float, hz: float = 100.0, uid: Uid = UID, after_s: float = 0.0) -> None:
    await asyncio.sleep(after_s)
    loop = asyncio.get_running_loop()
    for _ in range(round(seconds * hz)):
        rig.host.hub.publish(Sampled(uid, "current_angle", loop.time(), 1.0))
        await asyncio.sleep(1 / hz)


@scene()
async def test_every_message_is_valid_by_the_contract_and_numbered_in_order(rig: Rig, servo: Servo) -> None:
    queue = queue_of(EventLog(rig.host, demo=False), "servos", "telemetry", "events", "jobs", "bus")
    rig.host.hub.publish(ReadingChanged(servo.uid, "angle_p_gain"))
    queue.refuse(Busy("a reason", cause=None))
    rig.host.restarting.start(servo, "restart")
    await asyncio.sleep(2)
    begun = rig.host.base.now()
    found = [MESSAGE.validate_json(one) for one in [queue.hello(), *await drain(queue)]]
    assert {one.type for one in found} >= {
        "hello", "stop", "lease", "bus", "error", "job", "servos", "parameter", "event", "telemetry",
    }  # fmt: skip
    assert [one.seq for one in found] == list(range(1, len(found) + 1))
    assert found[0].now == pytest.approx(begun)


@scene(connect=False)
async def test_a_slow_reader_gets_fewer_and_larger_messages_and_delays_no_other(rig: Rig) -> None:
    log = EventLog(rig.host, demo=False)
    fast, slow = (queue_of(log, "telemetry", uids=[UID]) for _ in range(2))
    streaming = asyncio.create_task(stream(rig, 10))
    got: dict[SocketQueue, list[dict[str, Any]]] = {fast: [], slow: []}

    async def read(queue: SocketQueue, every_s: float) -> None:
        while not streaming.done():
            await asyncio.sleep(every_s)
            got[queue] += telemetry(queue.take())

    await asyncio.gather(read(fast, BATCH_S), read(slow, 1.0))
    for queue in (fast, slow):
        got[queue] += telemetry(queue.take())
        assert times(got[queue]) == sorted(times(got[queue]))
        assert len(times(got[queue])) == pytest.approx(1000, abs=5)
        assert not any(message["dropped"] for message in got[queue])
    assert len(got[slow]) < 13 < 200 < len(got[fast]) <= 10 / BATCH_S + 2


@scene(connect=False)
async def test_a_reader_that_is_too_slow_gets_the_number_of_dropped_samples_and_a_closed_one_nothing(rig: Rig) -> None:
    log = EventLog(rig.host, demo=False)
    queue = queue_of(log, "telemetry", uids=[UID])
    other, closed = queue_of(log, "telemetry", uids=["0b" * 16]), queue_of(log, "telemetry", uids=[UID])
    closed.close()
    await stream(rig, KEPT_S + 10)
    (message,) = telemetry(queue.take())
    assert len(times([message])) + message["dropped"] == pytest.approx(3000, abs=5)
    assert message["dropped"] == pytest.approx(1000, abs=20)
    assert telemetry(other.take()) == telemetry(closed.take()) == []
    closed.subscribe(["telemetry"], [UID])
    await stream(rig, 1)
    (message,) = telemetry(closed.take())
    assert len(times([message])) == pytest.approx(100, abs=5)


@scene()
async def test_a_change_is_encoded_once_for_ten_sockets(
    rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []
    encode: Callable[[Host, Servo], Any] = present.servo

    def counting(host: Host, one: Servo) -> Any:
        made.append(one.uid)
        return encode(host, one)

    monkeypatch.setattr(present, "servo", counting)
    log = EventLog(rig.host, demo=False)
    queues = [queue_of(log, "servos") for _ in range(10)]
    for queue in queues:
        await drain(queue)
    made.clear()
    rig.host.hub.publish(ServoChanged(servo.uid))
    await asyncio.sleep(BATCH_S)
    assert len({orjson.dumps(orjson.loads(queue.take()[0])["servos"]) for queue in queues}) == 1
    assert made == [servo.uid]
    servo.label = "another"
    rig.host.hub.publish(ServoChanged(servo.uid))
    await asyncio.sleep(BATCH_S)
    assert orjson.loads(queues[0].take()[0])["servos"][0]["label"] == "another"


@scene(connect=False)
async def test_all_sockets_together_get_a_limited_number_of_telemetry_messages(rig: Rig) -> None:
    uids = [f"{number:032x}" for number in range(20)]
    log = EventLog(rig.host, demo=False)
    queues = [queue_of(log, "telemetry", uids=uids) for _ in range(10)]
    sent = 0
    loop = asyncio.get_running_loop()
    for _ in range(200):
        for uid in uids:
            rig.host.hub.publish(Sampled(Uid(uid), "current_angle", loop.time(), 1.0))
        await asyncio.sleep(0.02)
        sent += sum(len(telemetry(queue.take())) for queue in queues)
    assert sent <= 4 * ALL_PER_S * 1.1 + 200


@pytest.mark.parametrize("count", [10, 125])
@scene(connect=False)
async def test_samples_of_a_few_servos_are_sent_at_once_and_of_a_crowd_in_larger_messages(rig: Rig, count: int) -> None:
    uids = [f"{number:032x}" for number in range(count)]
    queue = queue_of(EventLog(rig.host, demo=False), "telemetry", uids=uids)
    streams = asyncio.gather(
        *(stream(rig, 10, hz=10, uid=Uid(uid), after_s=0.1 * place / count) for place, uid in enumerate(uids))
    )
    sent = samples = 0
    longest = 0.0
    while samples < 100 * count:
        await queue.waiting.wait()
        for message in telemetry(queue.take()):
            sent += 1
            samples += len(times([message]))
            longest = max(longest, rig.host.base.now() - times([message])[0])
            assert message["dropped"] == 0
        await asyncio.sleep(BATCH_S)
    await streams
    assert samples == 100 * count
    if count == 10:
        assert sent > 0.95 * samples
        assert longest < 2 * BATCH_S
    else:
        assert sent < 1.1 * TELEMETRY_PER_S * 10
        assert longest < count / TELEMETRY_PER_S + 3 * BATCH_S


@scene(*(Recipe("BLA21-06U-A0", "1.300", servo_id=1 + n, node_id=10 + n) for n in range(12)))
async def test_many_changes_are_sent_completely_in_limited_batches(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket_queue, "ENTRIES_A_TIME", 60)
    for module in (event_log, socket_queue):
        monkeypatch.setattr(module, "SERVOS_A_TIME", 5)
    servos = await rig.ready(12)
    queue = queue_of(EventLog(rig.host, demo=False), "servos")
    await drain(queue)
    published = {(servo.uid, key) for servo in servos for key in servo.registers}
    for uid, key in published:
        rig.host.hub.publish(ReadingChanged(uid, key))
    seen: set[tuple[str, str]] = set()
    batches = 0
    while seen != published:
        async with asyncio.timeout(1):
            await queue.waiting.wait()
        messages = [orjson.loads(one) for one in queue.take()]
        readings = [one for one in messages if one["type"] == "parameter"]
        assert len(readings) <= 60
        assert all(len(one["servos"]) <= 5 for one in messages if one["type"] == "servos")
        seen |= {(one["uid"], one["reading"]["key"]) for one in readings}
        batches += 1
    assert batches >= len(published) / 60
