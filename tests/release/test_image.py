"""The image: it builds from a clean context, its demo answers with the page, as nobody special, no tools left."""

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
PATIENCE_S: Final = 500.0
DOCKERFILE: Final = re.sub(r"\\\n", " ", (ROOT / "Dockerfile").read_text(encoding="utf-8"))


def words(instruction: str) -> list[str]:
    """What the last such instruction of the Dockerfile says, in its JSON form."""
    return json.loads(re.findall(rf"^{instruction}\b[^\[\n]*(\[.*\])$", DOCKERFILE, re.MULTILINE)[-1])


@dataclass(frozen=True)
class Running:
    """The demo of the image, and what was printed before it."""

    url: str
    port: int
    told: list[str]


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
    look = 'id -u; python -m pip --version 2>&1; python -c "import sys; print(sys.prefix)"; test -w . && pwd; exec "$@"'
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
        process.wait(timeout=PATIENCE_S)
    with socket.socket() as left, pytest.raises(ConnectionRefusedError):
        left.connect(("127.0.0.1", port))


def test_it_runs_as_nobody_special_and_without_a_package_manager(demo: Running) -> None:
    user, pip, prefix, folder, *_ = demo.told
    assert user == "1000"
    assert "No module named pip" in pip
    assert prefix == "/opt/hornbill"
    assert folder == "/data", "the data folder may be written"


def test_its_demo_answers_on_localhost_with_the_page_and_its_servos(demo: Running) -> None:
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


def test_it_has_the_documentation(demo: Running) -> None:
    with httpx.Client(base_url=f"http://localhost:{demo.port}/", timeout=30) as web:
        for path in ("docs/", "docs/tutorial.html", "docs/searchindex.js", "docs/_static/tokens.css"):
            assert web.get(path).status_code == 200, path
        assert "<h1" in web.get("docs/tutorial.html").text


def test_it_answers_to_no_other_name(demo: Running) -> None:
    assert httpx.get(demo.url, headers={"Host": "rig.example"}).status_code == 403


def test_it_connects_no_adapter_for_anybody_who_asks(demo: Running) -> None:
    refused = httpx.put(demo.url + "api/v1/bus", json={"address": "socketcan:can0"})
    assert refused.status_code >= 400
    assert "simulated" in refused.json()["detail"]


def test_its_health_check_says_yes_while_it_serves_and_no_otherwise(demo: Running) -> None:
    program, *arguments = words("HEALTHCHECK")
    assert program == "python"
    environment = {name: value for name, value in os.environ.items() if not name.startswith("HORNBILL_")}

    def asked(port: int) -> int:
        command = [sys.executable, *arguments]
        return subprocess.run(
            command, env=environment | {"HORNBILL_PORT": str(port)}, capture_output=True, check=False
        ).returncode

    assert asked(demo.port) == 0
    assert asked(9) != 0


def test_what_other_engines_do_not_know_is_not_in_the_dockerfile() -> None:
    assert "<<" not in DOCKERFILE
    assert "--link" not in DOCKERFILE
    assert len(re.findall(r"^EXPOSE (\d+)$", DOCKERFILE, re.MULTILINE)) == 1


def test_the_context_holds_nothing_that_was_built_or_installed_here() -> None:
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert ignored[0] == "*", "what is wanted is named, the rest stays out"
    assert {"web/node_modules", "web/dist", "docs/dist"} <= set(ignored)


def test_the_compose_file_is_understood() -> None:
    if (
        shutil.which("docker") is None
        or subprocess.run(["docker", "compose", "version"], capture_output=True, check=False).returncode
    ):
        pytest.skip("Docker Compose is not installed")
    subprocess.run(["docker", "compose", "config", "--quiet"], cwd=ROOT, check=True, timeout=60)
