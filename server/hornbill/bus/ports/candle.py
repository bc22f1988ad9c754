"""Adapters with candleLight firmware on Windows and macOS, through python-can-candle (the extra `candle`).

On Linux the kernel drives them: socketcan.
"""

import errno
import re
import sys
from importlib import import_module
from typing import Any, Protocol, cast

import can

from hornbill.bus.adapters.adapter import FoundAdapter
from hornbill.bus.ports.link import MessageLink, Received
from hornbill.errors import PortOpenFailed
from hornbill.units import Instant

INSTALL = 'Run: pip install "hornbill[candle]"'

_CHANNEL = re.compile(r"(?P<serial>[^/\s]*)(/(?P<number>\d{1,2}))?")


class CandleDevice(Protocol):
    """An adapter in candle_api."""

    serial_number: str
    product: str
    is_connected: bool

    def __len__(self) -> int: ...

    def close(self) -> None:
        """Release the adapter."""
        ...


def devices() -> list[CandleDevice]:
    """Plugged-in adapters. Raises ImportError if the package is not installed."""
    return cast("list[CandleDevice]", import_module("candle.candle_bus").api.list_device())


def candle_adapters() -> list[FoundAdapter]:
    """Plugged-in adapters, except where the kernel has a driver. Blocks briefly: call it in a thread."""
    if sys.platform == "linux":
        return []
    found: list[FoundAdapter] = []
    for device in devices():
        for number in range(len(device)):
            channel = device.serial_number + (f"/{number}" if number else "")
            name = f"{device.product or 'candleLight'} {device.serial_number}".strip()
            found.append(FoundAdapter(f"candle:{channel}", name, serial_number=device.serial_number or None))
    return found


class CandleLink(MessageLink):
    """A Link to an adapter with candleLight firmware."""

    def __init__(self, channel: str, bitrate: int) -> None:
        """Open `[SERIAL_NUMBER][/NUMBER]` at `bitrate` (bit/s); without a serial number, the only adapter.

        Raises PortOpenFailed if the package or the adapter is missing, and the errors of the driver.
        """
        address = f"candle:{channel}"
        try:
            device, number = _choose(devices(), channel, address)
        except ImportError as error:
            raise PortOpenFailed(
                f"{address} needs a Python package that is not installed. {INSTALL}",
                address=address,
                remedy=INSTALL,
                cause="candle_package_missing",
            ) from error
        bus = can.Bus(
            interface="candle", channel=f"{device.serial_number}:{number}", bitrate=bitrate, ignore_config=True
        )
        super().__init__(bus, "candle")
        self._opened = cast(Any, bus)._device  # left open by the bus on shutdown

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """Receive until `not_before`. Raises OSError if the adapter was unplugged."""
        got = super().receive(timeout_s, not_before)
        if not got and not self._opened.is_connected:
            raise OSError(errno.ENODEV, "it was unplugged")
        return got

    def shutdown(self) -> None:
        """Take the adapter off the bus and release it."""
        try:
            super().shutdown()
        finally:
            self._opened.close()


def _choose(found: list[CandleDevice], channel: str, address: str) -> tuple[CandleDevice, int]:
    """The adapter and the number of its channel. Raises PortOpenFailed."""
    requested = _CHANNEL.fullmatch(channel)
    if requested is None:
        raise PortOpenFailed(
            f"{channel!r} is not SERIAL_NUMBER or SERIAL_NUMBER/CHANNEL.",
            address=address,
            cause="candle_channel_invalid",
        )
    serial, number = requested["serial"], int(requested["number"] or 0)
    fitting = [one for one in found if serial in ("", one.serial_number)]
    names = ", ".join(f"candle:{one.serial_number}" for one in found)
    if not fitting:
        remedy = f"Choose one of: {names}." if names else "Plug it in."
        raise PortOpenFailed(
            f"Adapter {address} not found. {remedy}",
            address=address,
            remedy=remedy,
            cause="adapter_not_found",
            others=[f"candle:{one.serial_number}" for one in found],
        )
    if len(fitting) > 1:
        remedy = f"Choose one by its serial number: {names}."
        raise PortOpenFailed(
            f"{address} matches {len(fitting)} adapters. {remedy}",
            address=address,
            remedy=remedy,
            cause="adapter_ambiguous",
            others=[f"candle:{one.serial_number}" for one in found],
        )
    if number >= len(fitting[0]):
        remedy = f"Choose a channel from 0 to {len(fitting[0]) - 1}."
        raise PortOpenFailed(
            f"The adapter {fitting[0].serial_number} has no channel {number}. {remedy}",
            address=address,
            remedy=remedy,
            cause="channel_not_found",
            channel=number,
            highest=len(fitting[0]) - 1,
        )
    return fitting[0], number
