"""A PostgreSQL server that hangs or is stopped: a bench keeps working, and nothing is lost."""

import asyncio
from collections.abc import AsyncGenerator, Iterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from behaviour.actions import by_servo_id
from behaviour.rig import PLAIN, Response, Rig, json, play, problem, until
from hornbill.api.addressing import resolve
from hornbill.store.store import Store
from hornbill.units import Uid
from unit.store.postgres import Cluster, Missing

pytest.importorskip("psycopg", reason="psycopg is not installed")

SPARE = Uid("5a" * 16)
MOVES, SAVES = replace(PLAIN, servo_id=1, node_id=11), replace(PLAIN, servo_id=2, node_id=12)
GAINS = [41, 42, 43, 44, 45]
LAG_S = 1.0
"""Far below the time for which the database hangs, and far above what a busy machine causes."""


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    try:
        with Cluster() as started:
            yield started
    except Missing as missing:
        pytest.skip(f"no PostgreSQL: {missing}")


@asynccontextmanager
async def away(cluster: Cluster, how: str) -> AsyncGenerator[None]:
    """The database hangs or is stopped while it lasts."""
    await asyncio.to_thread(cluster.suspend if how == "hangs" else cluster.stop)
    try:
        yield
    finally:
        await asyncio.to_thread(cluster.resume if how == "hangs" else cluster.start)


async def move(rig: Rig, uid: str, lease: str, lags: list[float], angles: set[float]) -> None:
    """Move a servo until cancelled; note the delays of the event loop."""
    loop = asyncio.get_running_loop()
    number = 0
    while True:
        number += 1
        command = {"type": "angle", "value": 20 * (number // 10 % 2)}
        json(await rig.call("POST", f"/servos/{uid}/command", command, lease=lease))
        angles.add(round(rig.bench.servo(Uid(uid)).angle_deg))
        due = loop.time() + 0.05
        await asyncio.sleep(0.05)
        lags.append(loop.time() - due)


@pytest.mark.real_time
@pytest.mark.parametrize("how", ["hangs", pytest.param("is stopped", marks=pytest.mark.release)])
def test_a_bench_works_without_its_database_and_stores_everything_later(cluster: Cluster, how: str) -> None:
    lags: list[float] = []
    angles: set[float] = set()

    async def save(rig: Rig, uid: str, key: str, lease: str | None = None) -> Response:
        return await rig.call(
            "POST",
            f"/servos/{uid}/save?wait=true",
            lease=lease,
            **{"Idempotency-Key": f"{how} {key}".replace(" ", "-")},
        )

    async def first(rig: Rig) -> Response:
        moving, saving = by_servo_id(await rig.ready(2))
        store, began = rig.host.store, rig.walls()
        lease = await rig.lease()
        before = await save(rig, saving.uid, "before", lease)
        await store.run(store.servos.set_label, SPARE, "spare")
        path = f"/servos/{saving.uid}/parameters"
        async with away(cluster, how):
            mover = asyncio.create_task(move(rig, moving.uid, lease, lags, angles))
            for gain in GAINS:
                json(await rig.call("PATCH", path, {"values": {"angle_p_gain": gain}}, lease=lease))
            during = await save(rig, saving.uid, "during", lease)
            assert json(during)["state"] == "succeeded"
            for one, key in ((before, "before"), (during, "during")):
                again = await save(rig, saving.uid, key, lease)
                assert (again.content, again.headers["idempotency-replayed"]) == (one.content, "true")
            problem(await rig.call("PATCH", f"/servos/{saving.uid}", {"label": how}), "store_failed", 500)
            assert resolve(rig.host, "spare") == SPARE
            assert not mover.done()
            mover.cancel()
            stopped = json(await rig.call("POST", "/stop"))
            assert [one["confirmed"] for one in stopped["servos"]] == [True, True]
            json(await rig.call("DELETE", "/stop"))
            assert store.pending > len(GAINS)
            assert store.failing_since is not None
        await until(lambda: store.pending == 0, 60)
        await until(lambda: store.failing_since is None, 60)
        assert store.lost == 0
        rows = [row for row in reversed(await store.run(store.audit.rows)) if row.at >= began]
        assert [row.entry.after for row in rows if row.entry.action == "write"] == GAINS
        told = [(row.entry.action, row.entry.outcome) for row in rows if row.entry.action in ("save", "stop", "label")]
        assert told == [("save", "succeeded"), ("save", "succeeded"), ("stop", "pressed"), ("stop", "cleared")]
        assert [row.at for row in rows] == sorted(row.at for row in rows)
        with Store(cluster.url) as other:
            jobs = {job.id: job.state for job in other.jobs.all()}
            assert jobs[json(before)["id"]] == jobs[json(during)["id"]] == "succeeded"
            stored = other.servos.get(saving.uid)
            assert stored is not None
            assert (stored.label, stored.rom["angle_p_gain"]) == ("", GAINS[-1])
        return during

    async def second(rig: Rig) -> Response:
        saving = by_servo_id(await rig.ready(2))[1]
        return await save(rig, saving.uid, "during")

    during = play(first, MOVES, SAVES, store=cluster.url, behind=True)
    assert max(lags) < LAG_S
    assert len(angles) > 5, "it moved"
    again = play(second, MOVES, SAVES, store=cluster.url, behind=True)
    assert (again.content, again.headers["idempotency-replayed"]) == (during.content, "true")
