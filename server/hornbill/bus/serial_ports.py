"""Owns the list of serial ports with an slcan adapter behind them, known by their USB ids and names, or possibly so."""

import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

from serial.tools import list_ports

from hornbill.bus.adapter import Adapter
from hornbill.bus.diagnosis import no_permission, users_of

KNOWN = {
    (0x0403, 0x9F80): "CANdapter",
    (0x0403, 0xFFA8): "LAWICEL CANUSB",
    (0x04D8, 0x000A): "USBtin, or something else by Microchip",
    (0x16D0, 0x117E): "CANable 2",
    (0x1D50, 0x60C7): "Zubax Babel",
    (0xAD50, 0x60C4): "CANable",
}
"""USB vendor and product id of adapters that speak slcan."""

POSSIBLE = frozenset(
    (
        (0x0403, 0x6001), (0x0403, 0x6010), (0x0403, 0x6014), (0x0403, 0x6015),  # FTDI
        (0x0483, 0x5740),  # any STM32
        (0x10C4, 0xEA60),  # CP210x
        (0x1209, 0x5740), (0x1209, 0x5741),  # an autopilot with ArduPilot, which can pass CAN through
        (0x1A86, 0x5523), (0x1A86, 0x55D3), (0x1A86, 0x55D4), (0x1A86, 0x7523),  # WCH
        (0x2E8A, 0x000A),  # RP2040
    )
)  # fmt: skip
"""Chips with which slcan adapters are built, as is much else."""

_NAMED = re.compile(r"slcan|canable|cantact|canface|usbtin|babel|usb-?2?can|can-?2?usb|\bcan(fd|bus)?\b", re.IGNORECASE)


class SerialPort(Protocol):
    """What pyserial's list_ports tells of a port."""

    device: str
    vid: int | None
    pid: int | None
    serial_number: str | None
    manufacturer: str | None
    product: str | None


def serial_adapters(ports: Iterable[SerialPort] | None = None) -> list[Adapter]:
    """Serial ports a bus can perhaps be opened on, the sure ones first. Reads no port and opens none.

    `ports` are the machine's unless given. Takes up to a second: call it in a thread.
    """
    found = list_ports.comports() if ports is None else ports
    sure: list[Adapter] = []
    possible: list[Adapter] = []
    for port in sorted(found, key=lambda each: each.device):
        ids = (port.vid or 0, port.pid or 0)
        if ids in KNOWN or _NAMED.search(f"{port.product or ''} {port.manufacturer or ''}"):
            sure.append(_adapter(port, KNOWN.get(ids)))
        elif ids in POSSIBLE:
            possible.append(
                _adapter(port, None, doubt="A serial port does not tell whether a CAN adapter is behind it.")
            )
    return sure + possible


def _adapter(port: SerialPort, known_as: str | None, doubt: str | None = None) -> Adapter:
    named = port.product if known_as is None or (port.product and _NAMED.search(port.product)) else known_as
    name = " ".join(filter(None, (named or "Serial port", port.serial_number)))
    address = f"slcan:{port.device}"
    if port.device.startswith("/"):
        if not Path(port.device).exists():
            return Adapter(address, name, "no_driver", "It is going away.", "Plug it in again.")
        if not os.access(port.device, os.R_OK | os.W_OK):
            return Adapter(address, name, "no_permission", *no_permission(port.device))
        users = users_of(port.device)
        if users:
            return Adapter(address, name, "in_use", f"{', '.join(users)} uses it.", "Close that program first.")
    return Adapter(address, name, reason=doubt)
