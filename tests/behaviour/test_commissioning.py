"""Commissioning: new servos get names, IDs and values, saved and verified; no IDs clash on the way."""

import asyncio
import csv
import io
import json as jsons
import xml.etree.ElementTree as ET
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from behaviour.actions import torque
from behaviour.clashes import Watch
from behaviour.rig import CATALOG, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.identify_motion import FURTHEST_DEG
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.wire.frame import Frame

SIX = [Recipe("BLA21-06U-A0", serial=100 + place, angle_deg=5.0 * place) for place in range(6)]
VALUES: dict[str, Any] = {"angle_limit_cw": 60, "angle_limit_ccw": -60.5, "angle_p_gain": 55, "smoothing": False}
RAW = {0x38: 600, 0x39: -605, 0x2C: 55, 0x22: 0}
P_GAIN = CATALOG.by_key["angle_p_gain"].name


@contextmanager
def watching(rig: Rig) -> Generator[Watch, None, None]:
    watch = Watch(rig)
    yield watch
    assert watch.clashes == set()
    assert watch.furthest_deg <= FURTHEST_DEG
    assert rig.array_commands() == []


async def profile(rig: Rig, values: dict[str, Any] = VALUES) -> None:
    assert (await rig.call("PUT", "/profiles/bench", {"values": values})).is_success


async def ordered(rig: Rig) -> tuple[list[Servo], list[SimulatedServo]]:
    """The servos of the host and of the bench, in the order of the recipes, once the profile is stored."""
    await profile(rig)
    await rig.ready(len(rig.bench.servos))
    return [rig.host.fleet.get(uid) for uid in rig.bench.servos], list(rig.bench.servos.values())


def order(servos: Sequence[Servo], **more: Any) -> dict[str, Any]:
    """A request that numbers servos from 1, in this order."""
    wanted = [{"uid": one.uid, "servo_id": at, "label": f"axis {at}"} for at, one in enumerate(servos, start=1)]
    return {"servos": wanted, "profile": "bench", **more}


async def commission(rig: Rig, body: dict[str, Any], state: str = "succeeded") -> Any:
    """The ended job, which must be in this state."""
    job = json(await rig.call("POST", "/commissioning?wait=true", body))
    assert job["state"] == state, job["error"]
    return job


async def resume(rig: Rig, job_id: str) -> Any:
    """The resumed job, which must have succeeded."""
    job = json(await rig.call("POST", f"/jobs/{job_id}/resume?wait=true"))
    assert job["state"] == "succeeded", job["error"]
    return job


async def report(rig: Rig, job: Any, form: str) -> str:
    response = await rig.call("GET", f"/jobs/{job['id']}/report?format={form}")
    assert response.status_code == 200, response.text
    return response.text


def gain(row: dict[str, str]) -> str:
    """The P gain in a row of a CSV report."""
    return next(value for key, value in row.items() if key.startswith("angle_p_gain"))


def right(sim: SimulatedServo, servo_id: int) -> bool:
    """Whether RAM and ROM of a simulated servo contain the values of `order` and the profile."""
    wanted = {**RAW, 0x45: servo_id}
    return all((sim.memory.get(at), sim.memory.stored(at)) == (raw, raw) for at, raw in wanted.items())


def all_right(sims: Sequence[SimulatedServo]) -> bool:
    return all(right(sim, at) for at, sim in enumerate(sims, start=1))


def untouched(sim: SimulatedServo) -> bool:
    memory = sim.memory
    held = [memory.get(at) for at in (0x22, 0x2C, 0x38, 0x45)]
    return (sim.starts, held, memory.stored(0x45)) == (1, [1, 40, 1799, 0], 0)


def verdicts(job: Any) -> list[str]:
    return [unit["verdict"] for unit in job["result"]["servos"]]


