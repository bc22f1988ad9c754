"""The virtual CAN interface chosen for simulated servos, never one of real hardware."""

import socket
from contextlib import nullcontext
from pathlib import Path

import pytest

from hornbill.bus.adapters import socketcan
from hornbill.bus.adapters.virtual import find_vcan
from unit.bus.sysfs import interface

on_linux = pytest.mark.skipif(not hasattr(socket, "AF_CAN"), reason="SocketCAN is available on Linux only")


@pytest.fixture
def net(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A kernel's list of interfaces, empty; every virtual CAN interface opens."""
    folder = tmp_path / "net"
    folder.mkdir()
    monkeypatch.setattr(socketcan, "NET", folder)
    return folder


class Opens(nullcontext[object]):
    """A socket that binds to every interface."""

    def __init__(self, *_arguments: int) -> None:
        super().__init__(self)

    def bind(self, _address: tuple[str]) -> None: ...


def test_without_an_interface_the_reason_names_the_commands_to_create_one(net: Path) -> None:
    address, why = find_vcan()
    assert address is None
    assert "ip link add dev vcan0 type vcan" in why or not hasattr(socket, "AF_CAN")


@on_linux
def test_the_first_interface_that_is_up_is_chosen(net: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "socket", Opens)
    interface(net, "vcan0", up=False, device="virtual")
    interface(net, "vcan1", device="virtual")
    address, why = find_vcan()
    assert address == "socketcan:vcan1"
    assert "vcan1 is up" in why


@on_linux
def test_an_interface_that_is_down_or_cannot_be_opened_is_named(net: Path) -> None:
    interface(net, "vcan0", up=False, device="virtual")
    assert find_vcan() == (None, "vcan0 is down (sudo ip link set vcan0 up)")
    (net / "vcan0" / "flags").write_text("0x40081")
    address, why = find_vcan()
    assert address is None, "the kernel has no such interface or family"
    assert why


@pytest.mark.parametrize(("name", "place"), [("can0", "platform/spi"), ("vcan0", "usb1"), ("slcan0", "virtual")])
def test_an_interface_of_real_hardware_is_never_chosen(
    net: Path, monkeypatch: pytest.MonkeyPatch, name: str, place: str
) -> None:
    monkeypatch.setattr(socket, "socket", Opens)
    interface(net, name, device=place)
    assert find_vcan()[0] is None


def test_without_socketcan_the_reason_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(socket, "AF_CAN", raising=False)
    assert find_vcan() == (None, "SocketCAN is available on Linux only")
