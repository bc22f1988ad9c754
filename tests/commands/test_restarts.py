"""After the server is killed during a job, the next one reports it as interrupted and starts nothing."""

import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import httpx
import pytest

from e2e.servers import Server, running, serving, until

KEY, WAITING = {"Idempotency-Key": "before-the-kill"}, {"Idempotency-Key": "no-response"}


def ready(server: Server) -> str:
    server.api.put("/bus", json={"address": "memory:demo"}).raise_for_status()
    return min(server.ready(6))


def requests(folder: Path) -> int:
    """The number of requests with a key that the server has stored."""
    with closing(sqlite3.connect(folder / "hornbill.sqlite3")) as database:
        return int(database.execute("SELECT count(*) FROM answers").fetchone()[0])


def test_a_job_of_a_killed_server_is_interrupted_and_its_key_starts_no_other(tmp_path: Path) -> None:
    words = serving(tmp_path, "--allocator", "on")
    with running(*words) as first, ThreadPoolExecutor() as elsewhere:
        uid = ready(first)
        save = f"/servos/{uid}/save"
        label = first.api.patch(f"/servos/{uid}", json={"label": "left"})
        label.raise_for_status()
        started = first.api.post(save, headers=KEY)
        assert started.status_code == 202, started.text
        job = started.json()["id"]
        waiting = elsewhere.submit(first.api.post, f"{save}?wait=true", headers=WAITING)
        until(lambda: first.api.get(f"/jobs/{job}").json()["step"] is not None, 5, "it does not begin")
        until(lambda: requests(tmp_path) == 2, 5, "the second request is not there")
        assert not waiting.done()
        first.process.kill()
        first.process.wait(timeout=10)
        with pytest.raises(httpx.TransportError):
            waiting.result(10)
    with running(*words) as second:
        assert ready(second) == uid
        found = second.api.get(f"/jobs/{job}").json()
        assert (found["kind"], found["state"], found["error"]["code"]) == ("save", "failed", "interrupted")
        assert found["resumable"] is False
        assert [one["state"] for one in found["steps"]].count("failed") == 1
        again = second.api.post(save, headers=KEY)
        assert (again.status_code, again.json()["id"]) == (202, job)
        assert again.headers["idempotency-replayed"] == "true"
        unknown = second.api.post(f"{save}?wait=true", headers=WAITING)
        assert (unknown.status_code, unknown.json()["code"]) == (500, "interrupted")
        assert [one["id"] for one in second.api.get("/jobs").json()] == [job], "a key started something"
        assert second.api.get(f"/servos/{uid}").json()["label"] == "left"
        done = second.api.post(f"{save}?wait=true", headers={"Idempotency-Key": "a-new-one"})
        assert (done.status_code, done.json()["state"]) == (200, "succeeded"), done.text
