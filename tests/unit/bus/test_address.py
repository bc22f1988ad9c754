"""Owns the tests of open_port: every way it fails names the remedy, and an opening that comes late is closed."""

import asyncio
import threading
from pathlib import Path

import can
import pytest

from hornbill.bus import socketcan
from hornbill.bus.address import open_port, parse
from hornbill.bus.clock import run
from hornbill.errors import PortOpenFailed
from hornbill.wire.port import PortState


def failure(address: str, bitrate: int = 1_000_000) -> PortOpenFailed:
    with pytest.raises(PortOpenFailed) as caught:
        run(open_port(address, bitrate=bitrate))
    assert caught.value.facts["address"] == address
    return caught.value


def test_an_address_is_an_interface_and_a_channel_which_may_hold_colons() -> None:
    assert parse("socketcan:can0") == ("socketcan", "can0")
    assert parse("slcan:/dev/ttyACM0@3000000") == ("slcan", "/dev/ttyACM0@3000000")
    assert parse("udp_multicast:ff15::1:2") == ("udp_multicast", "ff15::1:2")


def test_what_is_no_address_is_refused_with_examples() -> None:
    assert "INTERFACE:CHANNEL" in failure("can0").detail
    assert "names no channel" in failure("slcan: ").detail
    unknown = failure("canopener:can0").detail
    assert "socketcan" in unknown
    assert "slcan" in unknown


@pytest.mark.parametrize("bitrate", [0, 8_000_000])
def test_a_bitrate_beyond_classic_can_is_refused(bitrate: int) -> None:
    assert f"{bitrate} bit/s is outside 1 to 1000000" in failure("virtual:x", bitrate).detail


def test_a_serial_device_that_is_not_there() -> None:
    pytest.importorskip("termios", reason="serial device files are a matter of POSIX")
    error = failure("slcan:/dev/no-such-adapter")
    assert "/dev/no-such-adapter" in error.detail
    assert "plug the adapter in" in error.detail


@pytest.fixture
def net(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(socketcan, "NET", tmp_path)
    monkeypatch.setattr(socketcan.socket, "AF_CAN", 29, raising=False)
    return tmp_path


def interface(net: Path, name: str, *, kind: int = 280, up: bool) -> None:
    (net / name).mkdir()
    (net / name / "type").write_text(f"{kind}\n")
    (net / name / "flags").write_text("0x40081\n" if up else "0x40080\n")


def test_socketcan_interfaces_that_do_not_exist(net: Path) -> None:
    interface(net, "lo", kind=772, up=True)
    assert "no CAN interface" in failure("socketcan:can0").detail
    assert "There is no CAN interface lo" in failure("socketcan:lo").detail
    interface(net, "can1", up=True)
    assert "CAN interfaces here: can1." in failure("socketcan:can0").detail
    missing = failure("socketcan:vcan0")
    assert missing.facts["remedy"] == "sudo ip link add dev vcan0 type vcan && sudo ip link set vcan0 up"
    assert "There is no CAN interface ../can1" in failure("socketcan:../can1").detail


def test_socketcan_interfaces_that_are_down(net: Path) -> None:
    interface(net, "can0", up=False)
    interface(net, "vcan0", up=False)
    down = failure("socketcan:can0")
    assert down.facts["remedy"] == "sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875"
    assert str(down.facts["remedy"]) in down.detail
    assert "bitrate 500000" in failure("socketcan:can0", 500_000).detail
    assert failure("socketcan:vcan0").facts["remedy"] == "sudo ip link set vcan0 up"


def test_socketcan_off_linux(net: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(socketcan.socket, "AF_CAN")
    assert "Linux only" in failure("socketcan:can0").detail


@pytest.mark.parametrize(
    ("error", "remedy"),
    [
        (PermissionError(13, "Permission denied"), "dialout"),
        (can.CanInitializationError("in use", 16), "Another program"),
        (OSError(97, "Address family not supported by protocol"), "modprobe can_raw"),
        (can.CanInterfaceNotImplementedError("no driver"), "Install"),
        (can.CanInitializationError("something else"), "plugged in"),
    ],
)
def test_what_the_driver_says_comes_with_a_remedy(
    error: Exception, remedy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(**_: object) -> can.BusABC:
        raise error

    monkeypatch.setattr(can, "Bus", refuse)
    detail = failure("pcan:PCAN_USBBUS1").detail
    assert str(error) in detail
    assert remedy in detail


@pytest.mark.parametrize("way", ["deadline", "cancelled"])
def test_an_opening_that_succeeds_too_late_is_closed_again(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    proceed = threading.Event()
    closed = threading.Event()

    class Late:
        def shutdown(self) -> None:
            closed.set()

    def slow(**_: object) -> Late:
        proceed.wait(5)
        return Late()

    monkeypatch.setattr(can, "Bus", slow)

    async def main() -> None:
        if way == "deadline":
            with pytest.raises(PortOpenFailed, match=r"did not open within 0\.01 s"):
                await open_port("virtual:x", deadline_s=0.01)
        else:
            opening = asyncio.create_task(open_port("virtual:x"))
            await asyncio.sleep(0.01)
            opening.cancel()
            with pytest.raises(asyncio.CancelledError):
                await opening
        assert not closed.is_set()
        proceed.set()
        assert closed.wait(5)

    asyncio.run(main())


def test_no_file_in_the_home_folder_changes_what_is_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / ".canrc").write_text("[default]\nreceive_own_messages = True\nchannel = other\n")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("CAN_CONFIG", '{"receive_own_messages": true}')

    async def main() -> None:
        port = await open_port("virtual:home")
        bus = port._bus  # type: ignore[attr-defined] # pyright: ignore
        assert not bus.receive_own_messages
        assert port.state is PortState.ACTIVE
        await port.close()

    asyncio.run(main())
