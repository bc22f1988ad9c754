"""Write-behind: changes are visible immediately, and written to the database in order without blocking."""

import asyncio
import contextlib
import subprocess
import sys
import threading
import time
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import event

from hornbill.errors import InvalidValue, StoreFailed, Unknown
from hornbill.store import responses, write_behind
from hornbill.store.audit import NewAuditEntry
from hornbill.store.faults import FaultReading
from hornbill.store.jobs import StoredJob
from hornbill.store.responses import Begun, StoredResponse
from hornbill.store.servos import ServoFacts, StoredServo
from hornbill.store.store import Store
from hornbill.units import NodeId, Uid

pytestmark = pytest.mark.real_time

UID, OTHER = Uid("ab" * 16), Uid("cd" * 16)


class Gate:
    """Blocks every call to a database while it is closed, or makes it fail."""

    def __init__(self, store: Store) -> None:
        self._free = threading.Event()
        self._free.set()
        self._committing = threading.Event()
        self._committing.set()
        self.error: Exception | None = None
        database: Any = store._database  # pyright: ignore[reportPrivateUsage]
        self._usable = database._usable
        database._usable = self._enter

        event.listen(database._engine, "commit", self._at_commit)

    def _at_commit(self, _connection: object) -> None:
        assert self._committing.wait(60), "the event loop was blocked"

    def _enter(self) -> Any:
        assert self._free.wait(60), "the event loop was blocked"
        if self.error is not None:
            raise self.error
        return self._usable()

    def close(self) -> None:
        self._free.clear()

    def close_commits(self) -> None:
        """Block calls at their end only."""
        self._committing.clear()

    def open(self) -> None:
        self._free.set()
        self._committing.set()


@asynccontextmanager
async def behind(place: str, wall: Callable[[], float] = lambda: 5.0) -> AsyncGenerator[tuple[Store, Gate]]:
    """A store that writes behind, closed and completely written afterwards."""
    with Store(place, wall=wall) as store:
        store.begin()
        gate = Gate(store)
        try:
            yield store, gate
        finally:
            gate.error = None
            gate.open()


def stored(store: Store) -> StoredServo:
    servo = store.servos.get(UID)
    assert servo is not None
    return servo


async def test_tables_are_loaded_at_the_start_and_usable_while_the_database_is_blocked(place: str) -> None:
    async with behind(place) as (store, gate):
        gate.close()
        store.servos.seen(UID, ServoFacts(model="M", firmware=1300))
        for number in range(20):
            store.servos.put_rom(UID, {"angle_p_gain": number})
            store.settings.put("latest", number)
        store.servos.set_label(UID, "rudder")
        store.allocations.record(UID, NodeId(20))
        store.profiles.put("gains", {"values": {}})
        store.faults.record(FaultReading(UID, 5.0, appeared=frozenset(["voltage_low"])))
        servo = stored(store)
        assert (servo.label, servo.rom, servo.facts.model) == ("rudder", {"angle_p_gain": 19}, "M")
        assert store.settings.get("latest") == 19
        assert store.allocations.entries() == {UID: 20}
        assert [one.name for one in store.profiles.all()] == ["gains"]
        assert list(store.faults.of(UID)) == ["voltage_low"]
        assert [one.uid for one in store.servos.all(but=[OTHER])] == [UID]
    with Store(place) as again:
        servo = stored(again)
        assert (servo.label, servo.rom, servo.facts.firmware) == ("rudder", {"angle_p_gain": 19}, 1300)
        assert again.settings.get("latest") == 19
        rows = again.servos.all(), again.allocations.rows(), again.profiles.all(), again.faults.of(UID)
    assert all(rows)

    async with behind(place) as (store, gate):
        gate.close()
        assert (store.servos.all(), store.allocations.rows(), store.profiles.all(), store.faults.of(UID)) == rows
        assert store.settings.get("latest") == 19


async def test_a_read_from_the_database_follows_earlier_changes(place: str) -> None:
    async with behind(place) as (store, gate):
        gate.close()
        for number in range(10):
            store.audit.add([NewAuditEntry("Ada", "write", "applied", UID, after=number)])
        reading = asyncio.create_task(store.run(store.audit.rows))
        await asyncio.sleep(0)
        assert not reading.done()
        gate.open()
        assert [row.entry.after for row in await reading] == list(reversed(range(10)))


