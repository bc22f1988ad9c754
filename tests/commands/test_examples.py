"""Every example, and what docs/rigs.md promises of its commands, against a server that is running."""

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from commands.guides import ROOT, WRITTEN, Rig, blocks
from e2e.servers import ready_demo

EXAMPLES = ROOT / "examples"
GUIDE = ROOT / "docs" / "rigs.md"
TELEMETRY = ROOT / "docs" / "how-to" / "telemetry.md"


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with ready_demo(2, seed=3) as demo:
        servo: dict[str, Any] = demo.api.get("/servos").json()[0]
        yield Rig(demo.url.rstrip("/"), str(servo["serial"]))


def torque(rig: Rig) -> str:
    """The torque mode of the servo, as the server reads it now."""
    servo = httpx.get(f"{rig.url}/api/v1/servos", params={"serial": rig.serial}).json()[0]
    answer = httpx.get(f"{rig.url}/api/v1/servos/{servo['uid']}/parameters/torque_mode")
    return str(answer.json()["value"])


def test_the_pytest_rig_passes_on_a_simulated_servo_of_its_own(rig: Rig) -> None:
    told = rig.run(
        sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--hornbill-sim", EXAMPLES / "pytest_rig"
    )
    assert re.search(r"\b8 passed", told), told


def test_the_pytest_rig_passes_on_a_servo_of_a_running_server(rig: Rig) -> None:
    told = rig.run(
        sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--hornbill-url", rig.url, "--hornbill-servo",
        rig.serial, EXAMPLES / "pytest_rig",
    )  # fmt: skip
    assert re.search(r"\b8 passed", told), told
    assert torque(rig) == "off"
    assert httpx.get(f"{rig.url}/api/v1/stop").json()["latched"] is False


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--hornbill-servo", "nobody"), "No servo on the bus has the label, serial or unique ID 'nobody'"),
        ((), "Specify the servo with --hornbill-servo"),
    ],
)
def test_a_rig_without_its_servo_fails_and_says_so(rig: Rig, options: tuple[str, ...], said: str) -> None:
    command = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", "fault")
    told = rig.run(*command, "--hornbill-url", rig.url, *options, EXAMPLES / "pytest_rig", code=1)
    assert said in told


def test_a_stop_that_somebody_else_made_stays_and_fails_the_rig(rig: Rig) -> None:
    httpx.post(f"{rig.url}/api/v1/stop", params={"by": "Ann"}).raise_for_status()
    command = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", "fault")
    server = ("--hornbill-url", rig.url, "--hornbill-servo", rig.serial)
    assert "Stopped by Ann" in rig.run(*command, *server, EXAMPLES / "pytest_rig", code=1)
    assert httpx.get(f"{rig.url}/api/v1/stop").json()["latched"] is True
    httpx.delete(f"{rig.url}/api/v1/stop").raise_for_status()


def test_the_plug_measures_and_leaves_torque_off(rig: Rig) -> None:
    record = json.loads(rig.run(sys.executable, EXAMPLES / "openhtf_plug" / "station.py", rig.serial))
    assert record["outcome"] == "PASS"
    assert 0 < record["measurements"]["settle_20_deg_s"] < 1
    assert torque(rig) == "off"


def test_the_bash_example_moves_and_leaves_torque_off(rig: Rig) -> None:
    assert re.search(r"at 1\d\.\d*° after", rig.run(EXAMPLES / "bash" / "move.sh", rig.serial, "15"))
    assert torque(rig) == "off"


def test_the_bash_example_says_what_the_server_says(rig: Rig) -> None:
    told = rig.run(EXAMPLES / "bash" / "move.sh", rig.serial, "500", code=None)
    assert "out_of_range: " in told
    assert torque(rig) == "off"


def test_the_guides_python_runs(rig: Rig) -> None:
    move, long_run, _ = (one.script.replace(WRITTEN, rig.serial) for one in blocks(GUIDE, "python"))
    assert 0 < float(rig.run(sys.executable, "-c", move)) < 3
    assert rig.run(sys.executable, "-c", long_run) == "done\n"


def test_the_guides_telemetry_program_prints_a_hundred_samples(rig: Rig) -> None:
    (block,) = blocks(TELEMETRY, "python")
    lines = rig.run(sys.executable, "-c", block.script.replace(WRITTEN, rig.serial)).splitlines()
    assert len(lines) >= 100
    assert all(re.fullmatch(r"\d+\.\d{3} s  (-?\d+\.\d+|None)°", line) for line in lines)


def test_the_guides_pytest_runs(rig: Rig, tmp_path: Path) -> None:
    (test,) = (one.script for one in blocks(GUIDE, "python") if "def test_" in one.script)
    (tmp_path / "test_rig.py").write_text(test)
    command = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", tmp_path, tmp_path)
    assert "1 passed" in rig.run(*command, "--hornbill-servo", rig.serial, folder=tmp_path)


def test_the_guides_sequence_by_curl_goes_there_and_lets_go(rig: Rig, tmp_path: Path) -> None:
    (block,) = [one for one in blocks(GUIDE) if "TestStand" in one.script]
    on, settled, angle, holder = rig.bash(block.script, tmp_path).splitlines()
    assert (on, settled, holder) == ('"on"', "true", '"TestStand"')
    assert 19 < float(angle) < 21
    assert torque(rig) == "off"


def test_the_guides_bench_file_is_one(rig: Rig, tmp_path: Path) -> None:
    (text,) = (one.script for one in blocks(GUIDE, "toml"))
    file = tmp_path / "bench.toml"
    file.write_text(text.replace(WRITTEN, rig.serial).replace('profile = "aileron"', ""))
    told = rig.run("hornbill", "apply", "--check", file, code=None)
    assert "angle_p_gain = 42" in told or "no differences" in told
    assert '+ timeout_action = "brake"' in told


def test_the_guides_exit_codes_are_those_of_the_program() -> None:
    from hornbill.cli.failing import Exit

    assert [int(code) for code in re.findall(r"^\| (\d+) \|", GUIDE.read_text(encoding="utf-8"), re.MULTILINE)] == [
        int(one) for one in Exit
    ]
