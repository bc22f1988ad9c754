"""Commissioning: new servos, all alike, get names, ids and values, saved and proved; nothing clashes on the way."""

import asyncio
import csv
import io
import json as jsons
import xml.etree.ElementTree as ET
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from behaviour.rig import CATALOG, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host, HostSettings
from hornbill.servo.motion.identify_motion import FURTHEST_DEG
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.device import ServoStage
from hornbill.sim.servo import SimulatedServo
from hornbill.store.store import Store
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort

TWELVE = [Recipe("BLA21-06U-A0", serial=100 + place, angle_deg=5.0 * place) for place in range(12)]
VALUES: dict[str, Any] = {"angle_limit_cw": 60, "angle_limit_ccw": -60.5, "angle_p_gain": 55, "smoothing": False}
RAW = {0x38: 600, 0x39: -605, 0x2C: 55, 0x22: 0}
P_GAIN = CATALOG.by_key["angle_p_gain"].name


class Watch:
    """Looks at every simulated servo each time anything was on the bus: what two share, and how far horns went."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.clashes: set[tuple[str, int]] = set()
        self.furthest_deg = 0.0
        self._rest = {uid: sim.angle_deg for uid, sim in rig.bench.servos.items()}

    def look(self, _frames: Sequence[Frame]) -> None:
        up = [sim for sim in self.rig.bench.servos.values() if sim.stage is ServoStage.RUNNING and sim.powered]
        self._unique("servo_id", [sim.servo_id for sim in up])
        self._unique("node_id", [int(sim.node_id) for sim in up])
        for uid, sim in self.rig.bench.servos.items():
            if sim.soft_starting or sim.stage is not ServoStage.RUNNING:
                self._rest[uid] = sim.angle_deg
            self.furthest_deg = max(self.furthest_deg, abs(sim.angle_deg - self._rest[uid]))

    def _unique(self, kind: str, numbers: list[int]) -> None:
        given = [number for number in numbers if number]
        self.clashes |= {(kind, number) for number in given if given.count(number) > 1}


@contextmanager
def watching(rig: Rig) -> Generator[Watch, None, None]:
    watch = Watch(rig)
    port = rig.bus.port("watch")
    port.listen(watch.look)
    yield watch
    assert watch.clashes == set()
    assert watch.furthest_deg <= FURTHEST_DEG
    assert rig.array_commands() == []


async def profile(rig: Rig, values: dict[str, Any] = VALUES) -> None:
    json(await rig.call("PUT", "/profiles/bench", {"values": values}), 201)


def ordered(rig: Rig) -> list[Servo]:
    """The host's servos in the order of the recipes."""
    return [rig.host.fleet.get(uid) for uid in rig.bench.servos]


def order(servos: Sequence[Servo], **more: Any) -> dict[str, Any]:
    """A request that numbers servos from 1, in this order."""
    wanted = [{"uid": one.uid, "servo_id": at, "label": f"axis {at}"} for at, one in enumerate(servos, start=1)]
    return {"servos": wanted, "profile": "bench", **more}


async def commission(rig: Rig, body: dict[str, Any]) -> Any:
    return json(await rig.call("POST", "/commissioning?wait=true", body))


async def report(rig: Rig, job: Any, form: str) -> str:
    answer = await rig.call("GET", f"/jobs/{job['id']}/report?format={form}")
    assert answer.status_code == 200, answer.text
    return answer.text


def right(sim: SimulatedServo, servo_id: int) -> bool:
    """Whether RAM and ROM of a simulated servo hold what `order` and the profile want."""
    memory = sim.memory
    wanted = {**RAW, 0x45: servo_id}
    return all((memory.get(at), memory.stored(at)) == (raw, raw) for at, raw in wanted.items())


def untouched(sim: SimulatedServo) -> bool:
    memory = sim.memory
    held = [memory.get(at) for at in (0x22, 0x2C, 0x38, 0x45)]
    return (sim.starts, held, memory.stored(0x45)) == (1, [1, 40, 1799, 0], 0)


def verdicts(job: Any) -> list[str]:
    return [unit["verdict"] for unit in job["result"]["servos"]]


