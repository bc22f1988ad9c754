"""The WebSocket: what it publishes, what it accepts, and what happens when the page is closed."""

import asyncio
from collections import Counter
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from behaviour.actions import torque, write
from behaviour.rig import PLAIN, Rig, Socket, json
from behaviour.scene import scene
from hornbill.api import present
from hornbill.api.live.event_log import REFRESHED_A_TIME
from hornbill.api.live.socket_queue import SocketQueue
from hornbill.domain.servo import Servo as ServoFacts
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.sim.bench.recipe import Recipe


@asynccontextmanager
async def page(rig: Rig, *topics: str, **more: object) -> AsyncGenerator[Socket]:
    """A socket with a subscription."""
    socket = Socket(rig.app)
    if topics:
        socket.send(type="subscribe", topics=topics, **more)
    yield socket
    await socket.close()


def telemetry(socket: Socket) -> list[dict[str, Any]]:
    """The telemetry messages that wait."""
    return [message for message in socket.received() if message["type"] == "telemetry"]


@scene()
async def test_a_page_receives_hello_servos_telemetry_changes_and_errors(rig: Rig, servo: Servo) -> None:
    async with page(rig, "servos", "telemetry", "events", "bus", "jobs") as socket:
        hello = await socket.receive("hello")
        assert (hello["seq"], hello["schema_revision"]) == (1, rig.host.catalog.revision)
        assert [one["uid"] for one in (await socket.receive("servos"))["servos"]] == [servo.uid]
        samples = await socket.receive("telemetry")
        times = samples["channels"]["current_angle"]["t"]
        assert samples["uid"] == servo.uid
        assert times == sorted(times)
        await write(rig, servo, angle_p_gain=41)
        reading = (await socket.receive("parameter"))["reading"]
        assert (reading["key"], reading["value"], reading["rom"]) == ("angle_p_gain", 41, 40)

        command = '{"type": "command", "lease": "x", "commands": [{"uid": "UID", "type": "angle", "value": 1}]}'
        written = rig.writes()
        for wrong, code in (
            ("nonsense", "invalid_value"),
            ('{"type": "dance"}', "invalid_value"),
            ('{"type": "heartbeat", "lease": "none"}', "unknown_lease"),
            (command.replace("UID", servo.uid), "lease_required"),
            (command.replace("UID", "00"), "unknown_servo"),
        ):
            socket.send_raw(wrong)
            assert (await socket.receive("error"))["code"] == code
        assert rig.writes() == written


@scene(*(replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(9)))
async def test_the_refresh_of_servos_leaves_turns_of_the_loop_to_a_stop(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    servos = await rig.ready(9)
    async with page(rig, "servos") as socket:
        await asyncio.sleep(3)
        encoded: list[tuple[object, str]] = []
        turn: object = None
        encode = present.servo

        def spy(host: Host, one: Servo) -> ServoFacts:
            nonlocal turn
            if turn is None:
                turn = object()
                asyncio.get_running_loop().call_soon(end_turn)
            encoded.append((turn, one.uid))
            return encode(host, one)

        def end_turn() -> None:
            nonlocal turn
            turn = None

        monkeypatch.setattr(present, "servo", spy)
        socket.received()
        await asyncio.sleep(2)
        assert max(Counter(turn for turn, _ in encoded).values()) <= REFRESHED_A_TIME
        received = {
            one["uid"] for message in socket.received() if message["type"] == "servos" for one in message["servos"]
        }
        assert received == {servo.uid for servo in servos}


@scene()
async def test_the_angle_is_published_at_10_hz_with_the_time_on_the_bus_and_with_its_past(rig: Rig) -> None:
    await rig.ready()
    async with page(rig, "telemetry", "events") as socket:
        await socket.receive("hello")
        await asyncio.sleep(5)
        times = [t for one in telemetry(socket) for t in one["channels"].get("current_angle", {"t": []})["t"]]
        assert 45 <= len(times) <= 55
        assert all(0.08 < after - before < 0.12 for before, after in pairwise(times))
    await asyncio.sleep(15)
    async with page(rig, "telemetry", "events") as late:
        assert (await late.receive("event"))["code"] == "connected"
        times = (await late.receive("telemetry"))["channels"]["current_angle"]["t"]
        assert len(times) > 150
        assert times == sorted(times)


@scene(PLAIN, Recipe("BLA15-06U-A0", "1.300", node_id=12))
async def test_uids_filter_messages_until_null_removes_the_filter(rig: Rig) -> None:
    one, other = await rig.ready(2)
    async with page(rig, "telemetry", "servos", uids=[one.uid]) as socket:

        async def published() -> set[str]:
            socket.received()
            await asyncio.sleep(1)
            return {message["uid"] for message in telemetry(socket)}

        assert await published() == {one.uid}
        socket.send(type="subscribe", topics=["frames"], frames={})
        socket.send(type="subscribe", topics=["bus"])
        assert await published() == {one.uid}
        socket.send(type="subscribe", topics=["bus"], uids=None)
        assert await published() == {one.uid, other.uid}


@scene()
async def test_a_closed_page_or_a_stop_over_the_socket_turns_torque_off(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease(ttl_s=30)
    async with page(rig) as socket:
        socket.send(type="heartbeat", lease=lease)
        for value in range(201):  # faster than the bus: the newest is sent
            command = {"uid": servo.uid, "type": "angle", "value": value / 8}
            socket.send(type="command", lease=lease, commands=[command])
        await asyncio.sleep(2)
        sent = [raw for _, name, raw in rig.writes() if name == "0x00"]
        assert sent[-1] == 250
        assert len(sent) < 30
        assert abs(rig.sim(servo).angle_deg - 25) < 1
        assert rig.sim(servo).output == 0
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1
    assert json(await rig.call("GET", "/leases")) == []
    await torque(rig, servo, "on", await rig.lease())
    async with page(rig) as socket, page(rig) as other:
        socket.send(type="stop")
        async with asyncio.timeout(1):
            while not (await other.receive("stop"))["stop"]["latched"]:
                pass
        await asyncio.sleep(0.05)
        assert rig.sim(servo).output == 1


@scene()
async def test_a_socket_whose_writer_fails_is_closed_with_1011(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    await rig.ready()

    def fail(_: SocketQueue) -> list[str]:
        raise RuntimeWarning("a defect")

    async with page(rig) as socket:
        await socket.receive("hello")
        monkeypatch.setattr(SocketQueue, "take", fail)
        socket.send(type="subscribe", topics=["servos"])
        assert await socket.closed() == 1011
