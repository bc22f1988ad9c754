"""The recorder: a failure is recorded with the time before and after it, and can be replayed without a bus."""

import asyncio
import csv
import io
import zipfile
from collections.abc import Awaitable, Callable
from dataclasses import replace
from functools import partial
from inspect import signature
from itertools import pairwise
from pathlib import Path
from typing import Any

import orjson
import pytest

from behaviour.rig import PLAIN, Rig, Socket, json, play, problem, until
from behaviour.scene import scene
from hornbill.app.bus_ports import BusPorts
from hornbill.bus.recordings.folder import RECORDINGS, FileFolder
from hornbill.bus.recordings.recording import MEMBERS, RecordingReader, RecordingWriter
from hornbill.errors import PortOpenFailed
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.types import decode

TWO = (PLAIN, Recipe("BLA15-06U-A0", "1.300", servo_id=2, node_id=12))


def record(folder: Path, scene: Callable[[Rig], Awaitable[None]], *recipes: Recipe, most: int = 50) -> None:
    """Play a scene with a recorder that writes to this folder."""

    async def recorded(rig: Rig) -> None:
        start_recorder(rig, folder, most)
        await scene(rig)

    play(recorded, *recipes)


def start_recorder(rig: Rig, folder: Path, most: int = 50) -> None:
    rig.app.state.recordings = shelf = FileFolder(folder, replace(RECORDINGS, most=most))
    rig.host.recorder.begin(partial(RecordingWriter.begin, shelf))


def recorded(*recipes: Recipe, most: int = 50) -> Callable[[Callable[..., Awaitable[None]]], Callable[..., None]]:
    """Decorate a scene `(rig)`, with `servo` and `tmp_path` if needed: a test with a recorder that writes to it."""

    def make(act: Callable[..., Awaitable[None]]) -> Callable[..., None]:
        async def test(rig: Rig, tmp_path: Path) -> None:
            start_recorder(rig, tmp_path, most)
            given: dict[str, Any] = {"rig": rig, "tmp_path": tmp_path}
            if "servo" in signature(act).parameters:
                given["servo"] = (await rig.ready(len(recipes) or 1))[0]
            await act(**{name: given[name] for name in signature(act).parameters})

        return scene(*recipes)(test)

    return make


async def recordings(rig: Rig) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json(await rig.call("GET", "/recorder/recordings"))
    return found


async def written(rig: Rig, count: int = 1) -> list[dict[str, Any]]:
    await until(lambda: len(rig.events("recording_written")) >= count, every_s=0.2)
    return await recordings(rig)


async def break_driver(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).faults.inject("motor_driver", True)
    await until(lambda: servo.raw("fault_failure"), 10)


def names_in(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir() if file.is_file())


def frames_of(path: Path) -> list[Frame]:
    with RecordingReader(path) as recording:
        log = recording.frames()
    found = [one.frame for one in log]
    log.close()
    return found


@recorded(*TWO)
async def test_a_failure_bit_writes_a_recording_with_the_time_before_and_after_it(
    rig: Rig, servo: Servo, tmp_path: Path
) -> None:
    await asyncio.sleep(70)
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_limit_cw": 61}}))
    at = rig.host.base.utc_now()
    await break_driver(rig, servo)
    state = json(await rig.call("GET", "/recorder"))
    assert state["pending"]["reason"] == "failure"
    assert state["recording"]
    assert state["reach_s"] > 70
    (one,) = await written(rig)
    assert (one["reason"], one["problem"]) == ("failure", None)
    assert "reports a failure: Motor driver stopped" in one["text"]
    assert one["name"].startswith("hornbill-")
    assert one["name"].endswith("-failure.zip")
    (mark,) = one["marks"]
    assert 0 <= mark["at"] - at < 5
    assert mark["uid"] == servo.uid
    path = tmp_path / one["name"]
    with zipfile.ZipFile(path) as archive:
        assert sorted(archive.namelist()) == sorted(MEMBERS)
        assert archive.testzip() is None
        samples = list(csv.DictReader(io.TextIOWrapper(archive.open("telemetry.csv"))))
        events = [orjson.loads(line) for line in archive.read("events.jsonl").splitlines()]
        writes = list(csv.DictReader(io.TextIOWrapper(archive.open("writes.csv"))))
        about = orjson.loads(archive.read("about.json"))
    frames = frames_of(path)
    assert mark["at"] - frames[0].at >= 30
    assert 9.8 <= frames[-1].at - mark["at"] <= 10.1
    assert about["frames"] == len(frames) > 600
    assert all(late.at >= early.at for early, late in pairwise(frames))
    transfers = Reassembler().feed(frames)
    assert len(transfers) > 300
    assert None not in map(decode, transfers)
    on_bus = {(frame.id, frame.data) for _, frame in rig.bus.history}
    assert {(frame.id, frame.data) for frame in frames} <= on_bus
    angles = [float(row["time"]) for row in samples if (row["uid"], row["channel"]) == (servo.uid, "current_angle")]
    assert mark["at"] - angles[0] > 30
    assert angles[-1] - mark["at"] > 9
    assert "fault" in "".join(one.get("code", "") for one in events)
    ours = [row for row in writes if row["kind"] == "parameter" and row["key"] == "angle_limit_cw"]
    assert [(row["uid"], row["raw"], row["value"]) for row in ours] == [(servo.uid, "610", "61.0")]
    shown = next(each for each in about["servos"] if each["uid"] == servo.uid)
    assert shown["readings"]["angle_limit_cw"]["value"] == 61.0
    assert shown["readings"]["fault_failure"]["raw"] == 1


