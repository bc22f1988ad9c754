"""The event stream: same events as the WebSocket, resumed after an interruption, with gaps reported."""

import asyncio
from typing import Any, cast

import orjson
import pytest
from fastapi import FastAPI
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviour.actions import write
from behaviour.restarting import run
from behaviour.rig import PLAIN, Rig, Socket, json, problem
from behaviour.scene import scene
from behaviour.secured import SecuredServer, secured
from behaviour.streaming import http_scope
from hornbill.api.live import event_log
from hornbill.api.live.event_log import EventBuffer, LogEntry
from hornbill.api.live.event_stream import HEARTBEAT_S, end_streams, places
from hornbill.domain.event import EventCode
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import LogEvent
from hornbill.sim.bench.recipe import Recipe

OTHER = Recipe("BLA21-06U-A0", "1.300", servo_id=2, node_id=12)
Event = dict[str, Any]


class Stream:
    """One event stream without a network. Without `flowing`, its reader takes nothing."""

    def __init__(self, app: FastAPI, query: str = "", last: str | None = None, **headers: str) -> None:
        self._from: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._gone = asyncio.Event()
        self.flowing = asyncio.Event()
        self.flowing.set()
        self.status = 0
        self.headers: dict[str, str] = {}
        self._text = ""
        self.last: str | None = None
        names = {"host": "localhost", **headers, **({} if last is None else {"last-event-id": last})}
        headed = [(name.encode(), value.encode()) for name, value in names.items()]
        scope = http_scope("/api/v1/events/stream", query.encode(), headed)
        self.task = asyncio.create_task(app(scope, self._receive, self._send))  # pyright: ignore[reportArgumentType]

    async def _receive(self) -> dict[str, Any]:
        await self._gone.wait()
        return {"type": "http.disconnect"}

    async def _send(self, message: Any) -> None:
        await self.flowing.wait()
        self._from.put_nowait(message)

    async def block(self, within_s: float = 15.0) -> str:
        """The next block of lines."""
        async with asyncio.timeout(within_s):
            while "\n\n" not in self._text:
                message = await self._from.get()
                if message["type"] == "http.response.start":
                    self.status = message["status"]
                    self.headers = {name.decode(): value.decode() for name, value in message["headers"]}
                self._text += message.get("body", b"").decode()
        found, _, self._text = self._text.partition("\n\n")
        return found

    async def next(self, within_s: float = 15.0) -> Event:
        """The next event; comments are skipped."""
        while True:
            lines = dict(line.split(": ", 1) for line in (await self.block(within_s)).splitlines())
            if "event" in lines:
                event: Event = orjson.loads(lines["data"])
                assert event["type"] == lines["event"]
                self.last = lines.get("id", self.last)
                return {**event, "id": lines.get("id")}

    async def receive(self, kind: str, **members: object) -> Event:
        """The next event of this type with these members."""
        async with asyncio.timeout(60):
            while True:
                event = await self.next()
                if event["type"] == kind and all(event.get(name) == value for name, value in members.items()):
                    return event

    async def settled(self) -> list[Event]:
        """All events until none comes for 0.3 s."""
        found: list[Event] = []
        while True:
            try:
                found.append(await self.next(0.3))
            except TimeoutError:
                return found

    async def close(self) -> None:
        """Disconnect."""
        self._gone.set()
        self.flowing.set()
        await self.task


def publish(rig: Rig, code: str) -> None:
    rig.host.hub.publish(LogEvent("notice", cast("EventCode", code), f"This is {code}."))


def codes(events: list[Event]) -> list[str]:
    return [one["code"] for one in events if one["type"] == "event"]


@scene()
async def test_a_stream_begins_with_the_state_continues_with_changes_and_ends_with_the_server(
    rig: Rig, servo: Servo
) -> None:
    stream = Stream(rig.app)
    hello = await stream.next()
    assert (hello["type"], stream.status) == ("hello", 200)
    assert stream.headers["content-type"].startswith("text/event-stream")
    first = await stream.settled()
    kinds = {one["type"] for one in first}
    assert {"servos", "bus", "lease", "stop", "event"} <= kinds
    assert "telemetry" not in kinds
    assert [one["servos"][0]["uid"] for one in first if one["type"] == "servos"] == [servo.uid]
    assert [one["seq"] for one in first] == list(range(1, len(first) + 1))
    await write(rig, servo, angle_p_gain=42)
    changed = await stream.receive("parameter")
    assert (changed["reading"]["key"], changed["reading"]["value"]) == ("angle_p_gain", 42)
    await run(rig, servo, "restart")
    await stream.receive("job")
    json(await rig.call("POST", "/stop"))
    assert (await stream.receive("stop"))["stop"]["latched"] is True
    end_streams(rig.app.state)
    async with asyncio.timeout(1):
        await stream.task