async def test_rows_have_the_time_of_the_change_not_of_the_write(place: str) -> None:
    now = 100.0

    async with behind(place, lambda: now) as (store, gate):
        gate.close()
        store.audit.add([NewAuditEntry("Ada", "write", "applied")])
        store.servos.seen(UID)
        now = 9000.0
        gate.open()
        assert [row.at for row in await store.run(store.audit.rows)] == [100.0]
    with Store(place) as again:
        assert stored(again).last_seen == 100.0


async def test_an_awaited_change_is_made_in_the_database_or_fails(place: str) -> None:
    async with behind(place) as (store, gate):
        await store.run(store.servos.set_label, UID, "rudder")
        gate.error = StoreFailed("The disk is full.", cause=None)
        with pytest.raises(StoreFailed):
            await store.run(store.servos.set_label, UID, "elbow")
        with pytest.raises(StoreFailed):
            await store.run(store.profiles.put, "gains", {})
        servo = stored(store)
        assert (servo.label, store.profiles.all()) == ("rudder", [])
        gate.error = None
        with pytest.raises(Unknown):
            await store.run(store.profiles.drop, "gains")
        await store.run(store.allocations.record, OTHER, NodeId(9))
        with pytest.raises(InvalidValue):
            await store.run(store.allocations.pin, UID, NodeId(9))
        assert store.allocations.entries() == {OTHER: 9}


async def test_cancelling_an_awaited_change_leaves_it_complete(place: str) -> None:
    async with behind(place) as (store, gate):
        gate.close()
        waiting = asyncio.create_task(store.run(store.servos.set_label, UID, "rudder"))
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        gate.open()
        await store.settled()
        while store.servos.get(UID) is None:
            await asyncio.sleep(0)
    with Store(place) as again:
        assert stored(again).label == "rudder"


async def test_listeners_receive_failed_writes_and_the_next_success(place: str) -> None:
    async with behind(place) as (store, gate):
        results: list[Exception | None] = []
        store.listen(results.append)
        gate.error = failure = StoreFailed("The disk is full.", cause=None)
        job = StoredJob("1", "save", UID, "running", 1.0, None, None, {"steps": []})
        store.jobs.put(job)
        store.settings.put("one", 1)
        while len(results) < 2:
            await asyncio.sleep(0)
        assert results == [failure, failure]
        gate.error = None
        store.jobs.put(job)
        assert store.posted(store.jobs) is not None
        while len(results) < 3:
            await asyncio.sleep(0)
        assert results[2] is None
        assert [one.id for one in await store.run(store.jobs.all)] == ["1"]


async def test_without_a_server_every_change_is_written_immediately(place: str) -> None:
    with Store(place) as store, Store(place) as other:
        store.servos.set_label(UID, "rudder")
        assert other.servos.get(UID) == store.servos.get(UID)
        assert store.posted(store.servos) is None
        assert await store.run(store.servos.get, UID) == store.servos.get(UID)


async def resumed(store: Store) -> None:
    """Wait until the database responds and everything is written."""
    async with asyncio.timeout(20):
        while True:
            with contextlib.suppress(StoreFailed):
                return await store.settled()
            await asyncio.sleep(0.01)


async def timed_out(call: Awaitable[object], within_s: float) -> None:
    """Await a call, which must fail within this time, because the database does not respond."""
    began = time.monotonic()
    with pytest.raises(StoreFailed) as caught:
        await call
    assert (caught.value.facts["cause"], caught.value.facts["retry"]) == ("store_timeout", True)
    assert time.monotonic() - began < within_s


