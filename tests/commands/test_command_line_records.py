"""The commands for history, faults, jobs and the inventory, with a running server."""

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
    """A server whose servos these tests may change."""
    with ready_demo(2, seed=3) as one:
        yield one


@pytest.fixture
def serial(bench: Demo) -> str:
    return str(bench.api.get("/servos").json()[0]["serial"])


def output(bench: Demo, *words: str, code: int = 0) -> str:
    """The output of a command that exits with `code`."""
    done = hornbill(bench, *words, sub=words[0] in GROUPS)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def value(bench: Demo, serial: str, key: str = "angle_p_gain") -> Any:
    return json.loads(output(bench, "get", serial, key, "--json"))["value"]


def test_values_lost_in_a_power_cut_are_shown_restored_and_dismissed(bench: Demo, serial: str) -> None:
    uid = bench.api.get("/servos").json()[0]["uid"]

    def cut() -> None:
        for power in ("off", "on"):
            assert bench.api.patch(f"/sim/servos/{uid}", json={"power": power}).status_code == 200
            time.sleep(1)
        until = time.monotonic() + 30
        while not bench.api.get(f"/servos/{uid}").json()["lost"]:
            assert time.monotonic() < until
            time.sleep(0.1)

    assert "No lost values." in output(bench, "lost-values", "show", serial)
    before = value(bench, serial)
    output(bench, "set", serial, "angle_p_gain=31")
    time.sleep(3)
    cut()
    assert value(bench, serial) == before
    assert [one["value"] for one in json.loads(output(bench, "lost-values", "show", serial, "--json"))] == [31]
    assert "31" in output(bench, "lost-values", "restore", serial)
    assert value(bench, serial) == 31
    assert "has no lost values" in output(bench, "lost-values", "restore", serial, code=1)
    cut()
    output(bench, "lost-values", "dismiss", serial)
    assert json.loads(output(bench, "lost-values", "show", serial, "--json")) == []


def test_undo_reverts_the_last_change_and_a_second_undo_restores_it(bench: Demo, serial: str) -> None:
    before = value(bench, serial)
    output(bench, "set", serial, "angle_p_gain=33")
    assert f"33 → {before}" in output(bench, "undo", serial, "--dry-run")
    assert value(bench, serial) == 33
    assert "without a terminal" in output(bench, "undo", serial, code=2)
    assert value(bench, serial) == 33
    output(bench, "undo", serial, "--yes")
    assert value(bench, serial) == before
    output(bench, "undo", serial, "--yes")
    assert value(bench, serial) == 33
    output(bench, "undo", serial, "--yes")


def test_a_snapshot_is_created_compared_restored_and_deleted(bench: Demo, serial: str) -> None:
    taken = json.loads(output(bench, "snapshots", "create", serial, "--reason", "trial", "--json"))
    number = str(taken["id"])
    gain = taken["values"]["angle_p_gain"]
    output(bench, "set", serial, f"angle_p_gain={gain + 5}", "smoothing=false")
    assert "2 rows differ" in output(bench, "snapshots", "compare", serial, number)
    assert f"snapshot:{number}" in output(bench, "compare", f"snapshot:{number}", serial)
    output(bench, "snapshots", "restore", serial, number, "--key", "smoothing", "--yes")
    assert (value(bench, serial, "smoothing"), value(bench, serial)) == (True, gain + 5)
    output(bench, "snapshots", "restore", serial, number, "--yes", "--save")
    assert value(bench, serial) == gain
    assert "angle_p_gain" in output(bench, "snapshots", "show", serial, number)
    output(bench, "snapshots", "delete", serial, number)
    assert "unknown_snapshot" in output(bench, "snapshots", "show", serial, number, code=1)


def test_copy_changes_only_the_given_rows(bench: Demo, serial: str) -> None:
    other = str(bench.api.get("/servos").json()[1]["serial"])
    output(bench, "set", serial, "angle_p_gain=37", "angle_boost=7")
    was = value(bench, other, "angle_boost")
    output(bench, "copy", other, serial, "--key", "angle_p_gain", "--yes")
    assert (value(bench, other), value(bench, other, "angle_boost")) == (37, was)


