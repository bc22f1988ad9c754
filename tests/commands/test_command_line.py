"""The command line with a running server: output and exit codes."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from e2e.servers import Demo, as_in_rom, ready_demo


@pytest.fixture
def untouched() -> Iterator[Demo]:
    """A new demo with two ready servos."""
    with ready_demo(2) as one:
        yield one


def hornbill(demo: Demo | None, *words: str, sub: bool = False) -> subprocess.CompletedProcess[str]:
    """Run a command; `sub`: its name has two words."""
    server = ["--server", demo.url] if demo is not None else []
    command = [sys.executable, "-m", "hornbill", *words[: 1 + sub], *server, *words[1 + sub :]]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


@pytest.fixture
def serial(demo: Demo) -> str:
    """The serial of a servo that only these tests use."""
    found = [one for one in demo.api.get("/servos").json() if one["model"] == "BLA21-28U-AB"]
    as_in_rom(demo.api, found[0]["uid"])
    return str(found[0]["serial"])


def test_list_get_set_and_save(demo: Demo, serial: str) -> None:
    listed = hornbill(demo, "list")
    assert listed.returncode == 0
    assert serial in listed.stdout
    assert len(json.loads(hornbill(demo, "list", "--json").stdout)) == len(demo.api.get("/servos").json())

    assert "angle_p_gain" in hornbill(demo, "get", serial).stdout
    applied = hornbill(demo, "set", serial, "angle_p_gain=47", "smoothing=false")
    assert applied.returncode == 0, applied.stderr
    assert "applied" in applied.stdout
    reading = json.loads(hornbill(demo, "get", serial, "angle_p_gain", "--json").stdout)
    assert (reading["value"], reading["rom"]) == (47, 40)
    saved = hornbill(demo, "save", serial)
    assert saved.returncode == 0, saved.stderr
    assert "read back" in saved.stdout
    assert json.loads(hornbill(demo, "get", serial, "angle_p_gain", "--json").stdout)["rom"] == 47


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("set", "SERIAL", "angle_p_gain=0"), "out_of_range: 0 is below this model's limit of 1"),
        (("set", "SERIAL", "0x49=1"), "forbidden_parameter"),
        (("get", "SERIAL", "nonsense"), "unknown_parameter"),
        (("get", "nothing"), "No servo matches 'nothing'"),
    ],
)
def test_an_error_is_explained_and_exits_with_1(demo: Demo, serial: str, words: tuple[str, ...], error: str) -> None:
    failed = hornbill(demo, *(word.replace("SERIAL", serial) for word in words))
    assert failed.returncode == 1
    assert error in failed.stderr


def test_without_a_server_the_error_says_how_to_start_one() -> None:
    failed = subprocess.run(
        [sys.executable, "-m", "hornbill", "list", "--server", "http://127.0.0.1:9"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert failed.returncode == 3
    assert "hornbill demo" in failed.stderr


def test_openapi_prints_the_document() -> None:
    document = json.loads(hornbill(None, "openapi").stdout)
    assert "/api/v1/servos/{uid}/parameters/angle_limit_cw" in document["paths"]


def test_the_doctor_finds_nothing_in_a_new_demo(untouched: Demo) -> None:
    examined = hornbill(untouched, "doctor")
    assert examined.returncode == 0, examined.stdout + examined.stderr
    assert re.fullmatch(r"0 findings, 1\d checks passed\.\n", examined.stdout)
    as_json = hornbill(untouched, "doctor", "--json")
    assert (as_json.returncode, json.loads(as_json.stdout)) == (0, [])


def test_the_doctor_reports_a_missing_bus() -> None:
    with ready_demo(1) as lone:
        lone.api.delete("/bus").raise_for_status()
        examined = hornbill(lone, "doctor")
        assert examined.returncode == 1
        assert examined.stdout.startswith("Failure: No bus is connected\n")
        assert "PUT /api/v1/bus" in examined.stdout
        as_json = hornbill(lone, "doctor", "--json")
        assert as_json.returncode == 1
        assert [one["code"] for one in json.loads(as_json.stdout)] == ["no_bus"]


@pytest.fixture(scope="module")
def bench() -> Iterator[Demo]:
    """A server whose servos these tests may change."""
    with ready_demo(2, seed=3) as one:
        yield one


def first(bench: Demo) -> dict[str, Any]:
    found: dict[str, Any] = bench.api.get("/servos").json()[0]
    return found


def test_move_waits_and_turns_torque_off(bench: Demo) -> None:
    servo = first(bench)
    refused = hornbill(bench, "move", servo["serial"], "15")
    assert refused.returncode == 0, "torque is on after the start"
    moved = hornbill(bench, "move", servo["serial"], "--torque-on", "--json", "--", "-15")
    assert moved.returncode == 0, moved.stderr
    done = json.loads(moved.stdout)
    assert done["settled"] is True
    assert abs(done["angle_deg"] + 15) < 1
    assert json.loads(hornbill(bench, "get", servo["serial"], "torque_mode", "--json").stdout)["value"] == "off"
    assert bench.api.get("/leases").json() == []


def test_no_response_refused_and_stopped_have_different_exit_codes(bench: Demo) -> None:
    servo = first(bench)
    sim = f"/sim/servos/{servo['uid']}"
    bench.api.patch(sim, json={"refuse_keys": ["angle_boost"]}).raise_for_status()
    assert hornbill(bench, "get", servo["serial"], "angle_boost").returncode == 5
    bench.api.patch(sim, json={"refuse_keys": [], "mute": True}).raise_for_status()
    silent = hornbill(bench, "get", servo["serial"], "angle_boost")
    assert (silent.returncode, silent.stderr.split(":")[0]) == (4, "no_response")
    bench.api.patch(sim, json={"mute": False}).raise_for_status()
    assert hornbill(bench, "stop").returncode == 0
    stopped = hornbill(bench, "move", servo["serial"], "5")
    assert (stopped.returncode, stopped.stderr.split(":")[0]) == (6, "stopped")
    assert hornbill(bench, "stop", "--clear").returncode == 0


def test_watch_prints_samples_and_ends_its_subscription(bench: Demo) -> None:
    servo = first(bench)
    watched = hornbill(bench, "watch", servo["serial"], "--channel", "current_angle", "--seconds", "2", "--json")
    assert watched.returncode == 0, watched.stderr
    messages = [json.loads(line) for line in watched.stdout.splitlines()]
    samples = [one for one in messages if one["type"] == "telemetry"]
    assert samples
    assert {one["uid"] for one in samples} == {servo["uid"]}
    owners = [one["owner"] for one in bench.api.get(f"/servos/{servo['uid']}/telemetry").json()["subscriptions"]]
    assert "hornbill watch" not in owners
    events = hornbill(bench, "watch", "--seconds", "0.5").stdout
    assert f"{servo['serial']}: ready" in events


def test_a_profile_is_created_exported_imported_and_applied(bench: Demo, tmp_path: Path) -> None:
    one, other = (servo["serial"] for servo in bench.api.get("/servos").json())
    assert hornbill(bench, "profiles", "create", "base line", one, sub=True).returncode == 0
    file = tmp_path / "base.toml"
    file.write_text(hornbill(bench, "profiles", "export", "base line", sub=True).stdout, encoding="utf-8")
    assert hornbill(bench, "profiles", "import", "copy", str(file), sub=True).returncode == 0
    assert "copy" in hornbill(bench, "profiles", "list", sub=True).stdout
    (tmp_path / "gain.json").write_text('{"values": {"angle_p_gain": 31}}')
    assert hornbill(bench, "profiles", "import", "gain", str(tmp_path / "gain.json"), sub=True).returncode == 0
    applied = hornbill(bench, "profiles", "apply", "gain", other, "--json", sub=True)
    assert applied.returncode == 0, applied.stderr
    assert json.loads(applied.stdout)["state"] == "succeeded"
    assert json.loads(hornbill(bench, "get", other, "angle_p_gain", "--json").stdout)["value"] == 31
    assert hornbill(bench, "profiles", "delete", "copy", sub=True).returncode == 0
    assert hornbill(bench, "profiles", "export", "copy", sub=True).returncode == 1


def test_a_log_is_recorded_and_decoded(bench: Demo, tmp_path: Path) -> None:
    assert hornbill(bench, "logs", "start", "--name", "run", sub=True).returncode == 0
    hornbill(bench, "get", first(bench)["serial"])
    assert hornbill(bench, "logs", "stop", sub=True).stdout.startswith("stopped: run.log, ")
    assert "run.log" in hornbill(bench, "logs", "list", sub=True).stdout
    file = tmp_path / "run.log"
    file.write_text(hornbill(bench, "logs", "export", "run.log", sub=True).stdout)
    assert "GetSet" in hornbill(None, "decode", str(file)).stdout


def test_commission_sets_id_and_label_of_a_new_servo(bench: Demo) -> None:
    bench.api.post("/sim/servos", json={"model": "BLA21-06U-A0", "firmware": "1.300"}).raise_for_status()
    until = time.monotonic() + 20
    while not (found := json.loads(hornbill(bench, "commission", "--json").stdout)["servos"]):
        assert time.monotonic() < until, "the new servo is offered"
    serial, number = found[0]["servo"]["serial"], found[0]["servo_id"]
    while (
        next(one for one in bench.api.get("/servos").json() if one["serial"] == serial)["state"] != "ready"
        and time.monotonic() < until
    ):
        time.sleep(0.1)
    done = hornbill(bench, "commission", f"{serial}={number}:Rudder")
    assert done.returncode == 0, done.stdout + done.stderr
    (servo,) = (one for one in json.loads(hornbill(bench, "list", "--json").stdout) if one["serial"] == serial)
    assert (servo["label"], servo["servo_id"]) == ("Rudder", number)


def test_completion_of_servos_keys_and_choices(bench: Demo) -> None:
    def completed(words: str) -> list[str]:
        environment = {
            **os.environ, "HORNBILL_URL": bench.url, "_HORNBILL_COMPLETE": "complete_bash", "COMP_WORDS": words,
            "COMP_CWORD": str(words.count(" ")),
        }  # fmt: skip
        script = "import sys; sys.argv[0] = 'hornbill'; from hornbill.cli import main; main()"
        ran = subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=False
        )
        return ran.stdout.split()

    assert first(bench)["serial"] in completed("hornbill get ")
    assert completed("hornbill get x angle_p") == ["angle_p_gain"]
    assert completed("hornbill set x timeout_action=b") == ["timeout_action=brake"]
    assert {"apply", "export"} <= set(completed("hornbill "))