@scene(PLAIN, OTHER)
async def test_topics_and_servos_filter_but_stop_and_lease_always_come(rig: Rig) -> None:
    servos = await rig.ready(2)
    for query in ("topics=frames", "topics=", "topics=servos,", "topics=all", "uids="):
        problem(await rig.call("GET", f"/events/stream?{query}"), "invalid_value", 422)
    problem(await rig.call("GET", "/events/stream?uids=abc"), "unknown_servo", 404)
    stream = Stream(rig.app, f"topics=servos&uids={servos[0].uid}")
    for one in servos:
        await write(rig, one, angle_p_gain=42)
    await rig.lease()
    publish(rig, "not_subscribed")
    received = await stream.settled()
    assert {one["type"] for one in received} == {"hello", "servos", "parameter", "lease", "stop"}
    assert {one["uid"] for one in received if one["type"] == "parameter"} == {servos[0].uid}
    assert {one["servos"][0]["uid"] for one in received if one["type"] == "servos"} == {servos[0].uid}
    assert [one["lease"] and one["lease"]["holder"] for one in received if one["type"] == "lease"][-1] == "test"
    await stream.close()


@scene()
async def test_telemetry_arrives_in_batches_and_resumes(rig: Rig, servo: Servo) -> None:
    json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", {"channels": ["current_angle"], "rate_hz": 50}))
    stream = Stream(rig.app, "topics=telemetry")
    seen: list[float] = []
    while len(seen) < 100:
        event = await stream.receive("telemetry", uid=servo.uid)
        seen += event["channels"]["current_angle"]["t"]
    assert seen == sorted(set(seen))
    await stream.close()
    again = Stream(rig.app, "topics=telemetry", last=stream.last)
    more = (await again.receive("telemetry"))["channels"]["current_angle"]["t"]
    assert more[0] - seen[-1] < 0.2
    await again.close()


@scene()
async def test_a_resumed_stream_delivers_missed_events_once_or_reports_a_gap_of_unknown_size(rig: Rig) -> None:
    await rig.ready()
    stream = Stream(rig.app, "topics=events")
    await stream.settled()
    publish(rig, "before")
    await stream.receive("event", code="before")
    await stream.close()
    for n in range(5):
        publish(rig, f"missed_{n}")
        await asyncio.sleep(1)
    again = Stream(rig.app, "topics=events", last=stream.last)
    received = await again.settled()
    assert codes(received) == [f"missed_{n}" for n in range(5)]
    assert {one["type"] for one in received} == {"hello", "event"}
    publish(rig, "after")
    assert (await again.next())["code"] == "after"
    await again.close()
    for last in ("deadbeef.12", "nonsense", "~.~", "", "x" * 200):
        stream = Stream(rig.app, "topics=servos", last=last)
        received = await stream.settled()
        assert [(one["type"], one.get("count")) for one in received[:2]] == [("hello", None), ("dropped", None)]
        assert "servos" in {one["type"] for one in received}
        await stream.close()


@scene()
async def test_a_gap_is_reported_with_its_size_and_the_state(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_log, "EventBuffer", lambda: EventBuffer(entries=10))
    await rig.ready()
    stream = Stream(rig.app, "topics=events")
    await stream.settled()
    await stream.close()
    for n in range(25):
        publish(rig, f"e{n}")
    again = Stream(rig.app, "topics=events", last=stream.last)
    assert (await again.next())["type"] == "hello"
    dropped = await again.next()
    received = await again.settled()
    assert (dropped["type"], dropped["count"], dropped["telemetry"]) == ("dropped", 25 - 10, False)
    assert codes(received) == [f"e{n}" for n in range(15, 25)]
    assert {"stop", "lease"} <= {one["type"] for one in received}
    assert [one["id"] is None for one in received] == [True] * (len(received) - 1) + [False]
    await again.close()


