"""A database that hangs: nothing on the bus waits for it, and what was changed meanwhile follows in order."""

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

from behaviour.rig import PLAIN, Rig, json, play, problem
from behaviour.scene import scene
from hornbill.errors import StoreFailed
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Sampled
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.database import FILE_NAME
from hornbill.store.store import Store
from hornbill.units import Uid

STALLED_S = 2.0
NEW = Recipe("BLA21-12U-A0", "1.300", servo_id=0, node_id=0)
HOLD = """
import sqlite3, sys
held = sqlite3.connect(sys.argv[1], isolation_level=None)
held.execute("BEGIN IMMEDIATE")
print("held", flush=True)
sys.stdin.readline()
held.execute("ROLLBACK")
"""
"""A process that writes to a database file, and takes until it is told."""


def stops(folder: Path) -> int:
    """Stops that are in the audit of the database."""
    with closing(sqlite3.connect(folder / FILE_NAME)) as database:
        return int(database.execute("SELECT count(*) FROM audit WHERE action = 'stop'").fetchone()[0])


@asynccontextmanager
async def stalled(store: Store) -> AsyncGenerator[None]:
    """While it lasts, the database answers nobody; whoever waits for it on the event loop waits for ever."""
    free = threading.Event()
    database: Any = store._database  # pyright: ignore[reportPrivateUsage]
    usable = database._usable

    @contextmanager
    def hanging() -> Generator[Any]:
        assert free.wait(60), "the database was waited for on the event loop"
        with usable() as engine:
            yield engine

    database._usable = hanging
    try:
        yield
    finally:
        free.set()
        database._usable = usable


@scene(replace(PLAIN, rom={"timeout_time": 1000}), store=lambda tmp_path: str(tmp_path), behind=True)
async def test_no_keep_alive_sample_or_stop_waits_for_a_database_that_hangs(
    rig: Rig, servo: Servo, tmp_path: Path
) -> None:
    lease = await rig.lease()
    command = {"type": "angle", "value": 20}
    store = rig.host.store
    json(await rig.call("POST", f"/servos/{servo.uid}/command", command, lease=lease))
    async with stalled(store):
        before = len([one for one in rig.changes if isinstance(one, Sampled)])
        fed = len([1 for _, name, _ in rig.writes() if name == "0x00"])
        until = rig.host.base.now() + STALLED_S
        rig.sim(servo).faults.inject("sensor_weak", True)  # its history is to be kept, too
        path, body = f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 41}}
        change = asyncio.create_task(rig.call("PATCH", path, body, lease=lease))
        while rig.host.base.now() < until:
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
        assert not change.done(), "nothing is written before its snapshot is kept"
    json(await change)
    rows = json(await rig.call("GET", "/audit"))
    assert [row["action"] for row in rows if row["action"] == "stop"], "it followed"
    assert [row["at"] for row in rows] == sorted((row["at"] for row in rows), reverse=True)


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_node_id_is_given_only_when_the_table_has_it_for_good(rig: Rig, tmp_path: Path) -> None:
    await rig.ready()
    async with stalled(rig.host.store):
        made = rig.bench.add(NEW)
        uid = Uid(made.uid.hex())
        async with asyncio.timeout(20):
            while uid not in rig.host.store.allocations.entries():
                await asyncio.sleep(0.01)
        until = rig.host.base.now() + STALLED_S
        while rig.host.base.now() < until:
            await asyncio.sleep(0.01)
            assert made.node_id == 0, "nobody has written it down yet"
    async with asyncio.timeout(20):
        while made.node_id == 0:
            await asyncio.sleep(0.01)
    given = rig.host.store.allocations.entries()[uid]
    assert made.node_id == given
    with Store(tmp_path) as other:
        assert other.allocations.entries()[uid] == given
    told = [one.text for one in rig.events("allocated") if uid[:8] in one.text]
    assert len(told) == 1, "answered once, however often it asked"


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_an_id_that_cannot_be_kept_is_not_given(
    rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full() -> Any:
        raise StoreFailed("The disk of the database is full. Make room.", cause=None)

    await rig.ready()
    with monkeypatch.context() as broken:
        broken.setattr(rig.host.store._database, "_usable", contextmanager(full))  # pyright: ignore[reportPrivateUsage]
        made = rig.bench.add(NEW)
        async with asyncio.timeout(20):
            while not rig.events("no_node_id"):
                await asyncio.sleep(0.01)
        assert made.node_id == 0
        assert len(rig.events("store_failed")) == 1, "said once"
    async with asyncio.timeout(20):
        while made.node_id == 0:
            await asyncio.sleep(0.01)


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_stop_does_not_wait_for_another_process_that_holds_the_database_and_is_kept_when_it_lets_go(
    rig: Rig,
    servo: Servo,
    tmp_path: Path,
) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 20}, lease=lease))
    holder = await asyncio.create_subprocess_exec(
        sys.executable, "-c", HOLD, str(tmp_path / FILE_NAME), stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        assert holder.stdout is not None
        assert await holder.stdout.readline() == b"held\n"
        json(await rig.call("PUT", f"/leases/{lease}"))
        stopped = json(await rig.call("POST", "/stop"))
        assert [one["confirmed"] for one in stopped["servos"]] == [True]
        assert stops(tmp_path) == 0, "it is still held"
    finally:
        await holder.communicate(b"\n")
    await rig.host.store.settled()
    assert stops(tmp_path) == 1
    assert not rig.events("store_failed")


def test_a_stop_that_cannot_be_stored_at_once_is_stored_when_the_server_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def first(rig: Rig) -> None:
        def full() -> Any:
            raise StoreFailed("The disk of the database is full. Make room.", cause=None)

        await rig.ready()
        with monkeypatch.context() as broken:
            broken.setattr(rig.host.store._database, "_usable", contextmanager(full))  # pyright: ignore[reportPrivateUsage]
            json(await rig.call("POST", "/stop"))
            async with asyncio.timeout(20):
                while not any("would not know of it" in one.text for one in rig.events("store_failed")):
                    await asyncio.sleep(0.01)

    async def second(rig: Rig) -> None:
        assert json(await rig.call("GET", "/stop"))["latched"] is True

    play(first, store=str(tmp_path), behind=True)
    play(second, store=str(tmp_path), behind=True, connect=False)


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_request_that_is_sent_twice_while_the_database_hangs_is_done_once(
    rig: Rig, servo: Servo, tmp_path: Path
) -> None:
    path = f"/servos/{servo.uid}/restart?wait=true"
    async with stalled(rig.host.store):
        both = [asyncio.create_task(rig.call("POST", path, **{"Idempotency-Key": "one"})) for _ in range(2)]
        await asyncio.sleep(0.1)
    answers = [json(await one) for one in both]
    assert answers[0] == answers[1]
    assert answers[0]["state"] == "succeeded"
    assert len([job for job in rig.host.jobs.all() if job.kind == "restart"]) == 1


@scene(store=lambda tmp_path: str(tmp_path), behind=True)
async def test_a_change_that_cannot_be_stored_is_refused_and_not_shown(
    rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full() -> Any:
        raise StoreFailed("The disk of the database is full. Make room.", cause=None)

    servo = (await rig.ready())[0]
    json(await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "rudder"}))
    with monkeypatch.context() as broken:
        broken.setattr(rig.host.store._database, "_usable", contextmanager(full))  # pyright: ignore[reportPrivateUsage]
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
        kept = other.servos.get(servo.uid)
        assert kept is not None
        assert kept.label == "rudder"


def test_what_is_changed_is_in_the_database_when_it_is_closed_and_read_again_at_the_next_start(tmp_path: Path) -> None:
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
