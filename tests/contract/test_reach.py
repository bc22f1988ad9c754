"""Every operation of the API has a command and a method of the client, or a reason here; and every command is tested.

A new operation fails both tests until it is listed.
"""

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

import hornbill.client
from commands.guides import ROOT, blocks, guides
from contract.document_server import UID, DocumentServer, document
from contract.test_doc_references import commands
from hornbill.cli import app
from hornbill.client import Hornbill, ServerUnreachable, Servo
from hornbill.schema.catalog import Catalog

ROWS = {f"{verb}_{key}" for key in Catalog.load().parameters for verb in ("get", "set")}
"""One route per row, for generated clients: `get`, `set` and Servo.reading, write take the key of any row."""

COMMANDS: dict[str, str] = {
    "accept_drift": "drift accept S",
    "acknowledge_fault": "faults acknowledge S overheat",
    "acknowledge_faults": "faults acknowledge S",
    "import_recording": "recordings import FILE.zip",
    "apply_profile": "profiles apply x S",
    "cancel_job": "jobs cancel 7",
    "change_parameters": "set S angle_p_gain=40",
    "clear_stop": "stop --clear",
    "command_servo": "move S 5",
    "commission": "commission S=3:front",
    "compare": "compare S rom:S",
    "change_role": "bus set-role guest",
    "get_autopilot_plan": "autopilot plan",
    "export_autopilot_parameters": "autopilot export FILE.json",
    "import_autopilot_parameters": "autopilot import FILE.param",
    "get_failsafe": "autopilot failsafe S",
    "get_sim_truth": "sim truth S",
    "connect_bus": "bus connect socketcan:can0",
    "copy_configuration": "copy S profile:x --yes",
    "delete_recording": "recordings delete x.zip",
    "delete_log": "logs delete x.log",
    "delete_profile": "profiles delete x",
    "disconnect_bus": "bus disconnect --yes",
    "dismiss_lost_values": "lost-values dismiss S",
    "download_audit": "audit --csv",
    "download_recording": "recordings export x.zip",
    "download_inventory": "inventory list --csv",
    "download_log": "logs export x.log",
    "delete_run": "runs delete 7",
    "delete_snapshot": "snapshots delete S 7",
    "diagnose_bus": "doctor",
    "export_profile": "profiles export x",
    "export_telemetry_csv": "samples S",
    "factory_reset": "factory-reset S --yes",
    "forget_allocation": "node-ids release S",
    "forget_servo": "inventory forget S --yes",
    "get_recording": "recordings show x.zip",
    "get_bus": "bus show",
    "get_drift": "drift show S",
    "get_health": "health",
    "get_job": "jobs show 7",
    "get_known_servo": "inventory show S",
    "get_log": "logs status",
    "get_position_unit": "position-unit S",
    "get_recorder": "recordings list",
    "get_report": "jobs report 7 --format junit",
    "get_run": "runs show 7",
    "get_run_csv": "runs export 7",
    "get_schema": "export",
    "get_snapshot": "snapshots show S 7",
    "identify_servo": "identify S",
    "import_profile": "profiles import x FILE.toml",
    "update_known_servo": "label S front",
    "list_adapters": "bus adapters",
    "list_allocations": "node-ids list",
    "list_audit": "audit",
    "list_recordings": "recordings list",
    "list_benches": "site",
    "list_candidates": "commission",
    "list_faults": "faults list --all",
    "list_inventory": "inventory list",
    "list_jobs": "jobs list",
    "list_leases": "leases",
    "list_logs": "logs list",
    "list_nodes": "bus nodes",
    "list_parameters": "get S",
    "list_profiles": "profiles list",
    "list_runs": "runs list",
    "list_servos": "list",
    "list_snapshots": "snapshots list S",
    "overlay_runs": "runs compare 7 8",
    "pin_allocation": "node-ids pin S 7",
    "preview_factory_reset": "factory-reset S --dry-run",
    "put_profile": "profiles create x S",
    "recycle_allocations": "node-ids recycle 30 --yes",
    "release_lease": "move S 5",
    "run_plan": "run PLAN.toml --yes",
    "restart_servo": "restart S --yes",
    "restore_drift": "drift restore S --yes",
    "restore_output": "stop --restore --yes --hold 0",
    "resume_job": "jobs resume 7",
    "save_servo": "save S",
    "set_allocator": "node-ids set-allocator on",
    "set_position_unit": "position-unit S radian",
    "improve_servo": "improve S --yes",
    "improve_servos": "improve S S --yes",
    "plan_improve": "improve S --dry-run",
    "measure_mechanics": "mechanics measure S --yes",
    "get_mechanics": "mechanics show S",
    "export_mechanics": "mechanics export S",
    "measure_frequency_response": "frequency-response S --yes",
    "list_frequency_responses": "frequency-responses list",
    "get_frequency_response": "frequency-responses show 7",
    "get_frequency_response_csv": "frequency-responses export 7",
    "delete_frequency_response": "frequency-responses delete 7",
    "get_set_up": "set-up S",
    "put_set_up": "set-up S arm_mm=60",
    "set_torque": "torque S off",
    "start_log": "logs start",
    "step_test": "step-test S --yes",
    "stop": "stop",
    "stop_log": "logs stop",
    "take_lease": "move S 5",
    "take_snapshot": "snapshots create S",
    "create_recording": "recordings create",
}
"""S is a servo. Requests over the socket (`watch`) are not covered here."""

