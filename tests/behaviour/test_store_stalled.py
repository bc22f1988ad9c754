"""A stalled database: nothing on the bus waits for it, and changes are stored later, in order."""

import asyncio
import sqlite3
import subprocess
import sys
import threading
from collections.abc import AsyncGenerator, Generator
from contextlib import asynccontextmanager, closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from behaviour.rig import PLAIN, Rig, json, play, problem, until
from behaviour.scene import scene
from hornbill.errors import StoreFailed
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Sampled
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.database import FILE_NAME
from hornbill.store.store import Store
from hornbill.units import Uid

STALLED_S = 1.0
NEW = Recipe("BLA21-12U-A0", "1.300", servo_id=0, node_id=0)
LOCK = """
import sqlite3, sys
locked = sqlite3.connect(sys.argv[1], isolation_level=None)
locked.execute("BEGIN IMMEDIATE")
print("locked", flush=True)
sys.stdin.readline()
locked.execute("ROLLBACK")
"""
"""A process that locks a database file until it receives a line."""


def stops(folder: Path) -> int:
    """Stops that are in the audit of the database."""
    with closing(sqlite3.connect(folder / FILE_NAME)) as database:
        return int(database.execute("SELECT count(*) FROM audit WHERE action = 'stop'").fetchone()[0])


@asynccontextmanager
async def stalled(store: Store) -> AsyncGenerator[None]:
    """While it lasts, every use of the database blocks, and one on the event loop fails."""
    free = threading.Event()
    database: Any = store._database  # pyright: ignore[reportPrivateUsage]
    usable = database._usable

    @contextmanager
    def hanging() -> Generator[Any]:
        assert free.wait(60), "the event loop waited for the database"
        with usable() as engine:
            yield engine

    database._usable = hanging
    try:
        yield
    finally:
        free.set()
        database._usable = usable


@contextmanager
def disk_full(rig: Rig) -> Generator[None]:
    """While it lasts, nothing can be stored."""

    def full() -> Any:
        raise StoreFailed("The disk of the database is full. Free space on it.", cause=None)

    with pytest.MonkeyPatch.context() as broken:
        broken.setattr(rig.host.store._database, "_usable", contextmanager(full))  # pyright: ignore[reportPrivateUsage]
        yield


@scene(replace(PLAIN, rom={"timeout_time": 1000}), store=lambda tmp_path: str(tmp_path), behind=True)
async def test_motion_and_stop_do_not_wait_for_a_stalled_database(
    rig: Rig, servo: Servo, lease: str, tmp_path: Path
) -> None:
    command = {"type": "angle", "value": 20}
    store = rig.host.store
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command, lease=lease))
    async with stalled(store):
        before = len([one for one in rig.changes if isinstance(one, Sampled)])
        fed = len([1 for _, name, _ in rig.writes() if name == "0x00"])
        deadline = rig.host.base.now() + STALLED_S
        rig.sim(servo).faults.inject("sensor_weak", True)  # its history is stored, too
        path, body = f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 41}}
        change = asyncio.create_task(rig.call("PATCH", path, body, lease=lease))
        while rig.host.base.now() < deadline:
            await asyncio.sleep(0.01)
            assert rig.sim(servo).output == 0
            json(await rig.call("GET", "/servos"))
            json(await rig.call("GET", "/bus"))
        samples = len([one for one in rig.changes if isinstance(one, Sampled)]) - before
        assert samples > 5 * STALLED_S
        assert len([1 for _, name, _ in rig.writes() if name == "0x00"]) - fed >= STALLED_S
        stopped = json(await rig.call("POST", "/stop"))
        assert [one["confirmed"] for one in stopped["servos"]] == [True]
        assert rig.sim(servo).output == 1
        json(await rig.call("DELETE", "/stop"))
        assert not rig.events("command_ended")
        assert not change.done(), "nothing is written before its snapshot is stored"
    json(await change)
    rows = json(await rig.call("GET", "/audit"))
    assert [row["action"] for row in rows if row["action"] == "stop"], "it was stored later"
    assert [row["at"] for row in rows] == sorted((row["at"] for row in rows), reverse=True)


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_node_id_is_allocated_only_once_it_is_stored(rig: Rig, tmp_path: Path) -> None:
    await rig.ready()
    async with stalled(rig.host.store):
        made = rig.bench.add(NEW)
        uid = Uid(made.uid.hex())
        await until(lambda: uid in rig.host.store.allocations.entries(), 20)
        deadline = rig.host.base.now() + STALLED_S
        while rig.host.base.now() < deadline:
            await asyncio.sleep(0.01)
            assert made.node_id == 0, "it is not stored yet"
    await until(lambda: made.node_id, 20)
    given = rig.host.store.allocations.entries()[uid]
    assert made.node_id == given
    with Store(tmp_path) as other:
        assert other.allocations.entries()[uid] == given
    allocated = [one.text for one in rig.events("allocated") if uid[:8] in one.text]
    assert len(allocated) == 1, "one response, however often the servo requests"


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_node_id_that_cannot_be_stored_is_not_allocated(rig: Rig, tmp_path: Path) -> None:
    await rig.ready()
    with disk_full(rig):
        made = rig.bench.add(NEW)
        await until(lambda: rig.events("no_node_id"), 20)
        assert made.node_id == 0
        assert len(rig.events("store_failed")) == 1, "reported once"
    await until(lambda: made.node_id, 20)


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_stop_does_not_wait_for_a_process_that_locks_the_database_and_is_stored_later(
    rig: Rig, servo: Servo, lease: str, tmp_path: Path
) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 20}, lease=lease))
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", LOCK, str(tmp_path / FILE_NAME), stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        assert process.stdout is not None
        assert await process.stdout.readline() == b"locked\n"
        json(await rig.call("PUT", f"/leases/{lease}"))
        stopped = json(await rig.call("POST", "/stop"))
        assert [one["confirmed"] for one in stopped["servos"]] == [True]
        assert stops(tmp_path) == 0, "it is still locked"
    finally:
        await process.communicate(b"\n")
    await rig.host.store.settled()
    assert stops(tmp_path) == 1
    assert not rig.events("store_failed")


