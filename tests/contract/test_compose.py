"""compose.yaml, as far as it can be checked without an engine: one port, least rights, valid commands."""

import os
import subprocess
import tomllib
from pathlib import Path
from typing import Any, Final

import yaml

from contract.test_doc_references import command_error
from hornbill.app.settings import Settings

ROOT: Final = Path(__file__).parents[2]
FILE: Final[dict[str, Any]] = yaml.safe_load((ROOT / "compose.yaml").read_text(encoding="utf-8"))
SERVICES: Final[dict[str, dict[str, Any]]] = FILE["services"]
OURS: Final = [name for name, service in SERVICES.items() if service["image"] == "hornbill"]


def test_only_the_port_of_the_server_is_published_and_only_locally() -> None:
    published = [port for service in SERVICES.values() for port in service.get("ports", [])]
    assert published == ["127.0.0.1:8000:8000"]
    assert Settings.model_fields["port"].default == 8000
    (owner,) = (name for name, service in SERVICES.items() if "ports" in service)
    assert SERVICES["hornbill"]["network_mode"] == f"service:{owner}", "it must listen where the port is published"
    assert "EXPOSE 8000" in (ROOT / "Dockerfile").read_text(encoding="utf-8").splitlines()


def test_services_share_the_network_of_the_bus_and_wait_for_it() -> None:
    assert set(SERVICES) == {"vcan", *OURS}
    for name in OURS:
        assert SERVICES[name]["network_mode"] == "service:vcan"
        assert SERVICES[name]["depends_on"]["vcan"] == {"condition": "service_healthy", "restart": True}
        assert not {"ports", "privileged", "cap_add", "user", "devices"} & set(SERVICES[name])
    assert "HEALTHCHECK" in (ROOT / "docker" / "vcan.Dockerfile").read_text(encoding="utf-8")


def test_only_the_bus_has_a_capability() -> None:
    assert all(service["cap_drop"] == ["ALL"] for service in SERVICES.values())
    assert {name: service["cap_add"] for name, service in SERVICES.items() if "cap_add" in service} == {
        "vcan": ["NET_ADMIN"]
    }
    assert all(SERVICES[name]["read_only"] and "/tmp" in SERVICES[name]["tmpfs"] for name in OURS)


def test_data_is_in_a_volume() -> None:
    assert SERVICES["hornbill"]["volumes"] == ["data:/data"]
    assert set(FILE["volumes"]) == {"data"}
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert "HORNBILL_DATA_DIR=/data" in text
    assert "VOLUME /data" in text


def test_one_service_builds_the_image_for_both() -> None:
    """Two builds of one tag collide; without a policy, a service that does not build would pull it from a registry."""
    (builds,) = (name for name in OURS if "build" in SERVICES[name])
    assert all(builds in SERVICES[name]["depends_on"] for name in OURS if name != builds), "the image exists before"
    assert builds == "hornbill"
    assert all(SERVICES[name]["pull_policy"] == "never" for name in OURS if name != builds)
    context = SERVICES["vcan"]["build"]
    assert (ROOT / context["context"] / context["dockerfile"]).is_file()


def test_commands_are_valid_and_both_use_one_bus() -> None:
    assert [command_error(SERVICES[name]["command"], complete=True) for name in OURS] == ["", ""]
    servos, server = SERVICES["servos"]["command"], SERVICES["hornbill"]["command"]
    assert server[server.index("--host") + 1] == "0.0.0.0"
    assert servos[servos.index("--bus") + 1] == server[server.index("--bus") + 1] == "socketcan:vcan0"
    assert "vcan0" in (ROOT / "docker" / "vcan-up").read_text(encoding="utf-8")


def test_make_docker_labels_the_image_with_version_and_commit(tmp_path: Path) -> None:
    engine = tmp_path / "docker"
    engine.write_text('#!/bin/sh\necho "$@"\n')
    engine.chmod(0o755)
    path = os.pathsep.join((str(tmp_path), os.environ["PATH"]))
    made = subprocess.run(
        ["make", "-s", "docker"], cwd=ROOT, env={**os.environ, "PATH": path}, capture_output=True, text=True, check=True
    )
    git = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False)
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert made.stdout.split()[1:5] == [
        "--build-arg",
        f"VERSION={version}",
        "--build-arg",
        f"REVISION={git.stdout.strip()}",
    ]
