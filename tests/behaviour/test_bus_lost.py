"""A bus that is lost: shown at once, nobody left waiting, and back by itself; connections leave nothing behind."""

import asyncio
import gc
import threading
from pathlib import Path

import pytest

from behaviour.losing import ASKING, HOLDING, PAIR, THREE, Way, back, commanded, now, off_the_bus, ways
from behaviour.rig import Rig, Socket, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State

# Shown, and back by itself.


@ways
@scene(*PAIR)
async def test_a_lost_bus_is_shown_within_a_second_and_comes_back_by_itself(rig: Rig, lose: Way) -> None:
    await rig.ready()
    page = Socket(rig.app)
    page.say(type="subscribe", topics=["bus", "events"])
    await page.hear("bus")
    before = json(await rig.call("GET", "/bus"))
    await lose(rig)
    lost_at = now()
    while (told := await page.hear("bus"))["bus"]["state"] in ("active", "passive"):
        pass
    assert told["bus"]["state"] in ("lost", "bus_off")
    assert now() - lost_at < 0.5
    assert told["bus"]["trouble"]
    await asyncio.sleep(0)
    said = rig.events("bus_lost")
    assert [one.level for one in said] == ["failure"]
    assert "memory:host" in said[0].text
    await back(rig)
    shown = json(await rig.call("GET", "/bus"))
    assert (shown["trouble"], shown["retry_in_s"], shown["reopened"]) == (None, None, 1)
    assert shown["rx_frames"] >= before["rx_frames"] > 0, "counters go on"
    assert shown["bus_offs"] == (lose is off_the_bus)
    assert [one.level for one in rig.events("bus_back")] == ["notice"]
    await page.close()


@scene(*PAIR)
async def test_what_helps_is_said_while_it_is_gone_and_when_it_is_tried_next(rig: Rig) -> None:
    await rig.ready()
    await rig.cable.unplug()
    await asyncio.sleep(0.95)
    shown = json(await rig.call("GET", "/bus"))
    assert shown["state"] == "lost"
    assert shown["trouble"] == "There is no such adapter. Plug it in."
    assert 0 <= shown["retry_in_s"] <= 1
    assert "Plug it in" in rig.events("bus_trouble")[0].text
    await asyncio.sleep(60)
    assert len(rig.events("bus_lost")) == len(rig.events("bus_trouble")) == 1
    assert 0 <= json(await rig.call("GET", "/bus"))["retry_in_s"] <= 5


