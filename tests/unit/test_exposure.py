"""Network access requires a token, except for this machine and a demo in a container."""

from pathlib import Path
from typing import Any

import pytest

from hornbill.app.network_policy import LOCAL, NetworkPolicy, decide, in_container, may_open
from hornbill.app.settings import Settings
from hornbill.errors import CannotStart, PortOpenFailed
from hornbill.store.data_folder import FIRST_TOKEN
from hornbill.store.store import Store

OUTSIDE = {"HORNBILL_CONTAINER": "0"}
INSIDE = {"HORNBILL_CONTAINER": "1"}
LONG = "long-enough-a-token"


def settings(folder: Path, **other: Any) -> Settings:
    return Settings(data_dir=folder, **other)


@pytest.mark.parametrize("demo", [True, False])
@pytest.mark.parametrize("host", sorted(LOCAL))
def test_this_machine_needs_no_token(tmp_path: Path, demo: bool, host: str) -> None:
    assert decide(settings(tmp_path, host=host), demo=demo, environment=OUTSIDE) == NetworkPolicy()
    assert decide(settings(tmp_path, host=host, token=LONG), demo=demo, environment=OUTSIDE).required


@pytest.mark.parametrize("demo", [True, False])
@pytest.mark.parametrize(
    "network",
    [{"host": "0.0.0.0"}, {"host": "::"}, {"host": "192.0.2.7"}, {"behind_proxy": True}, {"allow_host": ["bench"]}],
)
def test_network_access_without_a_token_is_rejected(tmp_path: Path, demo: bool, network: dict[str, Any]) -> None:
    with pytest.raises(CannotStart) as refused:
        decide(settings(tmp_path, **network), demo=demo, environment=OUTSIDE)
    assert ("--token" if demo else "hornbill tokens create NAME --role admin") in refused.value.detail


def test_a_token_allows_network_access(tmp_path: Path) -> None:
    given = decide(settings(tmp_path, host="192.0.2.7", token=LONG), demo=False, environment=OUTSIDE)
    assert given == NetworkPolicy(LOCAL | {"192.0.2.7"}, addresses=True, required=True)
    with Store(tmp_path) as store:
        store.tokens.add("me", "admin")
    wide = settings(tmp_path, host="0.0.0.0", allow_host="Bench.local, rig")
    stored = decide(wide, demo=False, environment=OUTSIDE)
    assert stored == NetworkPolicy(LOCAL | {"bench.local", "rig"}, addresses=True, required=True)


@pytest.mark.parametrize("demo", [True, False])
@pytest.mark.parametrize("where", [{"host": "0.0.0.0"}, {"host": "127.0.0.1"}, {"behind_proxy": True}])
def test_a_token_of_fewer_than_16_characters_is_rejected(tmp_path: Path, demo: bool, where: dict[str, Any]) -> None:
    with pytest.raises(CannotStart, match=r"15 characters and could be guessed.*tokens create NAME --role admin"):
        decide(settings(tmp_path, token="x" * 15, **where), demo=demo, environment=OUTSIDE)
    assert decide(settings(tmp_path, token="x" * 16, **where), demo=demo, environment=OUTSIDE).required


def test_an_empty_token_is_rejected() -> None:
    with pytest.raises(ValueError, match="The token is empty"):
        Settings.model_validate({"token": " "})


def test_a_demo_in_a_container_has_local_names_and_simulated_servos_only(tmp_path: Path) -> None:
    exposed = decide(settings(tmp_path, host="0.0.0.0"), demo=True, environment=INSIDE)
    assert exposed == NetworkPolicy(simulated_only=True)
    assert exposed.hosts == LOCAL
    assert not exposed.addresses
    with pytest.raises(PortOpenFailed, match="simulated servos only"):
        may_open(exposed, None, "socketcan:can0")
    may_open(exposed, None, "memory:demo")


def test_a_server_in_virtual_time_opens_no_adapter() -> None:
    with pytest.raises(PortOpenFailed) as refused:
        may_open(NetworkPolicy(), None, "socketcan:can0", virtual=True)
    assert refused.value.facts["cause"] == "virtual_time"
    may_open(NetworkPolicy(), None, "memory:demo", virtual=True)
    may_open(NetworkPolicy(), None, "file:run.log", virtual=True)


def test_a_server_in_a_container_creates_a_token_at_its_first_start(tmp_path: Path) -> None:
    first = decide(settings(tmp_path, host="0.0.0.0"), demo=False, environment=INSIDE)
    assert first.required
    assert first.first_token is not None
    file = tmp_path / FIRST_TOKEN
    assert file.read_text() == f"{first.first_token}\n"
    assert file.stat().st_mode & 0o777 == 0o600
    file.unlink()
    again = decide(settings(tmp_path, host="0.0.0.0"), demo=False, environment=INSIDE)
    assert again.required
    assert again.first_token is None
    assert not file.exists(), "it is written once"