@scene(*SIX)
async def test_new_servos_get_ids_and_values_in_one_job_and_repeating_it_writes_nothing(rig: Rig) -> None:
    servos, sims = await ordered(rig)
    shown = json(await rig.call("GET", "/commissioning/candidates"))
    assert [one["servo"]["uid"] for one in shown["servos"]] == [one.uid for one in servos]
    assert [one["servo_id"] for one in shown["servos"]] == list(range(1, 7))
    with watching(rig) as watch:
        job = await commission(rig, order(servos))
    assert watch.furthest_deg < 1.0
    assert all_right(sims)
    assert [sim.starts for sim in sims] == [2] * 6
    assert [servo.label for servo in servos] == [f"axis {at}" for at in range(1, 7)]
    assert [servo.unsaved() for servo in servos] == [[]] * 6
    assert all(step["state"] == "done" for step in job["steps"])
    assert verdicts(job) == ["done"] * 6
    assert json(await rig.call("GET", "/commissioning/candidates"))["servos"] == []
    entries = [row.entry for row in rig.host.store.audit.rows(action="commissioning")]
    assert [(one.outcome, one.job) for one in entries] == [("succeeded", job["id"])] * 6
    for row, uid in zip(csv.DictReader(io.StringIO(await report(rig, job, "csv"))), rig.bench.servos, strict=True):
        assert (row["uid"], row["serial"][3:]) == (uid, f"{rig.bench.servo(uid).serial:06d}")
        assert (row["angle_limit_ccw [°]"], row["verified_in"], row["profile"]) == ("-60.5", "rom", "bench")
    document = jsons.loads(await report(rig, job, "json"))
    assert [one["values"]["angle_p_gain"]["value"] for one in document["servos"]] == [55] * 6
    root = ET.fromstring(await report(rig, job, "junit"))
    assert (root.get("tests"), root.get("failures")) == ("18", "0")
    page = await report(rig, job, "html")
    assert all(f"axis {at}" in page for at in range(1, 7))
    problem(await rig.call("GET", f"/jobs/{job['id']}/report?format=pdf"), "invalid_value", 422)

    before = len(rig.writes())
    wanted = {"servos": [{"uid": servos[1].uid, "servo_id": 2, "label": "axis 2"}], "profile": "bench"}
    job = await commission(rig, wanted)
    assert rig.writes()[before:] == []
    assert [step["state"] for step in job["steps"]] == ["done", "skipped", "done"]
    assert "ROM already contains all values" in job["steps"][1]["evidence"]
    assert sims[1].starts == 2


@scene(*SIX[:3])
async def test_a_static_node_id_is_used_and_frees_the_allocated_one(rig: Rig) -> None:
    """Before, without a save only RAM is verified; identifying turns no horn further than the wiggle."""
    servos, sims = await ordered(rig)
    job = await commission(rig, order(servos, save=False))
    assert "not saved to ROM" in job["result"]["text"]
    assert [unit["verified_in"] for unit in job["result"]["servos"]] == ["ram"] * 3
    assert [(sim.memory.get(0x45), sim.memory.stored(0x45), sim.starts) for sim in sims] == [
        (1, 0, 1), (2, 0, 1), (3, 0, 1),
    ]  # fmt: skip
    wanted = [one | {"node_id": 20 + one["servo_id"]} for one in order(servos)["servos"]]
    with watching(rig) as watch:
        await commission(rig, order(servos, identify=True) | {"servos": wanted})
    assert watch.furthest_deg > 1.0
    assert all_right(sims)
    assert [servo.node_id for servo in servos] == [int(sim.node_id) for sim in sims] == [21, 22, 23]
    assert rig.host.store.allocations.entries() == {}


KNOWN = [Recipe("BLA21-06U-A0", serial=200 + n, servo_id=n, node_id=10 + n, rom={"soft_start": 0}) for n in (1, 2, 3)]


@scene(*KNOWN)
async def test_ids_are_swapped_and_rotated_without_a_clash(rig: Rig) -> None:
    servos, sims = await ordered(rig)
    wanted = [{"uid": servos[0].uid, "servo_id": 2}, {"uid": servos[1].uid, "servo_id": 1}]
    with watching(rig):
        job = await commission(rig, {"servos": wanted})
        assert [one.memory.stored(0x45) for one in sims] == [2, 1, 3]
        assert [one.starts for one in sims] == [2, 2, 1]
        assert [step["name"] for step in job["steps"]][:2] == ["park_servo_id 2", "write 1"]

        wanted = [
            {"uid": one.uid, "servo_id": (1, 3, 2)[at], "node_id": (12, 13, 11)[at]} for at, one in enumerate(servos)
        ]
        job = await commission(rig, {"servos": wanted})
        assert [int(one.node_id) for one in sims] == [12, 13, 11]
        assert [one.memory.stored(0x46) for one in sims] == [12, 13, 11]
        assert [one.memory.stored(0x45) for one in sims] == [1, 3, 2]
        assert sorted(one.starts - count for one, count in zip(sims, (2, 2, 1), strict=True)) == [1, 1, 2], (
            "one of the cycle was parked with a save"
        )
        assert [step["name"] for step in job["steps"] if step["name"].startswith("park_node_id")] == ["park_node_id 2"]
        assert rig.host.store.allocations.entries() == {}, "the parking ID is free again"
        assert job["result"]["pinned"] == []

        first, _, owner = servos
        wanted = [{"uid": first.uid, "node_id": 11}, {"uid": owner.uid, "node_id": 0}]
        await commission(rig, {"servos": wanted})
        assert first.node_id == 11, "the owner of a requested node ID moves first"
        assert owner.node_id not in (11, 12, 13)
        assert rig.sim(owner).memory.stored(0x46) == 0


