"""A recording as the bus of the server: it can be watched like any other, and nothing is sent."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from behaviour.rig import Rig, Socket, json, play, problem
from hornbill.app.composition import bus_log_of
from hornbill.bus.recordings.replay import open_replay
from hornbill.errors import BusReadOnly
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.services import EMPTY, GetSetRequest

Transfers = list[dict[str, Any]]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a host, with the present node ID, that finds a servo, allocates a node ID, reads and writes."""
    folder = tmp_path_factory.mktemp("logs")

    async def scene(rig: Rig) -> None:
        recorder = bus_log_of(rig.host, folder)
        rig.app.state.bus_log = recorder
        json(await rig.call("POST", "/bus/log", {"name": "bench"}), 201)
        await rig.host.connect("memory:host", 1_000_000)
        servo = (await rig.ready(2))[0]
        for limit in (60, 70):
            json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_limit_cw": limit}}))
        await asyncio.sleep(2)
        await recorder.stop()

    play(scene, Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11), Recipe("BLA15-06U-A0", "1.300"), connect=False)
    return folder / "bench.log"


def replayed(act: Callable[[Rig], Awaitable[None]]) -> Callable[[Path], None]:
    """Decorate a scene: a test whose bus is the recording."""
    return lambda recorded: replay(recorded, act)


def replay(path: Path, act: Callable[[Rig], Awaitable[None]], speed: float = 1) -> None:
    async def scene(rig: Rig) -> None:
        await rig.host.attach(await open_replay(f"file:{path}?speed={speed:g}"))
        await act(rig)

    play(scene, connect=False)


def test_the_bus_is_shown_as_an_active_recording(recorded: Path) -> None:
    frames = len(recorded.read_text().splitlines())

    async def scene(rig: Rig) -> None:
        await asyncio.sleep(3.0)
        shown = json(await rig.call("GET", "/bus"))
        assert (shown["state"], shown["trouble"], shown["tx_frames"]) == ("active", None, 0)
        assert shown["address"] == f"file:{recorded}?speed=1"
        assert shown["rx_fps"] > 20
        assert shown["load_pct"] > 0.1
        await asyncio.sleep(120)
        after = json(await rig.call("GET", "/bus"))
        assert (after["state"], after["rx_fps"], after["errors"]) == ("active", 0.0, 0)
        assert after["rx_frames"] == frames

    replay(recorded, scene)


@pytest.mark.parametrize("speed", [1, 4])
def test_the_monitor_shows_the_recorded_transfers(recorded: Path, speed: float) -> None:
    async def scene(rig: Rig) -> None:
        page = Socket(rig.app)
        page.send(type="subscribe", topics=["frames"], frames={"kind": "response", "type": "GetSet"})
        await asyncio.sleep(30)
        rows: Transfers = [row for one in page.received() if one["type"] == "frames" for row in one["transfers"]]
        written = [row["summary"].rpartition(". ")[0] for row in rows if ", as requested" in row["summary"]]
        assert written[:2] == [
            "GetSet response 0x38 = 600, 60.0°, as requested",
            "GetSet response 0x38 = 700, 70.0°, as requested",
        ]
        assert not any(row["sent"] for row in rows)
        await page.close()

    replay(recorded, scene, speed=speed)


@replayed
async def test_a_recorded_response_is_no_response_to_a_present_request_and_nothing_is_stored(rig: Rig) -> None:
    counters = rig.host.connected().participant.request_counters
    await asyncio.sleep(6)
    nodes = {one["node_id"]: one for one in json(await rig.call("GET", "/nodes"))}
    assert nodes[11]["online"]
    await asyncio.sleep(54)
    assert counters.responses == 0
    assert counters.late > 100, "recorded responses are counted as late"
    assert rig.host.connected().port.statistics.tx_frames == 0
    assert rig.host.fleet.all() == []
    assert json(await rig.call("GET", "/allocations"))["allocations"] == []
    assert list(rig.host.store.servos.all()) == []


@replayed
async def test_sending_is_refused_until_another_bus_is_connected(rig: Rig) -> None:
    await asyncio.sleep(2)
    participant = rig.host.connected().participant
    with pytest.raises(BusReadOnly, match="is a recording and read-only"):
        await participant.request(11, GetSetRequest(0, EMPTY, "0x08"), tries=10)
    lease = await rig.lease()
    refused = await rig.call("POST", "/servos/" + "0" * 32 + "/command", {"type": "angle", "value": 5}, lease=lease)
    problem(refused, "unknown_servo", 404)
    stopped = json(await rig.call("POST", "/stop"))
    assert (stopped["latched"], stopped["servos"]) == (True, [])
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    servo = (await rig.ready())[0]
    json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))
    assert json(await rig.call("GET", "/bus"))["allocator"]["state"] == "on"
