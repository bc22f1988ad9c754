"""Opening, migrating, sharing and losing a database."""

import gc
import json
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, create_engine, text

import hornbill
from hornbill.domain.note import Note
from hornbill.errors import StoreFailed
from hornbill.store import database as databases
from hornbill.store import migrate
from hornbill.store.allocations import AllocationEntry
from hornbill.store.audit import NewAuditEntry
from hornbill.store.database import FILE_NAME
from hornbill.store.servos import ServoFacts, StoredServo
from hornbill.store.store import Store
from hornbill.store.tables import METADATA
from hornbill.units import NodeId, Uid

A = Uid("a0" * 16)
SERVER = Path(hornbill.__file__).parent.parent


@contextmanager
def connected(place: str) -> Generator[Connection]:
    """One transaction without `Store`."""
    if "://" in place:
        engine = create_engine(place.replace("postgresql://", "postgresql+psycopg://"))
    else:
        Path(place).mkdir(exist_ok=True)
        engine = create_engine(f"sqlite:///{place}/{FILE_NAME}")
    try:
        with engine.begin() as connection:
            yield connection
    finally:
        engine.dispose()


def execute(place: str, statement: str) -> None:
    with connected(place) as connection:
        connection.execute(text(statement))


def rows(folder: Path, query: str) -> list[Any]:
    with connected(str(folder)) as connection:
        return [tuple(row) for row in connection.execute(text(query))]


def migrations(connection: Connection) -> Config:
    """The configuration of Alembic for a database."""
    config = Config()
    config.set_main_option("script_location", str(Path(migrate.__file__).parent / "migrations"))
    config.attributes["connection"] = connection
    config.attributes["bench"] = "first"
    return config


@contextmanager
def of_version(place: str, version: str) -> Generator[Callable[..., None]]:
    """A new database with the tables of a version; called with a table and its columns, it inserts a row."""

    def insert(table: str, **columns: object) -> None:
        values = {name: json.dumps(one) if isinstance(one, dict | list) else one for name, one in columns.items()}
        names = ", ".join(f'"{name}"' for name in values)
        places = ", ".join(f":{name}" for name in values)
        connection.execute(text(f"INSERT INTO {table} ({names}) VALUES ({places})"), values)

    with connected(place) as connection:
        command.upgrade(migrations(connection), version)
        yield insert


def test_a_place_is_a_folder_a_url_or_memory(tmp_path: Path) -> None:
    folder, url = tmp_path / "some" / "where new?#%41", f"sqlite:///{tmp_path / 'other.db'}"
    for place in (str(folder), url):
        with Store(place) as store:
            store.allocations.record(A, NodeId(125))
        with Store(place) as store:
            assert store.allocations.entries() == {A: 125}
    assert (folder / FILE_NAME).is_file()
    assert (tmp_path / "other.db").is_file()
    with Store("sqlite://") as store:
        store.allocations.record(A, NodeId(125))
        assert store.allocations.entries() == {A: 125}