NO_COMMAND: dict[str, str] = {
    "motion control ends with the command that took it": """
        request_lease get_lease_request refuse_lease_request withdraw_lease_request renew_lease
        start_stream get_stream list_streams set_stream_values end_stream command_servos""",
    "sessions of a browser; the command line sends its token": "get_session log_in log_out create_ticket",
    "simulated servos, for tests: Hornbill.sim": """
        add_sim_servo get_sim_servo list_sim_servos change_sim_servo remove_sim_servo
        add_sim_autopilot get_sim_autopilot change_sim_autopilot remove_sim_autopilot
        get_sim_clock set_sim_clock get_sim_chaos start_sim_chaos stop_sim_chaos list_sim_injections""",
    "hornbill tokens uses the data folder: no secret crosses a network": "create_token list_tokens revoke_token",
    "hornbill apply changes many servos from a file": "change_matrix",
    "hornbill samples writes CSV": "export_telemetry_parquet",
    "hornbill restart shows it in its confirmation": "forecast_restart",
    "hornbill move shows them and requires confirmation": "get_cautions",
    "hornbill get reads the whole set and prints the requested part": "get_parameter",
    "hornbill profiles export prints it as a file": "get_profile",
    "hornbill list shows all of it": "get_servo",
    "hornbill stop and hornbill watch show it": "get_stop",
    "for programs that poll": "get_telemetry",
    "files for Prometheus and Grafana, by download": "get_alert_rules get_dashboard",
    "hornbill label also works for servos that are off": "label_servo",
    "hornbill faults list reads each servo": "read_faults",
    "hornbill autopilot verify prompts for each step": """
        begin_verification get_verification begin_verification_step end_verification""",
    "hornbill export, or get for each servo": "read_matrix",
    "hornbill snapshots restore copies from snapshot:N, which is the same": "restore_snapshot",
    "hornbill set changes one or several rows at once": "set_parameter",
    "hornbill watch uses the socket": "set_telemetry stream_events",
    "commands that need the package name it": "get_tuning",
}
"""Operations without a command, by reason."""

