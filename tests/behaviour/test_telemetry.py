"""Telemetry over REST: subscriptions, measured rates, gaps, and the window as a file."""

import asyncio
import csv
import io
import time
from dataclasses import replace
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, Socket, json, play, problem
from behaviour.scene import scene
from hornbill.api import telemetry_files
from hornbill.servo.device.requests import POLL
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.monitoring.polling import BUDGET
from hornbill.servo.runtime.hub import Sampled
from hornbill.wire.bittime import frame_bits

SIX = ["current_angle", "command_angle", "current_speed", "current_torque", "current_temperature", "current_voltage"]


async def subscribe(rig: Rig, servo: Servo, channels: list[str], rate_hz: float, **more: object) -> dict[str, Any]:
    body = {"channels": channels, "rate_hz": rate_hz, **more}
    return json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", body))


async def state_of(rig: Rig, servo: Servo) -> dict[str, Any]:
    return json(await rig.call("GET", f"/servos/{servo.uid}/telemetry"))


@scene(*(replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(6)))
async def test_polling_stays_within_the_budget_in_bits_on_the_bus(rig: Rig, servos: list[Servo]) -> None:
    for servo in servos:
        await subscribe(rig, servo, SIX, 200)
    await asyncio.sleep(2)
    rig.bus.history.clear()
    await asyncio.sleep(4)
    bits = sum(frame_bits(frame) for _, frame in rig.bus.history if frame.id >> 24 == POLL.priority)
    assert 0.37 < bits / 4e6 <= BUDGET
    assert json(await rig.call("GET", "/bus"))["load_cap_pct"] == BUDGET * 100


@scene(PLAIN, replace(PLAIN, node_id=12, servo_id=2))
async def test_the_granted_rate_is_the_measured_rate(rig: Rig) -> None:
    servo, other = await rig.ready(2)
    granted = await subscribe(rig, servo, ["current_speed", "current_torque"], 50)
    assert granted == {
        "owner": "rest", "channels": ["current_speed", "current_torque"], "requested_hz": 50, "granted_hz": 50,
        "bus_share": pytest.approx(100 * 556e-6, abs=1e-4), "expires_in_s": None, "note": None,
        "note_code": None, "note_params": {},
    }  # fmt: skip
    await asyncio.sleep(6)
    state = await state_of(rig, servo)
    assert state["subscriptions"] == [granted]
    speed = state["channels"]["current_speed"]
    assert speed["granted_hz"] == 50
    assert speed["background_hz"] is None
    assert speed["measured_hz"] == pytest.approx(50, abs=1)
    assert speed["age_s"] < 0.05
    assert state["channels"]["current_voltage"]["background_hz"] == pytest.approx(1 / 2.4, abs=0.01)
    assert (await state_of(rig, other))["subscriptions"] == []


@scene()
async def test_a_row_with_several_subscriptions_is_read_at_the_highest_rate(rig: Rig, servo: Servo) -> None:
    await subscribe(rig, servo, ["current_speed"], 10, owner="page")
    await subscribe(rig, servo, ["current_speed", "current_torque"], 40, owner="rig", ttl_s=3)
    await asyncio.sleep(2.9)
    channels = (await state_of(rig, servo))["channels"]
    assert (channels["current_speed"]["granted_hz"], channels["current_torque"]["granted_hz"]) == (40, 40)
    await asyncio.sleep(0.2)
    state = await state_of(rig, servo)
    assert [one["owner"] for one in state["subscriptions"]] == ["page"]
    assert state["channels"]["current_speed"]["granted_hz"] == 10
    await subscribe(rig, servo, [], 1, owner="page")
    assert (await state_of(rig, servo))["subscriptions"] == []


@scene()
async def test_an_unidentified_servo_is_granted_nothing_with_a_reason(rig: Rig, servo: Servo) -> None:
    servo.registers.clear()
    granted = await subscribe(rig, servo, SIX, 20)
    assert (granted["channels"], granted["granted_hz"], granted["bus_share"]) == ([], 0, 0)
    assert "has not been identified yet" in granted["note"]
    assert (await state_of(rig, servo))["subscriptions"] == []
    wrong = {"channels": ["nonsense"], "rate_hz": 1}
    problem(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", wrong), "unknown_parameter", 404)


@scene()
async def test_a_silent_servo_leaves_a_gap_for_sockets_and_for_files(rig: Rig, servo: Servo) -> None:
    page = Socket(rig.app)
    page.send(type="subscribe", topics=["telemetry"])
    await asyncio.sleep(2)
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"mute": True}))
    await asyncio.sleep(8)
    json(await rig.call("PATCH", f"/sim/servos/{servo.uid}", {"mute": False}))
    await asyncio.sleep(8)
    assert servo.state is State.READY
    values = [
        value
        for message in page.received()
        if message["type"] == "telemetry"
        for value in message["channels"].get("current_angle", {"v": []})["v"]
    ]
    assert values.count(None) == 1
    assert values[0] is not None
    assert values[-1] is not None
    state = (await state_of(rig, servo))["channels"]["current_angle"]
    assert "gap" in [mark["kind"] for mark in state["marks"]]
    await page.close()


