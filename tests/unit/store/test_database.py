"""Opening, migrating, sharing and losing a database."""

import gc
import json
import os
import sqlite3
import subprocess
import sys
import time
import warnings
from collections.abc import Generator
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
from hornbill.store.tables import Table
from hornbill.units import NodeId, Uid

A = Uid("a0" * 16)
B = Uid("b0" * 16)
SERVER = Path(hornbill.__file__).parent.parent


def rows(folder: Path, query: str) -> list[Any]:
    connection = sqlite3.connect(folder / FILE_NAME)
    try:
        return connection.execute(query).fetchall()
    finally:
        connection.close()


def change(folder: Path, statement: str) -> None:
    connection = sqlite3.connect(folder / FILE_NAME)
    try:
        connection.execute(statement)
        connection.commit()
    finally:
        connection.close()


@contextmanager
def connected(place: str) -> Generator[Connection]:
    """One transaction past `Store`."""
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


def child(program: str, *arguments: str) -> "subprocess.Popen[str]":
    """Another Python process that knows hornbill."""
    return subprocess.Popen(
        [sys.executable, "-c", program, *arguments],
        env={"PYTHONPATH": os.pathsep.join((str(SERVER), *sys.path)), "PATH": ""},
        stdout=subprocess.PIPE,
        text=True,
    )


def test_a_new_folder_is_made_and_its_tables_too(tmp_path: Path) -> None:
    folder = tmp_path / "some" / "where new?#%41"
    with Store(folder) as store:
        assert store.allocations.entries() == {}
    assert (folder / FILE_NAME).is_file()
    assert rows(folder, "SELECT version_num FROM alembic_version") == [(migrate.NEWEST,)]


def test_what_was_kept_is_there_after_opening_again(place: str) -> None:
    with Store(place) as store:
        store.allocations.record(A, NodeId(125))
        store.settings.put("stop", {"latched": True})
    with Store(place) as store:
        assert store.allocations.entries() == {A: 125}
        assert store.settings.get("stop") == {"latched": True}


def test_a_database_url_is_taken_as_it_is(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'other.db'}"
    with Store(url) as store:
        store.allocations.record(A, NodeId(125))
    with Store(url) as store:
        assert store.allocations.entries() == {A: 125}
    assert not (tmp_path / FILE_NAME).exists()


def test_a_database_in_memory_keeps_its_tables_while_it_is_open() -> None:
    with Store("sqlite://") as store:
        store.allocations.record(A, NodeId(125))
        assert store.allocations.entries() == {A: 125}