@contextmanager
def refusing_half_way(rig: Rig, sim: SimulatedServo) -> Generator[None, None, None]:
    """Once its first value was written, this servo refuses the next."""
    broken = True

    def check(_frames: Sequence[Frame]) -> None:
        if broken and sim.memory.get(0x22) == 0:
            sim.conditions.refuse_keys.add("angle_p_gain")

    rig.bus.port("refusing").listen(check)
    yield
    broken = False
    sim.conditions.refuse_keys.clear()


@scene(*SIX[:4])
async def test_a_failure_stops_the_job_or_skips_one_servo(rig: Rig) -> None:
    servos, sims = await ordered(rig)
    with watching(rig), refusing_half_way(rig, sims[1]):
        job = await commission(rig, order(servos), "failed")
        assert job["error"]["code"] == "refused_by_servo"
        assert job["error"]["uids"] == [servos[1].uid]
        assert job["resumable"]
        assert verdicts(job) == ["done", "failed", "not_tried", "not_tried"]
        assert all_right(sims[:1])
        assert all(untouched(sim) for sim in sims[1:])
        assert [servo.label for servo in servos[1:]] == [""] * 3
        assert not {node for node, _, _ in rig.writes()} & {int(sim.node_id) for sim in sims[2:]}
        root = ET.fromstring(await report(rig, job, "junit"))
        assert (root.get("failures"), root.get("skipped")) == ("1", "8")
        job = await commission(rig, order(servos, on_anomaly="continue"), "failed")
        assert verdicts(job) == ["done", "failed", "done", "done"]
        assert untouched(sims[1])
        assert all(right(sim, at) for at, sim in enumerate(sims, start=1) if at != 2)
    await resume(rig, job["id"])
    assert all_right(sims)
    assert [sim.starts for sim in sims] == [2] * 4


@scene(*SIX[:4], store=lambda tmp_path: f"sqlite:///{tmp_path / 'hornbill.db'}")
async def test_a_job_interrupted_by_the_server_is_resumed_by_the_next_one(rig: Rig, tmp_path: Path) -> None:
    place = f"sqlite:///{tmp_path / 'hornbill.db'}"
    servos, sims = await ordered(rig)
    job_id = json(await rig.call("POST", "/commissioning", order(servos)), 202)["id"]
    await until(lambda: sims[2].memory.get(0x2C) == 55, every_s=0.001)
    with await rig.restart_server(place):
        job = json(await rig.call("GET", f"/jobs/{job_id}"))
        assert (job["state"], job["error"]["code"], job["resumable"]) == ("failed", "interrupted", True)
        assert verdicts(job)[:2] == ["done"] * 2
        await rig.host.connect("memory:host", 1_000_000)
        await rig.ready(4)
        done = {int(sim.node_id) for sim in sims[:2]}
        before = len(rig.writes())
        json(await rig.call("PUT", "/profiles/bench", {"values": {"angle_p_gain": 99}}))  # has no effect on this job
        with watching(rig):
            again = await resume(rig, job_id)
        assert again["id"] == job_id
        assert all(right(sim, at) for at, sim in enumerate(sims, start=1))
        assert not {node for node, _, _ in rig.writes()[before:]} & done, "finished servos are only read"
        assert [sim.starts for sim in sims] == [2] * 4
        checked = [step for step in again["steps"] if step["name"].startswith("check")]
        assert [step["state"] for step in checked] == ["done"] * 2
        for uid in list(rig.bench.servos):
            await rig.bench.remove(uid)
        with await rig.restart_server(place):
            rows = list(csv.DictReader(io.StringIO(await report(rig, again, "csv"))))
            assert [gain(row) for row in rows] == ["55"] * 4
            await rig.host.close()


@scene(*KNOWN)
async def test_after_a_failure_a_parked_id_is_restored(rig: Rig) -> None:
    servos, sims = await ordered(rig)
    wanted = [{"uid": servos[0].uid, "servo_id": 2}, {"uid": servos[1].uid, "servo_id": 1}]
    with watching(rig), refusing_half_way(rig, sims[0]):
        job = await commission(rig, {"servos": wanted, "profile": "bench"}, "failed")
    assert verdicts(job) == ["failed", "not_tried"]
    assert [sim.servo_id for sim in sims] == [1, 2, 3]
    assert [sim.starts for sim in sims] == [1, 1, 1]