@scene()
async def test_an_inactive_command_is_a_mark_and_an_empty_cell(rig: Rig, servo: Servo, lease: str) -> None:
    await asyncio.sleep(3)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 10}, lease=lease))
    await asyncio.sleep(3)
    marks = (await state_of(rig, servo))["channels"]["command_speed"]["marks"]
    assert [mark["kind"] for mark in marks] == ["inactive"]
    text = (await rig.call("GET", f"/servos/{servo.uid}/telemetry.csv?channels=command_speed")).text
    assert text.splitlines()[-1].endswith(",")


@scene()
async def test_csv_has_a_line_for_each_sample_time_and_only_sampled_values(rig: Rig, servo: Servo) -> None:
    await subscribe(rig, servo, ["current_speed", "current_torque"], 20)
    await asyncio.sleep(10)
    response = await rig.call(
        "GET", f"/servos/{servo.uid}/telemetry.csv?seconds=5&channels=current_angle,current_speed"
    )
    assert response.headers["content-type"] == "text/csv; charset=utf-8"
    rows = list(csv.DictReader(io.StringIO(response.text)))
    now = rig.host.base.now()
    assert list(rows[0]) == ["t_utc", "t_s", "current_angle", "current_speed"]
    assert all(row["current_angle"] or row["current_speed"] for row in rows)
    assert all(float(a["t_s"]) < float(b["t_s"]) for a, b in pairwise(rows))
    assert now - 5 <= float(rows[0]["t_s"])
    assert sum(bool(row["current_speed"]) for row in rows) == pytest.approx(100, abs=2)
    for row in rows:
        utc = datetime.fromisoformat(row["t_utc"])
        assert utc.tzinfo == UTC
        assert utc.timestamp() == pytest.approx(rig.host.base.utc(float(row["t_s"])), abs=2e-6)
    times, values = rig.host.telemetry.window(servo.uid, "current_speed", now - 5)
    assert [(float(row["t_s"]), float(row["current_speed"])) for row in rows if row["current_speed"]] == [
        (pytest.approx(t, abs=1e-6), v) for t, v in zip(times, values, strict=True)
    ]
    whole = (await rig.call("GET", f"/servos/{servo.uid}/telemetry.csv")).text
    assert set(whole.splitlines()[0].split(",")) == {"t_utc", "t_s", *rig.host.telemetry.channels(servo.uid)}
    path = f"/servos/{servo.uid}/telemetry.csv"
    problem(await rig.call("GET", f"{path}?channels=nonsense"), "unknown_parameter", 404)
    problem(await rig.call("GET", f"{path}?channels=torque_mode"), "invalid_value", 422)


def test_parquet_contains_the_samples_of_the_ring() -> None:
    async def scene(rig: Rig) -> tuple[bytes, dict[str, Any], float]:
        servo = (await rig.ready())[0]
        await asyncio.sleep(5)
        rig.host.hub.publish(Sampled(servo.uid, "current_angle", rig.host.base.now(), None))
        response = await rig.call(
            "GET", f"/servos/{servo.uid}/telemetry.parquet?channels=current_angle,current_voltage"
        )
        assert response.headers["content-disposition"].endswith('.parquet"')
        stored = {key: rig.host.telemetry.window(servo.uid, key, 0.0) for key in ("current_angle", "current_voltage")}
        return response.content, stored, rig.host.base.utc_offset

    content, stored, utc_offset = play(scene)
    parquet: Any = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(io.BytesIO(content))
    assert table.column_names == ["channel", "t", "value"]
    rows = [(row["channel"], row["t"], row["value"]) for row in table.to_pylist()]
    assert rows == [(key, t, v) for key, (times, values) in stored.items() for t, v in zip(times, values, strict=True)]
    assert rows[-1][0] == "current_voltage"
    assert None in stored["current_angle"][1]
    assert float(table.schema.metadata[b"utc_offset"]) == utc_offset


@scene()
async def test_parquet_names_its_missing_library(rig: Rig, servo: Servo, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(_name: str) -> None:
        return None

    monkeypatch.setattr(telemetry_files.importlib.util, "find_spec", nothing)
    found = problem(await rig.call("GET", f"/servos/{servo.uid}/telemetry.parquet"), "not_available", 501)
    assert "hornbill[parquet]" in found["detail"]


def test_a_large_window_is_packed_without_blocking_the_loop() -> None:
    async def scene(rig: Rig) -> tuple[float, int]:
        servo = (await rig.ready())[0]
        now = rig.host.base.now()
        for place in range(60_000):
            rig.host.hub.publish(Sampled(servo.uid, SIX[place % 6], now + place / 1000, place / 7))
        window = {key: rig.host.telemetry.columns(servo.uid, key, now) for key in SIX}
        longest, size = 0.0, 0
        began = time.thread_time()
        async for piece in telemetry_files.csv(window, rig.host.base):
            size += piece.count(b"\n")
            longest = max(longest, time.thread_time() - began)
            began = time.thread_time()
        return longest, size

    longest, rows = play(scene)
    assert rows == 60_001
    assert longest < 0.02
