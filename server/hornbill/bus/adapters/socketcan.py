"""What is particular to Linux SocketCAN: which interfaces there are, whether one can be used."""

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
"""Where in a bit the servos sample (section 2.1)."""

NEAR = 0.005
"""How far a bit rate (as a share of it) or a sample point (of a bit) may be off and still be called right."""

_ARPHRD_CAN = "280"
_IFF_UP = 0x1
_IP_S = 1.0  # how long `ip` may take
_SBIN = ("/usr/sbin", "/sbin")  # where `ip` is, and what users' PATH often lacks


@dataclass(frozen=True, slots=True)
class Interface:
    """One CAN interface as the kernel has it. `bitrate` (bit/s) and `sample_point` (0..1) are None where nobody
    tells: on virtual interfaces, and where there is no `ip`.
    """

    name: str
    up: bool
    bus_off: bool = False
    bitrate: int | None = None
    sample_point: float | None = None


@dataclass(frozen=True, slots=True)
class InterfaceFault:
    """Why an interface cannot be used: a word of `GET /bus/adapters`, a sentence, and the command that helps;
    `cause` and `params` say the same for programs.
    """

    state: str
    reason: str
    remedy: str
    cause: Cause
    params: Mapping[str, Any]


def names() -> list[str]:
    """The CAN interfaces of this machine, up or down."""
    if not NET.is_dir():
        return []
    return sorted(entry.name for entry in NET.iterdir() if _read(entry / "type") == _ARPHRD_CAN)


def interfaces() -> list[Interface]:
    """Every CAN interface with what is known of it. Takes up to a second: call it in a thread."""
    found = names()
    told = _details() if found else {}
    return [_interface(name, told.get(name, {})) for name in found]


def check(channel: str, bitrate: int) -> Interface | None:
    """The interface `channel`, fit for `bitrate` (bit/s); None where nothing can be known before it is opened.

    Takes up to a second: call it in a thread. Raises PortOpenFailed with the command that helps when `channel` is
    no CAN interface, is down, off the bus, or runs at another bit rate.
    """
    address = f"socketcan:{channel}"
    if not hasattr(socket, "AF_CAN"):
        raise PortOpenFailed(
            "SocketCAN exists on Linux only. Use the adapter's own interface, for example slcan:COM3.",
            address=address,
            cause="linux_only",
        )
    if not NET.is_dir():
        return None
    known = names()
    if channel not in known:
        others = f"CAN interfaces here: {', '.join(known)}." if known else "This machine has no CAN interface."
        if _is_virtual(channel):
            command = remedy = f"sudo ip link add dev {channel} type vcan && sudo ip link set {channel} up"
            detail = f"There is no interface {channel}. {others} Make it with: {remedy}"
        else:
            command, remedy = None, "Plug the adapter in, or choose another interface."
            detail = f"There is no CAN interface {channel}. {others} {remedy}"
        facts: dict[str, Any] = {"interface": channel, "others": known}
        if command is not None:
            facts["command"] = command
        raise PortOpenFailed(detail, address=address, remedy=remedy, cause="no_such_interface", **facts)
    found = _interface(channel, _details().get(channel, {}))
    fault = fault_of(found, bitrate)
    if fault is not None:
        text = f"{fault.reason} {fault.remedy}"
        raise PortOpenFailed(text, address=address, remedy=fault.remedy, cause=fault.cause, **fault.params)
    return found


def fault_of(found: Interface, bitrate: int) -> InterfaceFault | None:
    """What keeps an interface from being used at `bitrate` (bit/s); None when nothing does.

    A sample point other than SAMPLE_POINT does not: on a short bus it works.
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
            f"The controller of {found.name} is off the bus after too many errors. "
            "Check bit rate, wiring and termination, then restart it with:",
            command,
            "interface_bus_off",
            {"interface": found.name, "command": command},
        )
    if found.bitrate is not None and abs(found.bitrate - bitrate) > NEAR * bitrate:
        command = set_command(found.name, bitrate)
        return InterfaceFault(
            "wrong_bitrate",
            f"{found.name} runs at {found.bitrate} bit/s and not at {bitrate}. Set it with:",
            command,
            "other_bit_rate",
            {"interface": found.name, "bitrate": found.bitrate, "wanted_bitrate": bitrate, "command": command},
        )
    return None


def up_command(name: str, bitrate: int) -> str:
    """The command that brings an interface up at `bitrate` (bit/s) with the servos' sample point."""
    timing = "" if _is_virtual(name) else f" type can bitrate {bitrate} sample-point {SAMPLE_POINT}"
    return f"sudo ip link set {name} up{timing}"


def set_command(name: str, bitrate: int) -> str:
    """The commands that give an interface that is up another bit rate and sample point."""
    return f"sudo ip link set {name} down && {up_command(name, bitrate)}"


def keep_backlog_short(bus: object) -> None:
    """Let the kernel hold only a few frames of `bus`, an open python-can SocketCAN bus.

    What waits in our own queue can be overtaken by a stop, what waits in the kernel's cannot. The kernel
    raises the size to its minimum, which is about three frames.
    """
    raw = getattr(bus, "socket", None)
    if isinstance(raw, socket.socket):
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)


def is_up(name: str) -> bool:
    """Whether the interface is there and up."""
    return bool(int(_read(NET / name / "flags") or "0", 16) & _IFF_UP)


def _interface(name: str, told: Mapping[str, Any]) -> Interface:
    up = is_up(name)
    # A controller that went off the bus takes the carrier away until it restarts; nothing else does.
    bus_off = up and (_read(NET / name / "carrier") == "0" or told.get("state") == "BUS-OFF")
    timing = cast(Mapping[str, Any], told.get("bittiming") or {})
    try:  # `ip` prints the sample point as a text
        return Interface(name, up, bus_off, int(timing["bitrate"]), float(timing["sample_point"]))
    except (KeyError, TypeError, ValueError):
        return Interface(name, up, bus_off)


def _details() -> dict[str, Mapping[str, Any]]:
    """What `ip` knows of every CAN interface's controller, by name; nothing where there is no `ip` or it fails."""
    command = shutil.which("ip", path=os.pathsep.join(filter(None, (os.environ.get("PATH"), *_SBIN))))
    if command is None:
        return {}
    try:
        done = subprocess.run(
            (command, "-details", "-json", "link", "show"), capture_output=True, timeout=_IP_S, check=True
        )
        links = cast(list[dict[str, Any]], json.loads(done.stdout))
        told: dict[str, Any] = {str(link["ifname"]): (link.get("linkinfo") or {}).get("info_data") for link in links}
    except (OSError, subprocess.SubprocessError, ValueError, AttributeError, LookupError, TypeError):
        return {}
    return {name: cast(Mapping[str, Any], info) for name, info in told.items() if isinstance(info, dict)}


def _is_virtual(channel: str) -> bool:
    """Whether an interface has no bit timing of its own to set: simulated, or a serial line's."""
    return channel.startswith(("vcan", "vxcan", "slcan"))


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except OSError:
        return ""
