"""What many sockets cost each other: everything is packed once, a slow one gets less, and a crowd comes in turns."""

import asyncio
from collections.abc import Callable
from typing import Any

import orjson
import pytest
from pydantic import TypeAdapter

from behaviour.rig import Rig, play
from behaviour.scene import scene
from hornbill.api import present
from hornbill.api.live.event_log import EventLog
from hornbill.api.live.messages import ServerMessage
from hornbill.api.live.socket_queue import ENTRIES_A_TIME, SERVOS_A_TIME, SocketQueue
from hornbill.api.live.telemetry_batches import ALL_PER_S, BATCH_S, KEPT_S
from hornbill.errors import Busy
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.servo.runtime.hub import ReadingChanged, Sampled, ServoChanged
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid

MESSAGE: TypeAdapter[Any] = TypeAdapter(ServerMessage)
UID = Uid("0a" * 16)


def box_of(log: EventLog, *topics: Any, uids: list[str] | None = None) -> SocketQueue:
    box = SocketQueue(log)
    box.subscribe(list(topics), uids)
    return box


async def taken_by(box: SocketQueue) -> list[str]:
    """What waits, and what is packed meanwhile."""
    found: list[str] = []
    for _ in range(10):
        found += box.take()
        await asyncio.sleep(BATCH_S)
    return found


def telemetry(taken: list[str]) -> list[dict[str, Any]]:
    return [message for one in taken if (message := orjson.loads(one))["type"] == "telemetry"]


async def stream(rig: Rig, seconds: float, hz: float = 100.0) -> None:
    loop = asyncio.get_running_loop()
    for _ in range(round(seconds * hz)):
        rig.host.hub.publish(Sampled(UID, "current_angle", loop.time(), 1.0))
        await asyncio.sleep(1 / hz)


@scene()
async def test_every_message_is_of_the_form_the_contract_gives_and_in_order(rig: Rig, servo: Servo) -> None:
    box = box_of(EventLog(rig.host, demo=False), "servos", "telemetry", "events", "jobs", "bus")
    rig.host.hub.publish(ReadingChanged(servo.uid, "angle_p_gain"))
    box.refuse(Busy("a reason", cause=None))
    rig.host.restarting.start(servo, "restart")
    await asyncio.sleep(2)
    begun = rig.host.base.now()
    taken = [box.hello(), *await taken_by(box)]
    found = [MESSAGE.validate_json(one) for one in taken]
    assert {one.type for one in found} >= {
        "hello", "stop", "lease", "bus", "error", "job", "servos", "parameter", "event", "telemetry",
    }  # fmt: skip
    assert [one.seq for one in found] == list(range(1, len(found) + 1))
    assert found[0].now == pytest.approx(begun)


@scene(connect=False)
async def test_a_slow_reader_gets_fewer_and_larger_messages_and_no_other_waits_for_it(rig: Rig) -> None:
    log = EventLog(rig.host, demo=False)
    fast, slow = (box_of(log, "telemetry", uids=[UID]) for _ in range(2))
    streaming = asyncio.create_task(stream(rig, 10))
    got: dict[SocketQueue, list[dict[str, Any]]] = {fast: [], slow: []}

    async def take(box: SocketQueue, every_s: float) -> None:
        while not streaming.done():
            await asyncio.sleep(every_s)
            got[box] += telemetry(box.take())

    await asyncio.gather(take(fast, BATCH_S), take(slow, 1.0))
    for box in (fast, slow):
        got[box] += telemetry(box.take())
        times = [t for message in got[box] for t in message["channels"]["current_angle"]["t"]]
        assert times == sorted(times)
        assert len(times) == pytest.approx(1000, abs=5)
        assert not any(message["dropped"] for message in got[box])
    assert len(got[slow]) < 13 < 200 < len(got[fast]) <= 10 / BATCH_S + 2