@recorded()
async def test_a_lost_servo_writes_a_recording_but_not_each_time_it_is_lost_again(rig: Rig, servo: Servo) -> None:
    uid = servo.uid
    await asyncio.sleep(35)
    for _ in range(4):
        rig.bench.power(uid, False)
        await asyncio.sleep(15)
        rig.bench.power(uid, True)
        await asyncio.sleep(15)
    found = await recordings(rig)
    assert [one["reason"] for one in found] == ["lost"]
    assert len(rig.events("offline")) == 4
    await asyncio.sleep(70)
    rig.bench.power(uid, False)
    assert len(await written(rig, 2)) == 2


@recorded()
async def test_triggers_during_a_recording_are_marks_in_it(rig: Rig, servo: Servo, tmp_path: Path) -> None:
    await asyncio.sleep(40)
    json(await rig.call("POST", "/stop", {"reason": "smoke"}))
    await asyncio.sleep(6)
    await break_driver(rig, servo)
    await asyncio.sleep(6)
    assert await recordings(rig) == [], "it includes ten seconds after the last mark"
    json(await rig.call("POST", "/recorder/recordings", {"reason": "A click"}), 202)
    (one,) = await written(rig)
    assert one["reason"] == "stop"
    assert "smoke" in one["text"]
    assert [mark["reason"] for mark in one["marks"]] == ["stop", "failure", "manual"]
    assert frames_of(tmp_path / one["name"])[-1].at - one["marks"][-1]["at"] > 9.5
    content = json(await rig.call("GET", f"/recorder/recordings/{one['name']}/content"))
    assert [each["latched"] for each in content["events"] if each["type"] == "stop"] == [True]
    torque = [row for row in content["writes"] if row["key"] == "torque_mode"]
    assert torque[-1]["raw"] == "1"
    assert content["complete"]


@recorded(*TWO)
async def test_it_says_who_had_motion_control_of_which_servos(rig: Rig) -> None:
    servos = await rig.ready(2)
    for holder, servo in zip(("A", "B"), servos, strict=True):
        json(await rig.call("POST", "/leases", {"holder": holder, "ttl_s": 9, "uids": [servo.uid]}), 201)
    json(await rig.call("POST", "/recorder/recordings", {"reason": "A click"}), 202)
    (one,) = await written(rig)
    content = json(await rig.call("GET", f"/recorder/recordings/{one['name']}/content"))
    noted = [each["leases"] for each in content["events"] if each["type"] == "lease"]
    a, b = ({"holder": holder, "uids": [servo.uid]} for holder, servo in zip(("A", "B"), servos, strict=True))
    assert noted[:2] == [[a], [a, b]]


@recorded()
async def test_a_manual_recording_covers_the_requested_time_and_servos_found_after_the_mark(
    rig: Rig, tmp_path: Path
) -> None:
    assert rig.host.fleet.all() == []
    one = json(await rig.call("POST", "/recorder/recordings?wait=true"), 201)
    content = json(await rig.call("GET", f"/recorder/recordings/{one['name']}/content"))
    (servo,) = rig.host.fleet.all()
    assert [each["uid"] for each in content["about"]["servos"]] == [servo.uid]
    assert any(column["channel"] == "current_angle" for column in content["telemetry"])
    await asyncio.sleep(130)
    body = {"reason": "Odd noise, left wing", "before_s": 120}
    one = json(await rig.call("POST", "/recorder/recordings?wait=true", body), 201)
    assert (one["reason"], one["text"]) == ("manual", "Odd noise, left wing")
    assert one["name"].endswith("-odd-noise-left-wing.zip")
    assert one["seconds"] == 130.0
    assert one["marks"][0]["at"] - frames_of(tmp_path / one["name"])[0].at == pytest.approx(120, abs=1.0)
    for wrong in ({"before_s": 0}, {"before_s": 601}, {"reason": "x" * 201}):
        problem(await rig.call("POST", "/recorder/recordings", wrong), "invalid_value", 422)