@scene(*TWELVE)
async def test_twelve_new_servos_become_1_to_12_by_one_job_and_no_horn_goes_further_than_the_wiggle(rig: Rig) -> None:
    await rig.ready(12)
    servos = ordered(rig)
    await profile(rig)
    shown = json(await rig.call("GET", "/commissioning/candidates"))
    assert [one["servo"]["uid"] for one in shown["servos"]] == [one.uid for one in servos]
    assert [one["servo_id"] for one in shown["servos"]] == list(range(1, 13))
    with watching(rig) as watch:
        job = await commission(rig, order(servos, identify=True))
    assert job["state"] == "succeeded", job["error"]
    assert watch.furthest_deg > 1.0, "the wiggle was seen"
    assert all(right(sim, at) for at, sim in enumerate(rig.bench.servos.values(), start=1))
    assert [sim.starts for sim in rig.bench.servos.values()] == [2] * 12
    assert [servo.label for servo in servos] == [f"axis {at}" for at in range(1, 13)]
    assert [servo.unsaved() for servo in servos] == [[]] * 12
    assert all(step["state"] == "done" for step in job["steps"])
    assert verdicts(job) == ["done"] * 12
    assert json(await rig.call("GET", "/commissioning/candidates"))["servos"] == []
    entries = [row.entry for row in rig.host.store.audit.rows(action="commissioning")]
    assert [(one.outcome, one.job) for one in entries] == [("succeeded", job["id"])] * 12
    await _reports_are_right(rig, job)


async def _reports_are_right(rig: Rig, job: Any) -> None:
    rows = list(csv.DictReader(io.StringIO(await report(rig, job, "csv"))))
    assert [int(row["servo_id"]) for row in rows] == list(range(1, 13))
    for row, uid in zip(rows, rig.bench.servos, strict=True):
        assert row["uid"] == uid
        assert row["serial"].endswith(f"{rig.bench.servo(uid).serial:06d}")
        assert (row["angle_limit_ccw [°]"], row["verified_in"], row["profile"]) == ("-60.5", "rom", "bench")
    document = jsons.loads(await report(rig, job, "json"))
    assert [one["values"]["angle_p_gain"]["value"] for one in document["servos"]] == [55] * 12
    root = ET.fromstring(await report(rig, job, "junit"))
    assert (root.get("tests"), root.get("failures")) == ("48", "0")
    assert all(float(case.get("time", "")) > 0 for case in root.iter("testcase"))
    page = await report(rig, job, "html")
    assert all(f"axis {at}" in page for at in range(1, 13))
    problem(await rig.call("GET", f"/jobs/{job['id']}/report?format=pdf"), "invalid_value", 422)


@scene(*TWELVE[:3])
async def test_a_static_node_id_is_what_the_servo_answers_under_and_its_old_one_is_free(rig: Rig) -> None:
    await rig.ready(3)
    servos = ordered(rig)
    wanted = [{"uid": one.uid, "servo_id": at, "node_id": 20 + at} for at, one in enumerate(servos, start=1)]
    with watching(rig):
        job = await commission(rig, {"servos": wanted})
    assert job["state"] == "succeeded", job["error"]
    assert [servo.node_id for servo in servos] == [21, 22, 23]
    assert [int(rig.sim(servo).node_id) for servo in servos] == [21, 22, 23]
    assert rig.host.store.allocations.entries() == {}


KNOWN = [
    Recipe("BLA21-06U-A0", serial=200 + at, servo_id=at, node_id=10 + at, rom={"soft_start": 0}) for at in (1, 2, 3)
]


@scene(*KNOWN)
async def test_two_servo_ids_are_swapped_and_never_the_same(rig: Rig) -> None:
    await rig.ready(3)
    servos = ordered(rig)
    wanted = [{"uid": servos[0].uid, "servo_id": 2}, {"uid": servos[1].uid, "servo_id": 1}]
    with watching(rig):
        job = await commission(rig, {"servos": wanted})
    assert job["state"] == "succeeded", job["error"]
    assert [rig.sim(one).memory.stored(0x45) for one in servos] == [2, 1, 3]
    assert [rig.sim(one).starts for one in servos] == [2, 2, 1]
    assert [step["name"] for step in job["steps"]][:2] == ["park_servo_id 2", "write 1"]