CALLS: dict[str, Callable[[Hornbill, Servo], object]] = {
    "accept_drift": lambda _, s: s.history.accept_drift(),
    "acknowledge_fault": lambda _, s: s.acknowledge_faults("overheat"),
    "acknowledge_faults": lambda _, s: s.acknowledge_faults(by="me"),
    "import_recording": lambda h, _: h.records.import_recording("x.zip", b"PK"),
    "apply_profile": lambda h, s: h.apply_profile("x", [s]),
    "cancel_job": lambda h, _: h.jobs.cancel("7"),
    "change_matrix": lambda h, s: h.write_many({s: {"angle_p_gain": 40}}),
    "change_parameters": lambda _, s: s.write_many({"angle_p_gain": 40}),
    "clear_stop": lambda h, _: h.clear_stop(),
    "get_sim_truth": lambda h, s: h.sim.truth(s),
    "list_sim_servos": lambda h, _: h.sim.servos(),
    "get_sim_servo": lambda h, s: h.sim.servo(s),
    "change_sim_servo": lambda h, s: h.sim.set(s, load_pct=20.0),
    "add_sim_servo": lambda h, _: h.sim.add(model="BLA21-06U-A0"),
    "remove_sim_servo": lambda h, s: h.sim.remove(s),
    "get_sim_autopilot": lambda h, _: h.sim.autopilot(),
    "add_sim_autopilot": lambda h, _: h.sim.add_autopilot("px4"),
    "change_sim_autopilot": lambda h, _: h.sim.set_autopilot(armed=True),
    "remove_sim_autopilot": lambda h, _: h.sim.remove_autopilot(),
    "stream_events": lambda h, _: _events(h),
    "get_sim_clock": lambda h, _: h.sim.clock(),
    "set_sim_clock": lambda h, _: h.sim.set_speed("max"),
    "get_sim_chaos": lambda h, _: h.sim.chaos(),
    "start_sim_chaos": lambda h, _: h.sim.start_chaos(1, interval_s=5.0),
    "stop_sim_chaos": lambda h, _: h.sim.stop_chaos(),
    "list_sim_injections": lambda h, _: h.sim.injections(),
    "command_servo": lambda _, s: s.move(5),
    "command_servos": lambda h, s: h.command_many([(s, "angle", 5.0)]),
    "commission": lambda h, s: h.commission([{"uid": s.uid, "servo_id": 3}]),
    "compare": lambda h, s: h.compare(f"servo:{s.uid}", f"rom:{s.uid}"),
    "change_role": lambda h, _: h.bus.set_role("guest"),
    "get_autopilot_plan": lambda h, _: h.autopilot.plan(),
    "export_autopilot_parameters": lambda h, _: h.autopilot.write_parameters({"program": "px4", "outputs": []}),
    "import_autopilot_parameters": lambda h, _: h.autopilot.read_parameters("", "px4"),
    "begin_verification": lambda h, _: h.autopilot.begin_verification({"program": "px4", "outputs": []}),
    "get_verification": lambda h, _: h.autopilot.verification(),
    "begin_verification_step": lambda h, _: h.autopilot.begin_verification_step("neutral"),
    "end_verification": lambda h, _: h.autopilot.end_verification(),
    "get_failsafe": lambda h, s: h.autopilot.failsafe(s.uid),
    "connect_bus": lambda h, _: h.bus.connect("socketcan:can0"),
    "copy_configuration": lambda _, s: s.history.copy("profile:x"),
    "delete_recording": lambda h, _: h.records.delete_recording("x.zip"),
    "delete_log": lambda h, _: h.bus.delete_log("x.log"),
    "delete_profile": lambda h, _: h.delete_profile("x"),
    "disconnect_bus": lambda h, _: h.bus.disconnect(),
    "dismiss_lost_values": lambda _, s: s.history.dismiss_lost(),
    "download_audit": lambda h, _: h.records.audit_csv(since=1.0),
    "download_recording": lambda h, _: h.records.recording("x.zip"),
    "download_inventory": lambda h, _: h.records.servos_csv(),
    "download_log": lambda h, _: h.bus.log_file("x.log"),
    "delete_run": lambda h, _: h.records.delete_run(7),
    "delete_snapshot": lambda _, s: s.history.delete(7),
    "diagnose_bus": lambda h, _: h.doctor(),
    "export_telemetry_csv": lambda _, s: s.samples_csv(60, ["current_angle"]),
    "factory_reset": lambda _, s: s.factory_reset(),
    "forecast_restart": lambda _, s: s.forecast_restart(save=True),
    "forget_allocation": lambda h, s: h.bus.release_node_id(s.uid),
    "forget_servo": lambda h, s: h.records.forget(s.uid, history=True),
    "get_recording": lambda h, _: h.records.recording_content("x.zip"),
    "get_bus": lambda h, _: h.bus.state(),
    "get_cautions": lambda _, s: s.cautions("angle", 170),
    "get_drift": lambda _, s: s.history.drift(),
    "get_health": lambda h, _: h.health(),
    "get_job": lambda h, _: h.jobs.get("7"),
    "get_known_servo": lambda h, s: h.records.servo(s.uid),
    "get_log": lambda h, _: h.bus.log(),
    "get_parameter": lambda _, s: s.reading("angle_p_gain"),
    "get_position_unit": lambda _, s: s.position_unit(),
    "get_profile": lambda h, _: h.profile("x"),
    "get_recorder": lambda h, _: h.records.recorder(),
    "get_report": lambda h, _: h.jobs.report("7", "csv"),
    "get_run": lambda h, _: h.records.run(7),
    "get_run_csv": lambda h, _: h.records.run_csv(7),
    "get_schema": lambda h, _: h.schema(),
    "get_servo": lambda _, s: s.refresh(),
    "get_snapshot": lambda _, s: s.history.snapshot(7),
    "get_stop": lambda h, _: h.stop_state(),
    "get_telemetry": lambda _, s: s.telemetry_state(),
    "identify_servo": lambda _, s: s.identify(),
    "update_known_servo": lambda h, s: h.records.label(s.uid, "front"),
    "label_servo": lambda _, s: s.set_label("front"),
    "list_adapters": lambda h, _: h.bus.adapters(),
    "list_allocations": lambda h, _: h.bus.allocations(),
    "list_audit": lambda h, s: h.records.audit(uid=s.uid, key="origin", action="write", since=1.0, before_id=9),
    "list_recordings": lambda h, _: h.records.recordings(),
    "list_benches": lambda h, _: h.records.benches(),
    "list_candidates": lambda h, _: h.candidates(),
    "list_faults": lambda _, s: s.faults(),
    "list_inventory": lambda h, _: h.records.servos(),
    "list_jobs": lambda h, s: h.jobs.all(kind="save", state="failed", uid=s.uid),
    "list_leases": lambda h, _: h.leases(),
    "list_logs": lambda h, _: h.bus.logs(),
    "list_nodes": lambda h, _: h.bus.nodes(),
    "list_parameters": lambda _, s: s.read_all(),
    "list_profiles": lambda h, _: h.profiles(),
    "list_runs": lambda h, s: h.records.runs(uid=s.uid),
    "list_servos": lambda h, _: h.servos(),
    "list_snapshots": lambda _, s: s.history.snapshots(),
    "overlay_runs": lambda h, _: h.records.overlay([7, 8]),
    "pin_allocation": lambda h, s: h.bus.pin(s.uid, 7),
    "preview_factory_reset": lambda _, s: s.preview_factory_reset(keep_identity=False),
    "put_profile": lambda h, s: h.store_profile("x", s),
    "read_faults": lambda h, s: h.read_faults([s]),
    "read_matrix": lambda h, s: h.read_many([s], ["angle_p_gain"]),
    "recycle_allocations": lambda h, _: h.bus.recycle_node_ids(3600),
    "run_plan": lambda h, s: h.start_plan({"name": "x", "servos": [s.uid], "steps": [{"do": "move", "angle_deg": 5}]}),
    "restart_servo": lambda _, s: s.restart(),
    "restore_drift": lambda _, s: s.history.restore_drift(),
    "restore_output": lambda h, s: h.restore_output([s]),
    "restore_snapshot": lambda _, s: s.history.restore(7, source="rom"),
    "resume_job": lambda h, _: h.jobs.resume("7"),
    "save_servo": lambda _, s: s.save(),
    "set_allocator": lambda h, _: h.bus.set_allocator("on"),
    "set_parameter": lambda _, s: s.write("angle_p_gain", 40),
    "set_position_unit": lambda _, s: s.set_position_unit(None),
    "set_telemetry": lambda _, s: s.telemetry(["current_angle"], 10),
    "improve_servo": lambda _, s: s.improve(),
    "improve_servos": lambda h, s: h.improve([s]),
    "plan_improve": lambda _, s: s.plan_improve(),
    "measure_mechanics": lambda _, s: s.measure_mechanics(["friction"]),
    "get_mechanics": lambda _, s: s.mechanics(),
    "export_mechanics": lambda _, s: s.export_mechanics("mujoco", stall_nm=2.0),
    "measure_frequency_response": lambda _, s: s.frequency_response(),
    "list_frequency_responses": lambda h, s: h.records.frequency_responses(uid=s.uid),
    "get_frequency_response": lambda h, _: h.records.frequency_response(7),
    "get_frequency_response_csv": lambda h, _: h.records.frequency_response_csv(7),
    "delete_frequency_response": lambda h, _: h.records.delete_frequency_response(7),
    "get_set_up": lambda _, s: s.set_up(),
    "put_set_up": lambda _, s: s.put_set_up({"arm_mm": 60.0}),
    "get_tuning": lambda h, _: h.tuning(),
    "set_torque": lambda _, s: s.torque("off"),
    "start_log": lambda h, _: h.bus.start_log(),
    "step_test": lambda _, s: s.step_test(),
    "stop": lambda h, _: h.stop(),
    "stop_log": lambda h, _: h.bus.stop_log(),
    "take_snapshot": lambda _, s: s.history.take(),
    "create_recording": lambda h, _: h.records.create_recording("x"),
    "start_stream": lambda h, s: _stream(h, s),
    "set_stream_values": lambda h, s: _stream(h, s),
    "get_stream": lambda h, s: _stream(h, s),
    "end_stream": lambda h, s: _stream(h, s),
    "take_lease": lambda h, _: _lease(h),
    "renew_lease": lambda h, _: _lease(h),
    "release_lease": lambda h, _: _lease(h),
}

