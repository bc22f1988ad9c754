"""Every operation of the API can be done from the command line and by the client, or it is said here why not.

A new operation fails both tests until somebody has decided.
"""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

import hornbill.client
from contract.answering import UID, Answering, document
from hornbill.cli import app
from hornbill.client import Hornbill, Servo
from hornbill.schema.catalog import Catalog

ROWS = {f"{verb}_{key}" for key in Catalog.load().parameters for verb in ("get", "set")}
"""A route a row, for programs made from the document: `get`, `set` and Servo.reading, write do all of them by key."""

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
    "restart_servo": "restart S --yes",
    "restore_drift": "drift restore S --yes",
    "restore_output": "stop --restore --yes --hold 0",
    "resume_job": "jobs resume 7",
    "save_servo": "save S",
    "set_allocator": "node-ids set-allocator on",
    "set_position_unit": "position-unit S radian",
    "set_torque": "torque S off",
    "start_log": "logs start",
    "step_test": "step-test S --yes",
    "stop": "stop",
    "stop_log": "logs stop",
    "take_lease": "move S 5",
    "take_snapshot": "snapshots create S",
    "create_recording": "recordings create",
}
"""S is a servo. What a command does over the socket is not seen here: `watch`."""

LEASE_ENDS = "motion control ends with the command that took it"
BROWSER = "how a browser comes in; the command line sends its token"
BENCH = "what a bench could do to a simulated servo: for tests, by the client's ask"
NO_COMMAND: dict[str, str] = {
    "add_sim_servo": BENCH,
    "create_token": "hornbill tokens create writes the data folder, before a server runs: no secret crosses a network",
    "request_lease": LEASE_ENDS,
    "start_stream": LEASE_ENDS,
    "change_matrix": "hornbill apply takes many servos from a file",
    "change_sim_servo": BENCH,
    "command_servos": LEASE_ENDS,
    "end_stream": LEASE_ENDS,
    "export_telemetry_parquet": "hornbill samples writes CSV, and a terminal can do nothing with Parquet",
    "forecast_restart": "part of the question of hornbill restart, which nobody is asked here",
    "get_cautions": "hornbill move says them, and refuses until they are confirmed",
    "get_lease_request": LEASE_ENDS,
    "get_parameter": "hornbill get reads the whole set, and prints what was asked for of it",
    "get_profile": "hornbill profiles export prints it as the file that profiles import takes",
    "get_servo": "hornbill list has all of it",
    "get_session": BROWSER,
    "get_sim_servo": BENCH,
    "get_stop": "hornbill stop says it; hornbill watch shows it",
    "get_stream": LEASE_ENDS,
    "get_telemetry": "who polls what is for programs that poll",
    "label_servo": "hornbill label also does it for servos that are switched off",
    "list_sim_servos": BENCH,
    "list_streams": LEASE_ENDS,
    "list_tokens": "hornbill tokens list reads the data folder",
    "log_in": BROWSER,
    "log_out": BROWSER,
    "create_ticket": BROWSER,
    "set_stream_values": LEASE_ENDS,
    "read_faults": "hornbill faults list, which asks for each",
    "read_matrix": "hornbill export, or get for each",
    "refuse_lease_request": LEASE_ENDS,
    "remove_sim_servo": BENCH,
    "renew_lease": "done by itself every second while a command holds motion control",
    "restore_snapshot": "hornbill snapshots restore copies from snapshot:N, which is the same",
    "revoke_token": "hornbill tokens revoke writes the data folder",
    "set_parameter": "hornbill set changes several rows, or one, all or nothing",
    "set_telemetry": "hornbill watch --channel asks for it, over the socket's block",
    "stream_events": "hornbill watch hears the same over the socket",
    "withdraw_lease_request": LEASE_ENDS,
}

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
    "command_servo": lambda _, s: s.move(5),
    "command_servos": lambda h, s: h.command_many([(s, "angle", 5.0)]),
    "commission": lambda h, s: h.commission([{"uid": s.uid, "servo_id": 3}]),
    "compare": lambda h, s: h.compare(f"servo:{s.uid}", f"rom:{s.uid}"),
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

FILE = "a file, by download or ask: there is nothing in it to type"
PEOPLE = "between people at pages; a program takes motion control with force and a reason, or is told who has it"
NOT_TYPED: dict[str, str] = {
    "add_sim_servo": BENCH,
    "create_token": "made by hand, by hornbill tokens create",
    "request_lease": PEOPLE,
    "change_sim_servo": BENCH,
    "export_profile": FILE,
    "export_telemetry_parquet": FILE,
    "get_lease_request": PEOPLE,
    "get_session": BROWSER,
    "get_sim_servo": BENCH,
    "import_profile": FILE,
    "list_sim_servos": BENCH,
    "list_streams": "a program knows the stream it began",
    "list_tokens": "looked at by hand, by hornbill tokens list",
    "log_in": BROWSER,
    "log_out": BROWSER,
    "create_ticket": BROWSER,
    "refuse_lease_request": PEOPLE,
    "remove_sim_servo": BENCH,
    "revoke_token": "done by hand, by hornbill tokens revoke",
    "stream_events": "a stream without end, for programs that have no WebSocket; hornbill watch shows how to listen",
    "withdraw_lease_request": PEOPLE,
}