@scene(connect=False)
async def test_a_reader_that_is_too_slow_is_told_how_many_samples_it_missed(rig: Rig) -> None:
    log = EventLog(rig.host, demo=False)
    box = box_of(log, "telemetry", uids=[UID])
    other = box_of(log, "telemetry", uids=["0b" * 16])
    await stream(rig, KEPT_S + 10)
    (message,) = telemetry(box.take())
    assert len(message["channels"]["current_angle"]["t"]) + message["dropped"] == pytest.approx(3000, abs=5)
    assert message["dropped"] == pytest.approx(1000, abs=20)
    assert telemetry(other.take()) == []


def test_ten_sockets_pack_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    packed: Callable[[Host, Servo], Any] = present.servo

    def counting(host: Host, one: Servo) -> Any:
        made.append(one.uid)
        return packed(host, one)

    monkeypatch.setattr(present, "servo", counting)

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        log = EventLog(rig.host, demo=False)
        boxes = [box_of(log, "servos") for _ in range(10)]
        for box in boxes:
            await taken_by(box)
        made.clear()
        rig.host.hub.publish(ServoChanged(servo.uid))
        await asyncio.sleep(BATCH_S)
        taken = {orjson.dumps(orjson.loads(box.take()[0])["servos"]) for box in boxes}
        assert len(taken) == 1
        assert made == [servo.uid]
        servo.label = "another"
        rig.host.hub.publish(ServoChanged(servo.uid))
        await asyncio.sleep(BATCH_S)
        assert orjson.loads(boxes[0].take()[0])["servos"][0]["label"] == "another"

    play(scene)


@scene(connect=False)
async def test_many_sockets_are_told_of_less_often_all_together(rig: Rig) -> None:
    uids = [f"{number:032x}" for number in range(20)]
    log = EventLog(rig.host, demo=False)
    boxes = [box_of(log, "telemetry", uids=uids) for _ in range(10)]
    sent = 0
    loop = asyncio.get_running_loop()
    for _ in range(200):
        for uid in uids:
            rig.host.hub.publish(Sampled(Uid(uid), "current_angle", loop.time(), 1.0))
        await asyncio.sleep(0.02)
        sent += sum(len(telemetry(box.take())) for box in boxes)
    assert sent <= 4 * ALL_PER_S * 1.1 + 200


@scene(*(Recipe("BLA21-06U-A0", "1.300", servo_id=1 + n, node_id=10 + n) for n in range(60)))
async def test_what_changes_with_a_crowd_is_sent_in_turns_and_all_of_it(rig: Rig) -> None:
    servos = await rig.ready(60)
    box = box_of(EventLog(rig.host, demo=False), "servos")
    await taken_by(box)
    told = {(servo.uid, key) for servo in servos for key in servo.registers}
    for uid, key in told:
        rig.host.hub.publish(ReadingChanged(uid, key))
    seen: set[tuple[str, str]] = set()
    goes = 0
    while seen != told:
        async with asyncio.timeout(1):
            await box.waiting.wait()
        messages = [orjson.loads(one) for one in box.take()]
        readings = [one for one in messages if one["type"] == "parameter"]
        assert len(readings) <= ENTRIES_A_TIME
        assert all(len(one["servos"]) <= SERVOS_A_TIME for one in messages if one["type"] == "servos")
        seen |= {(one["uid"], one["reading"]["key"]) for one in readings}
        goes += 1
    assert goes >= len(told) / ENTRIES_A_TIME


@scene(connect=False)
async def test_a_socket_that_is_gone_costs_nothing_more(rig: Rig) -> None:
    log = EventLog(rig.host, demo=False)
    box = box_of(log, "telemetry", uids=[UID])
    box.close()
    await stream(rig, 1)
    assert telemetry(box.take()) == []
    box.subscribe(["telemetry"], [UID])
    await stream(rig, 1)
    (message,) = telemetry(box.take())
    assert len(message["channels"]["current_angle"]["t"]) == pytest.approx(100, abs=5)