@recorded()
async def test_a_lost_bus_writes_a_recording_and_a_disconnected_one_does_not(rig: Rig) -> None:
    await rig.ready()
    await asyncio.sleep(40)
    json(await rig.call("DELETE", "/bus"))
    await asyncio.sleep(15)
    assert await recordings(rig) == []
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await asyncio.sleep(40)
    await rig.cable.unplug()
    (one,) = await written(rig)
    assert one["reason"] == "bus_lost"


@recorded()
async def test_a_full_disk_is_reported_and_affects_nothing_else(rig: Rig, servo: Servo, tmp_path: Path) -> None:
    def no_space(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with pytest.MonkeyPatch.context() as broken:
        broken.setattr("hornbill.bus.recordings.recording.RecordingWriter._pack", no_space)
        refused = await rig.call("POST", "/recorder/recordings?wait=true")
        assert "Free space on the disk" in problem(refused, "log_failed", 500)["detail"]
        (event,) = rig.events("recording_failed")
        assert event.level == "warning"
        assert names_in(tmp_path) == []
        json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))
    json(await rig.call("POST", "/recorder/recordings?wait=true"), 201)


def test_a_pending_recording_is_written_when_the_server_exits(tmp_path: Path) -> None:
    async def scene(rig: Rig) -> None:
        await rig.ready()
        json(await rig.call("POST", "/recorder/recordings"), 202)
        await asyncio.sleep(1)

    record(tmp_path, scene)
    (path,) = tmp_path.iterdir()
    assert path.suffix == ".zip"
    assert frames_of(path)


@recorded(most=2)
async def test_only_the_newest_recordings_are_stored_and_deleted_ones_are_reported(rig: Rig) -> None:
    await rig.ready()
    names = [json(await rig.call("POST", "/recorder/recordings?wait=true"), 201)["name"] for _ in range(3)]
    assert sorted(one["name"] for one in await recordings(rig)) == sorted(names[1:])
    (event,) = rig.events("recordings_deleted")
    assert names[0] in event.text


@recorded()
async def test_recordings_are_downloaded_uploaded_and_deleted(rig: Rig, tmp_path: Path) -> None:
    await rig.ready()
    name = json(await rig.call("POST", "/recorder/recordings?wait=true"), 201)["name"]
    got = await rig.call("GET", f"/recorder/recordings/{name}")
    assert got.content == (tmp_path / name).read_bytes()
    assert got.headers["content-disposition"] == f'attachment; filename="{name}"'
    rest = await rig.http.get(f"/recorder/recordings/{name}", headers={"Range": "bytes=100-"})
    assert (rest.status_code, rest.content) == (206, got.content[100:]), "a download that broke off goes on"
    uploaded = json(await rig.http.put("/recorder/recordings/other.zip", content=got.content), 201)
    assert (uploaded["name"], uploaded["bytes"], uploaded["reason"]) == ("other.zip", len(got.content), "manual")
    problem(await rig.http.put("/recorder/recordings/other.zip", content=got.content), "invalid_value", 422)
    for wrong in (b"", b"PK\x03\x04", got.content[:-30], got.content.replace(b"frames.log", b"../../x.lo")):
        response = await rig.http.put("/recorder/recordings/wrong.zip", content=wrong)
        assert "is no recording of hornbill" in problem(response, "invalid_value", 422)["detail"]
    problem(await rig.http.put("/recorder/recordings/wrong.exe", content=got.content), "invalid_value", 422)
    assert names_in(tmp_path) == sorted([name, "other.zip"])
    assert (await rig.call("DELETE", "/recorder/recordings/other.zip")).status_code == 204
    for verb, path in (("DELETE", "other.zip"), ("GET", "other.zip"), ("GET", "other.zip/content")):
        problem(await rig.call(verb, f"/recorder/recordings/{path}"), "unknown_recording", 404)


