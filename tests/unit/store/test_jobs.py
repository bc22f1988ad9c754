"""Jobs and their progress are stored."""

from dataclasses import replace

import pytest

from hornbill.store import jobs
from hornbill.store.jobs import StoredJob
from hornbill.store.store import Store
from hornbill.units import Uid

A = Uid("a0" * 16)
JOB = StoredJob("j1", "commissioning", A, "running", 1000.0, None, {"count": 12}, {"steps": [], "result": None})


def test_the_last_state_of_a_job_is_stored(place: str, store: Store) -> None:
    store.jobs.put(JOB)
    ended = replace(JOB, state="failed", ended_at=1001.5, document={"steps": [1]})
    store.jobs.put(ended)
    other = StoredJob("j0", "save", None, "queued", 1000.0, None, None, {})
    store.jobs.put(other)
    store.close()
    with Store(place) as again:
        assert again.jobs.all() == [other, ended]


def test_jobs_are_ordered_oldest_first(store: Store) -> None:
    for n in (3, 1, 2):
        store.jobs.put(replace(JOB, id=str(n), created_at=float(n)))
    assert [one.id for one in store.jobs.all()] == ["1", "2", "3"]


def test_old_jobs_are_deleted_but_running_ones_kept(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs, "MAX_ROWS", 3)
    store.jobs.put(replace(JOB, id="under way", created_at=0.0))
    for n in range(1, 7):
        store.jobs.put(replace(JOB, id=str(n), created_at=float(n), ended_at=float(n)))
    assert [one.id for one in store.jobs.all()] == ["under way", "3", "4", "5", "6"]
    store.jobs.put(replace(JOB, id="6", ended_at=7.0))  # already stored: deletes no other
    assert len(store.jobs.all()) == 5