@scene(*KNOWN)
async def test_three_static_node_ids_and_servo_ids_go_round_and_never_clash(rig: Rig) -> None:
    await rig.ready(3)
    servos = ordered(rig)
    wanted = [
        {"uid": one.uid, "servo_id": at % 3 + 1, "node_id": 11 + at % 3} for at, one in enumerate(servos, start=1)
    ]
    with watching(rig):
        job = await commission(rig, {"servos": wanted})
    assert job["state"] == "succeeded", job["error"]
    assert [int(rig.sim(one).node_id) for one in servos] == [12, 13, 11]
    assert [rig.sim(one).memory.stored(0x46) for one in servos] == [12, 13, 11]
    assert [rig.sim(one).memory.stored(0x45) for one in servos] == [2, 3, 1]
    assert sorted(rig.sim(one).starts for one in servos) == [2, 2, 3], "one of the cycle was parked with a save"
    assert [step["name"] for step in job["steps"] if step["name"].startswith("park_node_id")] == ["park_node_id 2"]
    assert rig.host.store.allocations.entries() == {}, "what it was parked on is free again"
    assert job["result"]["pinned"] == []


@scene(*KNOWN[:2])
async def test_whoever_is_on_a_wanted_node_id_leaves_first_although_it_was_named_last(rig: Rig) -> None:
    await rig.ready(2)
    first, second = ordered(rig)
    wanted = [{"uid": first.uid, "node_id": 12}, {"uid": second.uid, "node_id": 0}]
    with watching(rig):
        job = await commission(rig, {"servos": wanted})
    assert job["state"] == "succeeded", job["error"]
    assert first.node_id == 12
    assert second.node_id not in (11, 12)
    assert rig.sim(second).memory.stored(0x46) == 0


@contextmanager
def refusing_half_way(rig: Rig, sim: SimulatedServo) -> Generator[None, None, None]:
    """From the moment its first value was written this servo refuses the next."""

    broken = True

    def look(_frames: Sequence[Frame]) -> None:
        if broken and sim.memory.get(0x22) == 0:
            sim.conditions.refuse_keys.add("angle_p_gain")

    rig.bus.port("refusing").listen(look)
    yield
    broken = False
    sim.conditions.refuse_keys.clear()


@scene(*TWELVE)
async def test_the_fifth_of_twelve_refuses_and_with_stop_the_rest_is_as_before_and_told_so(rig: Rig) -> None:
    await rig.ready(12)
    servos, sims = ordered(rig), list(rig.bench.servos.values())
    await profile(rig)
    with watching(rig), refusing_half_way(rig, sims[4]):
        job = await commission(rig, order(servos))
    assert job["state"] == "failed"
    assert job["error"]["code"] == "refused_by_servo"
    assert job["error"]["uids"] == [servos[4].uid]
    assert job["resumable"]
    assert verdicts(job) == ["done"] * 4 + ["failed"] + ["not_tried"] * 7
    assert all(right(sim, at) for at, sim in enumerate(sims[:4], start=1))
    assert all(untouched(sim) for sim in sims[4:])
    assert [servo.label for servo in servos[4:]] == [""] * 8
    touched = {node for node, _, _ in rig.writes()}
    assert not touched & {int(sim.node_id) for sim in sims[5:]}
    root = ET.fromstring(await report(rig, job, "junit"))
    assert (root.get("failures"), root.get("skipped")) == ("1", "23")


@scene(*TWELVE)
async def test_the_fifth_of_twelve_refuses_and_with_continue_all_others_are_done(rig: Rig) -> None:
    await rig.ready(12)
    servos, sims = ordered(rig), list(rig.bench.servos.values())
    await profile(rig)
    with watching(rig), refusing_half_way(rig, sims[4]):
        job = await commission(rig, order(servos, on_anomaly="continue"))
    assert job["state"] == "failed"
    assert verdicts(job) == ["done"] * 4 + ["failed"] + ["done"] * 7
    assert untouched(sims[4])
    assert all(right(sim, at) for at, sim in enumerate(sims, start=1) if at != 5)
    again = json(await rig.call("POST", f"/jobs/{job['id']}/resume?wait=true"))
    assert again["state"] == "succeeded", str(again["error"])
    assert all(right(sim, at) for at, sim in enumerate(sims, start=1))
    assert [sim.starts for sim in sims] == [2] * 12