def test_no_path_leads_out_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "secret.zip").write_text("secret")

    async def scene(rig: Rig) -> None:
        for name in ("../secret.zip", "..%2Fsecret.zip", "%2e%2e/secret.zip", "..\\secret.zip", ".zip"):
            for verb in ("GET", "DELETE", "PUT"):
                assert (await rig.call(verb, f"/recorder/recordings/{name}")).status_code in (404, 405, 422), name
        assert names_in(tmp_path) == ["secret.zip"]
        assert (tmp_path / "secret.zip").read_text() == "secret"

    record(tmp_path / "recordings", scene)


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of two servos, one of which was moved and written to."""
    folder = tmp_path_factory.mktemp("recordings")

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready(2))[0]
        await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "Left wing"})
        lease = await rig.lease()
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
        json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 30.0}, lease=lease))
        await asyncio.sleep(5)
        (folder / "uid").write_text(servo.uid)
        json(await rig.call("POST", "/recorder/recordings?wait=true", {"reason": "taken"}), 201)

    record(folder, scene, *TWO)
    return folder


def replayed(act: Callable[[Rig, Uid], Awaitable[None]]) -> Callable[[Path], None]:
    """Decorate a scene `(rig, uid)`: a test whose bus is the recording `taken` with this servo."""

    def test(taken: Path) -> None:
        (path,) = taken.glob("*.zip")

        async def scene(rig: Rig) -> None:
            start_recorder(rig, taken)
            await rig.host.attach(await BusPorts(None, taken, taken).open(f"recording:{path.name}", 1_000_000))
            await act(rig, Uid((taken / "uid").read_text()))

        play(scene, connect=False)

    return test


@replayed
async def test_a_recording_shows_its_servos_and_their_angles_without_a_bus(rig: Rig, uid: Uid) -> None:
    page = Socket(rig.app)
    page.send(type="subscribe", topics=["servos", "telemetry", "frames"])
    await asyncio.sleep(15)
    servos = {one["uid"]: one for one in json(await rig.call("GET", "/servos"))}
    assert len(servos) == 2
    one = servos[uid]
    assert (one["label"], one["model"], one["online"], one["state"]) == ("Left wing", "BLA21-06U-A0", True, "ready")
    assert one["angle_deg"] == pytest.approx(30, abs=1.0)
    messages = page.received()
    plotted = [v for m in messages if m["type"] == "telemetry" and m["uid"] == uid
               for v in m["channels"].get("current_angle", {"v": []})["v"]]  # fmt: skip
    assert len(plotted) > 30
    assert max(v for v in plotted if v is not None) == pytest.approx(30, abs=1.0)
    assert any(m["type"] == "frames" and m["transfers"] for m in messages)
    readings = json(await rig.call("GET", f"/servos/{uid}/parameters"))
    assert readings["parameters"]["torque_mode"]["value"] == "on"
    await page.close()


@replayed
async def test_a_recording_is_read_only_and_not_stored_and_is_replaced_by_the_next_bus(rig: Rig, uid: Uid) -> None:
    await asyncio.sleep(10)
    lease = await rig.lease()
    for verb, path, body in (
        ("POST", "command", {"type": "angle", "value": 5.0}), ("POST", "torque", {"mode": "on"}),
        ("PATCH", "parameters", {"values": {"angle_limit_cw": 50}}), ("PATCH", "", {"label": "Mine"}),
    ):  # fmt: skip
        response = await rig.call(verb, f"/servos/{uid}/{path}".rstrip("/"), body, lease=lease)
        problem(response, "bus_read_only", 409)
    stopped = json(await rig.call("POST", "/stop"))
    assert (stopped["latched"], stopped["servos"]) == (True, [])
    await asyncio.sleep(60)
    assert rig.host.connected().port.statistics.tx_frames == 0
    assert list(rig.host.store.servos.all()) == []
    state = json(await rig.call("GET", "/recorder"))
    assert (state["recording"], state["frames"], state["pending"]) == (False, 0, None)
    problem(await rig.call("POST", "/recorder/recordings"), "busy", 409)
    assert len(await recordings(rig)) == 1
    assert len(rig.host.fleet.all()) == 2
    json(await rig.call("DELETE", "/bus"))
    assert json(await rig.call("GET", "/servos")) == []
    assert list(rig.host.telemetry.channels(uid)) == [], "recorded samples are dropped"
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    (servo,) = await rig.ready()
    assert not servo.recorded
    await asyncio.sleep(2)
    assert json(await rig.call("GET", "/recorder"))["frames"] > 20


def test_an_invalid_file_is_refused_as_a_bus(tmp_path: Path) -> None:
    (tmp_path / "a.zip").write_bytes(b"no zip")

    async def scene(_rig: Rig) -> None:
        for name, why in (("a.zip", "no recording of hornbill"), ("b.zip", "cannot be read"), ("", "has no file name")):
            with pytest.raises(PortOpenFailed, match=why):
                await BusPorts(None, tmp_path, tmp_path).open(f"recording:{name}", 1_000_000)

    play(scene, connect=False)
