"""The wheel alone, without Node and the checkout, serves the demo with its page."""

import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final
from urllib.parse import urljoin

import httpx
import pytest

ROOT: Final = Path(__file__).parents[2]
VERSIONS: Final = ("3.11", "3.12", "3.13")
"""As pyproject.toml says."""


def find_python(version: str) -> str | None:
    """A Python of that version: this one, one on the PATH that starts, or one of pyenv."""
    if version == f"{sys.version_info.major}.{sys.version_info.minor}":
        return sys.executable
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    others = sorted(str(path / "bin" / "python") for path in pyenv.glob(f"{version}.*"))
    for each in (shutil.which(f"python{version}"), *others):
        if each and subprocess.run([each, "-c", "import venv"], capture_output=True, check=False).returncode == 0:
            return each
    return None


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sdist and the wheel built from it, as by `make build`."""
    assert (ROOT / "web" / "dist" / "index.html").is_file(), "the page is not built: run 'make build'"
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stdout[-2000:] + built.stderr[-2000:]
    return folder


def test_sdist_and_wheel_contain_the_notices(dist: Path) -> None:
    import tarfile
    import zipfile

    (sdist,), (wheel,) = dist.glob("*.tar.gz"), dist.glob("*.whl")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {"web/dist/index.html", "schemas/parameters.toml", "THIRD_PARTY.md", "server/hatch_build.py"} <= names
    inside = zipfile.ZipFile(wheel).namelist()
    assert wheel.stat().st_size <= 3e6, "the wheel has pictures or other large files"
    assert any(name.endswith(".dist-info/licenses/THIRD_PARTY.md") for name in inside)
    assert not any("node_modules" in name or "__pycache__" in name for name in [*names, *inside])
    assert any(name.endswith("/openapi.json") for name in inside), "the server serves it"


@pytest.fixture(scope="module")
def environments(dist: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A fresh environment with the wheel for each installed Python, created in parallel."""
    (wheel,) = dist.glob("*.whl")
    bare = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def make(python: str, folder: Path) -> None:
        subprocess.run([python, "-m", "venv", "--without-pip", str(folder)], check=True, env=bare)
        into = [sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python")]
        for what in (("--require-hashes", "-r", str(ROOT / "requirements.lock")), (str(wheel),)):
            run = [*into, "install", "--quiet", "--no-deps", "--no-compile", *what]
            installed = subprocess.run(run, capture_output=True, text=True, check=False, env=bare)
            assert installed.returncode == 0, installed.stderr[-2000:]
        subprocess.run([*into, "check"], check=True, capture_output=True, env=bare)

    found = {version: python for version in VERSIONS if (python := find_python(version))}
    folders = {version: tmp_path_factory.mktemp("python") / version for version in found}
    with ThreadPoolExecutor(len(found)) as pool:
        list(pool.map(make, found.values(), folders.values()))
    return folders


def test_the_wheelhouse_installs_without_a_network(dist: Path, tmp_path: Path) -> None:
    """As `make wheelhouse` and docs/how-to/install.md."""
    (wheel,) = dist.glob("*.whl")
    house, folder = tmp_path / "wheelhouse", tmp_path / "python"
    pip = [sys.executable, "-m", "pip"]
    lock = ("--require-hashes", "--no-deps", "-r", str(ROOT / "requirements.lock"))
    subprocess.run([*pip, "wheel", "--quiet", *lock, "--wheel-dir", str(house)], check=True)
    shutil.copy(wheel, house)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    offline = ("--no-index", "--find-links", str(house))
    into = [*pip, "--python", str(folder / "bin" / "python")]
    bare = {name: value for name, value in os.environ.items() if not name.startswith(("PIP_", "PYTHONPATH"))}
    subprocess.run(
        [*into, "install", "--quiet", *offline, "hornbill"], check=True, env=bare | {"PIP_CONFIG_FILE": os.devnull}
    )
    shown = subprocess.run(
        [folder / "bin" / "hornbill", "--help"], capture_output=True, text=True, check=True, env=bare
    )
    assert "demo" in shown.stdout


@pytest.mark.parametrize("version", VERSIONS)
def test_the_wheel_runs_the_demo_in_a_fresh_environment_without_node(
    version: str, environments: dict[str, Path], tmp_path: Path
) -> None:
    if version not in environments:
        pytest.skip(f"Python {version} is not installed here")
    bin_ = environments[version] / "bin"
    clean = {"PATH": str(bin_), "HOME": str(tmp_path), "TMPDIR": str(tmp_path), "LANG": "C.UTF-8"}
    assert shutil.which("node", path=clean["PATH"]) is None
    command = [str(bin_ / "hornbill"), "demo", "--port", "0", "--servos", "2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=tmp_path, env=clean) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://\S+/", process.stdout.readline())
            assert found is not None
            _check_responses(found[0])
        finally:
            process.terminate()
            process.wait(timeout=30)
    assert list(tmp_path.glob("hornbill-demo*")) == [], "the demo deletes its data"


def _check_responses(url: str) -> None:
    """REST, the page with each of its first scripts, and the 3D view."""
    with httpx.Client(base_url=url, timeout=30) as client:
        assert client.get("/api/v1/health").json()["demo"] is True
        assert len(client.get("/api/v1/schema").json()["models"]) == 10
        page = client.get("/")
        assert "<title>" in page.text
        assets = re.findall(r'(?:src|href)="([^"]*assets/[^"]+)"', page.text)
        assert any(name.endswith(".js") for name in assets)
        for name in assets:
            assert client.get(urljoin(str(page.url), name)).status_code == 200, name
        assert client.get("/viser/", follow_redirects=True).status_code == 200
