"""open_port: every failure names the remedy, and a port that opens late is closed."""

import asyncio
import threading
from pathlib import Path

import can
import pytest

from hornbill.bus.address import check, open_port, parse
from hornbill.errors import PortOpenFailed
from hornbill.wire.port import PortState
from jumping_clock import run


def failure(address: str, bitrate: int = 1_000_000) -> PortOpenFailed:
    with pytest.raises(PortOpenFailed) as caught:
        run(open_port(address, bitrate=bitrate))
    assert caught.value.facts["address"] == address
    return caught.value


def test_an_address_is_an_interface_and_a_channel_that_may_contain_colons() -> None:
    assert parse("socketcan:can0") == ("socketcan", "can0")
    assert parse("slcan:/dev/ttyACM0@3000000") == ("slcan", "/dev/ttyACM0@3000000")
    assert parse("udp_multicast:ff15::1:2") == ("udp_multicast", "ff15::1:2")


@pytest.mark.parametrize(
    ("address", "bitrate", "words"),
    [
        ("can0", 1_000_000, ["INTERFACE:CHANNEL"]),
        ("slcan: ", 1_000_000, ["has no channel"]),
        ("canopener:can0", 1_000_000, ["socketcan", "slcan"]),
        ("virtual:x", 0, ["0 bit/s is outside 1 to 1000000"]),
        ("virtual:x", 8_000_000, ["8000000 bit/s is outside 1 to 1000000"]),
    ],
)
def test_an_address_that_can_never_be_opened_is_refused_before_retrying(
    address: str, bitrate: int, words: list[str]
) -> None:
    detail = failure(address, bitrate).detail
    assert all(word in detail for word in words)
    with pytest.raises(PortOpenFailed):
        check(address, bitrate)
    assert check(" slcan : /dev/ttyACM0 ", 500_000) == "slcan:/dev/ttyACM0"


def test_a_missing_serial_device_is_refused_with_a_remedy() -> None:
    pytest.importorskip("termios", reason="serial device files are a matter of POSIX")
    error = failure("slcan:/dev/no-such-adapter")
    assert "/dev/no-such-adapter" in error.detail
    assert "Device not found. Plug the adapter in" in error.detail
    assert error.facts["remedy"] == "Plug the adapter in and check its name."


@pytest.mark.parametrize(
    ("error", "remedy"),
    [
        (PermissionError(13, "Permission denied"), "sudo usermod -aG dialout $USER"),
        (can.CanInitializationError("the hardware is in use by a net"), "Close that program"),
        (OSError(97, "Address family not supported by protocol"), "modprobe can_raw"),
        (can.CanInterfaceNotImplementedError("no driver"), "modprobe peak_usb"),
        (OSError("pcanbasic library not found."), "Install PCAN-Basic"),
        (can.CanInitializationError("a hardware handle is invalid"), "check its name"),
        (ValueError("channel"), "manual of pcan"),
        (can.CanInitializationError("something else"), "plugged in"),
        (TimeoutError("no response from the device"), "plugged in"),
    ],
)
def test_a_driver_error_is_quoted_with_a_remedy(error: Exception, remedy: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> can.BusABC:
        raise error

    monkeypatch.setattr(can, "Bus", refuse)
    failed = failure("pcan:PCAN_USBBUS1")
    assert str(error) in failed.detail
    assert remedy in failed.detail
    assert "hangs" not in failed.detail
    assert remedy in str(failed.facts["remedy"])


@pytest.mark.parametrize("way", ["deadline", "cancelled"])
@pytest.mark.real_time
async def test_a_port_that_opens_too_late_is_closed(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    proceed = threading.Event()
    closed = threading.Event()

    class Late:
        def shutdown(self) -> None:
            closed.set()

    def slow(**_: object) -> Late:
        proceed.wait(5)
        return Late()

    monkeypatch.setattr(can, "Bus", slow)
    if way == "deadline":
        with pytest.raises(PortOpenFailed, match=r"Opening timed out after 0\.01 s.*Unplug"):
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


@pytest.mark.real_time
async def test_configuration_in_the_home_folder_is_ignored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / ".canrc").write_text("[default]\nreceive_own_messages = True\nchannel = other\n")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("CAN_CONFIG", '{"receive_own_messages": true}')
    port = await open_port("virtual:home")
    bus = port._link._bus  # type: ignore[attr-defined] # pyright: ignore
    assert not bus.receive_own_messages
    assert port.state is PortState.ACTIVE
    await port.close()