@scene(*TWELVE[:4])
async def test_a_servo_unplugged_in_the_middle_is_an_anomaly_and_resuming_goes_on_with_it(rig: Rig) -> None:
    await rig.ready(4)
    servos, sims = ordered(rig), list(rig.bench.servos.values())
    await profile(rig)
    started = json(await rig.call("POST", "/commissioning", order(servos)), 202)
    while sims[1].starts < 2:
        await asyncio.sleep(0.01)
    rig.bench.power(servos[2].uid, on=False)
    job = rig.host.jobs.get(started["id"])
    await rig.host.jobs.wait(job)
    assert job.state == "failed"
    assert job.error is not None
    assert job.error.code == "no_response"
    assert job.error.detail.startswith("1 of 4 servos failed. 61-000102 ")
    assert "Check its supply and the wiring" in job.error.detail
    shown = json(await rig.call("GET", f"/jobs/{job.id}"))
    assert verdicts(shown) == ["done", "done", "failed", "not_tried"]
    rig.bench.power(servos[2].uid, on=True)
    await rig.ready(4)
    before = len(rig.writes())
    again = json(await rig.call("POST", f"/jobs/{job.id}/resume?wait=true"))
    assert again["state"] == "succeeded", str(again["error"])
    assert all(right(sim, at) for at, sim in enumerate(sims, start=1))
    assert not {node for node, _, _ in rig.writes()[before:]} & {int(sim.node_id) for sim in sims[:2]}
    assert [sim.starts for sim in sims] == [2, 2, 3, 2]


async def restart_server(rig: Rig, place: str) -> Store:
    """Close the server and start another on the same store; the servos run on."""
    await rig.host.close()
    kept = Store(place)

    async def open_port(address: str, bitrate: int) -> CanPort:
        port = rig.cable.port(address, bitrate)
        await port.open()
        return port

    rig.host = Host(CATALOG, kept, open_port, HostSettings(127, bytes(range(16)), (0, 1)))
    rig.app.state.host = rig.host
    return kept


def test_a_job_the_server_was_ended_in_is_listed_as_interrupted_and_resumed_by_the_next(tmp_path: Path) -> None:
    place = f"sqlite:///{tmp_path / 'hornbill.db'}"

    async def scene(rig: Rig) -> None:
        await rig.ready(12)
        servos, sims = ordered(rig), list(rig.bench.servos.values())
        await profile(rig)
        started = json(await rig.call("POST", "/commissioning", order(servos)), 202)
        while sims[4].memory.get(0x2C) != 55:
            await asyncio.sleep(0.001)
        kept = await restart_server(rig, place)
        try:
            await _resumed(rig, started["id"], sims)
        finally:
            await rig.host.close()
            kept.close()

    async def _resumed(rig: Rig, job_id: str, sims: list[SimulatedServo]) -> None:
        job = json(await rig.call("GET", f"/jobs/{job_id}"))
        assert (job["state"], job["error"]["code"], job["resumable"]) == ("failed", "interrupted", True)
        assert verdicts(job)[:4] == ["done"] * 4
        await rig.host.connect("memory:host", 1_000_000)
        await rig.ready(12)
        done = {int(sim.node_id) for sim in sims[:4]}
        before = len(rig.writes())
        json(await rig.call("PUT", "/profiles/bench", {"values": {"angle_p_gain": 99}}))  # others get what these got
        with watching(rig):
            again = json(await rig.call("POST", f"/jobs/{job_id}/resume?wait=true"))
        assert again["state"] == "succeeded", str(again["error"])
        assert again["id"] == job_id
        assert all(right(sim, at) for at, sim in enumerate(sims, start=1))
        assert not {node for node, _, _ in rig.writes()[before:]} & done, "what was finished is only read"
        assert [sim.starts for sim in sims] == [2] * 12
        checked = [step for step in again["steps"] if step["name"].startswith("check")]
        assert [step["state"] for step in checked] == ["done"] * 4
        for uid in list(rig.bench.servos):
            await rig.bench.remove(uid)
        kept = await restart_server(rig, place)
        rows = list(csv.DictReader(io.StringIO(await report(rig, again, "csv"))))
        assert [row["angle_p_gain [%]"] if "angle_p_gain [%]" in row else row["angle_p_gain"] for row in rows] == (
            ["55"] * 12
        )
        kept.close()

    play(scene, *TWELVE, store=place)


