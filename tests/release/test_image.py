"""The image is built from a clean context, runs the demo as an ordinary user, and contains no build tools."""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import urljoin

import httpx
import pytest

ROOT: Final = Path(__file__).parents[2]
CHECK: Final = "HORNBILL_DOCKERFILE_CHECK"
"""Names a program that builds the Dockerfile of a folder and runs a command in the image: CHECK FOLDER -- COMMAND…"""
TIMEOUT_S: Final = 500.0
DOCKERFILE: Final = re.sub(r"\\\n", " ", (ROOT / "Dockerfile").read_text(encoding="utf-8"))


def words(instruction: str) -> list[str]:
    """The arguments of the last such instruction of the Dockerfile, in JSON form."""
    return json.loads(re.findall(rf"^{instruction}\b[^\[\n]*(\[.*\])$", DOCKERFILE, re.MULTILINE)[-1])


@dataclass(frozen=True)
class Running:
    """The demo of the image, and the output before it."""

    url: str
    port: int
    output: list[str]


@pytest.fixture(scope="module")
def demo() -> Iterator[Running]:
    check = os.environ.get(CHECK)
    if not check or not Path(check).is_file():
        pytest.skip(f"{CHECK} names no program that builds images without an engine")
    if os.geteuid() != 0:
        pytest.skip("building an image takes root here")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = int(free.getsockname()[1])
    look = """id -u; python -m pip --version 2>&1; python -c "import sys; print(sys.prefix)"; test -w . && pwd
    python -c "import json; print(*(a['name'] for a in json.load(open('/opt/hornbill/sbom.cdx.json'))['components']))"
        exec "$@" """
    command = ["sh", "-c", look, "sh", *words("ENTRYPOINT"), *words("CMD"), "--port", str(port)]
    process = subprocess.Popen(
        [check, str(ROOT), "--", *command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert process.stdout is not None
    try:
        lines: list[str] = []
        for line in process.stdout:
            lines.append(line.rstrip("\n"))
            if "simulated servos: open" in line:
                break
        else:
            pytest.fail("the image was not built, or its demo did not start:\n" + "\n".join(lines[-40:]))
        built = next(number for number, line in enumerate(lines) if line.startswith("check-dockerfile: built"))
        yield Running(f"http://127.0.0.1:{port}/", port, lines[built + 1 :])
    finally:
        process.terminate()
        process.stdout.close()
        process.wait(timeout=TIMEOUT_S)
    with socket.socket() as left, pytest.raises(ConnectionRefusedError):
        left.connect(("127.0.0.1", port))


def test_it_runs_as_an_ordinary_user_without_a_package_manager(demo: Running) -> None:
    user, pip, prefix, folder, contents, *_ = demo.output
    assert user == "1000"
    assert "No module named pip" in pip
    assert prefix == "/opt/hornbill"
    assert folder == "/data", "the data folder is writable"
    assert {"fastapi", "viser", "uplot"} <= set(contents.split()), "its bill of materials"


def test_its_demo_serves_the_page_and_six_servos(demo: Running) -> None:
    with httpx.Client(base_url=f"http://localhost:{demo.port}/", timeout=30) as api:
        health = api.get("/api/v1/health").json()
        assert health["demo"] is True
        page = api.get("/")
        assert "<title>" in page.text
        (script, *_) = re.findall(r'src="([^"]*assets/[^"]+\.js)"', page.text)
        assert api.get(urljoin(str(page.url), script)).headers["content-type"].startswith("text/javascript")
        end = time.monotonic() + 60
        while sum(one["state"] == "ready" for one in api.get("/api/v1/servos").json()) < 6:
            assert time.monotonic() < end, "not all six servos are ready"
            time.sleep(0.3)
        assert api.get("/viser/", follow_redirects=True).status_code == 200


def test_it_serves_the_documentation(demo: Running) -> None:
    with httpx.Client(base_url=f"http://localhost:{demo.port}/", timeout=30) as web:
        for path in ("docs/", "docs/tutorial.html", "docs/searchindex.js", "docs/_static/tokens.css"):
            assert web.get(path).status_code == 200, path
        assert "<h1" in web.get("docs/tutorial.html").text


def test_it_rejects_other_host_names(demo: Running) -> None:
    assert httpx.get(demo.url, headers={"Host": "rig.example"}).status_code == 403


def test_it_connects_no_adapter(demo: Running) -> None:
    refused = httpx.put(demo.url + "api/v1/bus", json={"address": "socketcan:can0"})
    assert refused.status_code >= 400
    assert "simulated" in refused.json()["detail"]


def test_its_health_check(demo: Running) -> None:
    program, *arguments = words("HEALTHCHECK")
    assert program == "python"
    environment = {name: value for name, value in os.environ.items() if not name.startswith("HORNBILL_")}

    def exit_code(port: int) -> int:
        command = [sys.executable, *arguments]
        return subprocess.run(
            command, env=environment | {"HORNBILL_PORT": str(port)}, capture_output=True, check=False
        ).returncode

    assert exit_code(demo.port) == 0
    assert exit_code(9) != 0


def test_the_dockerfile_works_with_other_engines() -> None:
    assert "<<" not in DOCKERFILE
    assert "--link" not in DOCKERFILE
    assert len(re.findall(r"^EXPOSE (\d+)$", DOCKERFILE, re.MULTILINE)) == 1


def test_the_context_excludes_built_and_installed_files() -> None:
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert ignored[0] == "*", "only listed files are included"
    assert {"web/node_modules", "web/dist", "docs/dist"} <= set(ignored)


def test_the_compose_file_is_valid() -> None:
    if (
        shutil.which("docker") is None
        or subprocess.run(["docker", "compose", "version"], capture_output=True, check=False).returncode
    ):
        pytest.skip("Docker Compose is not installed")
    subprocess.run(["docker", "compose", "config", "--quiet"], cwd=ROOT, check=True, timeout=60)
