"""compose.yaml, as far as it can be held without an engine: shapes, one port, least rights, commands that are ours."""

from pathlib import Path
from typing import Any, Final

import pytest
import yaml

from contract.test_written import known
from hornbill.app.settings import Settings

ROOT: Final = Path(__file__).parents[2]
FILE: Final[dict[str, Any]] = yaml.safe_load((ROOT / "compose.yaml").read_text(encoding="utf-8"))
SERVICES: Final[dict[str, dict[str, Any]]] = FILE["services"]
KEYS: Final[dict[str, type | tuple[type, ...]]] = {
    "build": (str, dict), "image": str, "pull_policy": str, "command": list, "ports": list, "network_mode": str,
    "depends_on": dict, "healthcheck": dict, "init": bool, "cap_drop": list, "cap_add": list, "security_opt": list,
    "read_only": bool, "tmpfs": list, "volumes": list, "restart": str,
}  # fmt: skip
"""What of the Compose specification is used here, and the types it gives them."""
OURS: Final = [name for name, service in SERVICES.items() if service["image"] == "hornbill"]


def test_it_has_no_key_and_no_type_that_compose_does_not_know() -> None:
    assert set(FILE) == {"name", "services", "volumes"}
    for name, service in SERVICES.items():
        for key, value in service.items():
            assert key in KEYS, f"{name}: {key}"
            assert isinstance(value, KEYS[key]), f"{name}: {key}"
        for words in ("command", "cap_drop", "cap_add", "ports", "volumes", "security_opt", "tmpfs"):
            assert all(isinstance(one, str) for one in service.get(words, [])), f"{name}: {words}"
        assert service["restart"] in ("no", "always", "on-failure", "unless-stopped")


def test_one_port_is_published_to_this_machine_alone_and_it_is_the_servers() -> None:
    published = [port for service in SERVICES.values() for port in service.get("ports", [])]
    assert published == ["127.0.0.1:8000:8000"]
    assert Settings.model_fields["port"].default == 8000
    (owner,) = (name for name, service in SERVICES.items() if "ports" in service)
    assert SERVICES["hornbill"]["network_mode"] == f"service:{owner}", "it listens where the port leads"
    assert "EXPOSE 8000" in (ROOT / "Dockerfile").read_text(encoding="utf-8").splitlines()


def test_all_are_in_the_namespace_of_the_bus_and_wait_until_it_is_up() -> None:
    assert set(SERVICES) == {"vcan", *OURS}
    for name in OURS:
        assert SERVICES[name]["network_mode"] == "service:vcan"
        assert SERVICES[name]["depends_on"] == {"vcan": {"condition": "service_healthy", "restart": True}}
        assert not {"ports", "privileged", "cap_add", "user", "devices"} & set(SERVICES[name])
    assert "HEALTHCHECK" in (ROOT / "docker" / "vcan.Dockerfile").read_text(encoding="utf-8")


def test_only_the_bus_has_a_capability_and_it_is_the_one_that_makes_links() -> None:
    assert all(service["cap_drop"] == ["ALL"] for service in SERVICES.values())
    assert {name: service["cap_add"] for name, service in SERVICES.items() if "cap_add" in service} == {
        "vcan": ["NET_ADMIN"]
    }
    assert all(SERVICES[name]["read_only"] and "/tmp" in SERVICES[name]["tmpfs"] for name in OURS)


def test_data_outlives_the_container_of_the_server() -> None:
    assert SERVICES["hornbill"]["volumes"] == ["data:/data"]
    assert set(FILE["volumes"]) == {"data"}
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert "HORNBILL_DATA_DIR=/data" in text
    assert "VOLUME /data" in text


def test_one_service_builds_the_image_and_the_other_takes_it_from_nowhere_else() -> None:
    """Two builds of one tag collide; without a policy, a service that does not build asks a registry for it."""
    (builds,) = (name for name in OURS if "build" in SERVICES[name])
    assert builds == "hornbill"
    assert all(SERVICES[name]["pull_policy"] == "never" for name in OURS if name != builds)
    context = SERVICES["vcan"]["build"]
    assert (ROOT / context["context"] / context["dockerfile"]).is_file()


@pytest.mark.parametrize("name", OURS)
def test_its_command_is_one_the_command_line_takes(name: str) -> None:
    assert known(SERVICES[name]["command"], True) == ""


def test_the_server_listens_where_the_published_port_can_reach_it_and_on_the_bus_of_the_servos() -> None:
    servos, server = SERVICES["servos"]["command"], SERVICES["hornbill"]["command"]
    assert server[server.index("--host") + 1] == "0.0.0.0"
    assert servos[servos.index("--bus") + 1] == server[server.index("--bus") + 1] == "socketcan:vcan0"
    assert "vcan0" in (ROOT / "docker" / "vcan-up").read_text(encoding="utf-8")