@scene(*TWELVE[:2])
async def test_asking_again_for_one_servo_does_its_part_again_and_writes_nothing_it_holds(rig: Rig) -> None:
    await rig.ready(2)
    servos = ordered(rig)
    await profile(rig)
    assert (await commission(rig, order(servos)))["state"] == "succeeded"
    before = len(rig.writes())
    wanted = {"servos": [{"uid": servos[1].uid, "servo_id": 2, "label": "axis 2"}], "profile": "bench"}
    job = await commission(rig, wanted)
    assert job["state"] == "succeeded", job["error"]
    assert rig.writes()[before:] == []
    assert [step["state"] for step in job["steps"]] == ["done", "skipped", "done"]
    assert "ROM already contains all values" in job["steps"][1]["evidence"]
    assert rig.sim(servos[1]).starts == 2


@scene(*TWELVE[:2])
async def test_without_save_ram_is_proved_and_it_is_said_that_rom_holds_nothing_of_it(rig: Rig) -> None:
    await rig.ready(2)
    servos, sims = ordered(rig), list(rig.bench.servos.values())
    await profile(rig)
    job = await commission(rig, order(servos, save=False))
    assert job["state"] == "succeeded", job["error"]
    assert "not saved to ROM" in job["result"]["text"]
    assert [unit["verified_in"] for unit in job["result"]["servos"]] == ["ram", "ram"]
    assert [sim.memory.get(0x45) for sim in sims] == [1, 2]
    assert [sim.memory.stored(0x45) for sim in sims] == [0, 0]
    assert [sim.starts for sim in sims] == [1, 1]


@scene(*KNOWN)
async def test_with_an_anomaly_a_servo_that_stepped_aside_gets_its_id_back(rig: Rig) -> None:
    await rig.ready(3)
    servos, sims = ordered(rig), list(rig.bench.servos.values())
    await profile(rig)
    wanted = [{"uid": servos[0].uid, "servo_id": 2}, {"uid": servos[1].uid, "servo_id": 1}]
    with watching(rig), refusing_half_way(rig, sims[0]):
        job = await commission(rig, {"servos": wanted, "profile": "bench"})
    assert job["state"] == "failed"
    assert verdicts(job) == ["failed", "not_tried"]
    assert [sim.servo_id for sim in sims] == [1, 2, 3]
    assert [sim.starts for sim in sims] == [1, 1, 1]


@pytest.mark.parametrize(
    ("change", "code", "status"),
    [
        ({"servos": [{"uid": "0", "servo_id": 5}, {"uid": "0", "servo_id": 6}]}, "invalid_value", 422),
        ({"servos": [{"uid": "0", "servo_id": 5}, {"uid": "1", "servo_id": 5}]}, "conflict", 409),
        ({"servos": [{"uid": "0", "node_id": 55}, {"uid": "1", "node_id": 55}]}, "conflict", 409),
        ({"servos": [{"uid": "0", "servo_id": 3}]}, "conflict", 409),
        ({"servos": [{"uid": "0", "servo_id": 2}, {"uid": "1", "label": "stays"}]}, "conflict", 409),
        ({"servos": [{"uid": "0", "node_id": 13}]}, "conflict", 409),
        ({"servos": [{"uid": "0", "node_id": 12}, {"uid": "1", "node_id": 60}], "save": False}, "conflict", 409),
        ({"servos": [{"uid": "0"}], "profile": "none"}, "unknown_profile", 404),
        ({"servos": [{"uid": "0"}], "profile": "strong"}, "out_of_range", 422),
        ({"servos": [{"uid": "ab" * 16}]}, "unknown_servo", 404),
        ({"servos": [{"uid": "0", "servo_id": 300}]}, "invalid_value", 422),
    ],
)
@scene(*KNOWN)
async def test_everything_is_checked_before_the_first_write(
    rig: Rig, change: dict[str, Any], code: str, status: int
) -> None:
    await rig.ready(3)
    servos = ordered(rig)
    await profile(rig, {"overcurrent_limit": 1.5})
    body = {**change, "servos": [dict(one) for one in change["servos"]]}
    if body.get("profile") == "strong":
        body["profile"] = "bench"
    for one in body["servos"]:
        if len(one["uid"]) == 1:
            one["uid"] = servos[int(one["uid"])].uid
    problem(await rig.call("POST", "/commissioning", body), code, status)
    assert rig.writes() == []
    assert rig.host.jobs.all() == []