ASKING = (
    "restart S", "factory-reset S", "undo S", "snapshots restore S 7", "copy S profile:x", "drift restore S",
    "bus disconnect", "node-ids recycle 3", "stop --restore", "inventory forget S", "step-test S",
)  # fmt: skip
"""What asks before it does it."""


def _stream(hornbill: Hornbill, servo: Servo) -> None:
    with hornbill.stream([servo], rate_hz=50) as stream:
        stream.put({servo: 5.0}, speed_deg_s=30)
        stream.state()


def _lease(hornbill: Hornbill) -> None:
    with hornbill.lease("test", heartbeat=False) as lease:
        lease.renew()


def operations() -> set[str]:
    every = {one["operationId"] for verbs in document()["paths"].values() for one in verbs.values()}
    return every - ROWS


@pytest.mark.parametrize(
    ("done", "not_done"), [(COMMANDS, NO_COMMAND), (CALLS, NOT_TYPED)], ids=["command line", "client"]
)
def test_every_operation_is_decided_once(done: dict[str, Any], not_done: dict[str, str]) -> None:
    assert not done.keys() & not_done.keys()
    undecided = operations() - done.keys() - not_done.keys()
    assert undecided == set(), "say how it is done, or why not"
    assert (done.keys() | not_done.keys()) - operations() == set(), "there is no such operation any more"
    assert all(len(why) > 20 for why in not_done.values())


def run(
    words: str, server: Answering, monkeypatch: pytest.MonkeyPatch, folder: Path, *more: str
) -> tuple[int, str, str]:
    monkeypatch.setattr(hornbill.client, "Hornbill", partial(Hornbill, transport=server.transport()))
    given = [str(folder / word) if word.startswith("FILE") else word for word in words.split()]
    given = [word.replace("S", UID) if word in ("S", "rom:S") or word.startswith("S=") else word for word in given]
    done = CliRunner().invoke(app, [*given, *more])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "FILE.zip").write_bytes(b"PK")
    (tmp_path / "FILE.toml").write_text("[values]\n")
    return tmp_path


@pytest.mark.parametrize("operation", sorted(COMMANDS))
def test_the_command_asks_for_the_operation_and_prints_what_it_is_told(
    operation: str, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    server = Answering()
    code, _, said = run(COMMANDS[operation], server, monkeypatch, folder)
    assert operation in server.asked, f"{COMMANDS[operation]}: {server.asked} {said}"
    assert code in (0, 1), said
    if operation not in ("diagnose_bus", "stop", "clear_stop"):  # whose code says what was found
        assert code == 0, said


def has_json(words: str) -> bool:
    found: Any = typer.main.get_command(app)
    for word in words.split():
        if word not in getattr(found, "commands", ()):
            break
        found = found.commands[word]
    return any("--json" in one.opts for one in found.params)


@pytest.mark.parametrize(
    "words", sorted(words for words in set(COMMANDS.values()) if has_json(words) and "--csv" not in words)
)
def test_every_command_that_prints_an_answer_prints_json_that_can_be_read(
    words: str, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    _, out, said = run(words, Answering(), monkeypatch, folder, "--json")
    assert json.loads(out) is not None, said


@pytest.mark.parametrize("words", sorted(words for words in set(COMMANDS.values()) if " S" not in words))
def test_a_command_that_finds_nothing_says_so_and_does_not_fail(
    words: str, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    code, _, said = run(words, Answering(full=False), monkeypatch, folder)
    assert code in (0, 1), said


@pytest.mark.parametrize(
    ("words", "more"), [(one, more) for one in ASKING for more in ((), ("--json",)) if not more or has_json(one)]
)
def test_what_moves_restarts_or_forgets_does_nothing_when_nobody_can_be_asked(
    words: str, more: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    server = Answering()
    code, _, said = run(words, server, monkeypatch, folder, *more)
    assert code == 2
    assert "--yes" in said
    reading = ("get_", "list_", "compare", "forecast_", "preview_")
    assert [one for one in server.asked if not one.startswith(reading)] == []


@pytest.mark.parametrize("operation", sorted(CALLS))
def test_the_client_asks_for_the_operation_as_the_document_wants_it(operation: str) -> None:
    server = Answering()
    with Hornbill("http://127.0.0.1", transport=server.transport()) as client:
        (servo,) = client.servos()
        CALLS[operation](client, servo)
    assert operation in server.asked
