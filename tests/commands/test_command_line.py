"""The command line with a running server: output and exit codes."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from commands.command_line import CommandLine, hornbill
from e2e.servers import Server, until
from hornbill.cli import app


def test_list_get_set_and_save(bench: Server, command: CommandLine, serial: str) -> None:
    assert serial in command("list")
    assert len(command.json("list")) == len(bench.servos())
    assert "angle_p_gain" in command("get", serial)
    before = command.value(serial)
    assert "applied" in command("set", serial, f"angle_p_gain={before + 1}", "smoothing=false")
    assert (command.value(serial), command.value(serial, where="rom")) == (before + 1, before)
    assert "read back" in command("save", serial)
    assert command.value(serial, where="rom") == before + 1


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("set", "SERIAL", "angle_p_gain=0"), "out_of_range: 0 is below this model's limit of 1"),
        (("set", "SERIAL", "0x49=1"), "forbidden_parameter"),
        (("get", "SERIAL", "nonsense"), "unknown_parameter"),
        (("get", "nothing"), "No servo matches 'nothing'"),
    ],
)
def test_an_error_is_explained_and_exits_with_1(bench: Server, serial: str, words: tuple[str, ...], error: str) -> None:
    failed = hornbill(bench.url, *(word.replace("SERIAL", serial) for word in words))
    assert failed.exit_code == 1
    assert error in failed.stderr


def test_without_a_server_the_error_says_how_to_start_one() -> None:
    failed = hornbill(None, "list", "--server", "http://127.0.0.1:9")
    assert failed.exit_code == 3
    assert "hornbill demo" in failed.stderr


def test_openapi_prints_the_document() -> None:
    document = json.loads(hornbill(None, "openapi").stdout)
    assert "/api/v1/servos/{uid}/parameters/angle_limit_cw" in document["paths"]


def test_move_waits_and_turns_torque_off(bench: Server, command: CommandLine, serial: str) -> None:
    command("restart", serial, "--yes")
    command("move", serial, "15", "--timeout", "60")  # torque is on after the start
    done = json.loads(command("move", serial, "--torque-on", "--timeout", "60", "--json", "--", "-15"))
    assert done["settled"] is True
    assert abs(done["angle_deg"] + 15) < 1
    assert command.value(serial, "torque_mode") == "off"
    assert bench.api.get("/leases").json() == []


def test_no_response_refused_and_stopped_have_different_exit_codes(
    bench: Server, command: CommandLine, serial: str, uids: list[str]
) -> None:
    def simulate(**changes: object) -> None:
        bench.api.patch(f"/sim/servos/{uids[0]}", json=changes).raise_for_status()

    simulate(refuse_keys=["angle_boost"])
    command("get", serial, "angle_boost", code=5)
    simulate(refuse_keys=[], mute=True)
    assert command("get", serial, "angle_boost", code=4).startswith("no_response: ")
    simulate(mute=False)
    until(lambda: hornbill(bench.url, "get", serial, "angle_boost").exit_code == 0, 20, "it does not respond again")
    command("stop")
    assert command("move", serial, "5", code=6).startswith("stopped: ")
    command("stop", "--clear")


def test_watch_prints_samples_and_ends_its_subscription(
    bench: Server, command: CommandLine, serial: str, uids: list[str]
) -> None:
    watched = command("watch", serial, "--channel", "current_angle", "--seconds", "2", "--json")
    messages = [json.loads(line) for line in watched.splitlines()]
    assert {one["uid"] for one in messages if one["type"] == "telemetry"} == {uids[0]}
    owners = [one["owner"] for one in bench.api.get(f"/servos/{uids[0]}/telemetry").json()["subscriptions"]]
    assert "hornbill watch" not in owners
    assert f"{serial}: ready" in command("watch", "--seconds", "0.5")


def test_a_profile_is_created_exported_imported_and_applied(
    command: CommandLine, serials: list[str], tmp_path: Path
) -> None:
    one, other = serials
    command("profiles", "create", "base line", one)
    file = tmp_path / "base.toml"
    file.write_text(command("profiles", "export", "base line"), encoding="utf-8")
    command("profiles", "import", "copy", file)
    assert "copy" in command("profiles", "list")
    (tmp_path / "gain.json").write_text('{"values": {"angle_p_gain": 31}}')
    command("profiles", "import", "gain", tmp_path / "gain.json")
    assert command.json("profiles", "apply", "gain", other)["state"] == "succeeded"
    assert command.value(other) == 31
    for name in ("base line", "copy", "gain"):
        command("profiles", "delete", name)
    command("profiles", "export", "copy", code=1)


def test_a_log_is_recorded_and_decoded(command: CommandLine, serial: str, tmp_path: Path) -> None:
    command("logs", "start", "--name", "run")
    command("get", serial)
    assert command("logs", "stop").startswith("stopped: run.log, ")
    assert "run.log" in command("logs", "list")
    file = tmp_path / "run.log"
    file.write_text(command("logs", "export", "run.log"))
    assert "GetSet" in hornbill(None, "decode", file).stdout
    command("logs", "delete", "run.log")


def test_commission_sets_id_and_label_of_a_new_servo(command: CommandLine, serials: list[str]) -> None:
    serial = serials[1]
    offered = {one["servo"]["serial"]: one for one in command.json("commission")["servos"]}[serial]
    command("commission", f"{serial}={offered['servo_id']}:Rudder")
    (servo,) = (one for one in command.json("list") if one["serial"] == serial)
    assert (servo["label"], servo["servo_id"]) == ("Rudder", offered["servo_id"])
    command("label", serial, "")
    command("set", serial, "servo_id=0", "--save")


def test_completion_of_servos_keys_and_choices(bench: Server, serial: str) -> None:
    def completed(words: str) -> list[str]:
        asked = {
            "HORNBILL_URL": bench.url, "_HORNBILL_COMPLETE": "complete_bash", "COMP_WORDS": words,
            "COMP_CWORD": str(words.count(" ")),
        }  # fmt: skip
        return CliRunner().invoke(app, env=asked, prog_name="hornbill").stdout.split()

    assert serial in completed("hornbill get ")
    assert completed("hornbill get x angle_p") == ["angle_p_gain"]
    assert completed("hornbill set x timeout_action=b") == ["timeout_action=brake"]
    assert {"apply", "export"} <= set(completed("hornbill "))
