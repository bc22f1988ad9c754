"""Selection of a virtual CAN interface of the kernel, to make simulated servos visible to other programs."""

import socket
from typing import Final

from hornbill.bus.adapters import socketcan

MODULE: Final = "sudo modprobe vcan && sudo ip link add dev vcan0 type vcan && sudo ip link set vcan0 up"


def find_vcan() -> tuple[str | None, str]:
    """The address of the first usable virtual CAN interface, or None, and an explanation as a clause.

    Only interfaces that are virtual both by name and by sysfs path are considered: simulated servos must never be on a
    bus with real ones. Blocks briefly, because it opens a socket. Never raises.
    """
    if not hasattr(socket, "AF_CAN"):
        return None, "SocketCAN is available on Linux only"
    vcans = [name for name in socketcan.names() if name.startswith("vcan") and _is_virtual(name)]
    if not vcans:
        return None, f"there is no virtual CAN interface (create one with: {MODULE})"
    why = ""
    for name in vcans:
        why = _trouble(name)
        if not why:
            return f"socketcan:{name}", f"{name} is up and visible to other programs, for example: candump {name}"
    return None, why


def _is_virtual(name: str) -> bool:
    return "virtual" in (socketcan.NET / name).resolve().parts


def _trouble(name: str) -> str:
    """Why it cannot be used. "" if it can."""
    if not socketcan.is_up(name):
        return f"{name} is down (sudo ip link set {name} up)"
    try:
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
            raw.bind((name,))
    except OSError as error:
        return f"{name} cannot be opened: {error.strerror}"
    return ""
