"""Linux SocketCAN: list of interfaces, and whether they can be used."""

import json
import os
import shutil
import socket
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from hornbill.errors import Cause, PortOpenFailed

NET = Path("/sys/class/net")
"""Where the kernel lists its network interfaces."""

SAMPLE_POINT = 0.875
"""Sample point of the servos within a bit (section 2.1)."""

NEAR = 0.005
"""Tolerance of a bit rate (relative) and of a sample point (of a bit)."""

_ARPHRD_CAN = "280"
_IFF_UP = 0x1
_IP_S = 1.0  # timeout of `ip`
_SBIN = ("/usr/sbin", "/sbin")  # where `ip` is; often missing in users' PATH


@dataclass(frozen=True, slots=True)
class Interface:
    """One CAN interface of the kernel. `bitrate` (bit/s) and `sample_point` (0..1) are None if unknown: on virtual
    interfaces, and without the command `ip`. `listen_only`: it neither sends nor acknowledges frames.
    """

    name: str
    up: bool
    bus_off: bool = False
    bitrate: int | None = None
    sample_point: float | None = None
    listen_only: bool = False


@dataclass(frozen=True, slots=True)
class InterfaceFault:
    """Why an interface cannot be used: a state of `GET /bus/adapters`, a sentence, and a command as remedy. `cause`
    and `params` are the same for programs.
    """

    state: str
    reason: str
    remedy: str
    cause: Cause
    params: Mapping[str, Any]


def names() -> list[str]:
    """CAN interfaces of this computer, up or down."""
    if not NET.is_dir():
        return []
    return sorted(entry.name for entry in NET.iterdir() if _read(entry / "type") == _ARPHRD_CAN)


def interfaces() -> list[Interface]:
    """CAN interfaces with their properties. Takes up to a second: call it in a thread."""
    found = names()
    details = _details() if found else {}
    return [_interface(name, details.get(name, {})) for name in found]


def check(channel: str, bitrate: int) -> Interface | None:
    """Check the interface `channel` for `bitrate` (bit/s). None if nothing can be known before it is opened.

    Takes up to a second: call it in a thread. Raises PortOpenFailed with a command as remedy if `channel` is not a
    CAN interface, is down, in bus-off, or runs at another bit rate.
    """
    address = f"socketcan:{channel}"
    if not hasattr(socket, "AF_CAN"):
        raise PortOpenFailed(
            "SocketCAN is available on Linux only. Use the interface of your adapter, for example slcan:COM3.",
            address=address,
            cause="linux_only",
        )
    if not NET.is_dir():
        return None
    known = names()
    if channel not in known:
        others = f"Available: {', '.join(known)}." if known else "This computer has no CAN interface."
        if is_virtual(channel):
            command = remedy = f"sudo ip link add dev {channel} type vcan && sudo ip link set {channel} up"
            detail = f"CAN interface {channel} not found. {others} Create it with: {remedy}"
        else:
            command, remedy = None, "Plug the adapter in, or choose another interface."
            detail = f"CAN interface {channel} not found. {others} {remedy}"
        facts: dict[str, Any] = {"interface": channel, "others": known}
        if command is not None:
            facts["command"] = command
        raise PortOpenFailed(detail, address=address, remedy=remedy, cause="interface_not_found", **facts)
    found = _interface(channel, _details().get(channel, {}))
    fault = fault_of(found, bitrate)
    if fault is not None:
        text = f"{fault.reason} {fault.remedy}"
        raise PortOpenFailed(text, address=address, remedy=fault.remedy, cause=fault.cause, **fault.params)
    return found