@scene(*KNOWN[:2])
async def test_an_id_of_a_servo_on_the_shelf_is_not_given_to_another(rig: Rig) -> None:
    await rig.ready(2)
    servos = ordered(rig)
    rig.bench.power(servos[0].uid, on=False)
    await asyncio.sleep(4)
    wanted = {"servos": [{"uid": servos[1].uid, "servo_id": 1}]}
    refused = problem(await rig.call("POST", "/commissioning", wanted), "conflict", 409)
    assert refused["owner"] == servos[0].uid


@scene(*KNOWN[:2])
async def test_nothing_begins_while_stop_is_latched_or_somebody_else_has_motion_control(rig: Rig) -> None:
    await rig.ready(2)
    body = {"servos": [{"uid": ordered(rig)[0].uid, "servo_id": 5}]}
    lease = await rig.lease()
    problem(await rig.call("POST", "/commissioning", body), "lease_held", 409)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    json(await rig.call("POST", "/stop", {}))
    problem(await rig.call("POST", "/commissioning", body), "stopped", 423)
    assert [value for _, name, value in rig.writes() if name != "0x20"] == []


@scene(*TWELVE[:4])
async def test_stop_pressed_in_the_middle_ends_it_there_and_after_clearing_it_is_resumed(rig: Rig) -> None:
    await rig.ready(4)
    servos, sims = ordered(rig), list(rig.bench.servos.values())
    await profile(rig)
    started = json(await rig.call("POST", "/commissioning", order(servos, identify=True)), 202)
    while sims[1].starts < 2:
        await asyncio.sleep(0.01)
    json(await rig.call("POST", "/stop", {}))
    job = rig.host.jobs.get(started["id"])
    await rig.host.jobs.wait(job)
    assert job.error is not None
    assert job.error.code == "stopped"
    assert untouched(sims[3])
    problem(await rig.call("POST", f"/jobs/{job.id}/resume"), "stopped", 423)
    json(await rig.call("DELETE", "/stop"))
    for servo in servos:
        lease = await rig.lease()
        json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
        json(await rig.call("DELETE", f"/leases/{lease}"))
    await rig.ready(4)
    again = json(await rig.call("POST", f"/jobs/{job.id}/resume?wait=true"))
    assert again["state"] == "succeeded", str(again["error"])
    assert all(right(sim, at) for at, sim in enumerate(sims, start=1))


@scene(Recipe(servo_id=7, node_id=11), Recipe(servo_id=7, node_id=12))
async def test_the_bus_and_the_rig_are_what_this_file_thinks(rig: Rig) -> None:
    """The watch would see a clash: two servos with one id are one."""
    await rig.ready(2)
    watch = Watch(rig)
    watch.look([])
    assert watch.clashes == {("servo_id", 7)}


@scene(KNOWN[0])
async def test_the_report_of_a_save_holds_what_rom_was_found_to_hold(rig: Rig) -> None:
    await rig.ready(1)
    servo = ordered(rig)[0]
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 55}}))
    job = json(await rig.call("POST", f"/servos/{servo.uid}/save?wait=true"))
    await rig.bench.remove(servo.uid)
    (row,) = csv.DictReader(io.StringIO(await report(rig, job, "csv")))
    assert (row["uid"], row["verified_in"], row["verdict"]) == (servo.uid, "rom", "done")
    assert next(value for key, value in row.items() if key.startswith("angle_p_gain")) == "55"
    assert float(row["duration_s"]) > 0.1
