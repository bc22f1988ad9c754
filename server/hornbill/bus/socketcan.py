"""Owns what is particular to Linux SocketCAN: whether an interface can be used, its backlog, its error frames."""

import socket
from collections.abc import Sequence
from pathlib import Path

from hornbill.errors import PortOpenFailed
from hornbill.wire.port import PortState

NET = Path("/sys/class/net")
"""Where the kernel lists its network interfaces."""

_ARPHRD_CAN = "280"
_IFF_UP = 0x1

# include/uapi/linux/can/error.h: the class in the identifier, the controller's state in byte 1.
_BUS_OFF = 0x040
_RESTARTED = 0x100
_CONTROLLER = 0x004
_PASSIVE = 0x10 | 0x20
_ACTIVE = 0x40


def interfaces() -> list[str]:
    """The CAN interfaces of this machine, up or down, by name."""
    if not NET.is_dir():
        return []
    return sorted(entry.name for entry in NET.iterdir() if _read(entry / "type") == _ARPHRD_CAN)


def check(channel: str, bitrate: int) -> None:
    """Raise PortOpenFailed with the command that helps when `channel` is no CAN interface, or is down."""
    address = f"socketcan:{channel}"
    if not hasattr(socket, "AF_CAN"):
        raise PortOpenFailed(
            "SocketCAN exists on Linux only. Use the adapter's own interface, for example slcan:COM3.",
            address=address,
        )
    if not NET.is_dir():
        return  # without sysfs, opening it will tell
    known = interfaces()
    if channel not in known:
        others = f"CAN interfaces here: {', '.join(known)}." if known else "This machine has no CAN interface."
        if _is_virtual(channel):
            remedy = f"sudo ip link add dev {channel} type vcan && sudo ip link set {channel} up"
            detail = f"There is no interface {channel}. {others} Make it with: {remedy}"
        else:
            remedy = "Plug the adapter in, or choose another interface."
            detail = f"There is no CAN interface {channel}. {others} {remedy}"
        raise PortOpenFailed(detail, address=address, remedy=remedy)
    if not int(_read(NET / channel / "flags") or "0", 16) & _IFF_UP:
        remedy = f"sudo ip link set {channel} up"
        if not _is_virtual(channel):
            remedy += f" type can bitrate {bitrate} sample-point 0.875"
        raise PortOpenFailed(
            f"The interface {channel} is down. Bring it up with: {remedy}", address=address, remedy=remedy
        )


def keep_backlog_short(bus: object) -> None:
    """Let the kernel hold only a few frames of `bus`, an open python-can SocketCAN bus.

    What waits in our own queue can be overtaken by a stop, what waits in the kernel's cannot. The kernel
    raises the size to its minimum, which is about three frames.
    """
    raw = getattr(bus, "socket", None)
    if isinstance(raw, socket.socket):
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)


def state_after(error_class: int, data: Sequence[int]) -> PortState | None:
    """The controller's state an error frame tells of, or None when it tells of something else."""
    if error_class & _BUS_OFF:
        return PortState.BUS_OFF
    if error_class & _RESTARTED:
        return PortState.ACTIVE
    if error_class & _CONTROLLER and len(data) > 1:
        if data[1] & _PASSIVE:
            return PortState.PASSIVE
        if data[1] & _ACTIVE:
            return PortState.ACTIVE
    return None


def _is_virtual(channel: str) -> bool:
    return channel.startswith(("vcan", "vxcan"))


def _read(path: Path) -> str:
    try:
        return path.read_text().strip()
    except OSError:
        return ""