async def test_a_hanging_database_fails_calls_and_keeps_changes(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert write_behind.RESPONSE_S == 2.0
    monkeypatch.setattr(write_behind, "RESPONSE_S", 0.3)
    async with behind(place) as (store, gate):
        await store.run(store.servos.set_label, UID, "rudder")
        gate.close()
        store.settings.put("one", 1)
        store.audit.add([NewAuditEntry("Ada", "write", "applied", UID, after=1)])
        await timed_out(store.run(store.audit.rows), 5.0)
        for _ in range(200):  # at once, because it is known to hang
            await timed_out(store.run(store.servos.set_label, UID, "elbow"), 0.3)
        store.audit.add([NewAuditEntry("Ada", "write", "applied", UID, after=2)])
        assert store.failing_since is not None
        assert store.pending == 3
        gate.open()
        await resumed(store)
        assert (store.pending, store.lost, store.failing_since) == (0, 0, None)
        assert [row.entry.after for row in await store.run(store.audit.rows)] == [2, 1]
        assert stored(store).label == "rudder"
    with Store(place) as again:
        assert stored(again).label == "rudder", "what failed was not made later"


async def test_a_call_that_hangs_is_rolled_back_unless_it_is_being_committed(
    place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(write_behind, "RESPONSE_S", 0.3)
    async with behind(place) as (store, gate):
        for close, label in ((gate.close, ""), (gate.close_commits, "rudder")):
            await store.run(store.servos.set_label, UID, "")
            close()
            await timed_out(store.run(store.servos.set_label, UID, "rudder"), 5.0)
            gate.open()
            await resumed(store)
            assert stored(store).label == label
            with Store(place) as other:
                assert stored(other).label == label


async def test_keys_of_this_process_are_known_while_the_database_hangs(
    place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(write_behind, "RESPONSE_S", 0.3)
    first, second = StoredResponse(200, {}, b"first"), StoredResponse(200, {}, b"second")
    async with behind(place) as (store, _):
        assert await store.keys.begin("earlier", "r") is None
        await store.keys.end("earlier", first)
    async with behind(place) as (store, gate):
        assert await store.keys.begin("known", "r") is None
        await store.keys.end("known", first)
        gate.close()
        assert await store.keys.begin("known", "r") == Begun("r", True, first)
        assert await store.keys.begin("new", "r") is None
        await store.keys.end("new", first)
        assert await store.keys.begin("new", "r") == Begun("r", True, first)
        assert await store.keys.begin("earlier", "r") is None, "only the database knows it"
        await store.keys.end("earlier", second)
        gate.open()
        await resumed(store)
        assert store.lost == 0
        gate.error = StoreFailed("The disk is full.", cause=None)
        with pytest.raises(StoreFailed):
            await store.keys.begin("refused", "r")
    with Store(place) as again:
        for key in ("earlier", "known", "new"):
            assert again.responses.begin(key, "r") == Begun("r", False, first), key


async def test_the_oldest_keys_in_memory_are_left_to_the_database(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(responses, "MAX_BYTES", 10_000)
    monkeypatch.setattr(write_behind, "RESPONSE_S", 0.3)
    large = StoredResponse(200, {}, bytes(4000))
    async with behind(place) as (store, gate):
        for key in "abcd":
            assert await store.keys.begin(key, "r") is None
            await store.keys.end(key, large)
        assert await store.keys.begin("a", "r") == Begun("r", True, large), "from the database"
        gate.close()
        assert await store.keys.begin("d", "r") == Begun("r", True, large)
        assert await store.keys.begin("a", "r") is None


async def test_more_changes_than_memory_keeps_end_with_an_error(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(write_behind, "MAX_PENDING", 3)
    async with behind(place) as (store, gate):
        gate.close()
        posted: list[Any] = []
        for number in range(5):
            store.settings.put("latest", number)
            posted.append(store.posted(store.settings))
        for dropped in posted[:2]:
            with pytest.raises(StoreFailed, match="More than 3 changes"):
                await asyncio.wait_for(dropped, 5)
        assert not any(kept.done() for kept in posted[2:])
        assert (store.pending, store.lost) == (3, 2)


HANGING = """
import asyncio, sys, time
from hornbill.store import write_behind
from hornbill.store.store import Store

write_behind.CLOSE_S = 0.2

async def main():
    with Store(sys.argv[1]) as store:
        store.begin()
        store._database._usable = lambda: time.sleep(60)
        for number in range(3):
            store.settings.put("latest", number)

asyncio.run(main())
"""
"""A server that ends while a call to its database never returns."""


def test_a_process_ends_while_its_database_hangs_and_says_what_is_lost(tmp_path: Path) -> None:
    assert write_behind.CLOSE_S == 5.0
    done = subprocess.run(
        [sys.executable, "-c", HANGING, tmp_path], capture_output=True, text=True, timeout=30, check=True
    )
    assert "3 changes could not be stored and are lost, because the database has not responded" in done.stderr