def test_a_stop_that_could_not_be_stored_is_stored_when_the_server_exits(tmp_path: Path) -> None:
    async def first(rig: Rig) -> None:
        await rig.ready()
        with disk_full(rig):
            json(await rig.call("POST", "/stop"))
            await until(lambda: any("would lose it" in one.text for one in rig.events("store_failed")), 20)

    async def second(rig: Rig) -> None:
        assert json(await rig.call("GET", "/stop"))["latched"] is True

    play(first, store=str(tmp_path), behind=True)
    play(second, store=str(tmp_path), behind=True, connect=False)


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_request_repeated_in_a_stall_is_executed_once(rig: Rig, servo: Servo, tmp_path: Path) -> None:
    path = f"/servos/{servo.uid}/restart?wait=true"
    async with stalled(rig.host.store):
        both = [asyncio.create_task(rig.call("POST", path, **{"Idempotency-Key": "one"})) for _ in range(2)]
        await asyncio.sleep(0.1)
    responses = [json(await one) for one in both]
    assert responses[0] == responses[1]
    assert responses[0]["state"] == "succeeded"
    assert len([job for job in rig.host.jobs.all() if job.kind == "restart"]) == 1


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_change_that_cannot_be_stored_is_refused_and_not_shown(rig: Rig, tmp_path: Path) -> None:
    servo = (await rig.ready())[0]
    json(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "rudder"}))
    with disk_full(rig):
        for verb, path, body in (
            ("PATCH", f"/servos/{servo.uid}", {"label": "elbow"}),
            ("PUT", "/profiles/gains", {"values": {"angle_p_gain": 50}}),
            ("PUT", f"/allocations/{servo.uid}", {"node_id": 99}),
        ):
            problem(await rig.call(verb, path, body), "store_failed", 500)
    assert json(await rig.call("GET", f"/servos/{servo.uid}"))["label"] == "rudder"
    assert json(await rig.call("GET", "/profiles")) == []
    assert json(await rig.call("GET", "/allocations"))["allocations"] == []
    with Store(tmp_path) as other:
        stored = other.servos.get(servo.uid)
        assert stored is not None
        assert stored.label == "rudder"


def test_changes_are_stored_at_exit_and_loaded_at_the_next_start(tmp_path: Path) -> None:
    async def first(rig: Rig) -> str:
        servo = (await rig.ready())[0]
        json(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "rudder"}))
        json(await rig.call("PUT", "/profiles/gains", {"values": {"angle_p_gain": 50}}), 201)
        done = json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
        json(await rig.call("POST", "/stop"))
        return str(done["id"])

    async def second(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        assert servo.label == "rudder"
        assert [one["name"] for one in json(await rig.call("GET", "/profiles"))] == ["gains"]
        assert json(await rig.call("GET", "/stop"))["latched"] is True
        assert json(await rig.call("GET", f"/jobs/{job}"))["state"] == "succeeded"
        assert {row["action"] for row in json(await rig.call("GET", "/audit"))} >= {"label", "profile", "stop"}

    job = play(first, store=str(tmp_path), behind=True)
    play(second, store=str(tmp_path), behind=True)
