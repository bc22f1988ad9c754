"""hornbill-client in a fresh environment with pytest and OpenHTF, and without the server."""

import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import httpx
import pytest

from e2e.servers import running_demo
from hornbill.client import Hornbill

ROOT: Final = Path(__file__).parents[2]
STATION: Final = ROOT / "examples" / "openhtf_plug" / "station.py"
IMPORTS: Final = ("import httpx", "from hornbill.client import Hornbill", "from hornbill.client import AsyncHornbill")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel as built by `make build`."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--wheel", "--outdir", folder, ROOT / "client"]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stdout[-2000:] + built.stderr[-2000:]
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an environment with the wheel, pytest and OpenHTF only."""
    folder = tmp_path_factory.mktemp("rig")
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    made = folder / "bin" / "python"
    run(made, "-m", "pip", "install", "--quiet", wheel, "pytest", "openhtf")
    run(made, "-m", "pip", "check")
    return made


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with running_demo("--servos", "1") as (_, url), Hornbill(url) as hornbill:
        while [one.known["state"] for one in hornbill.servos()] != ["ready"]:
            time.sleep(0.1)
        yield url.rstrip("/")


def run(*command: str | Path, code: int = 0, folder: Path | None = None, **variables: str) -> str:
    """Output of a command in an environment without this checkout."""
    bare = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "HORNBILL_URL")}
    done = subprocess.run(
        command, env={**bare, **variables}, cwd=folder, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == code, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout + done.stderr


def servo_of(server: str) -> dict[str, str]:
    return httpx.get(f"{server}/api/v1/servos").json()[0]


def torque(server: str) -> str:
    uid = servo_of(server)["uid"]
    return str(httpx.get(f"{server}/api/v1/servos/{uid}/parameters/torque_mode").json()["value"])


def test_the_wheel_is_small_and_needs_httpx_only(wheel: Path) -> None:
    assert wheel.stat().st_size < 150_000
    archive = zipfile.ZipFile(wheel)
    folders = {name.split("/")[1] for name in archive.namelist() if name.startswith("hornbill/")}
    assert folders == {"__init__.py", "py.typed", "errors.py", "pytest_plugin.py", "client"}
    (metadata,) = (archive.read(name).decode() for name in archive.namelist() if name.endswith("/METADATA"))
    assert re.findall(r"Requires-Dist: (.*)", metadata) == ["httpx>=0.28"]
    assert re.search(r"^version = \"(.*)\"", (ROOT / "pyproject.toml").read_text(), re.M)[1] in metadata  # pyright: ignore[reportOptionalSubscript]
    assert any(name.endswith("licenses/LICENSE") for name in archive.namelist())


def test_the_import_takes_little_longer_than_that_of_httpx(python: Path) -> None:
    seconds: dict[str, list[float]] = {one: [] for one in IMPORTS}
    for _ in range(7):
        for one, times in seconds.items():
            code = f"import time; t = time.perf_counter(); {one}; print(time.perf_counter() - t)"
            times.append(float(run(python, "-c", code)))
    httpx_s, sync_s, async_s = (statistics.median(times) for times in seconds.values())
    assert sync_s < 1.5 * httpx_s
    assert async_s < 2.0 * httpx_s  # asyncio, which httpx itself imports at its first use


def test_openhtf_runs_the_station_and_tears_the_plug_down(python: Path, server: str, tmp_path: Path) -> None:
    serial, uid = servo_of(server)["serial"], servo_of(server)["uid"]
    run(python, STATION, serial, folder=tmp_path, HORNBILL_URL=server)
    record = json.loads((tmp_path / f"{serial}.json").read_text())
    assert (record["outcome"], record["dut_id"]) == ("PASS", serial)
    measured = {name: one for phase in record["phases"] for name, one in phase["measurements"].items()}
    assert 0 < measured["settle_20_deg_s"]["measured_value"] < 1
    assert torque(server) == "off"
    assert httpx.get(f"{server}/api/v1/leases").json() == []
    # a sluggish horn: outside the limits
    httpx.patch(f"{server}/api/v1/sim/servos/{uid}", json={"load_inertia": 100}).raise_for_status()
    run(python, STATION, serial, code=1, folder=tmp_path, HORNBILL_URL=server)
    record = json.loads((tmp_path / f"{serial}.json").read_text())
    assert record["outcome"] in ("ERROR", "FAIL")
    assert torque(server) == "off"
    httpx.patch(f"{server}/api/v1/sim/servos/{uid}", json={"load_inertia": 0}).raise_for_status()


def test_a_station_without_its_servo_ends_with_the_reason(python: Path, server: str, tmp_path: Path) -> None:
    output = run(python, STATION, "00-000000", code=1, folder=tmp_path, HORNBILL_URL=server)
    assert "No servo with serial '00-000000' is on the bus" in output


def test_the_pytest_plugin_uses_a_server_and_has_no_simulator(python: Path, server: str, tmp_path: Path) -> None:
    shutil.copy(ROOT / "examples" / "pytest_rig" / "test_servo.py", tmp_path)  # away from the settings of this checkout
    rig = (python, "-m", "pytest", "-q", "-p", "no:cacheprovider", tmp_path)
    serial = servo_of(server)["serial"]
    assert " passed" in run(*rig, "--hornbill-url", server, "--hornbill-servo", serial, folder=tmp_path)
    output = run(*rig, code=1, folder=tmp_path)
    assert "hornbill-client has no simulated servo. Give the server with --hornbill-url URL" in output
