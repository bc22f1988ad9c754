"""The event stream tells what the WebSocket tells, resumes where it was interrupted, and says what is lost."""

import asyncio
from typing import Any, cast

import orjson
import pytest
from fastapi import FastAPI
from hypothesis import given
from hypothesis import strategies as st

from behaviour.rig import PLAIN, Rig, Socket, json, play, problem
from behaviour.scene import scene
from behaviour.test_access import Door, through
from hornbill.api.live import event_log
from hornbill.api.live.event_log import EventBuffer, LogEntry
from hornbill.api.live.event_stream import HEARTBEAT_S, end_streams, places
from hornbill.domain.event import EventCode
from hornbill.servo.runtime.hub import LogEvent
from hornbill.sim.bench.recipe import Recipe

OTHER = Recipe("BLA21-06U-A0", "1.300", servo_id=2, node_id=12)
Event = dict[str, Any]


class Stream:
    """One event stream without a network; `slow` is a reader that takes nothing until it is let."""

    def __init__(self, app: FastAPI, query: str = "", last: str | None = None, **headers: str) -> None:
        self._from: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._gone = asyncio.Event()
        self.flowing = asyncio.Event()
        self.flowing.set()
        self.status = 0
        self.headers: dict[str, str] = {}
        self._text = ""
        self.last: str | None = None
        path = "/api/v1/events/stream"
        said = {"host": "localhost", **headers, **({} if last is None else {"last-event-id": last})}
        scope: dict[str, Any] = {
            "type": "http", "method": "GET", "path": path, "raw_path": path.encode(), "query_string": query.encode(),
            "headers": [(name.encode(), value.encode()) for name, value in said.items()], "root_path": "",
            "scheme": "http", "client": ("192.0.2.9", 1), "server": ("test", 80), "http_version": "1.1",
            "asgi": {"version": "3.0", "spec_version": "2.3"},
        }  # fmt: skip
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
        """The next event; comments are passed over."""
        while True:
            lines = dict(line.split(": ", 1) for line in (await self.block(within_s)).splitlines())
            if "event" in lines:
                told: Event = orjson.loads(lines["data"])
                assert told["type"] == lines["event"]
                self.last = lines.get("id", self.last)
                return {**told, "id": lines.get("id")}

    async def hear(self, kind: str, **members: object) -> Event:
        """The next event of this type with these members."""
        async with asyncio.timeout(60):
            while True:
                told = await self.next()
                if told["type"] == kind and all(told.get(name) == value for name, value in members.items()):
                    return told

    async def settled(self) -> list[Event]:
        """Everything until nothing more comes for a moment."""
        found: list[Event] = []
        while True:
            try:
                found.append(await self.next(0.3))
            except TimeoutError:
                return found

    async def close(self) -> None:
        """Go away."""
        self._gone.set()
        self.flowing.set()
        await self.task


def tell(rig: Rig, code: str) -> None:
    rig.host.hub.publish(LogEvent("notice", cast("EventCode", code), f"This is {code}."))


def codes(events: list[Event]) -> list[str]:
    return [one["code"] for one in events if one["type"] == "event"]


@scene()
async def test_it_begins_with_how_everything_is_and_goes_on_with_what_changes(rig: Rig) -> None:
    [servo] = await rig.ready()
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
    json(await rig.call("PUT", f"/servos/{servo.uid}/parameters/angle_p_gain", {"value": 42}))
    changed = await stream.hear("parameter")
    assert (changed["reading"]["key"], changed["reading"]["value"]) == ("angle_p_gain", 42)
    json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    await stream.hear("job")
    json(await rig.call("POST", "/stop"))
    assert (await stream.hear("stop"))["stop"]["latched"] is True
    await stream.close()


