"""diagnose: cause and remedy for an error raised by a driver on opening an adapter."""

import errno
import os
import socket
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import can

from hornbill.errors import Cause


class Diagnosis(NamedTuple):
    """Why an adapter does not open, and the remedy. Both are sentences; the remedy contains a command if one helps."""

    cause: str
    remedy: str
    code: Cause
    params: Mapping[str, str] = MappingProxyType({})


_MODULES = {"pcan": "peak_usb", "kvaser": "kvaser_usb", "gs_usb": "gs_usb"}
"""Linux kernel module for adapters of these interfaces."""

_SOCKETCAN_INSTEAD = "on Linux, load the kernel driver with sudo modprobe {} and use socketcan:can0"
_DRIVERS = {
    "pcan": "Install PCAN-Basic from PEAK-System; " + _SOCKETCAN_INSTEAD.format("peak_usb") + ".",
    "kvaser": "Install Kvaser CANlib; " + _SOCKETCAN_INSTEAD.format("kvaser_usb") + ".",
    "gs_usb": "Run pip install gs_usb pyusb; " + _SOCKETCAN_INSTEAD.format("gs_usb") + ".",
    "vector": "Install the Vector XL Driver Library (Windows only).",
    "ixxat": "Install the HMS Ixxat VCI driver (Windows only).",
    "nixnet": "Install NI-XNET and run pip install nixnet (Windows only).",
    "neovi": "Run pip install python-ics.",
    "canalystii": "Run pip install canalystii.",
    "cantact": "Run pip install cantact.",
    "udp_multicast": "Run: pip install msgpack",
}
_ANY_DRIVER = "Install the manufacturer's driver or the required Python package."

# Words in driver messages without an error number. The first match counts.
_IN_USE = ("in use", "already been initialized", "already connected", "already open", "access is denied")
_NO_DRIVER = ("driver", "library", "shared object", "install", "could not load", "not supported on")
_NO_DEVICE = ("not found", "no such", "not exist", "filenotfound", "handle is invalid", "no device")


def diagnose(interface: str, channel: str, error: BaseException) -> Diagnosis:
    """Diagnose `error`, raised on opening `interface:channel`."""
    device = channel.partition("@")[0]
    if interface == "socketcand":
        return _no_server(error)
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.errno is not None:
            known = _by_number(cause.errno, device)
            if known is not None:
                return known
        if isinstance(cause, ImportError | NameError | can.CanInterfaceNotImplementedError):
            return _no_driver(interface)
        cause = cause.__cause__
    text = str(error).casefold()
    if any(words in text for words in _IN_USE):
        return _in_use(device)
    if any(words in text for words in _NO_DRIVER):
        return _no_driver(interface)
    if any(words in text for words in _NO_DEVICE):
        return _no_device()
    if isinstance(error, TypeError | ValueError):
        return Diagnosis(
            f"{channel!r} is not a valid {interface} channel.",
            f"See the python-can manual of {interface} for the channel format.",
            "channel_invalid",
            {"channel": channel, "interface": interface},
        )
    return Diagnosis(
        "Its driver reported an error.",
        "Check that the adapter is plugged in and that its driver is installed.",
        "driver_refused",
    )


def no_permission(device: str) -> Diagnosis:
    """Diagnosis: this user has no permission for `device`, a file such as /dev/ttyACM0."""
    try:
        group = Path(device).group()
    except (OSError, KeyError, NotImplementedError):
        group = "dialout"
    command = f"sudo usermod -aG {group} $USER"
    return Diagnosis(
        "This user has no permission to use it.", f"Run: {command}, log out and in again, then retry.", "no_permission",
        {"command": command},
    )  # fmt: skip


def users_of(device: str) -> list[str]:
    """Name and process ID of the programs that have `device` open, as far as visible to this user (Linux)."""
    target = os.path.realpath(device)
    found: list[str] = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if any(os.path.realpath(each) == target for each in (process / "fd").iterdir()):
                found.append(f"{(process / 'comm').read_text(encoding='utf-8').strip()} (process {process.name})")
        except OSError:  # it ended, or belongs to another user
            continue
    return found


def _by_number(number: int, device: str) -> Diagnosis | None:
    match number:
        case errno.ENOENT | errno.ENODEV | errno.ENXIO:
            return _no_device()
        case errno.EACCES | errno.EPERM if os.name == "nt":
            return _in_use(device)  # on Windows: another program has the serial port open
        case errno.EACCES | errno.EPERM:
            return no_permission(device)
        case errno.EBUSY:
            return _in_use(device)
        case errno.EIO:
            return Diagnosis(
                "It was unplugged, or stopped responding, while it was being opened.", "Plug it in again and retry.",
                "unplugged",
            )  # fmt: skip
        case errno.EAFNOSUPPORT:
            command = "sudo modprobe can_raw"
            return Diagnosis(
                "This kernel has no SocketCAN.", f"Run: {command}", "kernel_without_socketcan", {"command": command}
            )
        case _:
            return None


def _in_use(device: str) -> Diagnosis:
    users = ", ".join(users_of(device)) if device.startswith("/") else ""
    params = {"users": users} if users else {}
    return Diagnosis(f"{users or 'Another program'} is using it.", "Close that program first.", "in_use", params)


def _no_device() -> Diagnosis:
    return Diagnosis("Device not found.", "Plug the adapter in and check its name.", "device_not_found")


def _no_server(error: BaseException) -> Diagnosis:
    """Diagnose a failed connection to a socketcand server."""
    if isinstance(error, socket.gaierror):
        return Diagnosis("Host not found.", "Check the host name, or enter its IP address.", "host_not_found")
    if isinstance(error, ConnectionRefusedError):
        return Diagnosis(
            "No server is listening there.", "Start socketcand on that host (socketcand -i can0), and check the port.",
            "server_not_running",
        )  # fmt: skip
    return Diagnosis(
        "The server does not respond.",
        "Check that the host can be reached and that a socketcand server is on that port.",
        "server_not_responding",
    )


def _no_driver(interface: str) -> Diagnosis:
    params = {"interface": interface}
    if interface in _MODULES:
        params["command"] = f"sudo modprobe {_MODULES[interface]}"
    what = f"The driver of {interface} is not installed."
    if interface == "udp_multicast":
        what = "The Python package msgpack is not installed."
    return Diagnosis(what, _DRIVERS.get(interface, _ANY_DRIVER), "no_driver", params)
