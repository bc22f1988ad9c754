"""`demo --bus auto` on a kernel CAN bus. No other server may be on it: both would have node ID 127."""

import re

import can
import httpx

from socketcan.processes import TIMEOUT_S, hornbill, identified, line, until


def test_a_demo_with_automatic_bus_uses_and_reports_the_kernels_bus(vcan0: str) -> None:
    with hornbill("demo", "--bus", "auto", "--servos", "2", "--port", "0") as process:
        found = re.search(r"http://\S+/", line(process))
        assert found is not None
        assert line(process).startswith(f"bus: {vcan0}, because vcan0 is up")
        with httpx.Client(base_url=found[0] + "api/v1", timeout=TIMEOUT_S) as api:
            assert api.get("/bus").json()["address"] == vcan0
            with can.Bus(interface="socketcan", channel="vcan0") as bus:
                until(lambda: (got := bus.recv(0.1)) is not None and got.is_extended_id, "a frame on the kernel's bus")
            uids = {one["uid"] for one in api.get("/sim/servos").json()}
            assert len(uids) == 2
            until(lambda: identified(api) >= uids, "both servos are ready")