@scene()
async def test_a_slow_reader_delays_no_one_and_learns_what_it_missed(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_log, "EventBuffer", lambda: EventBuffer(entries=50))
    await rig.ready()
    slow, quick = Stream(rig.app, "topics=events"), Stream(rig.app, "topics=events")
    await slow.settled()
    await quick.settled()
    slow.flowing.clear()
    received: list[Event] = []
    for n in range(300):
        publish(rig, f"e{n}")
        if n % 20 == 0:
            received += await quick.settled()
    received += await quick.settled()
    assert codes(received) == [f"e{n}" for n in range(300)]
    slow.flowing.set()
    late = await slow.settled()
    lost = sum(one["count"] for one in late if one["type"] == "dropped")
    seen = list(dict.fromkeys(codes(late)))
    assert lost > 0
    assert lost + len(seen) >= 300  # other events meanwhile are counted, too
    assert seen[-1] == "e299"
    await slow.close()
    await quick.close()


@scene(connect=False)
async def test_an_idle_stream_sends_heartbeats_and_an_event_its_values(rig: Rig) -> None:
    stream, socket = Stream(rig.app, "topics=events"), Socket(rig.app)
    socket.send(type="subscribe", topics=["events"])
    await stream.settled()
    begun = rig.host.base.now()
    assert await stream.block(HEARTBEAT_S + 1) == ": heartbeat"
    assert rig.host.base.now() - begun <= HEARTBEAT_S + 0.5
    rig.host.hub.publish(LogEvent("notice", "hunting", "It is 4.2°.", params={"angle_deg": 4.2}))
    for event in (await stream.receive("event", code="hunting"), await socket.receive("event")):
        assert (event["text"], event["params"]) == ("It is 4.2°.", {"angle_deg": 4.2})
    await stream.close()
    await socket.close()


@scene()
async def test_the_log_stops_after_the_last_reader(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_log, "LINGER_S", 3.0)
    await rig.ready()
    stream = Stream(rig.app, "topics=telemetry,events")
    publish(rig, "something")
    await stream.receive("event", code="something")
    found = rig.app.state.event_log
    await stream.close()
    await asyncio.sleep(event_log.LINGER_S / 2)
    assert found.listening
    await asyncio.sleep(event_log.LINGER_S)
    assert not found.listening
    again = Stream(rig.app, "topics=events", last=stream.last)
    assert (await again.receive("dropped"))["count"] is None
    await again.close()


@secured()
async def test_a_stream_needs_a_token_and_ends_with_it(server: SecuredServer) -> None:
    await server.token("boss", "admin")
    async with server.client() as client:
        problem(await client.get("/events/stream"), "unauthorized", 401)
    stream = Stream(server.app, authorization=f"Bearer {await server.token('viewer', 'view')}")
    await stream.settled()
    assert not stream.task.done()
    await server.revoke("viewer")
    async with asyncio.timeout(1):
        await stream.task


@settings(max_examples=50)
@given(st.integers(1, 20), st.lists(st.text("abc", max_size=5), max_size=60), st.integers(0, 60))
def test_a_buffer_counts_lost_entries_and_returns_the_rest(most: int, texts: list[str], place: int) -> None:
    buffer = EventBuffer(entries=most, size=40)
    for text in texts:
        buffer.put(LogEntry("events", "event", None, text))
    place = min(place, buffer.next)
    lost, found = buffer.since(place)
    assert buffer.next == len(texts)
    assert lost + len(found) == buffer.next - place
    assert [(number, texts[number]) for number, _ in found] == [(number, entry.json) for number, entry in found]
    assert len(buffer.since(0)[1]) <= most
    assert sum(len(entry.json) for _, entry in buffer.since(0)[1]) <= 40


def test_a_buffer_keeps_the_newest_entry_of_each_key() -> None:
    buffer = EventBuffer(entries=3)
    for number in range(30):
        buffer.put(LogEntry("servos", "parameter", None, str(number), f"key {number % 3}"))
    lost, found = buffer.since(0)
    assert (lost, [(number, entry.json) for number, entry in found]) == (0, [(27, "27"), (28, "28"), (29, "29")])


def test_event_ids_of_any_form_are_parsed() -> None:
    assert places("ab.12~cd.0~x~.7~e.-1~f.²") == {"ab": 12, "cd": 0, "": 7}