NO_METHOD: dict[str, str] = {
    "between people at pages; a program takes motion control with force and a reason": """
        request_lease get_lease_request refuse_lease_request withdraw_lease_request""",
    "sessions of a browser": "get_session log_in log_out create_ticket",
    "a file, by download or Hornbill.request": "export_profile export_telemetry_parquet import_profile",
    "hornbill tokens, with the data folder": "create_token list_tokens revoke_token",
    "files for Prometheus and Grafana, by download": "get_alert_rules get_dashboard",
    "a program knows the streams it started": "list_streams",
}
"""Operations without a method of the client, by reason."""

PLAN = f"""
name = "endurance"
servos = ["{UID}"]
cycles = 1000

[[steps]]
do = "move"
angle_deg = 10
"""

CONFIRMED = (
    "restart S", "factory-reset S", "undo S", "snapshots restore S 7", "copy S profile:x", "drift restore S",
    "bus disconnect", "node-ids recycle 3", "stop --restore", "inventory forget S", "step-test S",
    "frequency-response S", "improve S", "mechanics measure S", "run PLAN.toml",
)  # fmt: skip
"""Commands that require confirmation."""


def _stream(hornbill: Hornbill, servo: Servo) -> None:
    with hornbill.stream([servo], rate_hz=50) as stream:
        stream.put({servo: 5.0}, speed_deg_s=30)
        stream.state()