def test_it_writes_ahead_and_takes_no_longer_than_it_must(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        database = store._database  # pyright: ignore[reportPrivateUsage]
        with database.transaction() as session:
            connection = session.connection()
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


def upgrade(connection: Connection, target: str) -> None:
    """Run the migrations up to `target`, from where the database is."""
    config = Config()
    config.set_main_option("script_location", str(Path(migrate.__file__).parent / "migrations"))
    config.attributes["connection"] = connection
    command.upgrade(config, target)


@pytest.mark.parametrize("migrated", [False, True])
def test_a_new_database_and_a_migrated_one_have_the_tables_of_the_code(place: str, migrated: bool) -> None:
    if migrated:
        with connected(place) as connection:
            upgrade(connection, "0001")
    Store(place).close()
    with connected(place) as connection:
        context = MigrationContext.configure(connection, opts={"compare_server_default": True, "compare_type": True})
        assert compare_metadata(context, Table.metadata) == []
        assert context.get_current_revision() == migrate.NEWEST


def test_a_new_database_is_to_the_letter_what_the_migrations_lead_to(tmp_path: Path) -> None:
    """What a comparison of tables does not see too: the marks of primary keys, AUTOINCREMENT, the version's table."""
    Store(tmp_path / "new").close()
    with connected(str(tmp_path / "migrated")) as connection:
        upgrade(connection, "head")
    new, migrated = (
        {kind + name: sql and "".join(sql.replace('"', "").split()) for kind, name, sql in found}
        for found in (
            rows(tmp_path / each, "SELECT type, name, sql FROM sqlite_master") for each in ("new", "migrated")
        )
    )
    assert len(new) > 20
    assert new == migrated


def test_a_database_with_a_table_of_somebody_elses_is_left_alone(tmp_path: Path) -> None:
    with connected(str(tmp_path)) as connection:
        connection.execute(text("CREATE TABLE servos (x INTEGER)"))
    with pytest.raises(StoreFailed, match="table servos already exists"):
        Store(tmp_path)
    assert rows(tmp_path, "SELECT name FROM sqlite_master") == [("servos",)]


def test_what_the_first_tables_held_is_kept(place: str) -> None:
    with connected(place) as connection:
        upgrade(connection, "0001")
        connection.execute(text("INSERT INTO allocations VALUES (:uid, 125, TRUE, 1.5, 2.5)"), {"uid": A})
        connection.execute(
            text("INSERT INTO servos (uid, label, serial, last_seen, rom) VALUES (:uid, 'Rudder', 7, 2.5, :rom)"),
            {"uid": A, "rom": '{"origin": -900}'},
        )
        connection.execute(text("INSERT INTO settings VALUES ('stop', '{\"latched\": true}')"))
    with Store(place) as store:
        assert store.allocations.rows() == [AllocationEntry(A, NodeId(125), True, 1.5, 2.5)]
        assert store.servos.all() == [
            StoredServo(A, "Rudder", ServoFacts(serial=7), last_seen=2.5, rom={"origin": -900}, drift={})
        ]
        assert store.settings.get("stop") == {"latched": True}
        store.servos.put_drift(A, {"origin": -900})
        store.servos.seen(A, ServoFacts(serial=2**40))


def test_reasons_of_older_snapshots_get_their_code(place: str) -> None:
    reasons: dict[str, tuple[str | None, dict[str, object]]] = {
        "by hand": ("manual", {}),
        "before a change of reverse": ("change", {"key": "reverse", "more": 0}),
        "before a change of reverse and 2 more": ("change", {"key": "reverse", "more": 2}),
        "profile Wing, left": ("profile", {"profile": "Wing, left"}),
        "restore of snapshot 12": ("restore", {"side": "snapshot 12", "snapshot": 12}),
        "before the first flight": (None, {}),
    }
    with connected(place) as connection:
        upgrade(connection, "0005")
        for reason in reasons:
            connection.execute(
                text(
                    'INSERT INTO snapshots (uid, at, reason, "by", automatic, schema_revision, ram, rom)'
                    " VALUES (:uid, 1.5, :reason, 'Ada', TRUE, 'x', '{}', '{}')"
                ),
                {"uid": A, "reason": reason},
            )
    with Store(place) as store:
        found = {one.reason: (one.reason_code, one.reason_params) for one in store.snapshots.of(A)}
    assert found == reasons


def test_details_of_an_older_audit_become_notes_and_its_numbers_stay(place: str) -> None:
    older = [
        ("write", "It was clamped.", None),
        ("snapshot", "matrix", {"reason": "matrix"}),
        ("save", "", None),
        ("snapshot", "by Ann", None),
    ]
    with connected(place) as connection:
        upgrade(connection, "0006")
        for action, detail, requested in older:
            connection.execute(
                text(
                    'INSERT INTO audit (at, "by", action, outcome, requested, detail)'
                    " VALUES (1.5, 'Ada', :action, 'applied', :requested, :detail)"
                ),
                {"action": action, "detail": detail, "requested": requested and json.dumps(requested)},
            )
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
        config = Config()
        config.set_main_option("script_location", str(Path(migrate.__file__).parent / "migrations"))
        config.attributes["connection"] = connection
        command.downgrade(config, "0006")
        details = connection.execute(text("SELECT detail FROM audit ORDER BY id")).scalars().all()
    assert details == ["It was clamped.", "matrix", "", "by Ann", ""]


def test_codes_of_an_older_database_are_renamed(place: str) -> None:
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
    with connected(place) as connection:
        upgrade(connection, "0008")
        connection.execute(
            text(
                "INSERT INTO jobs (id, kind, state, created_at, document)"
                " VALUES ('j', 'commissioning', 'failed', 1.5, :document)"
            ),
            {"document": json.dumps(document)},
        )
        for action, outcome in (("write", "no_answer"), ("lease", "lapsed"), ("note", "lapsed")):
            connection.execute(
                text(
                    'INSERT INTO audit (at, "by", action, outcome, notes)'
                    " VALUES (1.5, 'Ada', :action, :outcome, :notes)"
                ),
                {"action": action, "outcome": outcome, "notes": json.dumps(notes)},
            )
        connection.execute(text("INSERT INTO settings VALUES ('allocator', '\"insist\"')"))
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


def test_the_newest_migration_is_the_one_the_code_expects() -> None:
    config = Config()
    config.set_main_option("script_location", str(Path(migrate.__file__).parent / "migrations"))
    assert ScriptDirectory.from_config(config).get_heads() == [migrate.NEWEST]


def test_a_database_of_a_newer_hornbill_is_left_alone(tmp_path: Path) -> None:
    Store(tmp_path).close()
    change(tmp_path, "UPDATE alembic_version SET version_num = '9999'")
    with pytest.raises(StoreFailed, match=r"written by a newer hornbill \(tables 9999\)"):
        Store(tmp_path)
    assert rows(tmp_path, "SELECT version_num FROM alembic_version") == [("9999",)]


def test_a_file_that_is_no_database_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_bytes(b"this is a holiday photograph" * 100)
    with pytest.raises(StoreFailed, match="not a database"):
        Store(tmp_path)
    assert (tmp_path / FILE_NAME).read_bytes().startswith(b"this is a holiday")


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreFailed, match="Choose another data folder"):
        Store(tmp_path / "file" / "folder")


