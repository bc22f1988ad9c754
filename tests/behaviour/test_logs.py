"""Bus logs over REST: started, stopped, listed, downloaded and deleted; their frames are those of the bus."""

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from itertools import pairwise
from pathlib import Path

import pytest

from behaviour.rig import Response, Rig, json, problem
from behaviour.scene import scene
from hornbill.app.composition import bus_log_of
from hornbill.bus.recordings.reader import LogReader
from hornbill.servo.device.servo import Servo
from hornbill.wire.frame import Frame


@asynccontextmanager
async def logging_to(rig: Rig, folder: Path) -> AsyncGenerator[None]:
    rig.app.state.bus_log = log = bus_log_of(rig.host, folder)
    try:
        yield
    finally:
        await log.stop()


async def start(rig: Rig, **body: object) -> Response:
    return await rig.call("POST", "/bus/log", body)


def frames_in(path: Path) -> list[tuple[bool, Frame]]:
    recording = LogReader.open(path)
    found = [(one.sent, one.frame) for one in recording]
    recording.close()
    return found


@pytest.mark.parametrize(("form", "ending"), [("candump", "log"), ("asc", "asc"), ("blf", "blf"), ("csv", "csv")])
@scene()
async def test_a_log_contains_every_frame_of_the_bus_in_both_directions(
    rig: Rig, servo: Servo, form: str, ending: str, tmp_path: Path
) -> None:
    async with logging_to(rig, tmp_path):
        assert json(await rig.call("GET", "/bus/log"))["state"] == "idle"
        begun = json(await start(rig, format=form, name="bench", limit_mb=5), 201)
        assert (begun["state"], begun["name"], begun["limit_bytes"]) == ("running", f"bench.{ending}", 5_000_000)
        assert abs(begun["started_at"] - rig.host.base.utc_now()) < 60
        since = asyncio.get_running_loop().time()
        json(await rig.call("GET", f"/servos/{servo.uid}/parameters?refresh=true"))
        await asyncio.sleep(1.0)
        until = asyncio.get_running_loop().time()
        ended = json(await rig.call("DELETE", "/bus/log"))
        assert (ended["state"], ended["dropped"], ended["reason"]) == ("stopped", 0, None)
        found = frames_in(tmp_path / f"bench.{ending}")
        on_bus = [(name == "host", frame) for name, frame in rig.bus.history if since <= frame.at < until]
        assert len(on_bus) > 150
        logged = {(frame.id, frame.data) for _, frame in found}
        assert {(frame.id, frame.data) for _, frame in on_bus} <= logged
        assert ended["frames"] == len(found) >= len(on_bus) - 1
        if form != "csv":
            assert sum(sent for sent, _ in found) >= sum(sent for sent, _ in on_bus)
        for frame in [frame for sent, frame in on_bus if not sent][::10]:
            times = [one.at for _, one in found if (one.id, one.data) == (frame.id, frame.data)]
            assert min(abs(at - rig.host.base.utc(frame.at)) for at in times) < 5e-6


@scene()
async def test_logs_are_written_one_at_a_time_with_unique_names_listed_downloaded_and_deleted(
    rig: Rig, tmp_path: Path
) -> None:
    path = "/bus/logs/one.log"
    await rig.ready()
    async with logging_to(rig, tmp_path):
        for wrong in (
            {"name": "../x"}, {"name": "a/b"}, {"name": "/tmp/x"}, {"name": ""},
            {"format": "mf4"}, {"limit_mb": 0}, {"limit_mb": 10_001},
        ):  # fmt: skip
            problem(await rig.call("POST", "/bus/log", wrong), "invalid_value", 422)
        assert json(await rig.call("GET", "/bus/log"))["state"] == "idle"
        assert json(await rig.call("GET", "/bus/logs")) == []
        json(await start(rig, name="one"), 201)
        problem(await start(rig, name="two"), "busy", 409)
        await asyncio.sleep(1)
        growing = await rig.call("GET", path)
        assert growing.status_code == 200
        assert growing.content.startswith(b"(")
        assert int(growing.headers["content-length"]) == len(growing.content)
        problem(await rig.call("DELETE", path), "busy", 409)
        ended = json(await rig.call("DELETE", "/bus/log"))
        problem(await start(rig, name="one"), "invalid_value", 422)
        (listed,) = json(await rig.call("GET", "/bus/logs"))
        assert (listed["name"], listed["bytes"]) == ("one.log", ended["bytes"])
        got = await rig.call("GET", path)
        assert got.content == (tmp_path / "one.log").read_bytes()
        assert got.headers["content-disposition"] == 'attachment; filename="one.log"'
        assert got.headers["content-type"] == "application/octet-stream"
        assert (await rig.call("DELETE", path)).status_code == 204
        for verb in ("GET", "DELETE"):
            problem(await rig.call(verb, path), "unknown_log", 404)
        assert json(await rig.call("GET", "/bus/logs")) == []


def no_space(*_: object) -> bool:
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("full", ["log", "disk"])
@scene()
async def test_a_full_log_or_disk_ends_the_log_with_an_event_and_nothing_else(
    rig: Rig, servo: Servo, full: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with logging_to(rig, tmp_path):
        json(await start(rig, name="bench", limit_mb=0.002 if full == "log" else 5), 201)
        await asyncio.sleep(0.05)
        if full == "disk":
            monkeypatch.setattr("hornbill.bus.recordings.writer.LogWriter.write", no_space)
        await asyncio.sleep(5)
        log = json(await rig.call("GET", "/bus/log"))
        if full == "log":
            assert (log["state"], log["reason"]) == ("full", "It reached its limit of 0.002 MB.")
            assert (tmp_path / "bench.log").stat().st_size == log["bytes"] <= 2000
            assert [one.level for one in rig.events("log_full")] == ["notice"]
        else:
            assert (log["state"], log["reason"]) == (
                "failed", "No space left on device: free space on the disk of the data folder.",
            )  # fmt: skip
            assert [one.level for one in rig.events("log_failed")] == ["warning"]
        json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))
        monkeypatch.undo()
        json(await start(rig, name="again"), 201)


@scene()
async def test_a_log_continues_after_the_bus_was_lost_or_disconnected(rig: Rig, tmp_path: Path) -> None:
    await rig.ready()
    async with logging_to(rig, tmp_path):
        json(await start(rig, name="bench"), 201)
        for unplugged in (True, False):
            await asyncio.sleep(1)
            await (rig.cable.unplug() if unplugged else rig.call("DELETE", "/bus"))
            await asyncio.sleep(5)
            gone = json(await rig.call("GET", "/bus/log"))
            assert gone["state"] == "running"
            if unplugged:
                rig.cable.plug_in()
            else:
                json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
            await asyncio.sleep(8)
            assert json(await rig.call("GET", "/bus/log"))["frames"] > gone["frames"] + 40
        json(await rig.call("DELETE", "/bus/log"))
        times = [frame.at for _, frame in frames_in(tmp_path / "bench.log")]
        assert sum(after - before > 4 for before, after in pairwise(times)) == 2
