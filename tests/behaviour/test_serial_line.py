"""Servos behind a serial adapter: nothing is lost on a slow line, and polling stays within its capacity."""

import asyncio
from collections import Counter

import pytest

from behaviour import serial_line
from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.servo.device.servo import State
from hornbill.servo.monitoring.line_budget import BROADCAST_BYTES_PER_S, FULL, READ_BYTES
from hornbill.servo.monitoring.polling import BUDGET, READ_S
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.port import SerialLineInfo

SLOW = 115_200
"""Baud rate whose line carries 426 full frames a second, where the bus carries 7,000."""


def crowd(count: int) -> list[Recipe]:
    return [Recipe(PLAIN.model, PLAIN.firmware, servo_id=n, node_id=10 + n) for n in range(1, count + 1)]


@pytest.mark.parametrize(
    ("baud", "frames"), [(57_600, 213), (115_200, 426), (460_800, 1706), (1_000_000, 3703), (3_000_000, 11111)]
)
def test_the_frame_budget_of_a_line(baud: int, frames: int) -> None:
    assert SerialLineInfo(baud).budget == frames
    assert SerialLineInfo(baud, native_usb=True).budget is None


@scene(*crowd(6), connect=False)
async def test_six_servos_stay_online_on_a_slow_line_without_loss(rig: Rig) -> None:
    adapter = await serial_line.connect(rig, SLOW)
    servos = await rig.ready(6)
    states = Counter[State]()
    began, received = asyncio.get_running_loop().time(), adapter.statistics.line_bytes
    outcomes = rig.host.requests.outcomes.copy()
    while asyncio.get_running_loop().time() < began + 10:
        await asyncio.sleep(0.1)
        states.update(servo.state for servo in servos)
        assert all(servo.online for servo in servos)
    assert set(states) == {State.READY}
    assert adapter.dropped == 0
    assert rig.events("servo_offline") == []
    outcomes = rig.host.requests.outcomes - outcomes
    assert outcomes["poll", "no_response"] == 0
    polled = outcomes["poll", "responded"] / 10
    assert polled * READ_BYTES <= BUDGET * SLOW / 10
    used = (adapter.statistics.line_bytes - received) / 10 / (SLOW / 10)
    assert used <= FULL
    assert outcomes["poll", "responded"] / 10 >= 6 * 6.0 / 2, "each row is read at least half as often as configured"


@scene(*crowd(6), connect=False)
async def test_a_subscription_is_limited_to_the_capacity_of_the_line(rig: Rig) -> None:
    adapter = await serial_line.connect(rig, SLOW)
    servos = await rig.ready(6)
    granted: dict[str, float] = {}
    for servo in servos:
        body = {"channels": ["current_angle", "current_speed"], "rate_hz": 50}
        granted = json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", body))
    assert granted["granted_hz"] < 5
    await asyncio.sleep(2)
    began, received = asyncio.get_running_loop().time(), adapter.statistics.line_bytes
    outcomes = rig.host.requests.outcomes.copy()
    await asyncio.sleep(10)
    took = asyncio.get_running_loop().time() - began
    outcomes = rig.host.requests.outcomes - outcomes
    assert outcomes["poll", "responded"] / took * READ_BYTES <= BUDGET * SLOW / 10 * 1.02
    assert (adapter.statistics.line_bytes - received) / took <= FULL * SLOW / 10
    assert (adapter.dropped, outcomes["poll", "no_response"]) == (0, 0)
    assert all(servo.online for servo in servos)