def test_a_first_token_that_cannot_be_written_is_not_valid(tmp_path: Path) -> None:
    (tmp_path / FIRST_TOKEN).mkdir()
    for _ in range(2):
        with pytest.raises(OSError, match=FIRST_TOKEN):
            decide(settings(tmp_path, host="0.0.0.0"), demo=False, environment=INSIDE)
    (tmp_path / FIRST_TOKEN).rmdir()
    first = decide(settings(tmp_path, host="0.0.0.0"), demo=False, environment=INSIDE)
    assert (tmp_path / FIRST_TOKEN).read_text() == f"{first.first_token}\n"


def test_network_clients_open_only_recordings_of_the_data_folder() -> None:
    network = NetworkPolicy(required=True)
    may_open(network, None, "socketcan:can0")
    may_open(network, None, "file:run.log")
    may_open(network, "file:/srv/run.log", "file:/srv/run.log")
    for address in ("file:/etc/passwd", "file:../../secret.log", "recording:C:\\x.zip", "file:.."):
        with pytest.raises(PortOpenFailed):
            may_open(network, None, address)
    may_open(NetworkPolicy(), None, "file:/home/me/run.log")


@pytest.mark.parametrize("address", ["slcan:spy:///dev/null?file=/etc/motd", "serial:socket://192.0.2.1:22"])
def test_network_clients_open_no_adapter_by_url(address: str) -> None:
    with pytest.raises(PortOpenFailed, match="only at start"):
        may_open(NetworkPolicy(required=True), None, address)
    with pytest.raises(PortOpenFailed):
        may_open(NetworkPolicy(simulated_only=True), None, address)
    may_open(NetworkPolicy(required=True), address, address)
    may_open(NetworkPolicy(), None, address)


PORTS = (
    "socketcan:can0", "slcan:/dev/ttyACM0", "slcan:/dev/ttyUSB1@115200", "slcan:COM3", "pcan:PCAN_USBBUS1",
    "mavcan:/dev/ttyACM0@57600?bus=2", "mavcan:COM4@115200", "slcan:/dev/cu.usbmodem1101",
    "slcan:/dev/serial/by-id/usb-Zubax_Robotics_Babel_31-if00", "memory:demo",
)  # fmt: skip
OTHERS = (
    "slcan:/etc/passwd", "slcan:/dev/sda", "serial:/dev/mem", "slcan:/dev/ttyACM0/../../etc/motd", "slcan:../x",
    "robotell:/home/me/.ssh/authorized_keys", "slcan:/dev/tty1", "slcan:/dev/pts/0", "slcan:/dev/serial/by-id/../../x",
    "slcan: /dev/sda", "slcan:\\\\.\\PhysicalDrive0", "slcan:/dev/ttyACM\u0661", "slcan:/dev/ttyACM0@/etc/x@115200",
    "socketcand:192.0.2.1", "udp_multicast:239.74.163.2", "remote:192.0.2.1", "mcast:0", "mavcan:udp:192.0.2.1:14550",
    "mavcan: udp:192.0.2.1:14550", "mavcan:/etc/passwd?bus=1", "slcan:/dev/ttyACM0?bus=1",
)  # fmt: skip


@pytest.mark.parametrize("address", PORTS)
def test_network_clients_open_adapters_of_the_server(address: str) -> None:
    may_open(NetworkPolicy(required=True), None, address)


@pytest.mark.parametrize("address", OTHERS)
def test_network_clients_open_other_addresses_only_if_named_at_start(address: str) -> None:
    with pytest.raises(PortOpenFailed, match="at start, with --bus") as refused:
        may_open(NetworkPolicy(required=True), None, address)
    assert refused.value.facts["address"] == address
    may_open(NetworkPolicy(required=True), address, address)
    may_open(NetworkPolicy(), None, address)


@pytest.mark.parametrize(("value", "found"), [("1", True), ("yes", True), ("0", False), ("", False)])
def test_a_container_can_be_declared(value: str, found: bool) -> None:
    assert in_container({"HORNBILL_CONTAINER": value}) is found


def test_a_certificate_requires_its_key(tmp_path: Path) -> None:
    cert = tmp_path / "cert.pem"
    cert.touch()
    with pytest.raises(CannotStart, match="Add --tls-key"):
        decide(settings(tmp_path, tls_cert=cert), demo=True, environment=OUTSIDE)
    with pytest.raises(CannotStart, match="not found"):
        decide(settings(tmp_path, tls_cert=cert, tls_key=tmp_path / "none"), demo=True, environment=OUTSIDE)


def test_the_root_path_is_a_plain_path() -> None:
    assert Settings.model_validate({"root_path": "/bench/hornbill/"}).root_path == "/bench/hornbill"
    for wrong in ("hornbill", "/a b", '/"><script>', "//evil.example"):
        with pytest.raises(ValueError, match="root_path"):
            Settings.model_validate({"root_path": wrong})