def _events(hornbill: Hornbill) -> None:
    with pytest.raises(ServerUnreachable, match="did not return within 0 s"):
        next(hornbill.events(reconnect_s=0.0))


def _lease(hornbill: Hornbill) -> None:
    with hornbill.lease("test", heartbeat=False) as lease:
        lease.renew()


@pytest.mark.parametrize(("done", "not_done"), [(COMMANDS, NO_COMMAND), (CALLS, NO_METHOD)], ids=["command", "method"])
def test_every_operation_is_listed_once(done: dict[str, Any], not_done: dict[str, str]) -> None:
    every = {one["operationId"] for verbs in document()["paths"].values() for one in verbs.values()}
    listed = [*done, *" ".join(not_done.values()).split()]
    assert sorted(listed) == sorted(every - ROWS)


def every_command(group: Any, *words: str) -> Iterator[tuple[str, Any]]:
    """Every command with its name; groups are left out."""
    for name, one in getattr(group, "commands", {}).items():
        if hasattr(one, "commands"):
            yield from every_command(one, *words, name)
        else:
            yield " ".join((*words, name)), one


EVERY: dict[str, Any] = dict(every_command(typer.main.get_command(app)))


def name_of(words: list[str]) -> str:
    """The command that a command line begins with."""
    return next((" ".join(words[:n]) for n in (2, 1) if " ".join(words[:n]) in EVERY), "")