def fault_of(found: Interface, bitrate: int) -> InterfaceFault | None:
    """Why an interface cannot be used at `bitrate` (bit/s). None if it can.

    A sample point other than SAMPLE_POINT is not a fault: it works on a short bus.
    """
    if not found.up:
        command = up_command(found.name, bitrate)
        return InterfaceFault(
            "down",
            f"The interface {found.name} is down. Bring it up with:",
            command,
            "interface_down",
            {"interface": found.name, "command": command},
        )
    if found.bus_off:
        command = f"sudo ip link set {found.name} type can restart"
        return InterfaceFault(
            "down",
            f"The controller of {found.name} is in bus-off after too many errors. "
            "Check bit rate, wiring and termination, then restart it with:",
            command,
            "interface_bus_off",
            {"interface": found.name, "command": command},
        )
    if found.bitrate is not None and abs(found.bitrate - bitrate) > NEAR * bitrate:
        command = set_command(found.name, bitrate)
        return InterfaceFault(
            "wrong_bitrate",
            f"{found.name} runs at {found.bitrate} bit/s instead of {bitrate}. Set it with:",
            command,
            "bit_rate_mismatch",
            {"interface": found.name, "bitrate": found.bitrate, "wanted_bitrate": bitrate, "command": command},
        )
    return None


def up_command(name: str, bitrate: int) -> str:
    """The command that brings an interface up at `bitrate` (bit/s) with the servos' sample point."""
    timing = "" if is_virtual(name) else f" type can bitrate {bitrate} sample-point {SAMPLE_POINT}"
    return f"sudo ip link set {name} up{timing}"


def set_command(name: str, bitrate: int) -> str:
    """The commands that change the bit rate and sample point of an interface that is up."""
    return f"sudo ip link set {name} down && {up_command(name, bitrate)}"


def listen_only_command(name: str, bitrate: int) -> str:
    """The commands that put an interface into listen-only mode at `bitrate` (bit/s)."""
    timing = f"bitrate {bitrate} sample-point {SAMPLE_POINT}"
    return f"sudo ip link set {name} down && sudo ip link set {name} up type can {timing} listen-only on"


def keep_backlog_short(bus: object) -> None:
    """Limit the frames of `bus`, an open python-can SocketCAN bus, in the kernel's queue.

    A stop can overtake frames in our own queue, but not in the kernel's. The kernel raises the size to its minimum
    of about three frames.
    """
    raw = getattr(bus, "socket", None)
    if isinstance(raw, socket.socket):
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)


def is_up(name: str) -> bool:
    """Whether the interface exists and is up."""
    return bool(int(_read(NET / name / "flags") or "0", 16) & _IFF_UP)


def _interface(name: str, details: Mapping[str, Any]) -> Interface:
    up = is_up(name)
    # Only bus-off removes the carrier, until the controller restarts.
    bus_off = up and (_read(NET / name / "carrier") == "0" or details.get("state") == "BUS-OFF")
    timing = cast(Mapping[str, Any], details.get("bittiming") or {})
    silent = "LISTEN-ONLY" in (details.get("ctrlmode") or ())
    try:  # `ip` prints the sample point as a string
        return Interface(name, up, bus_off, int(timing["bitrate"]), float(timing["sample_point"]), silent)
    except (KeyError, TypeError, ValueError):
        return Interface(name, up, bus_off, listen_only=silent)


def _details() -> dict[str, Mapping[str, Any]]:
    """Controller details from `ip` by interface name. Empty if `ip` is missing or fails."""
    command = shutil.which("ip", path=os.pathsep.join(filter(None, (os.environ.get("PATH"), *_SBIN))))
    if command is None:
        return {}
    try:
        done = subprocess.run(
            (command, "-details", "-json", "link", "show"), capture_output=True, timeout=_IP_S, check=True
        )
        links = cast(list[dict[str, Any]], json.loads(done.stdout))
        infos: dict[str, Any] = {str(link["ifname"]): (link.get("linkinfo") or {}).get("info_data") for link in links}
    except (OSError, subprocess.SubprocessError, ValueError, AttributeError, LookupError, TypeError):
        return {}
    return {name: cast(Mapping[str, Any], info) for name, info in infos.items() if isinstance(info, dict)}


def is_virtual(channel: str) -> bool:
    """Whether an interface has no bit timing to set: a virtual or a serial one."""
    return channel.startswith(("vcan", "vxcan", "slcan"))


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except OSError:
        return ""
