"""A lost bus: shown, pending requests failed, reopened automatically; connections leave nothing behind."""

import asyncio
import gc
import threading
from pathlib import Path

import pytest

from behaviour.actions import power_cycle
from behaviour.losing import HOLDING, PAIR, THREE, WITHOUT_ID, Loss, back, commanded, each_loss, now, off_the_bus
from behaviour.rig import Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State


@each_loss
@scene(*PAIR)
async def test_a_lost_bus_is_shown_within_a_second_with_a_remedy_and_reopened(rig: Rig, lose: Loss) -> None:
    servo = (await rig.ready(2))[0]
    page = Socket(rig.app)
    page.send(type="subscribe", topics=["bus", "events"])
    await page.receive("bus")
    before = json(await rig.call("GET", "/bus"))
    await lose(rig)
    lost_at = now()
    while (shown := await page.receive("bus"))["bus"]["state"] in ("active", "passive"):
        pass
    assert shown["bus"]["state"] in ("lost", "bus_off")
    assert now() - lost_at < 0.5
    assert shown["bus"]["trouble"]
    await asyncio.sleep(0)
    events = rig.events("bus_lost")
    assert [one.level for one in events] == ["failure"]
    assert "memory:host" in events[0].text
    await back(rig)
    shown = json(await rig.call("GET", "/bus"))
    assert (shown["trouble"], shown["retry_in_s"], shown["reopened"]) == (None, None, 1)
    assert shown["rx_frames"] >= before["rx_frames"] > 0, "counters go on"
    assert shown["bus_offs"] == (lose is off_the_bus)
    assert [one.level for one in rig.events("bus_back")] == ["notice"]
    await asyncio.sleep(2)
    assert servo.state is State.READY
    assert len(rig.events("ready")) == 2, "a short loss does not repeat identification"


@scene(*PAIR)
async def test_everything_resumes_once_the_bus_is_back(rig: Rig) -> None:
    """Angles, polling, reads, and node IDs, also for servos added meanwhile."""
    servo = (await rig.ready(2))[0]
    await rig.cable.unplug()
    rig.bench.add(WITHOUT_ID)
    await asyncio.sleep(0.95)
    shown = json(await rig.call("GET", "/bus"))
    assert (shown["state"], shown["trouble"]) == ("lost", "There is no such adapter. Plug it in.")
    assert 0 <= shown["retry_in_s"] <= 1
    assert "Plug it in" in rig.events("bus_trouble")[0].text
    await asyncio.sleep(60)
    assert len(rig.events("bus_lost")) == len(rig.events("bus_trouble")) == 1
    assert 0 <= json(await rig.call("GET", "/bus"))["retry_in_s"] <= 5
    assert servo.state is State.OFFLINE
    assert rig.events("offline") == [], "one lost bus, not one event for every servo on it"
    lost_until = now()
    await back(rig)
    assert rig.host.connected().allocator.listening_since > lost_until, "other hosts may have allocated IDs meanwhile"
    await rig.ready(3)
    assert servo.angle_at is not None
    assert now() - servo.angle_at < 0.2
    polled = servo.registers["current_temperature"]
    at = polled.at
    await asyncio.sleep(3)
    assert polled.at is not None
    assert at is not None
    assert polled.at > at
    json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_voltage"))
    assert len(json(await rig.call("GET", "/allocations"))["allocations"]) == 1


@pytest.mark.parametrize("away_s", [2.5, 60.0])
@scene(HOLDING)
async def test_queued_frames_of_a_lone_servo_are_no_restart_and_delay_no_torque_off(
    rig: Rig, servo: Servo, away_s: float
) -> None:
    """Unacknowledged, it repeats what it sent meanwhile before anything new."""
    await asyncio.sleep(20)
    await commanded(rig, servo)
    await rig.cable.unplug()
    await asyncio.sleep(away_s)
    await back(rig)
    await asyncio.sleep(0.2)
    assert rig.sim(servo).output == 1
    await asyncio.sleep(10)
    assert servo.state is State.READY
    assert servo.boot_count == 0
    assert rig.events("restarted") == []


