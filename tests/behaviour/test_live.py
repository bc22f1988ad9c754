"""The WebSocket: what it sends, what it does for a page, and what happens when the page is gone."""

import asyncio
from itertools import pairwise

import orjson
import pytest

from behaviour.rig import PLAIN, Rig, Socket, json
from behaviour.scene import scene
from hornbill.api.live.event_log import EventLog
from hornbill.api.live.socket_queue import SocketQueue
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe


@scene()
async def test_a_page_hears_hello_servos_telemetry_and_changes_in_order(rig: Rig, servo: Servo) -> None:
    page = Socket(rig.app)
    hello = await page.hear("hello")
    assert hello["seq"] == 1
    assert hello["schema_revision"] == rig.host.catalog.revision
    page.say(type="subscribe", topics=["servos", "telemetry", "events", "bus", "jobs"])
    shown = (await page.hear("servos"))["servos"]
    assert [one["uid"] for one in shown] == [servo.uid]
    samples = await page.hear("telemetry")
    times = samples["channels"]["current_angle"]["t"]
    assert samples["uid"] == servo.uid
    assert times == sorted(times)
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 41}}))
    changed = await page.hear("parameter")
    assert (changed["reading"]["key"], changed["reading"]["value"], changed["reading"]["rom"]) == (
        "angle_p_gain",
        41,
        40,
    )
    await page.close()


@scene()
async def test_the_angle_comes_ten_times_a_second_and_carries_the_time_it_was_on_the_bus(rig: Rig) -> None:
    await rig.ready()
    page = Socket(rig.app)
    page.say(type="subscribe", topics=["telemetry"])
    await page.hear("hello")
    await asyncio.sleep(5)
    times = [
        t
        for message in page.heard()
        if message["type"] == "telemetry"
        for t in message["channels"].get("current_angle", {"t": []})["t"]
    ]
    gaps = [after - before for before, after in pairwise(times)]
    assert 45 <= len(times) <= 55
    assert all(0.08 < gap < 0.12 for gap in gaps)
    await page.close()


@scene(PLAIN, Recipe("BLA15-06U-A0", "1.300", node_id=12))
async def test_uids_limit_what_is_sent(rig: Rig) -> None:
    one, other = await rig.ready(2)
    page = Socket(rig.app)
    page.say(type="subscribe", topics=["telemetry", "servos"], uids=[one.uid])
    await asyncio.sleep(1)
    uids = {message["uid"] for message in page.heard() if message["type"] == "telemetry"}
    assert uids == {one.uid}
    assert other.uid not in uids
    await page.close()


@scene(PLAIN, Recipe("BLA15-06U-A0", "1.300", node_id=12))
async def test_another_topic_keeps_the_limit_and_null_lifts_it(rig: Rig) -> None:
    one, other = await rig.ready(2)
    page = Socket(rig.app)

    async def heard() -> set[str]:
        page.heard()
        await asyncio.sleep(1)
        return {message["uid"] for message in page.heard() if message["type"] == "telemetry"}

    page.say(type="subscribe", topics=["telemetry", "servos"], uids=[one.uid])
    assert await heard() == {one.uid}
    page.say(type="subscribe", topics=["frames"], frames={})
    page.say(type="subscribe", topics=["bus"])
    assert await heard() == {one.uid}
    page.say(type="subscribe", topics=["bus"], uids=None)
    assert await heard() == {one.uid, other.uid}
    await page.close()


@scene()
async def test_a_closed_page_takes_torque_with_it(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease(ttl_s=30)
    page = Socket(rig.app)
    page.say(type="heartbeat", lease=lease)
    page.say(type="command", lease=lease, commands=[{"uid": servo.uid, "type": "angle", "value": 25}])
    await asyncio.sleep(1)
    assert abs(rig.sim(servo).angle_deg - 25) < 1
    assert rig.sim(servo).output == 0
    await page.close()
    await asyncio.sleep(0.1)
    assert rig.sim(servo).output == 1
    assert json(await rig.call("GET", "/leases")) == []


@scene()
async def test_stop_over_the_socket_is_stop(rig: Rig, servo: Servo) -> None:
    page, other = Socket(rig.app), Socket(rig.app)
    page.say(type="stop")
    async with asyncio.timeout(1):
        while not (message := await other.hear("stop"))["stop"]["latched"]:
            pass
    await asyncio.sleep(0.05)
    assert message["stop"]["latched"] is True
    assert rig.sim(servo).output == 1
    await page.close()
    await other.close()


@scene()
async def test_commands_faster_than_the_bus_are_thinned_and_the_newest_wins(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    page = Socket(rig.app)
    for value in range(200):
        page.say(type="command", lease=lease, commands=[{"uid": servo.uid, "type": "angle", "value": value / 10}])
    await asyncio.sleep(2)
    sent = [raw for _, name, raw in rig.writes() if name == "0x00"]
    assert sent[-1] == 199
    assert len(sent) < 30
    await page.close()


@scene()
async def test_what_cannot_be_done_is_answered_with_the_code_rest_would_give(rig: Rig, servo: Servo) -> None:
    page = Socket(rig.app)
    command = '{"type": "command", "lease": "x", "commands": [{"uid": "UID", "type": "angle", "value": 1}]}'
    for wrong, code in (
        ("nonsense", "invalid_value"),
        ('{"type": "dance"}', "invalid_value"),
        ('{"type": "heartbeat", "lease": "none"}', "unknown_lease"),
        (command.replace("UID", servo.uid), "lease_required"),
        (
            '{"type": "command", "lease": "x", "commands": [{"uid": "00", "type": "angle", "value": 1}]}',
            "unknown_servo",
        ),
    ):
        page.say_raw(wrong)
        assert (await page.hear("error"))["code"] == code
    assert rig.writes() == []
    await page.close()


@scene()
async def test_a_reader_that_never_reads_costs_a_bounded_outbox(rig: Rig, servo: Servo) -> None:
    box = SocketQueue(EventLog(rig.host, demo=False))
    box.subscribe(["telemetry", "servos", "events"], None)
    wish = {"channels": ["current_angle"], "rate_hz": 100}
    json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", wish))
    await asyncio.sleep(60)
    packed = [orjson.loads(message) for message in box.take() if '"telemetry"' in message[:40]]
    assert len(packed) == 2  # what there was when it subscribed, and since
    assert sum(message["dropped"] for message in packed) > 3000
    assert len(packed[1]["channels"]["current_angle"]["t"]) < 2500


@scene()
async def test_a_page_that_comes_late_is_given_the_last_angles_and_events_at_once(rig: Rig) -> None:
    await rig.ready()
    await asyncio.sleep(20)
    page = Socket(rig.app)
    page.say(type="subscribe", topics=["telemetry", "events"])
    event = await page.hear("event")
    assert event["code"] == "connected"
    times = (await page.hear("telemetry"))["channels"]["current_angle"]["t"]
    assert len(times) > 150
    assert times == sorted(times)
    await page.close()


@scene()
async def test_a_page_whose_writer_fails_is_told_to_connect_anew(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    await rig.ready()

    def fail(_box: SocketQueue) -> list[str]:
        raise RuntimeWarning("a defect")

    page = Socket(rig.app)
    await page.hear("hello")
    monkeypatch.setattr(SocketQueue, "take", fail)
    page.say(type="subscribe", topics=["servos"])
    assert await page.closed() == 1011
    await page.close()
