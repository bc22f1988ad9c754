"""Behaviour shared by the tables, and jobs, profiles, settings and tokens."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from hornbill.errors import Conflict, InvalidValue, Unknown
from hornbill.store import jobs, runs
from hornbill.store.jobs import StoredJob
from hornbill.store.profiles import StoredProfile
from hornbill.store.store import Store
from hornbill.store.tables import Json
from hornbill.store.tokens import digest
from hornbill.units import Uid
from unit.store.clock import Wall

A, B = Uid("a0" * 16), Uid("b0" * 16)
JOB = StoredJob("j1", "commissioning", A, "running", 1000.0, None, {"count": 12}, {"steps": [], "result": None})
DOCUMENT: dict[str, Json] = {"z": 1, "values": {"origin": -90.5, "list": [1, None]}, "a": "§"}
NUMBERS = (1, 0, -1, 2**31, 2**63, -(2**70))


@pytest.mark.parametrize(
    ("subject", "keys", "code"),
    [
        ("runs", NUMBERS, "unknown_run"),
        ("snapshots", NUMBERS, "unknown_snapshot"),
        ("profiles", ("nothing", "rudder\0", "x" * 500, "\ud800"), "unknown_profile"),
        ("allocations", (A,), "unknown_uid"),
    ],
)
def test_an_unknown_key_is_an_error(store: Store, subject: str, keys: tuple[Any, ...], code: str) -> None:
    table = getattr(store, subject)
    for key in keys:
        for method in (table.get, table.drop):
            with pytest.raises(Unknown) as caught:
                method(key)
            assert caught.value.code == code


def test_the_oldest_rows_of_a_servo_are_deleted(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "MAX_ROWS", 2)
    store.runs.add(B, "", {})
    for number in range(4):
        store.runs.add(A, str(number), {})
    assert [one.note for one in store.runs.of(A)] == ["3", "2"]
    assert len(store.runs.of(B)) == 1


def test_runs_of_one_kind_neither_show_nor_displace_those_of_another(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runs, "MAX_ROWS", 1)
    step = store.runs.add(A, "", {})
    response = store.runs.add(A, "", {}, kind="frequency_response")
    assert (step.kind, response.kind) == ("step", "frequency_response")
    assert store.runs.of(A) == [step]
    assert store.runs.of(A, kind="frequency_response") == [response]
    assert store.runs.find(step.id, "step") == step
    with pytest.raises(Unknown):
        store.runs.find(step.id, "frequency_response")


def test_the_last_state_of_a_job_is_stored(place: str, store: Store) -> None:
    store.jobs.put(JOB)
    ended = replace(JOB, state="failed", ended_at=1001.5, document={"steps": [1]})
    store.jobs.put(ended)
    older = [StoredJob(str(n), "save", None, "queued", float(n), None, None, {}) for n in (3, 1, 2)]
    for one in older:
        store.jobs.put(one)
    with Store(place) as again:
        assert again.jobs.all() == [older[1], older[2], older[0], ended]


def test_old_jobs_are_deleted_but_running_ones_kept(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs, "MAX_ROWS", 3)
    store.jobs.put(replace(JOB, id="under way", created_at=0.0))
    for n in range(1, 7):
        store.jobs.put(replace(JOB, id=str(n), created_at=float(n), ended_at=float(n)))
    assert [one.id for one in store.jobs.all()] == ["under way", "3", "4", "5", "6"]
    store.jobs.put(replace(JOB, id="6", ended_at=7.0))  # already stored: deletes no other
    assert len(store.jobs.all()) == 5


def test_a_profile_is_stored_in_its_order_replaced_and_deleted(place: str, store: Store, wall: Wall) -> None:
    assert store.profiles.put("Rudder", DOCUMENT) == StoredProfile("Rudder", DOCUMENT, 1000.0, 1000.0, store.bench)
    with Store(place) as again:
        found = again.profiles.get("Rudder")
    assert found == StoredProfile("Rudder", DOCUMENT, 1000.0, 1000.0, store.bench)
    assert list(found.document) == ["z", "values", "a"]
    wall.now = 2000.0
    assert store.profiles.put("Rudder", {}) == StoredProfile("Rudder", {}, 1000.0, 2000.0, store.bench)
    assert store.profiles.all() == [StoredProfile("Rudder", {}, 1000.0, 2000.0, store.bench)]
    store.profiles.drop("Rudder")
    assert store.profiles.all() == []


def test_the_order_of_profiles_is_the_same_on_every_database(store: Store) -> None:
    for name in ("b", "Ä", "a", "B", "a b", "A"):
        store.profiles.put(name, {})
    assert [one.name for one in store.profiles.all()] == ["A", "B", "a", "a b", "b", "Ä"]


def test_a_setting_is_any_json_value_or_the_default(store: Store) -> None:
    values: list[Json] = [None, True, 0, 1.5, "text", [], [1, [2]], {"a": {"b": None}}]
    for value in (*values, values):
        store.settings.put("key", value)
        assert store.settings.get("key", "default") == value
    for _ in range(2):
        store.settings.drop("key")
        assert (store.settings.get("key"), store.settings.get("key", 5)) == (None, 5)


def test_the_unique_id_of_an_installation_is_permanent(tmp_path: Path) -> None:
    found: list[bytes] = []
    for name in ("one", "one", "other"):
        with Store(tmp_path / name) as store:
            found += [store.settings.own_unique_id(), store.settings.own_unique_id()]
    assert len(found[0]) == 16
    assert found[:4] == found[:1] * 4
    assert found[4] == found[5] != found[0]


def test_only_the_digest_of_a_token_is_stored(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        made, secret = store.tokens.add("rig 3", "operate")
        assert re.fullmatch(r"hb_[A-Za-z0-9_-]{43}", secret)
        assert store.tokens.all() == [made]
        assert made.digest == digest(secret)
    for file in tmp_path.iterdir():
        assert secret.encode() not in file.read_bytes(), file


def test_tokens_differ_and_are_ordered_by_name(store: Store) -> None:
    assert len({store.tokens.add(f"t{n}", "view")[1] for n in range(12)}) == 12
    assert [one.name for one in store.tokens.all()] == sorted(f"t{n}" for n in range(12))


def test_the_name_of_a_token_is_unique_until_it_is_revoked(store: Store) -> None:
    _, first = store.tokens.add("rig", "view")
    with pytest.raises(Conflict):
        store.tokens.add("rig", "admin")
    store.tokens.used({"rig": 12.5, "gone": 13.0})
    assert [(one.name, one.last_used_at) for one in store.tokens.all()] == [("rig", 12.5)]
    store.tokens.drop("rig")
    assert store.tokens.all() == []
    with pytest.raises(Unknown):
        store.tokens.drop("rig")
    _, second = store.tokens.add("rig", "view")
    assert first != second


def test_a_token_name_that_could_do_harm_is_rejected(store: Store) -> None:
    for name in ("", " a", "a ", "a/b", "a\nb", "x" * 33, "<b>", "a·b", "é"):
        with pytest.raises(InvalidValue):
            store.tokens.add(name, "view")
    assert store.tokens.all() == []
