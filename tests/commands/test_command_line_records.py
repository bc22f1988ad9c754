"""The commands for history, faults, jobs and the inventory, with a running server."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from commands.command_line import CommandLine
from e2e.servers import Server, until


def test_values_lost_in_a_power_cut_are_shown_restored_and_dismissed(
    bench: Server, command: CommandLine, serial: str, uids: list[str]
) -> None:
    uid = uids[0]

    def servo() -> dict[str, Any]:
        return bench.api.get(f"/servos/{uid}").json()

    def cut() -> None:
        until(lambda: (servo()["uptime_s"] or 0) >= 2, 60, "a restart would be unknown")
        for power in ("off", "on"):
            bench.api.patch(f"/sim/servos/{uid}", json={"power": power}).raise_for_status()
        until(lambda: servo()["lost"], 60, "nothing was lost")

    assert "No lost values." in command("lost-values", "show", serial)
    before = command.value(serial)
    command("set", serial, f"angle_p_gain={before + 1}")
    cut()
    assert command.value(serial) == before
    assert [one["value"] for one in command.json("lost-values", "show", serial)] == [before + 1]
    assert str(before + 1) in command("lost-values", "restore", serial)
    assert command.value(serial) == before + 1
    assert "has no lost values" in command("lost-values", "restore", serial, code=1)
    cut()
    command("lost-values", "dismiss", serial)
    assert command.json("lost-values", "show", serial) == []


def test_undo_reverts_the_last_change_and_a_second_undo_restores_it(command: CommandLine, serial: str) -> None:
    before = command.value(serial)
    command("set", serial, f"angle_p_gain={before + 1}")
    assert f"{before + 1} → {before}" in command("undo", serial, "--dry-run")
    assert command.value(serial) == before + 1
    assert "without a terminal" in command("undo", serial, code=2)
    assert command.value(serial) == before + 1
    command("undo", serial, "--yes")
    assert command.value(serial) == before
    command("undo", serial, "--yes")
    assert command.value(serial) == before + 1
    command("undo", serial, "--yes")


def test_a_snapshot_is_created_compared_restored_and_deleted(command: CommandLine, serial: str) -> None:
    taken = command.json("snapshots", "create", serial, "--reason", "trial")
    number = str(taken["id"])
    gain, smoothing = (taken["values"][key] for key in ("angle_p_gain", "smoothing"))
    command("set", serial, f"angle_p_gain={gain + 5}", f"smoothing={str(not smoothing).lower()}")
    assert "2 rows differ" in command("snapshots", "compare", serial, number)
    assert f"snapshot:{number}" in command("compare", f"snapshot:{number}", serial)
    command("snapshots", "restore", serial, number, "--key", "smoothing", "--yes")
    assert (command.value(serial, "smoothing"), command.value(serial)) == (smoothing, gain + 5)
    command("snapshots", "restore", serial, number, "--yes", "--save")
    assert command.value(serial) == gain
    assert "angle_p_gain" in command("snapshots", "show", serial, number)
    command("snapshots", "delete", serial, number)
    assert "unknown_snapshot" in command("snapshots", "show", serial, number, code=1)


def test_copy_changes_only_the_given_rows(command: CommandLine, serials: list[str]) -> None:
    serial, other = serials
    command("set", serial, "angle_p_gain=37", "angle_boost=7")
    was = command.value(other, "angle_boost")
    command("copy", other, serial, "--key", "angle_p_gain", "--yes")
    assert (command.value(other), command.value(other, "angle_boost")) == (37, was)


def test_a_restart_shows_what_it_loses_and_has_a_report(command: CommandLine, serial: str) -> None:
    rom = command.value(serial, "angle_d_gain", "rom")
    command("set", serial, f"angle_d_gain={rom + 1}")
    assert "angle_d_gain" in command("restart", serial, code=2), "without confirmation it shows what would be lost"
    assert command.value(serial, "angle_d_gain") == rom + 1
    job = command.json("restart", serial, "--yes")
    assert command.value(serial, "angle_d_gain") == rom
    listed = [row.split()[:3] for row in command("jobs", "list", "--servo", serial).splitlines()]
    assert [job["id"], "restart", "succeeded"] in listed
    assert "Every row read" in command("jobs", "wait", job["id"])
    suite = ElementTree.fromstring(command("jobs", "report", job["id"], "--format", "junit"))
    assert (suite.tag, suite.get("failures"), suite.get("tests")) == ("testsuites", "0", str(len(job["steps"])))
    assert command("jobs", "report", job["id"], "--format", "csv").startswith("job,kind,")
    assert "cannot be resumed" in command("jobs", "resume", job["id"], code=6)
    assert "unknown_job" in command("jobs", "wait", "unknown", code=1)


def test_a_factory_reset_shows_its_changes_and_keeps_the_identity(command: CommandLine, serial: str) -> None:
    command("set", serial, "angle_p_gain=21")
    identity = command.value(serial, "servo_id")
    shown = command("factory-reset", serial, "--dry-run")
    assert "angle_p_gain" in shown
    assert f"servo_id {identity}" in shown
    assert command.value(serial) == 21
    assert "--dry-run" in command("factory-reset", serial, code=2)
    command("factory-reset", serial, "--yes")
    assert (command.value(serial) != 21, command.value(serial, "servo_id")) == (True, identity)


def test_a_fault_is_listed_and_acknowledged(bench: Server, command: CommandLine, serial: str, uids: list[str]) -> None:
    sim = f"/sim/servos/{uids[0]}"
    assert "No faults." in command("faults", "list", serial)
    bit = next(one["key"] for one in bench.api.get("/schema").json()["faults"] if one["level"] == "notification")
    bench.api.patch(sim, json={"faults": {bit: True}}).raise_for_status()
    until(lambda: bit in command("faults", "list", serial), 60, "it is not listed")
    assert "–" in command("faults", "list", serial), "not acknowledged"
    command("faults", "acknowledge", serial, bit)
    assert "command line" in command("faults", "list", serial)
    assert "unknown_fault" in command("faults", "acknowledge", serial, "nonsense", code=1)
    bench.api.patch(sim, json={"faults": {bit: False}}).raise_for_status()


def test_a_step_test_is_recorded_and_ends_with_torque_off(command: CommandLine, serial: str, tmp_path: Path) -> None:
    assert "without a terminal" in command("step-test", serial, code=2)
    command("step-test", serial, "--step", "4", "--note", "bare horn", "--yes")
    assert command.value(serial, "torque_mode") == "off"
    (run,) = (one for one in command.json("runs", "list") if one["note"] == "bare horn")
    assert run["step_deg"] == 4
    number = str(run["id"])
    assert "settling time" in command("runs", "show", number)
    (tmp_path / "run.csv").write_text(command("runs", "export", number))
    assert (tmp_path / "run.csv").read_text().startswith("step,direction,t_s,angle_deg")
    command("runs", "delete", number)
    assert "unknown_run" in command("runs", "show", number, code=1)


def test_a_frequency_response_is_measured_with_its_set_up_shown_exported_and_deleted(
    command: CommandLine, serial: str
) -> None:
    command("set-up", serial, "arm_mm=60", "mass_g=120", "mounting=vice")
    assert command.json("set-up", serial)["mass_g"] == 120
    assert command.json("set-up", serial, "mass_g=", "arm_mm=")["mass_g"] is None
    assert "invalid_value" in command("set-up", serial, "mounting=desk", code=1)
    short = ("--from", "2", "--to", "8", "--duration", "3", "--note", "in a vice")
    assert "without a terminal" in command("frequency-response", serial, *short, code=2)
    command("frequency-response", serial, *short, "--yes")
    assert command.value(serial, "torque_mode") == "off"
    (run,) = (one for one in command.json("frequency-responses", "list") if one["note"] == "in a vice")
    assert run["set_up"]["mounting"] == "vice"
    number = str(run["id"])
    assert run["verdict"]["text"] in command("frequency-responses", "list")
    assert "95 %" in command("frequency-responses", "show", number)
    assert command("frequency-responses", "export", number).startswith("amplitude_deg,frequency_hz")
    command("frequency-responses", "delete", number)
    assert "unknown_run" in command("frequency-responses", "show", number, code=1)
    command("set-up", serial, "mounting=")


def test_the_inventory_is_listed_and_a_connected_servo_cannot_be_forgotten(command: CommandLine, serial: str) -> None:
    command("label", serial, "Rudder")
    assert "Rudder" in command("inventory", "list")
    assert serial in command("inventory", "list", "--csv")
    (own,) = command.json("inventory", "list", "udde")
    assert own["bench"] in command("inventory", "list", own["serial"])
    assert serial not in command("inventory", "list", "nowhere", "--csv")
    assert "angle_p_gain" in command("inventory", "show", "Rudder")
    command("inventory", "annotate", "Rudder", "New gears")
    assert "New gears" in command("inventory", "show", "Rudder")
    assert "(this)" in command("site")
    assert "busy" in command("inventory", "forget", "Rudder", "--yes", code=6)
    assert "label" in command("audit", "--servo", "Rudder", "--action", "label")
    assert command("audit", "--csv").startswith("id,time,by,")
    command("label", serial, "")


def test_bus_adapters_and_node_ids_are_shown_and_node_ids_pinned(command: CommandLine, serial: str) -> None:
    assert "memory:demo" in command("bus", "show")
    assert "connected" in command("bus", "adapters")
    assert "This server." in command("bus", "nodes")
    assert "node IDs free" in command("node-ids", "list")
    assert "node ID 77" in command("node-ids", "pin", serial, "77")
    command("node-ids", "release", serial)
    assert "No leases." in command("leases")
    assert "bus active" in command("health")
    assert "without a terminal" in command("bus", "disconnect", code=2)
    assert "active" in command("bus", "show")