@scene(*crowd(14), connect=False)
async def test_polling_leaves_room_for_broadcasts(rig: Rig) -> None:
    """Broadcasts of 14 servos fill a slow line to 60 %: polling uses the rest up to 85 %."""
    adapter = await serial_line.connect(rig, SLOW)
    servos = await rig.ready(14, within_s=120)
    broadcast = 14 * BROADCAST_BYTES_PER_S / (SLOW / 10)
    assert broadcast + BUDGET > FULL
    for servo in servos:
        body = {"channels": ["current_angle"], "rate_hz": 20}
        json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", body))
    await asyncio.sleep(15)
    dropped, received = adapter.dropped, adapter.statistics.line_bytes
    outcomes = rig.host.requests.outcomes.copy()
    await asyncio.sleep(10)
    outcomes = rig.host.requests.outcomes - outcomes
    polled = outcomes["poll", "responded"] / 10 * READ_BYTES / (SLOW / 10)
    assert FULL - broadcast - 0.1 <= polled <= FULL - broadcast
    assert (adapter.statistics.line_bytes - received) / 10 <= FULL * SLOW / 10
    assert adapter.dropped == dropped, "when all are identified at once the buffer may have been too small"
    assert all(servo.online for servo in servos)
    assert "serial_line_full" not in [one["code"] for one in json(await rig.call("GET", "/bus/doctor"))]


@pytest.mark.release
@scene(*crowd(11), connect=False)
async def test_a_full_line_is_reported_with_a_remedy(rig: Rig) -> None:
    await serial_line.connect(rig, SLOW // 2)
    await rig.ready(11, within_s=120)
    await asyncio.sleep(10)
    found = json(await rig.call("GET", "/bus/doctor"))
    full = next(one for one in found if one["code"] == "serial_line_full")
    assert "of 57600 baud" in full["evidence"]
    assert "higher baud rate" in full["remedy"]
    assert all(servo.online for servo in rig.host.fleet.all())


@scene(*crowd(2), connect=False)
async def test_a_fast_line_does_not_limit_polling(rig: Rig) -> None:
    await serial_line.connect(rig, 3_000_000)
    await rig.ready(2)
    assert rig.host.polling.cap == pytest.approx(BUDGET)
    shown = json(await rig.call("GET", "/bus"))
    assert (shown["limited_by"], shown["load_cap_pct"]) == ("can", 40.0)


@scene(*crowd(6), connect=False)
async def test_the_bus_shows_the_line_with_its_budget_and_load(rig: Rig) -> None:
    shown = json(await rig.call("GET", "/bus"))
    assert (shown["serial_line"], shown["limited_by"], shown["notes"]) == (None, None, [])
    await serial_line.connect(rig, SLOW)
    await rig.ready(6)
    await asyncio.sleep(3)
    shown = json(await rig.call("GET", "/bus"))
    line = shown["serial_line"]
    assert 20 < line.pop("load_pct") < 70
    assert line == {
        "baud": 115_200, "budget": 426, "found": True, "confirmed": True, "serial_number": "A1B2",
        "latency_ms": None,
    }  # fmt: skip
    assert shown["limited_by"] == "serial_line"
    expected = (FULL * SLOW / 10 - 6 * BROADCAST_BYTES_PER_S) / READ_BYTES
    assert shown["load_cap_pct"] == pytest.approx(min(expected, 0.4 * SLOW / 10 / READ_BYTES) * READ_S * 100, abs=0.1)
    found = json(await rig.call("GET", "/bus/doctor?all=true"))
    assert next(one for one in found if one["code"] == "serial_line_full")["severity"] == "ok"


@scene(*crowd(6), connect=False)
async def test_on_a_slow_line_a_fast_stream_is_refused_and_every_servo_confirms_a_stop(rig: Rig) -> None:
    await serial_line.connect(rig, SLOW)
    servos = await rig.ready(6)
    lease = await rig.lease()
    for servo in servos:
        path = f"/servos/{servo.uid}"
        json(await rig.call("PUT", f"{path}/parameters/speed_torque_control", {"value": True}, lease=lease))
        json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    body = {"uids": [servo.uid for servo in servos], "type": "speed", "rate_hz": 100}
    refused = problem(await rig.call("POST", "/streams", body, lease=lease), "bus_budget", 409)
    # four frames of 27 bytes and one of 21: 11 ms of the line, where the bus needs half a millisecond
    assert 30 <= refused["possible_hz"] <= 45
    began = asyncio.get_running_loop().time()
    json(await rig.call("POST", "/stop", {}))
    latch = rig.host.stop.latch
    assert latch is not None
    await until(lambda: not latch.unconfirmed(), every_s=0.001)
    assert asyncio.get_running_loop().time() - began < 0.25