@scene(*PAIR)
async def test_everything_goes_on_once_it_is_back(rig: Rig) -> None:
    """Angles, polling, reads, and node ids for whoever asks, also those who came meanwhile."""

    servo = (await rig.ready(2))[0]
    await rig.cable.unplug()
    rig.bench.add(ASKING)
    await asyncio.sleep(30)
    assert servo.state is State.OFFLINE
    assert rig.events("offline") == [], "one lost bus, not one event for every servo on it"
    lost_until = now()
    await back(rig)
    assert rig.host.connected().allocator.listening_since > lost_until, "others may have taken ids meanwhile"
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
async def test_old_news_of_a_lonely_servo_is_not_taken_for_a_restart_and_delays_no_torque_off(
    rig: Rig, servo: Servo, away_s: float
) -> None:
    """Nobody acknowledged what it said meanwhile, so it says all of that first."""

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
async def test_a_restart_while_it_was_lost_is_noticed(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await asyncio.sleep(20)
    await rig.cable.unplug()
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(0.5)
    rig.bench.power(servo.uid, True)
    await asyncio.sleep(40)
    await back(rig)
    await asyncio.sleep(5)
    assert servo.boot_count == 1
    assert servo.state is State.READY


@scene(*PAIR)
async def test_a_short_loss_does_not_make_anybody_identify_anew(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    await rig.cable.unplug()
    await asyncio.sleep(0.5)
    await back(rig)
    await asyncio.sleep(2)
    assert servo.state is State.READY
    assert len(rig.events("ready")) == 2


@scene(connect=False)
async def test_a_bus_that_cannot_be_opened_yet_is_waited_for(rig: Rig) -> None:
    rig.cable.plugged = False
    port = rig.cable.port("memory:host", 1_000_000)
    await port.open_with_retries()
    await rig.host.attach(port)
    assert "reopened automatically" in rig.events("bus_lost")[0].text
    assert json(await rig.call("GET", "/bus"))["state"] == "lost"
    await back(rig)
    await rig.ready()
    assert json(await rig.call("GET", "/bus"))["reopened"] == 0


@pytest.mark.parametrize(("point", "told"), [(0.75, True), (0.875, False), (0.8778, False), (None, False)])
@scene(connect=False)
async def test_another_sample_point_is_allowed_shown_and_told(rig: Rig, point: float | None, told: bool) -> None:
    port = rig.cable.port("memory:host", 1_000_000)
    await port.open()
    assert rig.cable.inner is not None
    rig.cable.inner.sample_point = point
    await rig.host.attach(port)
    assert json(await rig.call("GET", "/bus"))["sample_point"] == point
    said = rig.events("sample_point")
    assert len(said) == told
    assert all("75.0%" in one.text and "87.5%" in one.text for one in said)


# Nobody waits.


@ways
@scene(*THREE)
async def test_no_request_is_left_waiting(rig: Rig, lose: Way) -> None:
    servos = await rig.ready(3)
    asked = [asyncio.create_task(rig.call("GET", f"/servos/{servo.uid}/parameters?refresh=true")) for servo in servos]
    await asyncio.sleep(0.005)
    await lose(rig)
    lost_at = now()
    for answer in await asyncio.gather(*asked):
        problem(answer, "bus_disconnected", 503)
    assert now() - lost_at < 0.2
    await asyncio.sleep(0.1)
    for servo in servos:
        began = now()
        for verb, path, body in (
            ("GET", "/parameters/current_angle", None),
            ("PUT", "/parameters/angle_limit_cw", {"value": 75}),
            ("POST", "/torque", {"mode": "off"}),
        ):
            problem(await rig.call(verb, f"/servos/{servo.uid}{path}", body), "bus_disconnected", 503)
        assert now() - began < 0.01


@scene(*PAIR)
async def test_whoever_waits_for_a_motion_to_settle_is_told(rig: Rig) -> None:
    servo = (await rig.ready(2))[0]
    lease = await rig.lease()
    body = {"type": "angle", "value": 150, "wait": "settled", "timeout_s": 60}
    waiting = asyncio.create_task(rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))
    await asyncio.sleep(0.1)
    await rig.cable.unplug()
    lost_at = now()
    problem(await waiting, "bus_disconnected", 503)
    assert now() - lost_at < 0.1


# Connecting again and again.


def open_files() -> int:
    files = Path("/proc/self/fd")
    return len(list(files.iterdir())) if files.is_dir() else 0


@scene(connect=False)
async def test_a_thousand_connections_leave_nothing_behind(rig: Rig) -> None:
    """No thread, no file, no task; and of objects no more than before, give or take a tenth of one a time."""

    async def cycles(count: int) -> tuple[int, int, int, int]:
        for _ in range(count):
            await rig.host.connect("memory:host", 1_000_000)
            await asyncio.sleep(0.01)
            await rig.host.disconnect()
        rig.changes.clear()
        rig.bus.history.clear()
        await asyncio.sleep(5)  # timers of requests, and what they hold, run out
        gc.collect()
        return threading.active_count(), open_files(), len(asyncio.all_tasks()), len(gc.get_objects())

    before = await cycles(300)  # the list of the last events is full by then
    after = await cycles(1000)
    assert after[:3] == before[:3]
    assert after[3] - before[3] < 100, "objects"
    assert rig.cable.openings == 1300
