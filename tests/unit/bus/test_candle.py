"""CandleLight adapters: the installed python-can-candle with simulated devices."""

import asyncio
import sys
import time
from collections import deque
from types import SimpleNamespace
from typing import Any

import pytest

from hornbill.bus.address import check, open_port
from hornbill.bus.ports import candle
from hornbill.bus.ports.candle import candle_adapters
from hornbill.errors import PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState
from unit.bus.waiting import received_by, until

pytestmark = pytest.mark.real_time

plugin: Any = pytest.importorskip("candle.candle_bus", reason="python-can-candle is not installed")


class Channel:
    """One CAN channel of a device, as candle_api shows it."""

    feature = SimpleNamespace(hardware_timestamp=False, fd=False)
    clock_frequency = 48_000_000

    def __init__(self) -> None:
        self.waiting: deque[Any] = deque()
        self.sent: list[Any] = []
        self.timing: tuple[int, ...] = ()
        self.started = False

    def reset(self) -> None:
        self.started = False

    def set_bit_timing(self, *timing: int) -> None:
        self.timing = timing

    def start(self, **_: bool) -> None:
        self.started = True

    def receive_nowait(self) -> Any:
        return self.waiting.popleft() if self.waiting else None

    def send(self, frame: Any, _timeout: float) -> None:
        self.sent.append(frame)


class Device:
    """A device as candle_api shows it."""

    product = "candleLight USB to CAN adapter"
    vendor_id, product_id, manufacturer = 0x1D50, 0x606F, "bytewerk"

    def __init__(self, serial_number: str, channels: int = 1) -> None:
        self.serial_number = serial_number
        self.channels = [Channel() for _ in range(channels)]
        self.is_connected = True
        self.opened = False

    def __len__(self) -> int:
        return len(self.channels)

    def __getitem__(self, number: int) -> Channel:
        return self.channels[number]

    def open(self) -> None:
        self.opened = True

    def close(self) -> None:
        self.opened = False

    def wait_for_frame(self, timeout: float) -> bool:
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            if any(one.waiting for one in self.channels):
                return True
            time.sleep(0.001)
        return False


def plugged_in(monkeypatch: pytest.MonkeyPatch, *devices: Device) -> None:
    api = SimpleNamespace(
        list_device=lambda: list(devices),
        CandleCanFrame=plugin.api.CandleCanFrame,
        CandleFrameType=plugin.api.CandleFrameType,
        CandleDevice=plugin.api.CandleDevice,
    )
    monkeypatch.setattr(plugin, "api", api)


def message(can_id: int, data: bytes) -> Any:
    """A received frame: made by candle_api itself."""
    kind = plugin.api.CandleFrameType(rx=True, extended_id=True)
    return plugin.api.CandleCanFrame(kind, can_id, len(data), data)


@pytest.mark.parametrize("channel", ["", "0031", "0031/0"])
async def test_an_adapter_is_opened_at_the_servos_bit_rate_used_lost_when_unplugged_and_released(
    channel: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = Device("0031")
    plugged_in(monkeypatch, device)
    port = await open_port(f"candle:{channel}")
    assert port.state is PortState.ACTIVE
    (wire,) = device.channels
    assert wire.started
    segments = sum(wire.timing[:3]) + 1
    assert device.channels[0].clock_frequency / wire.timing[4] / segments == 1_000_000
    assert (1 + wire.timing[0] + wire.timing[1]) / segments == pytest.approx(0.875)
    received = received_by(port)
    wire.waiting.append(message(0x1E08FF05, b"\x01\xc0"))
    await until(lambda: received)
    assert received[0][:2] == (0x1E08FF05, b"\x01\xc0")
    port.send([Frame(0x1FAA7F01, b"\x55")])
    await until(lambda: wire.sent)
    assert (wire.sent[0].can_id, bytes(wire.sent[0])[:1]) == (0x1FAA7F01, b"\x55")
    device.is_connected = False
    await until(lambda: port.state is PortState.LOST)
    assert "it was unplugged" in str(port.trouble)
    await port.close()
    assert (wire.started, device.opened) == (False, False)


@pytest.mark.parametrize(
    ("channel", "serials", "what"),
    [
        ("", (), "Adapter candle: not found. Plug it in."),
        ("", ("A", "B"), "matches 2 adapters. Choose one by its serial number: candle:A, candle:B."),
        ("C", ("A",), "Adapter candle:C not found. Choose one of: candle:A."),
        ("A/1", ("A",), "The adapter A has no channel 1. Choose a channel from 0 to 0."),
        ("A/x", ("A",), "is not SERIAL_NUMBER or SERIAL_NUMBER/CHANNEL"),
    ],
)
def test_an_invalid_channel_is_refused_with_the_available_ones(
    channel: str, serials: tuple[str, ...], what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    plugged_in(monkeypatch, *map(Device, serials))
    with pytest.raises(PortOpenFailed) as caught:
        asyncio.run(open_port(f"candle:{channel}"))
    assert what in caught.value.detail


def test_without_the_package_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> list[candle.CandleDevice]:
        raise ModuleNotFoundError("No module named 'candle'")

    monkeypatch.setattr(candle, "devices", missing)
    assert check("candle:", 1_000_000) == "candle:"
    with pytest.raises(PortOpenFailed, match=r'pip install "hornbill\[candle\]"'):
        asyncio.run(open_port("candle:"))


@pytest.mark.parametrize("platform", ["win32", "darwin", "linux"])
def test_adapters_are_listed_where_the_kernel_has_no_driver(platform: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plugged_in(monkeypatch, Device("0031"), Device("0042", 2))
    monkeypatch.setattr(sys, "platform", platform)
    found = candle_adapters()
    if platform == "linux":
        assert found == []
    else:
        assert [one.address for one in found] == ["candle:0031", "candle:0042", "candle:0042/1"]
        assert found[0].name == "candleLight USB to CAN adapter 0031"
        assert found[0].serial_number == "0031"
