"""Every example, and the programs in docs/rigs.md, with a running server."""

import re
import sys
from pathlib import Path

import httpx
import pytest

from commands.guides import ROOT, WRITTEN, Rig, blocks
from e2e.servers import Server

EXAMPLES = ROOT / "examples"
GUIDE = ROOT / "docs" / "rigs.md"
TELEMETRY = ROOT / "docs" / "how-to" / "telemetry.md"


@pytest.fixture
def rig(bench: Server, serial: str) -> Rig:
    return Rig(bench.url.rstrip("/"), serial)


def torque(rig: Rig) -> str:
    """The torque mode of the servo."""
    servo = httpx.get(f"{rig.url}/api/v1/servos", params={"serial": rig.serial}).json()[0]
    response = httpx.get(f"{rig.url}/api/v1/servos/{servo['uid']}/parameters/torque_mode")
    return str(response.json()["value"])


def pytest_rig(rig: Rig, *options: str, code: int = 0) -> str:
    """The output of the tests of the pytest rig."""
    command = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider")
    return rig.run(*command, *options, EXAMPLES / "pytest_rig", code=code)


def test_the_pytest_rig_passes_with_its_own_simulated_servo(rig: Rig) -> None:
    assert re.search(r"\b8 passed", pytest_rig(rig, "--hornbill-sim"))


def test_the_pytest_rig_passes_with_a_running_server(rig: Rig) -> None:
    output = pytest_rig(rig, "--hornbill-url", rig.url, "--hornbill-servo", rig.serial)
    assert re.search(r"\b8 passed", output), output
    assert torque(rig) == "off"
    assert httpx.get(f"{rig.url}/api/v1/stop").json()["latched"] is False


@pytest.mark.parametrize(
    ("options", "error"),
    [
        pytest.param(
            ("--hornbill-servo", "unknown"),
            "No servo on the bus has the label, serial or unique ID 'unknown'",
            marks=pytest.mark.release,
        ),
        ((), "Specify the servo with --hornbill-servo"),
    ],
)
def test_the_pytest_rig_fails_without_its_servo(rig: Rig, options: tuple[str, ...], error: str) -> None:
    assert error in pytest_rig(rig, "-k", "fault", "--hornbill-url", rig.url, *options, code=1)


def test_a_stop_by_another_user_stays_and_fails_the_rig(rig: Rig) -> None:
    httpx.post(f"{rig.url}/api/v1/stop", params={"by": "Ann"}).raise_for_status()
    server = ("--hornbill-url", rig.url, "--hornbill-servo", rig.serial)
    assert "Stopped by Ann" in pytest_rig(rig, "-k", "fault", *server, code=1)
    assert httpx.get(f"{rig.url}/api/v1/stop").json()["latched"] is True
    httpx.delete(f"{rig.url}/api/v1/stop").raise_for_status()


def test_the_bash_example_moves_reports_errors_and_turns_torque_off(rig: Rig) -> None:
    assert re.search(r"at 1\d(\.\d+)?° after", rig.run(EXAMPLES / "bash" / "move.sh", rig.serial, "15"))
    assert torque(rig) == "off"
    assert "out_of_range: " in rig.run(EXAMPLES / "bash" / "move.sh", rig.serial, "500", code=None)
    assert torque(rig) == "off"


def test_python_programs_of_the_guide_run(rig: Rig) -> None:
    move, long_run, _ = (one.script.replace(WRITTEN, rig.serial) for one in blocks(GUIDE, "python"))
    assert 0 < float(rig.run(sys.executable, "-c", move)) < 3
    assert rig.run(sys.executable, "-c", long_run) == "done\n"


@pytest.mark.release
def test_the_programs_of_the_telemetry_guide_print_samples_and_an_event(rig: Rig) -> None:
    telemetry, events = (block.script.replace(WRITTEN, rig.serial) for block in blocks(TELEMETRY, "python"))
    assert rig.run(sys.executable, "-c", events).strip()
    lines = rig.run(sys.executable, "-c", telemetry).splitlines()
    assert len(lines) == 101
    assert all(re.fullmatch(r"\d+\.\d{3} s  -?\d+\.\d+°", line) for line in lines)


def test_the_pytest_example_of_the_guide_passes(rig: Rig, tmp_path: Path) -> None:
    (test,) = (one.script for one in blocks(GUIDE, "python") if "def test_" in one.script)
    (tmp_path / "test_rig.py").write_text(test)
    command = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", tmp_path, tmp_path)
    assert "1 passed" in rig.run(*command, "--hornbill-servo", rig.serial, folder=tmp_path)


def test_the_curl_sequence_of_the_guide_moves_and_turns_torque_off(rig: Rig, tmp_path: Path) -> None:
    (block,) = [one for one in blocks(GUIDE) if "TestStand" in one.script]
    on, settled, angle, holder = rig.bash(block.script, tmp_path).splitlines()
    assert (on, settled, holder) == ('"on"', "true", '"TestStand"')
    assert 19 < float(angle) < 21
    assert torque(rig) == "off"


def test_the_bench_file_of_the_guide_is_valid(rig: Rig, tmp_path: Path) -> None:
    (text,) = (one.script for one in blocks(GUIDE, "toml"))
    file = tmp_path / "bench.toml"
    file.write_text(text.replace(WRITTEN, rig.serial).replace('profile = "aileron"', ""))
    output = rig.run("hornbill", "apply", "--check", file, code=None)
    assert "angle_p_gain = 42" in output or "No differences" in output
    assert '+ timeout_action = "brake"' in output
