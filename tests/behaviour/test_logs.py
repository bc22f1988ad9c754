"""The log over REST: begun, looked at, ended, listed, downloaded, deleted; and it agrees with what was on the bus."""

import asyncio
from collections.abc import Awaitable, Callable
from itertools import pairwise
from pathlib import Path

import pytest

from behaviour.rig import Rig, json, problem
from behaviour.rig import play as play_bare
from hornbill.app.composition import bus_log_of
from hornbill.bus.recordings.reader import LogReader
from hornbill.wire.frame import Frame


def play(folder: Path, scene: Callable[[Rig], Awaitable[None]]) -> None:
    async def with_recorder(rig: Rig) -> None:
        rig.app.state.bus_log = recorder = bus_log_of(rig.host, folder)
        try:
            await scene(rig)
        finally:
            await recorder.stop()

    play_bare(with_recorder)


def frames_in(path: Path) -> list[tuple[bool, Frame]]:
    recording = LogReader.open(path)
    found = [(one.sent, one.frame) for one in recording]
    recording.close()
    return found


@pytest.mark.parametrize(("form", "ending"), [("candump", "log"), ("asc", "asc"), ("blf", "blf"), ("csv", "csv")])
def test_a_log_holds_every_frame_of_the_bus_sent_ones_included(form: str, ending: str, tmp_path: Path) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        assert json(await rig.call("GET", "/bus/log"))["state"] == "idle"
        begun = json(await rig.call("POST", "/bus/log", {"format": form, "name": "bench", "limit_mb": 5}), 201)
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

    play(tmp_path, scene)


def test_logs_are_listed_downloaded_and_deleted(tmp_path: Path) -> None:
    async def scene(rig: Rig) -> None:
        await rig.ready()
        assert json(await rig.call("GET", "/bus/logs")) == []
        json(await rig.call("POST", "/bus/log", {"name": "one"}), 201)
        await asyncio.sleep(1)
        growing = await rig.call("GET", "/bus/logs/one.log")
        assert growing.status_code == 200
        assert growing.content.startswith(b"(")
        assert int(growing.headers["content-length"]) == len(growing.content)
        problem(await rig.call("DELETE", "/bus/logs/one.log"), "busy", 409)
        ended = json(await rig.call("DELETE", "/bus/log"))
        (listed,) = json(await rig.call("GET", "/bus/logs"))
        assert (listed["name"], listed["bytes"]) == ("one.log", ended["bytes"])
        got = await rig.call("GET", "/bus/logs/one.log")
        assert got.content == (tmp_path / "one.log").read_bytes()
        assert got.headers["content-disposition"] == 'attachment; filename="one.log"'
        assert got.headers["content-type"] == "application/octet-stream"
        assert (await rig.call("DELETE", "/bus/logs/one.log")).status_code == 204
        problem(await rig.call("GET", "/bus/logs/one.log"), "unknown_log", 404)
        problem(await rig.call("DELETE", "/bus/logs/one.log"), "unknown_log", 404)
        assert json(await rig.call("GET", "/bus/logs")) == []

    play(tmp_path, scene)


def test_no_path_leads_out_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "hornbill.log").write_text("secret")

    async def scene(rig: Rig) -> None:
        for name in ("../hornbill.log", "..%2Fhornbill.log", "%2e%2e/hornbill.log", "..\\hornbill.log", ".log"):
            for verb in ("GET", "DELETE"):
                answer = await rig.call(verb, f"/bus/logs/{name}")
                assert answer.status_code in (404, 405), name
        for name in ("../x", "a/b", "/tmp/x", ""):
            problem(await rig.call("POST", "/bus/log", {"name": name}), "invalid_value", 422)
        assert (tmp_path / "hornbill.log").read_text() == "secret"
        assert json(await rig.call("GET", "/bus/log"))["state"] == "idle"

    play(tmp_path / "logs", scene)


def test_only_one_log_is_written_and_a_name_is_used_once(tmp_path: Path) -> None:
    async def scene(rig: Rig) -> None:
        json(await rig.call("POST", "/bus/log", {"name": "one"}), 201)
        problem(await rig.call("POST", "/bus/log", {"name": "two"}), "busy", 409)
        json(await rig.call("DELETE", "/bus/log"))
        problem(await rig.call("POST", "/bus/log", {"name": "one"}), "invalid_value", 422)
        for wrong in ({"format": "mf4"}, {"limit_mb": 0}, {"limit_mb": 10_001}):
            problem(await rig.call("POST", "/bus/log", wrong), "invalid_value", 422)

    play(tmp_path, scene)


def test_a_log_that_is_full_ends_with_an_event_and_everything_else_goes_on(tmp_path: Path) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        json(await rig.call("POST", "/bus/log", {"name": "small", "limit_mb": 0.002}), 201)
        await asyncio.sleep(5)
        state = json(await rig.call("GET", "/bus/log"))
        assert (state["state"], state["reason"]) == ("full", "It reached its limit of 0.002 MB.")
        assert (tmp_path / "small.log").stat().st_size == state["bytes"] <= 2000
        assert [one.level for one in rig.events("log_full")] == ["notice"]
        json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))

    play(tmp_path, scene)


def test_a_disk_that_is_full_ends_the_log_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        json(await rig.call("POST", "/bus/log", {"name": "bench"}), 201)
        await asyncio.sleep(0.5)
        monkeypatch.setattr("hornbill.bus.recordings.writer.LogWriter.write", _no_space)
        await asyncio.sleep(0.5)
        state = json(await rig.call("GET", "/bus/log"))
        assert (state["state"], state["reason"]) == (
            "failed", "No space left on device: free space on the disk of the data folder.",
        )  # fmt: skip
        assert [one.level for one in rig.events("log_failed")] == ["warning"]
        json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))
        monkeypatch.undo()
        json(await rig.call("POST", "/bus/log", {"name": "again"}), 201)

    play(tmp_path, scene)


async def unplug(rig: Rig) -> None:
    await rig.cable.unplug()


async def plug_in(rig: Rig) -> None:
    rig.cable.plug_in()


async def disconnect(rig: Rig) -> None:
    json(await rig.call("DELETE", "/bus"))


async def connect(rig: Rig) -> None:
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))


@pytest.mark.parametrize(("lose", "find"), [(unplug, plug_in), (disconnect, connect)])
def test_a_log_goes_on_over_the_loss_of_the_bus(
    lose: Callable[[Rig], Awaitable[None]], find: Callable[[Rig], Awaitable[None]], tmp_path: Path
) -> None:
    async def scene(rig: Rig) -> None:
        await rig.ready()
        json(await rig.call("POST", "/bus/log", {"name": "bench"}), 201)
        await asyncio.sleep(1)
        await lose(rig)
        await asyncio.sleep(5)
        gone = json(await rig.call("GET", "/bus/log"))
        assert gone["state"] == "running"
        await find(rig)
        await asyncio.sleep(8)
        ended = json(await rig.call("DELETE", "/bus/log"))
        assert ended["frames"] > gone["frames"] + 40
        times = [frame.at for _, frame in frames_in(tmp_path / "bench.log")]
        assert max(after - before for before, after in pairwise(times)) > 4

    play(tmp_path, scene)


def _no_space(*_: object) -> bool:
    raise OSError(28, "No space left on device")
