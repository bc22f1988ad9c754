"""An interface that goes down under an open bus and comes up again: loss, remedy, automatic reopening."""

import asyncio
import errno
import fcntl
import os
import socket
import struct
from collections.abc import Callable, Coroutine, Iterator
from typing import Any

import httpx
import pytest

from hornbill.bus.adapters.kernel_adapters import kernel_adapters
from hornbill.bus.address import open_port
from hornbill.bus.reopening import ReopeningPort
from hornbill.errors import BusDisconnected
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState, PortStatistics
from socketcan.processes import hornbill, serving, until

LINK = "vcan1"
REMEDY = f"sudo ip link set {LINK} up"
_SIOCGIFFLAGS, _SIOCSIFFLAGS, _IFF_UP = 0x8913, 0x8914, 0x1


def set_up(up: bool) -> None:
    """What `ip link set vcan1 up` or `down` does, for machines without `ip`."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        request = struct.pack("16sH14x", LINK.encode(), 0)
        (flags,) = struct.unpack_from("H", fcntl.ioctl(control, _SIOCGIFFLAGS, request), 16)
        flags = flags | _IFF_UP if up else flags & ~_IFF_UP
        fcntl.ioctl(control, _SIOCSIFFLAGS, struct.pack("16sH14x", LINK.encode(), flags))


@pytest.fixture(autouse=True)
def link() -> Iterator[None]:
    """vcan1, up before and after the test; skips where it cannot be switched."""
    try:
        set_up(True)
    except OSError as error:
        if error.errno in (errno.ENODEV, errno.EPERM):
            pytest.skip(f"{LINK} cannot be taken down and up here: {os.strerror(error.errno)}")
        raise
    yield
    set_up(True)


def play(scene: Callable[[ReopeningPort], Coroutine[Any, Any, None]]) -> None:
    async def main() -> None:
        async def open_it(statistics: PortStatistics) -> CanPort:
            return await open_port(f"socketcan:{LINK}", statistics=statistics)

        port = ReopeningPort(open_it, address=f"socketcan:{LINK}", bitrate=1_000_000)
        await port.open()
        try:
            await scene(port)
        finally:
            await port.close()

    asyncio.run(main())


async def wait_for(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(60):
        while not condition():
            await asyncio.sleep(0.005)


def test_an_interface_that_goes_down_is_lost_with_a_remedy_and_reopens_automatically() -> None:
    async def scene(port: ReopeningPort) -> None:
        other = await open_port(f"socketcan:{LINK}")
        received: list[Frame] = []
        port.listen(received.extend)
        other.send([Frame(0x18AABB01, b"one")])
        await wait_for(lambda: received)
        set_up(False)
        await wait_for(lambda: port.state is PortState.LOST)
        await wait_for(lambda: REMEDY in str(port.trouble))
        assert port.retry_in_s is not None
        with pytest.raises(BusDisconnected, match=REMEDY):
            port.send([Frame(0x18AABB02, b"old")])
        (shown,) = [one for one in kernel_adapters() if one.channel == LINK]
        assert (shown.state, shown.usable, shown.remedy) == ("down", False, REMEDY)
        await other.close()
        set_up(True)
        await wait_for(lambda: port.state is PortState.ACTIVE)
        assert (port.trouble, port.retry_in_s, port.statistics.reopened) == (None, None, 1)
        other = await open_port(f"socketcan:{LINK}")
        theirs: list[Frame] = []
        other.listen(theirs.extend)
        port.send([Frame(0x18AABB03, b"new")])
        other.send([Frame(0x18AABB01, b"two")])
        await wait_for(lambda: len(received) == 2 and theirs)
        assert [frame.data for frame in theirs] == [b"new"]
        assert [frame.data for frame in received] == [b"one", b"two"]
        assert port.statistics.rx_frames == 2, "counters go on"
        await other.close()

    play(scene)


def test_repeated_losses_leave_no_file_open() -> None:
    async def scene(port: ReopeningPort) -> None:
        descriptors = len(os.listdir("/proc/self/fd"))  # noqa: PTH208
        for turn in range(4):
            set_up(False)
            await wait_for(lambda: port.state is not PortState.ACTIVE)
            set_up(True)
            await wait_for(lambda turn=turn: port.statistics.reopened == turn + 1)
            assert port.state is PortState.ACTIVE
        assert len(os.listdir("/proc/self/fd")) == descriptors  # noqa: PTH208

    play(scene)


def test_the_server_reports_the_loss_recovers_and_releases_commanded_servos(tmp_path: Any) -> None:
    """The interface is down when the server starts, comes up, and goes down while a servo is under command."""
    set_up(False)
    bus = f"socketcan:{LINK}"
    with serving(bus, tmp_path / "data") as api:
        shown = api.get("/bus").json()
        assert shown["state"] in ("lost", "connecting")
        assert REMEDY in shown["trouble"]
        assert listed(api, bus) == "down"
        set_up(True)
        until(lambda: state(api) == "active", "open once the link is up")
        assert listed(api, bus) == "connected"
        with hornbill("sim", "--bus", bus, "--servos", "1", "--node-id", "11"):
            (servo,) = until(lambda: [one for one in api.get("/servos").json() if one["state"] == "ready"], "a servo")
            path = f"/servos/{servo['uid']}"
            lease = {"Lease": api.post("/leases", json={"holder": "test", "ttl_s": 60}).json()["id"]}
            assert api.post(path + "/command", json={"type": "angle", "value": 10}, headers=lease).status_code == 200
            set_up(False)
            until(lambda: state(api) in ("lost", "connecting"), "lost")
            refused = api.post(path + "/command", json={"type": "angle", "value": 20}, headers=lease)
            assert (refused.status_code, refused.json()["code"]) == (503, "bus_disconnected")
            set_up(True)
            until(lambda: state(api) == "active", "back")
            until(lambda: api.get(path + "/parameters/torque_mode").json().get("value") == "off", "torque off")
            assert api.get(path + "/parameters/command_angle").json()["value"] in (10, None), "and never 20"
        assert api.get("/bus").json()["reopened"] == 1


def state(api: httpx.Client) -> str:
    return str(api.get("/bus").json()["state"])


def listed(api: httpx.Client, address: str) -> str:
    return str({one["address"]: one for one in api.get("/bus/adapters").json()}[address]["state"])
