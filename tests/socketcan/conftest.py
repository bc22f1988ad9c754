"""These tests need a real SocketCAN interface vcan0 that is up."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def vcan0() -> str:
    """The address of vcan0; skips where there is none."""
    flags = Path("/sys/class/net/vcan0/flags")
    if not flags.is_file():
        pytest.skip(
            "no vcan0 here: sudo modprobe vcan; sudo ip link add dev vcan0 type vcan; sudo ip link set vcan0 up"
        )
    if not int(flags.read_text(), 16) & 1:
        pytest.skip("vcan0 is down: sudo ip link set vcan0 up")
    return "socketcan:vcan0"