@scene(PLAIN, OTHER)
async def test_only_the_topics_and_servos_that_were_asked_for_and_always_stop_and_lease(rig: Rig) -> None:
    servos = await rig.ready(2)
    stream = Stream(rig.app, f"topics=servos&uids={servos[0].uid}")
    for one in servos:
        json(await rig.call("PUT", f"/servos/{one.uid}/parameters/angle_p_gain", {"value": 42}))
    await rig.lease()
    tell(rig, "not_asked_for")
    heard = await stream.settled()
    assert {one["type"] for one in heard} == {"hello", "servos", "parameter", "lease", "stop"}
    assert {one["uid"] for one in heard if one["type"] == "parameter"} == {servos[0].uid}
    assert {one["servos"][0]["uid"] for one in heard if one["type"] == "servos"} == {servos[0].uid}
    assert [one["lease"] and one["lease"]["holder"] for one in heard if one["type"] == "lease"][-1] == "test"
    await stream.close()


@scene()
async def test_telemetry_comes_in_batches_of_what_the_feed_packed(rig: Rig) -> None:
    [servo] = await rig.ready()
    json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", {"channels": ["current_angle"], "rate_hz": 50}))
    stream = Stream(rig.app, "topics=telemetry")
    seen: list[float] = []
    while len(seen) < 100:
        told = await stream.hear("telemetry", uid=servo.uid)
        seen += told["channels"]["current_angle"]["t"]
    assert seen == sorted(set(seen))
    await stream.close()
    again = Stream(rig.app, "topics=telemetry", last=stream.last)
    more = (await again.hear("telemetry"))["channels"]["current_angle"]["t"]
    assert more[0] - seen[-1] < 0.2
    await again.close()


@scene()
async def test_who_comes_back_gets_what_was_missed_once_and_nothing_else(rig: Rig) -> None:
    await rig.ready()
    stream = Stream(rig.app, "topics=events")
    await stream.settled()
    tell(rig, "before")
    await stream.hear("event", code="before")
    await stream.close()
    for n in range(5):
        tell(rig, f"missed_{n}")
        await asyncio.sleep(1)
    again = Stream(rig.app, "topics=events", last=stream.last)
    heard = await again.settled()
    assert codes(heard) == [f"missed_{n}" for n in range(5)]
    assert {one["type"] for one in heard} == {"hello", "event"}
    tell(rig, "after")
    assert (await again.next())["code"] == "after"
    await again.close()


def test_a_gap_is_said_with_its_size_and_then_how_everything_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_log, "EventBuffer", lambda: EventBuffer(entries=10))

    async def scene(rig: Rig) -> None:
        await rig.ready()
        stream = Stream(rig.app, "topics=events")
        await stream.settled()
        await stream.close()
        for n in range(25):
            tell(rig, f"e{n}")
        again = Stream(rig.app, "topics=events", last=stream.last)
        assert (await again.next())["type"] == "hello"
        dropped = await again.next()
        heard = await again.settled()
        assert (dropped["type"], dropped["count"], dropped["telemetry"]) == ("dropped", 25 - 10, False)
        assert codes(heard) == [f"e{n}" for n in range(15, 25)]
        assert {"stop", "lease"} <= {one["type"] for one in heard}
        assert [one["id"] is None for one in heard] == [True] * (len(heard) - 1) + [False]
        await again.close()

    play(scene)


@pytest.mark.parametrize("last", ["deadbeef.12", "nonsense", "~.~", "", "x" * 200])
@scene()
async def test_the_id_of_another_server_is_a_gap_of_unknown_size(rig: Rig, last: str) -> None:
    await rig.ready()
    stream = Stream(rig.app, "topics=servos", last=last)
    heard = await stream.settled()
    assert [(one["type"], one.get("count")) for one in heard[:2]] == [("hello", None), ("dropped", None)]
    assert "servos" in {one["type"] for one in heard}
    await stream.close()


def test_a_slow_reader_is_told_what_it_missed_and_holds_nobody_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_log, "EventBuffer", lambda: EventBuffer(entries=50))

    async def scene(rig: Rig) -> None:
        await rig.ready()
        slow, quick = Stream(rig.app, "topics=events"), Stream(rig.app, "topics=events")
        await slow.settled()
        await quick.settled()
        slow.flowing.clear()
        heard: list[Event] = []
        for n in range(300):
            tell(rig, f"e{n}")
            if n % 20 == 0:
                heard += await quick.settled()
        heard += await quick.settled()
        assert codes(heard) == [f"e{n}" for n in range(300)]
        slow.flowing.set()
        late = await slow.settled()
        counted = sum(one["count"] for one in late if one["type"] == "dropped")
        told = list(dict.fromkeys(codes(late)))
        assert counted > 0
        assert counted + len(told) >= 300  # what else happened meanwhile is counted, too
        assert told[-1] == "e299"
        await slow.close()
        await quick.close()

    play(scene)