def test_pragmas(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        database = store._database  # pyright: ignore[reportPrivateUsage]
        with database.transaction() as connection:
            found = {
                pragma: connection.exec_driver_sql(f"PRAGMA {pragma}").scalar()
                for pragma in ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
            }
    assert found == {
        "journal_mode": "wal",
        "synchronous": 1,
        "foreign_keys": 1,
        "busy_timeout": databases.LOCK_TIMEOUT_S * 1000,
    }


@pytest.mark.parametrize("migrated", [False, True])
def test_a_new_database_and_a_migrated_one_have_the_tables_of_the_code(place: str, migrated: bool) -> None:
    if migrated:
        with of_version(place, "0001"):
            pass
    Store(place).close()
    with connected(place) as connection:
        context = MigrationContext.configure(connection, opts={"compare_server_default": True, "compare_type": True})
        assert compare_metadata(context, METADATA) == []
        assert context.get_current_revision() == migrate.NEWEST
        assert ScriptDirectory.from_config(migrations(connection)).get_heads() == [migrate.NEWEST]


def test_a_new_database_has_the_same_sql_as_a_migrated_one(tmp_path: Path) -> None:
    """Also where a comparison of tables is blind: primary keys, AUTOINCREMENT, the table of the version."""
    Store(tmp_path / "new").close()
    with of_version(str(tmp_path / "migrated"), "head"):
        pass
    new, migrated = (
        {kind + name: sql and "".join(sql.replace('"', "").split()) for kind, name, sql in found}
        for found in (
            rows(tmp_path / each, "SELECT type, name, sql FROM sqlite_master") for each in ("new", "migrated")
        )
    )
    assert len(new) > 20
    assert new == migrated


def test_a_database_with_a_foreign_table_is_not_changed(tmp_path: Path) -> None:
    execute(str(tmp_path), "CREATE TABLE servos (x INTEGER)")
    with pytest.raises(StoreFailed, match="table servos already exists"):
        Store(tmp_path)
    assert rows(tmp_path, "SELECT name FROM sqlite_master") == [("servos",)]


def test_values_of_the_first_tables_are_migrated(place: str) -> None:
    with of_version(place, "0001") as insert:
        insert("allocations", uid=A, node_id=125, pinned=True, first_seen=1.5, last_seen=2.5)
        insert("servos", uid=A, label="Rudder", serial=7, last_seen=2.5, rom={"origin": -900})
        insert("settings", key="stop", value={"latched": True})
    with Store(place) as store:
        assert store.allocations.rows() == [AllocationEntry(A, NodeId(125), True, 1.5, 2.5)]
        assert store.servos.all() == [
            StoredServo(
                A, "Rudder", ServoFacts(serial=7), last_seen=2.5, rom={"origin": -900}, drift={}, bench=store.bench
            )
        ]
        assert store.settings.get("stop") == {"latched": True}
        store.servos.put_drift(A, {"origin": -900})
        store.servos.seen(A, ServoFacts(serial=2**40))


def test_older_runs_are_step_tests(place: str) -> None:
    with of_version(place, "0009") as insert:
        insert("runs", uid=A, at=1.5, note="arm of 30 g", document={"step_deg": 5.0})
    with Store(place) as store:
        (run,) = store.runs.of(A)
        assert (run.kind, run.note, run.document) == ("step", "arm of 30 g", {"step_deg": 5.0})
        store.runs.add(A, "", {}, kind="frequency_response")
    with connected(place) as connection:
        command.downgrade(migrations(connection), "0009")
        assert connection.execute(text("SELECT note FROM runs")).scalars().all() == ["arm of 30 g"]


def test_reasons_of_older_snapshots_are_migrated(place: str) -> None:
    reasons: dict[str, tuple[str | None, dict[str, object]]] = {
        "by hand": ("manual", {}),
        "before a change of reverse": ("change", {"key": "reverse", "more": 0}),
        "before a change of reverse and 2 more": ("change", {"key": "reverse", "more": 2}),
        "profile Wing, left": ("profile", {"profile": "Wing, left"}),
        "restore of snapshot 12": ("restore", {"side": "snapshot 12", "snapshot": 12}),
        "before the first flight": (None, {}),
    }
    with of_version(place, "0005") as insert:
        same: dict[str, object] = {"uid": A, "at": 1.5, "by": "Ada", "automatic": True, "schema_revision": "x"}
        for reason in reasons:
            insert("snapshots", reason=reason, ram={}, rom={}, **same)
    with Store(place) as store:
        found = {one.reason: (one.reason_code, one.reason_params) for one in store.snapshots.of(A)}
    assert found == reasons


def test_details_of_an_older_audit_are_migrated_to_notes(place: str) -> None:
    older = [
        ("write", "It was clamped.", None),
        ("snapshot", "matrix", {"reason": "matrix"}),
        ("save", "", None),
        ("snapshot", "by Ann", None),
    ]
    with of_version(place, "0006") as insert:
        for action, detail, requested in older:
            insert("audit", at=1.5, by="Ada", action=action, outcome="applied", requested=requested, detail=detail)
    with Store(place) as store:
        found = [(row.id, row.entry.action, row.entry.requested, row.entry.notes) for row in store.audit.rows()][::-1]
        store.audit.add([NewAuditEntry("Ada", "label", "applied")])
        assert store.audit.rows()[0].id == 5
    assert found == [
        (1, "write", None, (Note("It was clamped.", "text"),)),
        (2, "snapshot", None, (Note("matrix", "reason", {"reason": "matrix"}),)),
        (3, "save", None, ()),
        (4, "snapshot", None, (Note("by Ann", "text"),)),
    ]
    with connected(place) as connection:
        command.downgrade(migrations(connection), "0006")
        details = connection.execute(text("SELECT detail FROM audit ORDER BY id")).scalars().all()
    assert details == ["It was clamped.", "matrix", "", "by Ann", ""]


def test_older_codes_are_migrated(place: str) -> None:
    step = {
        "name": "aside 2", "text": "Elevator L", "state": "failed", "evidence_code": "problem",
        "evidence_params": {"problem": "no_answer", "cause": "never_met", "warnings": ["timeout_on_the_way"]},
    }  # fmt: skip
    record = {
        "uid": A, "verdict": "failed", "held_in": "rom", "changes": [{"key": "reverse", "verdict": "no_answer"}],
        "problem": {"code": "not_as_wanted", "cause": "holds_something_else", "detail": "asked"},
    }  # fmt: skip
    error = {
        "class": "NoAnswer", "code": "no_answer", "detail": "no_answer",
        "facts": {"cause": "no_restart_seen", "also": ["not_done"], "servo": "asked"},
    }  # fmt: skip
    document = {"steps": [step, {**step, "name": "save 2"}], "result": {"servos": [record]}, "error": error}
    notes = [
        {"code": "problem", "params": {"problem": "no_answer", "why": "asked"}, "text": "no_answer"},
        {"code": "lease_ended", "params": {"why": "ran_out"}, "text": ""},
    ]
    with of_version(place, "0008") as insert:
        insert("jobs", id="j", kind="commissioning", state="failed", created_at=1.5, document=document)
        for action, outcome in (("write", "no_answer"), ("lease", "lapsed"), ("note", "lapsed")):
            insert("audit", at=1.5, by="Ada", action=action, outcome=outcome, notes=notes)
        insert("settings", key="allocator", value='"insist"')
    with Store(place) as store:
        (job,) = store.jobs.all()
        audit = [row.entry for row in store.audit.rows()][::-1]
        assert store.settings.get("allocator") == "force"
    step["name"] = "park_servo_id 2"
    step["evidence_params"] = {
        "problem": "no_response", "cause": "servo_never_seen", "warnings": ["timeout_during_soft_start"]
    }  # fmt: skip
    record = {
        "uid": A, "verdict": "failed", "verified_in": "rom", "changes": [{"key": "reverse", "verdict": "no_response"}],
        "problem": {"code": "unexpected_result", "cause": "values_differ", "detail": "asked"},
    }  # fmt: skip
    error = {
        "class": "NoResponse", "code": "no_response", "detail": "no_answer",
        "facts": {"cause": "restart_not_seen", "also": ["steps_incomplete"], "servo": "asked"},
    }  # fmt: skip
    assert job.document == {
        "steps": [step, {**step, "name": "save 2"}], "result": {"servos": [record]}, "error": error
    }  # fmt: skip
    assert [one.outcome for one in audit] == ["no_response", "expired", "lapsed"]
    assert audit[0].notes == (
        Note("no_answer", "problem", {"problem": "no_response", "why": "asked"}),
        Note("", "lease_ended", {"why": "expired"}),
    )


def test_a_database_of_a_newer_hornbill_is_not_changed(tmp_path: Path) -> None:
    Store(tmp_path).close()
    execute(str(tmp_path), "UPDATE alembic_version SET version_num = '9999'")
    with pytest.raises(StoreFailed, match=r"written by a newer hornbill \(tables 9999\)"):
        Store(tmp_path)
    assert rows(tmp_path, "SELECT version_num FROM alembic_version") == [("9999",)]


def test_a_file_that_is_no_database_is_not_changed(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_bytes(b"this is a holiday photograph" * 100)
    with pytest.raises(StoreFailed, match="not a database"):
        Store(tmp_path)
    assert (tmp_path / FILE_NAME).read_bytes().startswith(b"this is a holiday")


def test_a_folder_that_cannot_be_created_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreFailed, match="Choose another data folder"):
        Store(tmp_path / "file" / "folder")


def test_a_failed_migration_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / "migrations"
    versions = broken / "versions"
    versions.mkdir(parents=True)
    source = Path(migrate.__file__).parent / "migrations"
    (broken / "env.py").write_text((source / "env.py").read_text())
    (versions / "0001.py").write_text(
        "import sqlalchemy as sa\nfrom alembic import op\nrevision = '0001'\ndown_revision = None\n"
        "def upgrade():\n"
        "    op.create_table('half', sa.Column('x', sa.Integer()))\n"
        "    raise OSError('the disk is full')\n"
    )
    execute(str(tmp_path / "data"), "CREATE TABLE alembic_version (version_num VARCHAR(32) NOT NULL)")
    monkeypatch.setattr(migrate, "_FOLDER", broken)
    with pytest.raises(StoreFailed, match="the disk is full"):
        Store(tmp_path / "data")
    assert rows(tmp_path / "data", "SELECT name FROM sqlite_master") == [("alembic_version",)]
    monkeypatch.undo()
    Store(tmp_path / "data").close()


def test_a_failed_transaction_changes_nothing(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        database = store._database  # pyright: ignore[reportPrivateUsage]

        def fail_half_way() -> None:
            with database.transaction() as connection:
                connection.exec_driver_sql("INSERT INTO settings VALUES ('bench', 'a', '1')")
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            fail_half_way()
        assert store.settings.get("a") is None


def test_a_closed_store_cannot_be_used_and_leaves_no_file_open(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        store = Store(tmp_path)
        store.settings.put("a", 1)
        store.close()
        store.close()
        with pytest.raises(RuntimeError, match="the store is closed"):
            store.settings.get("a")
        del store
        gc.collect()
    assert sorted(each.name for each in tmp_path.iterdir()) == [FILE_NAME]  # no journal remains


def test_several_processes_can_use_one_database(place: str) -> None:
    """All open it while it is new, and write: nothing is lost and no node ID is allocated twice."""
    program = """
import sys, time
from hornbill.errors import InvalidValue, StoreFailed
from hornbill.store.store import Store
first, rejected = int(sys.argv[2]), 0

def retry(call, *arguments):
    for _ in range(1000):
        try:
            return call(*arguments)
        except StoreFailed as error:  # the others write all the time
            last = error
            time.sleep(0.02)
    raise last

with Store(sys.argv[1]) as store:
    for n in range(20):
        retry(store.settings.put, f"{first}-{n}", n)
        retry(store.settings.put, "all", first)
        retry(store.servos.set_label, "5" * 32, str(first))
        try:
            retry(store.allocations.record, f"{first + n:032x}", n + 1)
        except InvalidValue:
            rejected += 1
print(rejected)
"""
    environment = {"PYTHONPATH": os.pathsep.join((str(SERVER), *sys.path)), "PATH": ""}
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", program, place, str(first)], env=environment, stdout=subprocess.PIPE, text=True
        )
        for first in (100, 200)
    ]
    printed = [process.communicate(timeout=60)[0] for process in processes]
    assert [process.returncode for process in processes] == [0, 0]
    assert sum(map(int, printed)) == 20
    with Store(place) as store:
        assert sorted(store.allocations.entries().values()) == list(range(1, 21))
        for first in (100, 200):
            assert [store.settings.get(f"{first}-{n}") for n in range(20)] == list(range(20))


def test_a_locked_database_delays_one_write_and_no_read(place: str) -> None:
    with Store(place) as locking, Store(place) as store:
        store.settings.put("a", 1)
        with locking._database.transaction():  # pyright: ignore[reportPrivateUsage]
            assert store.settings.get("a") == 1
            began = time.monotonic()
            with pytest.raises(StoreFailed) as caught:
                store.settings.put("a", 2)
            waited_once = time.monotonic() - began
            assert waited_once > databases.LOCK_TIMEOUT_S / 2
            for _ in range(20):
                with pytest.raises(StoreFailed):
                    store.settings.put("a", 2)
            assert time.monotonic() - began < waited_once + 4 * databases.LOCK_TIMEOUT_S
    assert caught.value.code == "store_failed"
    assert "secret" not in caught.value.detail


def test_an_unlocked_database_can_be_written_again(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(databases, "BACKOFF_S", 0.0)
    with Store(place) as locking, Store(place) as store:
        with locking._database.transaction(), pytest.raises(StoreFailed):  # pyright: ignore[reportPrivateUsage]
            store.settings.put("a", 2)
        store.settings.put("a", 3)
        assert locking.settings.get("a") == 3


def test_a_broken_database_is_an_error(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        execute(str(tmp_path), "DROP TABLE settings")
        with pytest.raises(StoreFailed, match=r"no such table: settings. Check that the data folder"):
            store.settings.get("a")
        with pytest.raises(StoreFailed, match="no such table"):
            store.settings.put("a", 1)


ADDRESSES = {
    "sqlite://someone:secret@/nowhere/at/all.db": "is not a usable database",
    "nosuchkind://someone:secret@host/name": "is not a usable database",
    "sqlite://someone:secret@host:port/name": "is invalid",
    "sqlite:////nowhere/at/all.db": "unable to open database file",
    "postgresql://someone:secret@/name?host=/nowhere/at/all": "Check that the database server runs",
    "postgres://someone:secret@127.0.0.1:1/name": "Check that the database server runs",
}


@pytest.mark.parametrize("address", ADDRESSES)
def test_the_error_of_an_unusable_address_hides_the_password(address: str) -> None:
    with pytest.raises(StoreFailed, match=ADDRESSES[address]) as caught:
        Store(address)
    assert "secret" not in str(caught.value)
