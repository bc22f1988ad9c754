"""Several benches in one database: the lock of a name, what is shared, and a database that is away for a while."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import update

from behaviour.rig import until
from hornbill.errors import StoreFailed
from hornbill.store.audit import NewAuditEntry
from hornbill.store.benches import NO_CONTACT_S
from hornbill.store.jobs import StoredJob
from hornbill.store.store import Store
from hornbill.store.tables import BENCHES
from hornbill.units import NodeId, Uid

pytestmark = pytest.mark.real_time

A = Uid("a0" * 16)
JOB = StoredJob("j1", "save", A, "running", 1.0, None, None, {"steps": []})
SERVER = """
import sys
from hornbill.store.store import Store
store = Store(sys.argv[1], bench="left")
store.benches.claim()
print("claimed", flush=True)
sys.stdin.readline()
store.benches.release()
store.close()
"""
"""A server that has the lock until it receives a line."""


def server(place: str) -> "subprocess.Popen[str]":
    process = subprocess.Popen(
        [sys.executable, "-c", SERVER, place], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3] / "server")},
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "claimed\n"
    return process


async def refused(place: str) -> StoreFailed:
    """The error of a second server for the same bench."""
    with Store(place, bench="left") as store:
        with pytest.raises(StoreFailed) as caught:
            store.begin()
        return caught.value


async def test_a_second_server_of_a_bench_is_refused_until_the_first_ends_or_is_killed(place: str) -> None:
    for kill in (False, True):
        with server(place) as first:
            error = await refused(place)
            facts = {name: error.facts[name] for name in ("cause", "bench", "pid")}
            assert facts == {"cause": "bench_in_use", "bench": "left", "pid": first.pid}
            assert f"process {first.pid}, since " in error.detail
            with Store(place, bench="right") as other:
                other.begin()
                states = {one.name: one.state for one in other.benches.all()}
                assert states == {"left": "online", "right": "online"}
            first.kill() if kill else first.communicate("\n")
        with Store(place, bench="left") as second:
            second.begin()


async def test_a_bench_without_contact_can_be_taken_over_from_another_computer(place: str) -> None:
    with Store(place, bench="left") as first:
        first.begin()

        def lost(contact_s: float) -> None:
            with first._database.transaction() as connection:  # pyright: ignore[reportPrivateUsage]
                change = {"machine": "another", "contact": BENCHES.c.contact - contact_s}
                connection.execute(update(BENCHES).where(BENCHES.c.name == "left").values(change))

        lost(NO_CONTACT_S / 2)
        await refused(place)
        lost(NO_CONTACT_S)
        with Store(place, bench="right") as other:
            other.begin()
            assert {one.name: one.state for one in other.benches.all()}["left"] == "no_contact"
        with Store(place, bench="left") as second:
            second.begin()
            assert not first.benches.contact(None, {}), "it lost its bench"


async def test_benches_have_their_own_jobs_ids_and_settings_and_share_the_rest(place: str) -> None:
    with Store(place, bench="left") as left, Store(place, bench="right") as right:
        left.begin()
        right.begin()
        for store, node in ((left, 20), (right, 20)):
            await store.run(store.allocations.pin, A, NodeId(node))
            store.settings.put("stop", store.bench)
            await store.settled()
        left.jobs.put(JOB)
        left.servos.seen(A)
        left.audit.add([NewAuditEntry("me", "write", "applied", A)])
        assert await left.run(left.responses.begin, "key", "request") is None
        assert await right.run(right.responses.begin, "key", "other request") is None
        assert await right.run(right.jobs.all) == []
        assert left.settings.own_unique_id() != right.settings.own_unique_id()
        assert [(one.settings.get("stop"), one.allocations.entries()) for one in (left, right)] == [
            ("left", {A: 20}), ("right", {A: 20}),
        ]  # fmt: skip
        await left.settled()
        assert [one.bench for one in await right.run(right.audit.rows)] == ["left"]


async def test_changes_of_another_bench_or_process_are_read_when_they_happen(place: str) -> None:
    with Store(place, bench="left") as left, Store(place, bench="right") as right:
        left.begin()
        right.begin()
        changed: list[str] = []
        right.on_changed(changed.append)
        await right.refresh()
        assert not changed
        await left.run(left.servos.set_label, A, "rudder")
        await left.run(left.profiles.put, "gains", {"a": 1})
        with Store(place, bench="tool") as tool:
            tool.tokens.add("rig", "view")
        await right.refresh()
        assert sorted(changed) == ["profiles", "servos", "tokens"]
        servo = right.servos.get(A)
        assert servo is not None
        assert (servo.label, right.profiles.get("gains").bench) == ("rudder", "left")
        await right.run(right.servos.set_label, A, "elevator")
        await right.refresh()
        assert len(changed) == 3, "its own changes are not read again"
        await left.refresh()
        await left.run(left.servos.forget, A)
        await right.refresh()
        assert right.servos.get(A) is None


async def test_changes_wait_in_order_while_the_database_is_away(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with Store(place, bench="left") as store:
        store.begin()
        database: Any = store._database  # pyright: ignore[reportPrivateUsage]

        def away() -> Any:
            raise StoreFailed("The database is away.", cause="store_timeout")

        with monkeypatch.context() as broken:
            broken.setattr(database, "_usable", away)
            for number in range(50):
                store.settings.put("one", number)
                store.audit.add([NewAuditEntry("me", "write", "applied", A, requested=number)])
            await until(lambda: store.failing_since is not None)
            assert store.pending == 100
            assert store.settings.get("one") == 49
            with pytest.raises(StoreFailed):
                await store.run(store.servos.set_label, A, "rudder")
            assert store.servos.get(A) is None, "a change that was refused is not shown"
        await until(lambda: store.pending == 0)
        assert (store.failing_since, store.lost) == (None, 0)
        rows = await store.run(store.audit.rows)
        assert [row.entry.requested for row in rows] == list(reversed(range(50)))
    with Store(place, bench="left") as again:
        assert again.settings.get("one") == 49


async def test_a_change_that_the_database_rejects_does_not_delay_others(place: str) -> None:
    with Store(place, bench="left") as store:
        store.begin()
        store.audit.add([NewAuditEntry(None, "write", "applied")])  # pyright: ignore[reportArgumentType]
        store.settings.put("one", 1)
        await store.settled()
        assert (store.lost, store.pending) == (1, 0)
        assert store.settings.get("one") == 1
