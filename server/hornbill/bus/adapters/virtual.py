"""The choice of a virtual CAN interface of the kernel, for simulated servos that other programs are to see."""

import socket
from typing import Final

from hornbill.bus.adapters import socketcan

MODULE: Final = "sudo modprobe vcan && sudo ip link add dev vcan0 type vcan && sudo ip link set vcan0 up"


def find_vcan() -> tuple[str | None, str]:
    """The address of the first virtual CAN interface that is up and opens, or None; and why, as a clause.

    Only interfaces the kernel itself made up are looked at, by name and by place: simulated servos must never get
    onto a bus with real ones. Takes a moment: it opens a socket. Never raises.
    """
    if not hasattr(socket, "AF_CAN"):
        return None, "SocketCAN exists on Linux only"
    vcans = [name for name in socketcan.names() if name.startswith("vcan") and _made_up(name)]
    if not vcans:
        return None, f"there is no virtual CAN interface (one is made by: {MODULE})"
    why = ""
    for name in vcans:
        why = _trouble(name)
        if not why:
            return f"socketcan:{name}", f"{name} is up, so other programs see it too, for example: candump {name}"
    return None, why


def _made_up(name: str) -> bool:
    return "virtual" in (socketcan.NET / name).resolve().parts


def _trouble(name: str) -> str:
    """Why it cannot be used, or nothing."""
    if not socketcan.is_up(name):
        return f"{name} is down (sudo ip link set {name} up)"
    try:
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
            raw.bind((name,))
    except OSError as error:
        return f"{name} does not open: {error.strerror}"
    return ""