REJECTED: list[tuple[list[dict[str, Any]], dict[str, Any], str, int]] = [
    ([{"uid": 0, "servo_id": 5}, {"uid": 0, "servo_id": 6}], {}, "invalid_value", 422),
    ([{"uid": 0, "servo_id": 5}, {"uid": 1, "servo_id": 5}], {}, "conflict", 409),
    ([{"uid": 0, "node_id": 55}, {"uid": 1, "node_id": 55}], {}, "conflict", 409),
    ([{"uid": 0, "servo_id": 3}], {}, "conflict", 409),
    ([{"uid": 0, "servo_id": 2}, {"uid": 1, "label": "stays"}], {}, "conflict", 409),
    ([{"uid": 0, "node_id": 13}], {}, "conflict", 409),
    ([{"uid": 0, "node_id": 12}, {"uid": 1, "node_id": 60}], {"save": False}, "conflict", 409),
    ([{"uid": 0}], {"profile": "none"}, "unknown_profile", 404),
    ([{"uid": 0}], {"profile": "bench"}, "out_of_range", 422),
    ([{"uid": "ab" * 16}], {}, "unknown_servo", 404),
    ([{"uid": 0, "servo_id": 300}], {}, "invalid_value", 422),
]
"""Requested servos (UIDs by place), the rest of the request, code, status."""


@scene(*KNOWN)
async def test_everything_is_checked_before_the_first_write(rig: Rig) -> None:
    servos, _ = await ordered(rig)
    await profile(rig, {"overcurrent_limit": 1.5})
    for wanted, more, code, status in REJECTED:
        named = [one | {"uid": servos[one["uid"]].uid if isinstance(one["uid"], int) else one["uid"]} for one in wanted]
        problem(await rig.call("POST", "/commissioning", {"servos": named, **more}), code, status)
    rig.bench.power(servos[0].uid, on=False)
    await asyncio.sleep(4)
    body = {"servos": [{"uid": servos[1].uid, "servo_id": 1}]}
    refused = problem(await rig.call("POST", "/commissioning", body), "conflict", 409)
    assert refused["owner"] == servos[0].uid, "an offline servo keeps its IDs"
    body = {"servos": [{"uid": servos[1].uid, "servo_id": 5}]}
    lease = await rig.lease()
    problem(await rig.call("POST", "/commissioning", body), "lease_held", 409)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    assert rig.writes() == []
    json(await rig.call("POST", "/stop", {}))
    problem(await rig.call("POST", "/commissioning", body), "stopped", 423)
    assert [value for _, name, value in rig.writes() if name != "0x20"] == []
    assert rig.host.jobs.all() == []


@scene(*SIX[:4])
async def test_a_stop_or_a_power_cut_ends_the_job_and_it_is_resumed(rig: Rig) -> None:
    servos, sims = await ordered(rig)
    started = json(await rig.call("POST", "/commissioning", order(servos, identify=True)), 202)
    await until(lambda: sims[0].starts >= 2)
    json(await rig.call("POST", "/stop", {}))
    job = rig.host.jobs.get(started["id"])
    await rig.host.jobs.wait(job)
    assert job.error is not None
    assert job.error.code == "stopped"
    assert all(untouched(sim) for sim in sims[2:])
    problem(await rig.call("POST", f"/jobs/{job.id}/resume"), "stopped", 423)
    json(await rig.call("DELETE", "/stop"))
    lease = await rig.lease()
    for servo in servos:
        await torque(rig, servo, "on", lease)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    await rig.ready(4)

    json(await rig.call("POST", f"/jobs/{job.id}/resume"), 202)
    await until(lambda: all_right(sims[:2]) and sims[1].starts >= 2)
    rig.bench.power(servos[2].uid, on=False)
    await rig.host.jobs.wait(job)
    assert job.state == "failed"
    assert job.error is not None
    assert job.error.code == "no_response"
    assert job.error.detail.startswith("1 of 4 servos failed. 61-000102 ")
    assert "Check its supply and the wiring" in job.error.detail
    assert verdicts(json(await rig.call("GET", f"/jobs/{job.id}"))) == ["done", "done", "failed", "not_tried"]
    rig.bench.power(servos[2].uid, on=True)
    await rig.ready(4)
    before = len(rig.writes())
    await resume(rig, job.id)
    assert all_right(sims)
    assert not {node for node, _, _ in rig.writes()[before:]} & {int(sim.node_id) for sim in sims[:2]}


@scene(Recipe(servo_id=7, node_id=11), Recipe(servo_id=7, node_id=12))
async def test_the_watch_detects_a_clash(rig: Rig) -> None:
    await rig.ready(2)
    watch = Watch(rig)
    watch.check([])
    assert watch.clashes == {("servo_id", 7)}
