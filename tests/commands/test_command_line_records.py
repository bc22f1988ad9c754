"""The commands about history, faults, jobs and what the server keeps, against a server with simulated servos."""

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from commands.test_command_line import hornbill
from e2e.servers import Demo, ready_demo

GROUPS = ("bus", "drift", "faults", "node-ids", "inventory", "jobs", "lost-values", "recordings", "runs", "snapshots")


@pytest.fixture(scope="module")
def bench() -> Iterator[Demo]:
    """A server of our own."""
    with ready_demo(2, seed=3) as one:
        yield one


@pytest.fixture
def serial(bench: Demo) -> str:
    return str(bench.api.get("/servos").json()[0]["serial"])


def said(bench: Demo, *words: str, code: int = 0) -> str:
    """What a command prints, when it ends with this code."""
    done = hornbill(bench, *words, sub=words[0] in GROUPS)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def held(bench: Demo, serial: str, key: str = "angle_p_gain") -> Any:
    return json.loads(said(bench, "get", serial, key, "--json"))["value"]


def test_ram_values_that_a_power_cut_took_are_shown_applied_again_and_dismissed(bench: Demo, serial: str) -> None:
    uid = bench.api.get("/servos").json()[0]["uid"]

    def cut() -> None:
        for power in ("off", "on"):
            assert bench.api.patch(f"/sim/servos/{uid}", json={"power": power}).status_code == 200
            time.sleep(1)
        until = time.monotonic() + 30
        while not bench.api.get(f"/servos/{uid}").json()["lost"]:
            assert time.monotonic() < until
            time.sleep(0.1)

    assert "No lost values." in said(bench, "lost-values", "show", serial)
    before = held(bench, serial)
    said(bench, "set", serial, "angle_p_gain=31")
    time.sleep(3)
    cut()
    assert held(bench, serial) == before
    assert [one["value"] for one in json.loads(said(bench, "lost-values", "show", serial, "--json"))] == [31]
    assert "31" in said(bench, "lost-values", "restore", serial)
    assert held(bench, serial) == 31
    assert "has no lost values" in said(bench, "lost-values", "restore", serial, code=1)
    cut()
    said(bench, "lost-values", "dismiss", serial)
    assert json.loads(said(bench, "lost-values", "show", serial, "--json")) == []


def test_an_undo_takes_the_last_change_back_and_a_second_one_brings_it_again(bench: Demo, serial: str) -> None:
    before = held(bench, serial)
    said(bench, "set", serial, "angle_p_gain=33")
    assert f"33 → {before}" in said(bench, "undo", serial, "--dry-run")
    assert held(bench, serial) == 33
    assert "without a terminal" in said(bench, "undo", serial, code=2)
    assert held(bench, serial) == 33
    said(bench, "undo", serial, "--yes")
    assert held(bench, serial) == before
    said(bench, "undo", serial, "--yes")
    assert held(bench, serial) == 33
    said(bench, "undo", serial, "--yes")


def test_a_snapshot_is_taken_compared_restored_and_deleted(bench: Demo, serial: str) -> None:
    taken = json.loads(said(bench, "snapshots", "create", serial, "--reason", "trial", "--json"))
    number = str(taken["id"])
    gain = taken["values"]["angle_p_gain"]
    said(bench, "set", serial, f"angle_p_gain={gain + 5}", "smoothing=false")
    assert "2 rows differ" in said(bench, "snapshots", "compare", serial, number)
    assert f"snapshot:{number}" in said(bench, "compare", f"snapshot:{number}", serial)
    said(bench, "snapshots", "restore", serial, number, "--key", "smoothing", "--yes")
    assert (held(bench, serial, "smoothing"), held(bench, serial)) == (True, gain + 5)
    said(bench, "snapshots", "restore", serial, number, "--yes", "--save")
    assert held(bench, serial) == gain
    assert "angle_p_gain" in said(bench, "snapshots", "show", serial, number)
    said(bench, "snapshots", "delete", serial, number)
    assert "unknown_snapshot" in said(bench, "snapshots", "show", serial, number, code=1)


def test_another_servo_is_copied_by_its_name_and_only_the_rows_named(bench: Demo, serial: str) -> None:
    other = str(bench.api.get("/servos").json()[1]["serial"])
    said(bench, "set", serial, "angle_p_gain=37", "angle_boost=7")
    was = held(bench, other, "angle_boost")
    said(bench, "copy", other, serial, "--key", "angle_p_gain", "--yes")
    assert (held(bench, other), held(bench, other, "angle_boost")) == (37, was)