def test_a_migration_that_fails_leaves_the_database_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
    with connected(str(tmp_path / "data")) as connection:
        connection.execute(
            text("CREATE TABLE alembic_version (version_num VARCHAR(32) NOT NULL)")
        )  # of no revision yet
    monkeypatch.setattr(migrate, "_FOLDER", broken)
    with pytest.raises(StoreFailed, match="the disk is full"):
        Store(tmp_path / "data")
    assert rows(tmp_path / "data", "SELECT name FROM sqlite_master") == [("alembic_version",)]
    monkeypatch.undo()
    Store(tmp_path / "data").close()


def test_a_block_that_fails_changes_nothing(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        database = store._database  # pyright: ignore[reportPrivateUsage]

        def fail_half_way() -> None:
            with database.transaction() as session:
                session.connection().exec_driver_sql("INSERT INTO settings VALUES ('a', '1')")
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            fail_half_way()
        assert store.settings.get("a") is None


def test_after_closing_nothing_opens_it_again_and_nothing_is_left_open(tmp_path: Path) -> None:
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
    assert sorted(each.name for each in tmp_path.iterdir()) == [FILE_NAME]  # no journal is left behind


def test_several_processes_may_use_one_database(place: str) -> None:
    """All open it while it is new, and write in turn: nothing is lost and no id is given twice."""
    program = """
import sys, time
from hornbill.errors import InvalidValue, StoreFailed
from hornbill.store.store import Store
first, turned_away = int(sys.argv[2]), 0

def insist(deed, *arguments):
    for _ in range(1000):
        try:
            return deed(*arguments)
        except StoreFailed as error:  # the others write all the time, and nobody waits for long
            last = error
            time.sleep(0.02)
    raise last

with Store(sys.argv[1]) as store:
    for n in range(20):
        insist(store.settings.put, f"{first}-{n}", n)
        insist(store.settings.put, "all", first)
        insist(store.servos.set_label, "5" * 32, str(first))
        try:
            insist(store.allocations.record, f"{first + n:032x}", n + 1)
        except InvalidValue:
            turned_away += 1
print(turned_away)
"""
    processes = [child(program, place, str(first)) for first in (100, 200, 300)]
    said = [process.communicate(timeout=60)[0] for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0]
    assert sum(map(int, said)) == 40
    with Store(place) as store:
        assert sorted(store.allocations.entries().values()) == list(range(1, 21))
        for first in (100, 200, 300):
            assert [store.settings.get(f"{first}-{n}") for n in range(20)] == list(range(20))


def test_two_stores_of_one_process_see_each_others_commits(place: str) -> None:
    with Store(place) as one, Store(place) as other:
        one.allocations.record(A, NodeId(125))
        assert other.allocations.entries() == {A: 125}
        other.allocations.record(B, NodeId(124))
        assert one.allocations.entries() == {A: 125, B: 124}


def test_a_process_that_holds_the_database_delays_writes_once_and_reads_never(place: str) -> None:
    with Store(place) as holder, Store(place) as store:
        store.settings.put("a", 1)
        with holder._database.transaction():  # pyright: ignore[reportPrivateUsage]
            began = time.monotonic()
            assert store.settings.get("a") == 1
            assert time.monotonic() - began < databases.LOCK_TIMEOUT_S / 2
            with pytest.raises(StoreFailed) as caught:
                store.settings.put("a", 2)
            assert databases.LOCK_TIMEOUT_S / 2 < time.monotonic() - began < databases.LOCK_TIMEOUT_S * 4
            began = time.monotonic()
            for _ in range(20):
                with pytest.raises(StoreFailed):
                    store.settings.put("a", 2)
            assert time.monotonic() - began < databases.LOCK_TIMEOUT_S
    assert caught.value.code == "store_failed"
    assert "secret" not in caught.value.detail


def test_a_database_that_was_held_can_be_written_when_it_is_free(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(databases, "BACKOFF_S", 0.0)
    with Store(place) as holder, Store(place) as store:
        with holder._database.transaction(), pytest.raises(StoreFailed):  # pyright: ignore[reportPrivateUsage]
            store.settings.put("a", 2)
        store.settings.put("a", 3)
        assert holder.settings.get("a") == 3


def test_a_database_that_breaks_is_told_as_a_problem(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        change(tmp_path, "DROP TABLE settings")
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
def test_an_address_that_cannot_be_used_is_told_without_its_password(address: str) -> None:
    with pytest.raises(StoreFailed, match=ADDRESSES[address]) as caught:
        Store(address)
    assert "secret" not in str(caught.value)
