"""`hornbill run`: exit codes, reports, a client that dies, and a server that is killed."""

import csv
import os
import signal
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from commands.command_line import CommandLine, hornbill
from e2e.servers import Server, running, serving, until

PLAN = """
name = "short"
servos = ["SERIAL"]
cycles = CYCLES

[limits]
temperature_c = LIMIT

[[steps]]
do = "move"
angle_deg = 5

[[steps]]
do = "move"
angle_deg = { "SERIAL" = -5 }
"""


def plan_file(folder: Path, serial: str, cycles: int = 2, limit: int = 100) -> Path:
    text = PLAN.replace("SERIAL", serial).replace("CYCLES", str(cycles)).replace("LIMIT", str(limit))
    (folder / "plan.toml").write_text(text)
    return folder / "plan.toml"


def job_of(server: Server, job: str) -> Any:
    return server.api.get(f"/jobs/{job}").json()


def cycles_done(server: Server, job: str) -> int:
    return int((job_of(server, job)["result"] or {"cycles_done": 0})["cycles_done"])


def test_a_run_writes_its_reports_and_exits_with_0_only_within_the_limits(
    command: CommandLine, serial: str, tmp_path: Path
) -> None:
    plan = plan_file(tmp_path, serial)
    assert "ready" in command("run", plan, "--dry-run")
    reports = ("--junit", tmp_path / "r.xml", "--csv", tmp_path / "r.csv", "--html", tmp_path / "r.html")
    done = command.json("run", plan, "--yes", *reports)
    assert (done["state"], done["result"]["cycles_done"]) == ("succeeded", 2)
    assert ET.fromstring((tmp_path / "r.xml").read_text()).attrib["failures"] == "0"
    rows = list(csv.DictReader((tmp_path / "r.csv").read_text(encoding="utf-8").splitlines()))
    assert [(row["serial"], row["runs"], row["exceeded"]) for row in rows] == [(serial, "2", "0")] * 2
    assert "Test plan: short" in (tmp_path / "r.html").read_text(encoding="utf-8")
    plan = plan_file(tmp_path, serial, limit=1)
    failed = command("run", plan, "--yes", *reports, code=1)
    assert "unexpected_result: " in failed
    assert "exceeded a limit in cycle 1, step 1: temperature" in failed
    assert ET.fromstring((tmp_path / "r.xml").read_text()).attrib["failures"] == "1"


@pytest.mark.parametrize(
    ("change", "words", "code", "error"),
    [
        (("cycles =", "cycels ="), ("--yes",), 1, "cycels"),
        (("angle_deg = 5", "angle_deg = 500"), ("--yes",), 1, "out_of_range"),
        (("angle_deg = 5", "angle_deg = 500"), ("--dry-run",), 1, "beyond"),
        (("name =", "name"), ("--yes",), 1, "plan.toml: Invalid TOML"),
        (("", ""), (), 2, "--yes"),
        (("", ""), ("--resume", "7"), 2, "--resume"),
    ],
)
def test_what_cannot_run_is_explained_and_moves_nothing(
    bench: Server, serial: str, tmp_path: Path, change: tuple[str, str], words: tuple[str, ...], code: int, error: str
) -> None:
    plan = plan_file(tmp_path, serial)
    plan.write_text(plan.read_text().replace(*change, 1))
    jobs = len(bench.api.get("/jobs").json())
    failed = hornbill(bench.url, "run", plan, *words)
    assert failed.exit_code == code, failed.output
    assert error in failed.output
    assert len(bench.api.get("/jobs").json()) == jobs


def test_a_run_goes_on_without_its_client_and_is_resumed_after_a_stop(
    bench: Server, command: CommandLine, serial: str, tmp_path: Path
) -> None:
    plan = plan_file(tmp_path, serial, cycles=12)
    words = (sys.executable, "-m", "hornbill", "run", str(plan), "--yes")
    environment = {**os.environ, "HORNBILL_URL": bench.url}
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True, env=environment) as client:
        assert client.stderr is not None
        job = client.stderr.readline().split()[1].rstrip(".")
        client.send_signal(signal.SIGKILL)
    done = cycles_done(bench, job)
    until(lambda: cycles_done(bench, job) > done, 20, "the run ended with its client")
    command("stop")
    until(lambda: job_of(bench, job)["state"] == "failed", 5, "the run goes on")
    assert "stopped" in command("run", "--resume", job, "--yes", code=6)
    command("stop", "--clear")
    assert command.json("run", "--resume", job, "--yes")["result"]["cycles_done"] == 12


def test_a_run_of_a_killed_server_is_resumed_by_the_next_one(tmp_path: Path) -> None:
    words = serving(tmp_path, "--allocator", "on")
    with running(*words) as first:
        first.api.put("/bus", json={"address": "memory:demo"}).raise_for_status()
        first.ready(6)
        # not the arm that hunts, by as much as the limit of the position error
        uid = next(str(one["uid"]) for one in first.servos() if one["model"] == "BLA21-06U-A0")
        plan = plan_file(tmp_path, uid, cycles=8)
        job = hornbill(first.url, "run", plan, "--yes", "--detach").output.strip()
        until(lambda: cycles_done(first, job) >= 2, 30, "no cycles")
        first.process.kill()
        first.process.wait(timeout=10)
    with running(*words) as second:
        second.api.put("/bus", json={"address": "memory:demo"}).raise_for_status()
        second.ready(6)
        found = job_of(second, job)
        assert (found["state"], found["error"]["code"], found["resumable"]) == ("failed", "interrupted", True)
        assert found["result"]["cycles_done"] >= 1
        done = hornbill(second.url, "run", "--resume", job, "--yes", "--json")
        assert done.exit_code == 0, done.output
        counts = job_of(second, job)["result"]["servos"][0]["steps"]
        assert [one["runs"] for one in counts] == [8, 8]