def test_a_restart_loses_what_is_only_in_ram_and_is_a_job_with_a_report(bench: Demo, serial: str) -> None:
    rom = json.loads(said(bench, "get", serial, "angle_d_gain", "--json"))["rom"]
    said(bench, "set", serial, f"angle_d_gain={rom + 1}")
    assert "angle_d_gain" in said(bench, "restart", serial, code=2), "it says what is lost, and does not restart"
    assert held(bench, serial, "angle_d_gain") == rom + 1
    job = json.loads(said(bench, "restart", serial, "--yes", "--json"))
    assert held(bench, serial, "angle_d_gain") == rom
    assert f"{job['id']}  restart  succeeded" in said(bench, "jobs", "list", "--servo", serial)
    assert "Every row read" in said(bench, "jobs", "wait", job["id"])
    suite = ElementTree.fromstring(said(bench, "jobs", "report", job["id"], "--format", "junit"))
    assert (suite.tag, suite.get("failures"), suite.get("tests")) == ("testsuites", "0", str(len(job["steps"])))
    assert said(bench, "jobs", "report", job["id"], "--format", "csv").startswith("job,kind,")
    assert "cannot be resumed" in said(bench, "jobs", "resume", job["id"], code=6)
    assert "unknown_job" in said(bench, "jobs", "wait", "nobody", code=1)


def test_a_factory_reset_shows_what_it_would_change_and_keeps_identity(bench: Demo, serial: str) -> None:
    said(bench, "set", serial, "angle_p_gain=21")
    identity = held(bench, serial, "servo_id")
    shown = said(bench, "factory-reset", serial, "--dry-run")
    assert "angle_p_gain" in shown
    assert f"servo_id {identity}" in shown
    assert held(bench, serial) == 21
    assert "--yes, or --dry-run" in said(bench, "factory-reset", serial, code=2)
    said(bench, "factory-reset", serial, "--yes")
    assert (held(bench, serial) != 21, held(bench, serial, "servo_id")) == (True, identity)


def test_a_fault_is_listed_with_its_advice_and_acknowledged(bench: Demo, serial: str) -> None:
    uid = bench.api.get("/servos").json()[0]["uid"]
    assert "No fault." in said(bench, "faults", "list", serial)
    bit = next(one["key"] for one in bench.api.get("/schema").json()["faults"] if one["level"] == "notification")
    bench.api.patch(f"/sim/servos/{uid}", json={"faults": {bit: True}}).raise_for_status()
    until = time.monotonic() + 20
    while bit not in (listed := said(bench, "faults", "list", serial)):
        assert time.monotonic() < until, listed
    assert "nobody" in listed
    said(bench, "faults", "acknowledge", serial, bit)
    assert "command line" in said(bench, "faults", "list", serial)
    assert "unknown_fault" in said(bench, "faults", "acknowledge", serial, "nonsense", code=1)
    bench.api.patch(f"/sim/servos/{uid}", json={"faults": {bit: False}}).raise_for_status()


def test_a_step_is_measured_and_torque_is_off_afterwards(bench: Demo, serial: str, tmp_path: Path) -> None:
    assert "without a terminal" in said(bench, "step-test", serial, code=2)
    said(bench, "step-test", serial, "--step", "4", "--note", "bare horn", "--yes")
    assert held(bench, serial, "torque_mode") == "off"
    (run,) = json.loads(said(bench, "runs", "list", "--json"))
    assert (run["step_deg"], run["note"]) == (4, "bare horn")
    number = str(run["id"])
    assert "settling time" in said(bench, "runs", "show", number)
    (tmp_path / "run.csv").write_text(said(bench, "runs", "export", number))
    assert (tmp_path / "run.csv").read_text().startswith("step,direction,t_s,angle_deg")
    said(bench, "runs", "delete", number)
    assert "unknown_run" in said(bench, "runs", "show", number, code=1)


def test_what_the_server_keeps_is_listed_and_a_servo_that_is_there_is_not_forgotten(bench: Demo, serial: str) -> None:
    said(bench, "label", serial, "Rudder")
    assert "Rudder" in said(bench, "inventory", "list")
    assert serial in said(bench, "inventory", "list", "--csv")
    assert "angle_p_gain" in said(bench, "inventory", "show", "Rudder")
    said(bench, "inventory", "annotate", "Rudder", "New gears")
    assert "New gears" in said(bench, "inventory", "show", "Rudder")
    assert "busy" in said(bench, "inventory", "forget", "Rudder", "--yes", code=6)
    assert "label" in said(bench, "audit", "--servo", "Rudder", "--action", "label")
    assert said(bench, "audit", "--csv").startswith("id,time,by,")
    said(bench, "label", serial, "")


def test_the_bus_its_node_ids_and_adapters_are_shown_and_pinned(bench: Demo, serial: str) -> None:
    assert "memory:demo" in said(bench, "bus", "show")
    assert "connected" in said(bench, "bus", "adapters")
    assert "This server." in said(bench, "bus", "nodes")
    assert "node IDs free" in said(bench, "node-ids", "list")
    assert "node ID 77" in said(bench, "node-ids", "pin", serial, "77")
    said(bench, "node-ids", "release", serial)
    assert "No leases." in said(bench, "leases")
    assert "bus active" in said(bench, "health")
    assert "without a terminal" in said(bench, "bus", "disconnect", code=2)
    assert "active" in said(bench, "bus", "show")