def test_every_command_is_run_by_a_test() -> None:
    """By one in this file, as part of a guide, or by a test that contains its words."""
    run = {name_of(words.split()) for words in (*COMMANDS.values(), *CONFIRMED)}
    run |= {
        name_of(words)
        for guide in guides()
        for block in blocks(guide)
        if not block.needs
        for words in commands(block.script)
    }
    folders = ("commands", "unit/cli", "e2e", "socketcan")
    files = (file for folder in folders for file in (ROOT / "tests" / folder).rglob("*.py"))
    source = "".join(file.read_text(encoding="utf-8") for file in files)
    quoted = {name for name in EVERY if '"{}"'.format('", "'.join(name.split())) in source}
    assert EVERY.keys() - run - quoted == set()


def run(
    words: str, server: DocumentServer, monkeypatch: pytest.MonkeyPatch, folder: Path, *more: str
) -> tuple[int, str, str]:
    monkeypatch.setattr(hornbill.client, "Hornbill", partial(Hornbill, transport=server.transport()))
    given = [str(folder / word) if word.startswith(("FILE", "PLAN")) else word for word in words.split()]
    given = [word.replace("S", UID) if word in ("S", "rom:S") or word.startswith("S=") else word for word in given]
    done = CliRunner().invoke(app, [*given, *more])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "FILE.zip").write_bytes(b"PK")
    (tmp_path / "FILE.toml").write_text("[values]\n")
    (tmp_path / "PLAN.toml").write_text(PLAN)
    (tmp_path / "FILE.json").write_text('{"program": "px4", "outputs": []}')
    (tmp_path / "FILE.param").write_text("")
    return tmp_path


def has_json(words: str) -> bool:
    return any("--json" in one.opts for one in EVERY[name_of(words.split())].params)


@pytest.mark.parametrize("operation", sorted(COMMANDS))
def test_the_command_requests_its_operation(operation: str, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    server = DocumentServer()
    code, _, errors = run(COMMANDS[operation], server, monkeypatch, folder)
    assert operation in server.requested, f"{COMMANDS[operation]}: {server.requested} {errors}"
    assert code in (0, 1), errors
    if operation not in ("diagnose_bus", "stop", "clear_stop"):  # their exit code reports findings
        assert code == 0, errors


@pytest.mark.parametrize("words", sorted(set(COMMANDS.values())))
def test_a_command_prints_json_and_accepts_empty_responses(
    words: str, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    if has_json(words) and "--csv" not in words:
        _, out, errors = run(words, DocumentServer(), monkeypatch, folder, "--json")
        assert json.loads(out) is not None, errors
    if " S" not in words:
        code, _, errors = run(words, DocumentServer(full=False), monkeypatch, folder)
        assert code in (0, 1), errors


@pytest.mark.parametrize("words", CONFIRMED)
def test_without_a_terminal_a_command_that_requires_confirmation_changes_nothing(
    words: str, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    for more in ((), ("--json",)) if has_json(words) else ((),):
        server = DocumentServer()
        code, _, errors = run(words, server, monkeypatch, folder, *more)
        assert code == 2
        assert "--yes" in errors
        reading = ("get_", "list_", "compare", "forecast_", "preview_")
        assert [one for one in server.requested if not one.startswith(reading)] == []


@pytest.mark.parametrize("operation", sorted(CALLS))
def test_the_client_requests_the_operation_as_documented(operation: str) -> None:
    server = DocumentServer()
    with Hornbill("http://127.0.0.1", transport=server.transport()) as client:
        (servo,) = client.servos()
        CALLS[operation](client, servo)
    assert operation in server.requested
