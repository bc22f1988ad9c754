"""SocketCAN interfaces: faults with their remedies, and a missing `ip`."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from hornbill.bus.adapters import socketcan
from hornbill.bus.adapters.socketcan import Interface, check, interfaces
from hornbill.bus.address import open_port
from hornbill.errors import PortOpenFailed
from jumping_clock import run
from unit.bus.sysfs import interface

SET_IT = "sudo ip link set can0 down && sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875"


@pytest.fixture(autouse=True)
def net(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    net = tmp_path / "net"
    net.mkdir()
    monkeypatch.setattr(socketcan, "NET", net)
    monkeypatch.setattr(socketcan.socket, "AF_CAN", 29, raising=False)
    monkeypatch.setattr(socketcan.shutil, "which", nothing)
    return net


def nothing(_name: str, path: str) -> str | None:
    """No program is found."""
    assert "/sbin" in path


def ip_is_found(_name: str, path: str) -> str:
    return "/sbin/ip"


def can(name: str, bitrate: int = 1_000_000, sample_point: object = "0.875", **more: object) -> dict[str, Any]:
    """A link as `ip -details -json` prints it, the sample point as text."""
    timing = {"bitrate": bitrate, "sample_point": sample_point, "tq": 25, "sjw": 1, "brp": 1}
    data = {"state": "ERROR-ACTIVE", "restart_ms": 0, "bittiming": timing, "clock": 40_000_000} | more
    return {"ifname": name, "link_type": "can", "linkinfo": {"info_kind": "can", "info_data": data}}


def ip_reports(monkeypatch: pytest.MonkeyPatch, *links: object, text: str | None = None, error: object = None) -> None:
    def response(command: tuple[str, ...], **options: Any) -> subprocess.CompletedProcess[bytes]:
        assert command[1:] == ("-details", "-json", "link", "show")
        assert options["timeout"] <= 1.0
        if isinstance(error, Exception):
            raise error
        output = json.dumps(links) if text is None else text
        return subprocess.CompletedProcess(command, 0, output.encode())

    monkeypatch.setattr(socketcan.shutil, "which", ip_is_found)
    monkeypatch.setattr(socketcan.subprocess, "run", response)


def failure(channel: str, bitrate: int = 1_000_000) -> PortOpenFailed:
    """The error of opening `channel`."""
    with pytest.raises(PortOpenFailed) as caught:
        run(open_port(f"socketcan:{channel}", bitrate=bitrate))
    assert caught.value.facts["address"] == f"socketcan:{channel}"
    return caught.value


def test_an_interface_that_does_not_exist(net: Path) -> None:
    interface(net, "lo", kind=772)
    assert "no CAN interface" in failure("can0").detail
    assert "CAN interface lo not found" in failure("lo").detail
    interface(net, "can1")
    assert "Available: can1." in failure("can0").detail
    missing = failure("vcan0")
    assert missing.facts["remedy"] == "sudo ip link add dev vcan0 type vcan && sudo ip link set vcan0 up"
    assert "CAN interface ../can1 not found" in failure("../can1").detail


def test_an_interface_that_is_down(net: Path) -> None:
    for name in ("can0", "vcan0", "slcan0"):
        interface(net, name, up=False)
    down = failure("can0")
    assert down.facts["remedy"] == "sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875"
    assert str(down.facts["remedy"]) in down.detail
    assert "bitrate 500000" in failure("can0", 500_000).detail
    assert failure("vcan0").facts["remedy"] == "sudo ip link set vcan0 up"
    assert failure("slcan0").facts["remedy"] == "sudo ip link set slcan0 up"


def test_off_linux(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(socketcan.socket, "AF_CAN")
    assert "Linux only" in failure("can0").detail


def test_a_wrong_bit_rate_is_refused_with_the_remedy_and_another_sample_point_is_shown(
    net: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interface(net, "can0")
    ip_reports(monkeypatch, can("can0", 500_000))
    wrong = failure("can0")
    assert wrong.detail.startswith("can0 runs at 500000 bit/s instead of 1000000.")
    assert wrong.facts["remedy"] == SET_IT
    assert check("can0", 500_000) is not None, "the requested rate"
    ip_reports(monkeypatch, can("can0", 999_000))
    assert check("can0", 1_000_000) is not None, "a crystal that does not divide evenly"
    ip_reports(monkeypatch, can("can0", 990_000))
    assert failure("can0").facts["remedy"] == SET_IT
    for sample_point in ("0.750", 0.75):
        ip_reports(monkeypatch, can("can0", sample_point=sample_point))
        assert check("can0", 1_000_000) == Interface("can0", up=True, bitrate=1_000_000, sample_point=0.75)


@pytest.mark.parametrize("by", ["carrier", "ip"])
def test_a_controller_that_stays_off_the_bus(by: str, net: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    interface(net, "can0", carrier=by != "carrier")
    if by == "ip":
        ip_reports(monkeypatch, can("can0", state="BUS-OFF"))
    off = failure("can0")
    assert "bus-off" in off.detail
    assert off.facts["remedy"] == "sudo ip link set can0 type can restart"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (None, FileNotFoundError(2, "gone")),
        (None, subprocess.TimeoutExpired("ip", 1)),
        (None, subprocess.CalledProcessError(255, "ip")),
        ("ip: unrecognized option", None),
        ("", None),
        ("{}", None),
        ("[{}]", None),
        ("[1]", None),
        ('[{"ifname": "can0", "linkinfo": "can"}]', None),
        ('[{"ifname": "can0", "linkinfo": {"info_kind": "can"}}]', None),
        ('[{"ifname": "can0", "linkinfo": {"info_data": {"bittiming": {"bitrate": 1000000}}}}]', None),
        ('[{"ifname": "can0", "linkinfo": {"info_data": {"bittiming": {"bitrate": "x", "sample_point": "y"}}}}]', None),
    ],
)
def test_without_data_from_ip_the_timing_is_unknown_and_accepted(
    text: str | None, error: object, net: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interface(net, "can0")
    ip_reports(monkeypatch, text=text, error=error)
    assert check("can0", 1_000_000) == Interface("can0", up=True)


def test_without_ip_or_sysfs_the_timing_is_unknown_and_accepted(net: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    interface(net, "can0")
    assert check("can0", 1_000_000) == Interface("can0", up=True)
    (net / "can0" / "carrier").unlink()
    assert check("can0", 1_000_000) == Interface("can0", up=True), "unknown whether it is off the bus"
    monkeypatch.setattr(socketcan, "NET", net / "nowhere")
    assert check("can0", 1_000_000) is None, "unknown until opened"
    assert interfaces() == []


def test_every_interface_is_listed_up_or_down(net: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    interface(net, "eth0", kind=1)
    interface(net, "can1", up=False)
    interface(net, "can0")
    interface(net, "vcan0")
    ip_reports(monkeypatch, {"ifname": "eth0"}, can("can0"), can("can1", 250_000), {"ifname": "vcan0"})
    assert interfaces() == [
        Interface("can0", up=True, bitrate=1_000_000, sample_point=0.875),
        Interface("can1", up=False, bitrate=250_000, sample_point=0.875),
        Interface("vcan0", up=True),
    ]