def test_a_restart_shows_what_it_loses_and_has_a_report(bench: Demo, serial: str) -> None:
    rom = json.loads(output(bench, "get", serial, "angle_d_gain", "--json"))["rom"]
    output(bench, "set", serial, f"angle_d_gain={rom + 1}")
    assert "angle_d_gain" in output(bench, "restart", serial, code=2), (
        "without confirmation it shows what would be lost"
    )
    assert value(bench, serial, "angle_d_gain") == rom + 1
    job = json.loads(output(bench, "restart", serial, "--yes", "--json"))
    assert value(bench, serial, "angle_d_gain") == rom
    assert f"{job['id']}  restart  succeeded" in output(bench, "jobs", "list", "--servo", serial)
    assert "Every row read" in output(bench, "jobs", "wait", job["id"])
    suite = ElementTree.fromstring(output(bench, "jobs", "report", job["id"], "--format", "junit"))
    assert (suite.tag, suite.get("failures"), suite.get("tests")) == ("testsuites", "0", str(len(job["steps"])))
    assert output(bench, "jobs", "report", job["id"], "--format", "csv").startswith("job,kind,")
    assert "cannot be resumed" in output(bench, "jobs", "resume", job["id"], code=6)
    assert "unknown_job" in output(bench, "jobs", "wait", "unknown", code=1)


def test_a_factory_reset_shows_its_changes_and_keeps_the_identity(bench: Demo, serial: str) -> None:
    output(bench, "set", serial, "angle_p_gain=21")
    identity = value(bench, serial, "servo_id")
    shown = output(bench, "factory-reset", serial, "--dry-run")
    assert "angle_p_gain" in shown
    assert f"servo_id {identity}" in shown
    assert value(bench, serial) == 21
    assert "--dry-run" in output(bench, "factory-reset", serial, code=2)
    output(bench, "factory-reset", serial, "--yes")
    assert (value(bench, serial) != 21, value(bench, serial, "servo_id")) == (True, identity)


def test_a_fault_is_listed_and_acknowledged(bench: Demo, serial: str) -> None:
    uid = bench.api.get("/servos").json()[0]["uid"]
    assert "No faults." in output(bench, "faults", "list", serial)
    bit = next(one["key"] for one in bench.api.get("/schema").json()["faults"] if one["level"] == "notification")
    bench.api.patch(f"/sim/servos/{uid}", json={"faults": {bit: True}}).raise_for_status()
    until = time.monotonic() + 20
    while bit not in (listed := output(bench, "faults", "list", serial)):
        assert time.monotonic() < until, listed
    assert "–" in listed, "not acknowledged"
    output(bench, "faults", "acknowledge", serial, bit)
    assert "command line" in output(bench, "faults", "list", serial)
    assert "unknown_fault" in output(bench, "faults", "acknowledge", serial, "nonsense", code=1)
    bench.api.patch(f"/sim/servos/{uid}", json={"faults": {bit: False}}).raise_for_status()


def test_a_step_test_is_recorded_and_ends_with_torque_off(bench: Demo, serial: str, tmp_path: Path) -> None:
    assert "without a terminal" in output(bench, "step-test", serial, code=2)
    output(bench, "step-test", serial, "--step", "4", "--note", "bare horn", "--yes")
    assert value(bench, serial, "torque_mode") == "off"
    (run,) = json.loads(output(bench, "runs", "list", "--json"))
    assert (run["step_deg"], run["note"]) == (4, "bare horn")
    number = str(run["id"])
    assert "settling time" in output(bench, "runs", "show", number)
    (tmp_path / "run.csv").write_text(output(bench, "runs", "export", number))
    assert (tmp_path / "run.csv").read_text().startswith("step,direction,t_s,angle_deg")
    output(bench, "runs", "delete", number)
    assert "unknown_run" in output(bench, "runs", "show", number, code=1)


def test_the_inventory_is_listed_and_a_connected_servo_cannot_be_forgotten(bench: Demo, serial: str) -> None:
    output(bench, "label", serial, "Rudder")
    assert "Rudder" in output(bench, "inventory", "list")
    assert serial in output(bench, "inventory", "list", "--csv")
    assert "angle_p_gain" in output(bench, "inventory", "show", "Rudder")
    output(bench, "inventory", "annotate", "Rudder", "New gears")
    assert "New gears" in output(bench, "inventory", "show", "Rudder")
    assert "busy" in output(bench, "inventory", "forget", "Rudder", "--yes", code=6)
    assert "label" in output(bench, "audit", "--servo", "Rudder", "--action", "label")
    assert output(bench, "audit", "--csv").startswith("id,time,by,")
    output(bench, "label", serial, "")


def test_bus_adapters_and_node_ids_are_shown_and_node_ids_pinned(bench: Demo, serial: str) -> None:
    assert "memory:demo" in output(bench, "bus", "show")
    assert "connected" in output(bench, "bus", "adapters")
    assert "This server." in output(bench, "bus", "nodes")
    assert "node IDs free" in output(bench, "node-ids", "list")
    assert "node ID 77" in output(bench, "node-ids", "pin", serial, "77")
    output(bench, "node-ids", "release", serial)
    assert "No leases." in output(bench, "leases")
    assert "bus active" in output(bench, "health")
    assert "without a terminal" in output(bench, "bus", "disconnect", code=2)
    assert "active" in output(bench, "bus", "show")
