"""Foreign and malformed frames on a Linux CAN bus: our server counts them and continues."""

import subprocess

import pytest

from socketcan import can_utils
from socketcan.processes import until
from socketcan.server.bench import Bench

pytestmark = pytest.mark.release
FOREIGN = [
    "123#DEADBEEF",  # a standard frame
    "123#R",  # a remote frame
    "1FFFFFFF#R",  # an extended one
    "7FF#",
    "12345678##1" + "A5" * 64,  # CAN FD
    "123##0",
]
"""Frames that are not DroneCAN on classic CAN, all six to be counted as ignored."""

BROKEN = [
    "10015521#",  # NodeStatus of a servo without even a tail byte
    "10015521#00",  # with a tail byte that starts nothing
    "10015521#0102C0",  # too short for its type
    "10015522#00000000E00000C3",  # a health and a mode that are reserved
    "10015522#FFFFFFFFFFFFFFE5",  # toggle set in a single frame
    "1003F221#112233445566778A",  # actuator Status that begins and never ends
    "1003F222#1122334455667705",  # and one that ends without a beginning
    "1003F222#112233445566778B",
    "1003F222#112233445566772B",
    "1003F222#112233445566774B",  # wrong checksum
    "00000100#0102030405060708",  # anonymous Allocation, malformed
    "180CB900#C0",  # Allocation of an unknown part of a unique id
    "00000180#C0",  # a service of node 0
    "18018000#C0",
    "100B7FA1#00000000000000C0",  # a response without a request
    "100BFFA1#8100010203040542",  # the rest of a request that never began
    "18EEFFA1#C0",  # an unknown service, requested from us
    "1001557F#00000000000000C0",  # NodeStatus with our own node id
    "1F0FFFFF#FFFFFFFFFFFFFFFF",
    "00000000#0000000000000000",
    "1FFFFFFF#FFFFFFFFFFFFFFFF",
]


@pytest.fixture(autouse=True)
def there() -> None:
    can_utils.needed()


def test_foreign_frames_are_counted_and_malformed_ones_ignored(bench: Bench) -> None:
    before = bench.bus()
    can_utils.cansend(*FOREIGN, *BROKEN)
    until(lambda: bench.bus()["ignored"] >= before["ignored"] + len(FOREIGN), "all are counted")
    after = bench.bus()
    assert after["ignored"] == before["ignored"] + len(FOREIGN)
    assert after["rx_frames"] >= before["rx_frames"] + len(BROKEN)
    assert (after["trouble"], after["reopened"], after["rx_dropped"]) == (None, 0, before["rx_dropped"])
    _all_is_well(bench)


def test_random_frames_of_every_kind_are_harmless(bench: Bench) -> None:
    before = bench.bus()
    frames = ("-m", "-g", "1", "-n", "2000", "-I", "r", "-L", "r", "-D", "r")
    subprocess.run(["cangen", "vcan0", *frames], check=True, timeout=can_utils.TIMEOUT_S)
    until(lambda: bench.bus()["ignored"] > before["ignored"] + 500, "they are counted")
    _all_is_well(bench)


def _all_is_well(bench: Bench) -> None:
    """The bus works, both servos respond, no other node is listed as one, and no ID was allocated."""
    servos = until(bench.ready, "both servos are ready")
    assert bench.bus()["state"] == "active"
    assert {each["uid"] for each in bench.api.get("/servos").json()} == bench.uids
    for each in servos:
        path = f"/servos/{each['uid']}/parameters/servo_id"  # stale if a busy machine let the response be late
        until(lambda path=path: bench.api.get(path).json()["stale"] is False, "it is read")
        assert bench.api.get(path).json()["value"] == each["servo_id"]
        assert each["faults"] == {"notification": 0, "warning": 0, "failure": 0}
    assert bench.allocations()[bench.requesting] == servos[1]["node_id"]