@scene(connect=False)
async def test_when_nothing_happens_there_are_comments(rig: Rig) -> None:
    stream = Stream(rig.app, "topics=jobs")
    await stream.settled()
    begun = rig.host.base.now()
    assert await stream.block(HEARTBEAT_S + 1) == ": heartbeat"
    assert rig.host.base.now() - begun <= HEARTBEAT_S + 0.5
    await stream.close()


@scene(connect=False)
async def test_an_event_carries_its_values_to_sockets_and_streams_alike(rig: Rig) -> None:
    stream, socket = Stream(rig.app, "topics=events"), Socket(rig.app)
    socket.say(type="subscribe", topics=["events"])
    await stream.settled()
    rig.host.hub.publish(LogEvent("notice", "hunting", "It is 4.2°.", params={"angle_deg": 4.2}))
    for told in (await stream.hear("event", code="hunting"), await socket.hear("event")):
        assert (told["text"], told["params"]) == ("It is 4.2°.", {"angle_deg": 4.2})
    await stream.close()
    await socket.close()


def test_it_stops_listening_a_while_after_the_last_reader(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_log, "LINGER_S", 3.0)

    async def scene(rig: Rig) -> None:
        await rig.ready()
        stream = Stream(rig.app, "topics=telemetry,events")
        tell(rig, "something")
        await stream.hear("event", code="something")
        found = rig.app.state.event_log
        await stream.close()
        await asyncio.sleep(event_log.LINGER_S / 2)
        assert found.listening
        await asyncio.sleep(event_log.LINGER_S)
        assert not found.listening
        again = Stream(rig.app, "topics=events", last=stream.last)
        assert (await again.hear("dropped"))["count"] is None
        await again.close()

    play(scene)


@scene()
async def test_streams_end_when_the_server_does(rig: Rig) -> None:
    stream = Stream(rig.app)
    await stream.settled()
    end_streams(rig.app.state)
    async with asyncio.timeout(1):
        await stream.task


@pytest.mark.parametrize("query", ["topics=frames", "topics=", "topics=servos,", "topics=all", "uids=abc", "uids=x,y"])
@scene()
async def test_what_is_no_topic_or_servo_is_refused(rig: Rig, query: str) -> None:
    problem(await rig.call("GET", f"/events/stream?{query}"), "invalid_value", 422)


def test_a_stream_takes_a_token_where_one_is_needed_and_ends_with_it() -> None:
    async def scene(door: Door) -> None:
        await door.token("boss", "admin")
        async with door.somebody() as nobody:
            problem(await nobody.get("/events/stream"), "unauthorized", 401)
        stream = Stream(door.app, authorization=f"Bearer {await door.token('looker', 'view')}")
        await stream.settled()
        assert not stream.task.done()
        door.rig.host.store.tokens.drop("looker")
        await door.access.refresh()
        async with asyncio.timeout(1):
            await stream.task

    through(scene)


@given(st.integers(1, 20), st.lists(st.text("abc", max_size=5), max_size=60), st.integers(0, 60))
def test_a_buffer_counts_what_is_lost_from_any_place_and_gives_the_rest(
    most: int, texts: list[str], place: int
) -> None:
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


def test_a_buffer_keeps_the_newest_entry_of_each_key_and_nothing_is_lost_by_it() -> None:
    buffer = EventBuffer(entries=3)
    for number in range(30):
        buffer.put(LogEntry("servos", "parameter", None, str(number), f"key {number % 3}"))
    lost, found = buffer.since(0)
    assert lost == 0
    assert [(number, entry.json) for number, entry in found] == [(27, "27"), (28, "28"), (29, "29")]


def test_ids_of_any_form_are_read() -> None:
    assert places("ab.12~cd.0~x~.7~e.-1~f.²") == {"ab": 12, "cd": 0, "": 7}
