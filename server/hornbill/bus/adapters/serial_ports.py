"""Detection of serial ports with a known or possible slcan adapter, by USB ID and name."""

import os
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from serial.tools import list_ports

from hornbill.bus.adapters.adapter import FoundAdapter
from hornbill.bus.adapters.diagnosis import no_permission, users_of

KNOWN = {
    (0x0403, 0x9F80): "CANdapter",
    (0x0403, 0xFFA8): "LAWICEL CANUSB",
    (0x04D8, 0x000A): "USBtin, or another Microchip device",
    (0x16D0, 0x117E): "CANable 2",
    (0x1D50, 0x60C7): "Zubax Babel",
    (0xAD50, 0x60C4): "CANable",
}
"""slcan adapters by USB vendor and product ID."""

NATIVE_USB = KNOWN.keys() - {(0x0403, 0x9F80)}
"""Those without a serial line between USB and the adapter: their baud rate has no effect."""

POSSIBLE = frozenset(
    (
        (0x0403, 0x6001), (0x0403, 0x6010), (0x0403, 0x6014), (0x0403, 0x6015),  # FTDI
        (0x0483, 0x5740),  # any STM32
        (0x10C4, 0xEA60),  # CP210x
        (0x1209, 0x5740), (0x1209, 0x5741),  # an ArduPilot autopilot, which can forward CAN
        (0x1A86, 0x5523), (0x1A86, 0x55D3), (0x1A86, 0x55D4), (0x1A86, 0x7523),  # WCH
        (0x2E8A, 0x000A),  # RP2040
    )
)  # fmt: skip
"""USB IDs of chips used in slcan adapters, but also in other devices."""

_NAMED = re.compile(r"slcan|canable|cantact|canface|usbtin|babel|usb-?2?can|can-?2?usb|\bcan(fd|bus)?\b", re.IGNORECASE)


class SerialPort(Protocol):
    """A port in pyserial's list_ports."""

    device: str
    vid: int | None
    pid: int | None
    serial_number: str | None
    manufacturer: str | None
    product: str | None
    location: str | None


class BaudMemory(Protocol):
    """The baud rates at which serial adapters were last used, by USB serial number."""

    def baud(self, serial_number: str) -> int | None:
        """The rate of an adapter, bit/s; None if it is not known."""
        ...

    def remember_baud(self, serial_number: str, baud: int) -> None:
        """Store the rate of an adapter, bit/s."""
        ...


@dataclass(frozen=True, slots=True)
class UsbAdapter:
    """USB properties of the adapter on a serial port."""

    serial_number: str | None = None
    native_usb: bool = False
    """Whether its baud rate has no effect."""


UNKNOWN_ADAPTER = UsbAdapter()
"""An adapter not on USB, or an unknown one."""


def usb_of(device: str, ports: Iterable[SerialPort] | None = None) -> UsbAdapter:
    """USB properties of the adapter on `device`. Takes up to a second: call it in a thread. Never raises."""
    try:
        found = list_ports.comports() if ports is None else ports
    except Exception:  # a driver may raise anything, and opening does not depend on it
        return UNKNOWN_ADAPTER
    path = os.path.realpath(device) if device.startswith("/") else device
    for port in found:
        if port.device in (device, path):
            return UsbAdapter(port.serial_number, (port.vid or 0, port.pid or 0) in NATIVE_USB)
    return UNKNOWN_ADAPTER


def serial_adapters(ports: Iterable[SerialPort] | None = None) -> list[FoundAdapter]:
    """Serial ports with a known or possible slcan adapter, known ones first. Does not open or read any port.

    `ports` defaults to those of this computer. Takes up to a second: call it in a thread.
    """
    found = sorted(list_ports.comports() if ports is None else ports, key=lambda each: each.device)
    alike = Counter((port.vid, port.pid, port.serial_number) for port in found)
    sure: list[FoundAdapter] = []
    possible: list[FoundAdapter] = []
    for port in found:
        ids = (port.vid or 0, port.pid or 0)
        where = port.location if alike[port.vid, port.pid, port.serial_number] > 1 else None
        if ids in KNOWN or _NAMED.search(f"{port.product or ''} {port.manufacturer or ''}"):
            sure.append(_adapter(port, KNOWN.get(ids), where))
        elif ids in POSSIBLE:
            doubt = "It is unknown whether a CAN adapter is on this serial port."
            possible.append(_adapter(port, None, where, doubt))
    return sure + possible


def _adapter(port: SerialPort, known_as: str | None, where: str | None, doubt: str | None = None) -> FoundAdapter:
    """`where` is the USB port, to distinguish identical adapters."""
    named = port.product if known_as is None or (port.product and _NAMED.search(port.product)) else known_as
    at = None if where is None else f"(USB {where})"
    name = " ".join(filter(None, (named or "Serial port", port.serial_number, at)))
    found = FoundAdapter(f"slcan:{port.device}", name, serial_number=port.serial_number)
    if port.device.startswith("/"):
        if not Path(port.device).exists():
            return replace(
                found,
                state="no_driver",
                reason="It was unplugged.",
                remedy="Plug it in again.",
                cause="adapter_removed",
            )
        if not os.access(port.device, os.R_OK | os.W_OK):
            why = no_permission(port.device)
            return replace(
                found, state="no_permission", reason=why.cause, remedy=why.remedy, cause=why.code, params=why.params
            )
        users = users_of(port.device)
        if users:
            why = f"{', '.join(users)} is using it."
            return replace(
                found,
                state="in_use",
                reason=why,
                remedy="Close that program first.",
                cause="in_use",
                params={"users": ", ".join(users)},
            )
    return found if doubt is None else replace(found, reason=doubt, cause="adapter_unconfirmed")