@scene(*PAIR)
async def test_a_restart_while_the_bus_was_lost_is_noticed(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await asyncio.sleep(20)
    await rig.cable.unplug()
    await power_cycle(rig, servo.uid, 0.5)
    await asyncio.sleep(40)
    await back(rig)
    await asyncio.sleep(5)
    assert servo.boot_count == 1
    assert servo.state is State.READY


@scene(connect=False)
async def test_a_bus_that_cannot_be_opened_at_start_is_retried(rig: Rig) -> None:
    rig.cable.plugged = False
    port = rig.cable.port("memory:host", 1_000_000)
    await port.open_with_retries()
    await rig.host.attach(port)
    assert "reopened automatically" in rig.events("bus_lost")[0].text
    assert json(await rig.call("GET", "/bus"))["state"] == "lost"
    await back(rig)
    await rig.ready()
    assert json(await rig.call("GET", "/bus"))["reopened"] == 0


@scene(connect=False)
async def test_an_unusual_sample_point_is_shown_and_reported(rig: Rig) -> None:
    for point, reported in ((0.875, 0), (0.8778, 0), (None, 0), (0.75, 1)):
        port = rig.cable.port("memory:host", 1_000_000)
        await port.open()
        assert rig.cable.inner is not None
        rig.cable.inner.sample_point = point
        await rig.host.attach(port)
        assert json(await rig.call("GET", "/bus"))["sample_point"] == point
        assert len(events := rig.events("sample_point")) == reported
        assert all("75.0%" in one.text and "87.5%" in one.text for one in events)
        await rig.host.disconnect()


@each_loss
@scene(*THREE)
async def test_no_request_keeps_waiting(rig: Rig, lose: Loss) -> None:
    servos, lease = await rig.ready(3), await rig.lease()
    reads = [asyncio.create_task(rig.call("GET", f"/servos/{servo.uid}/parameters?refresh=true")) for servo in servos]
    body = {"type": "angle", "value": 150, "wait": "settled", "timeout_s": 60}
    moving = asyncio.create_task(rig.call("POST", f"/servos/{servos[0].uid}/command", body, lease=lease))
    await asyncio.sleep(0.005)
    await lose(rig)
    lost_at = now()
    for response in await asyncio.gather(*reads, moving):
        problem(response, "bus_disconnected", 503)
    assert now() - lost_at < 0.2
    await asyncio.sleep(0.1)
    for servo in servos:
        began = now()
        for verb, path, body in (
            ("GET", "/parameters/current_angle", None),
            ("PUT", "/parameters/angle_limit_cw", {"value": 75}),
            ("POST", "/torque", {"mode": "off"}),
        ):
            response = await rig.call(verb, f"/servos/{servo.uid}{path}", body, lease=lease)
            problem(response, "bus_disconnected", 503)
        assert now() - began < 0.01


def open_files() -> int:
    files = Path("/proc/self/fd")
    return len(list(files.iterdir())) if files.is_dir() else 0


async def connections(rig: Rig, count: int) -> tuple[int, int, int]:
    """Connect and disconnect `count` times; the threads, open files and tasks that are left."""
    for _ in range(count):
        await rig.host.connect("memory:host", 1_000_000)
        await asyncio.sleep(0.01)
        await rig.host.disconnect()
    rig.changes.clear()
    rig.bus.history.clear()
    await asyncio.sleep(5)  # timers of requests expire
    gc.collect()
    return threading.active_count(), open_files(), len(asyncio.all_tasks())


@scene(connect=False)
async def test_connections_leave_nothing_behind(rig: Rig) -> None:
    """`make test-release` counts objects, too."""
    assert await connections(rig, 5) == await connections(rig, 30)
    assert rig.cable.openings == 35
