"""The gap between the frames of one transfer: in the address, on the bus, and never delaying a stop."""

import asyncio
from collections.abc import Sequence

import pytest

from behaviour.rig import Rig, json, problem
from behaviour.scene import scene
from hornbill.app.bus_ports import BusPorts, with_frame_gap
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.ports.frame_gap import FrameGap, parse_frame_gap
from hornbill.bus.reopening import ReopeningPort, adapter_port
from hornbill.errors import PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState, PortStatistics, same_device
from jumping_clock import START
from unit.node.recording import RecordingPort

GAP_S = 0.003
FIRST, MIDDLE, LAST, ALONE = b"\x80", b"\x20", b"\x40", b"\xc0"


def transfer(can_id: int, frames: int) -> list[Frame]:
    tails = [FIRST, *[MIDDLE] * (frames - 2), LAST] if frames > 1 else [ALONE]
    return [Frame(can_id, bytes([number]) + tail) for number, tail in enumerate(tails)]


class Log(RecordingPort):
    """Sent frames as (instant, identifier, first byte)."""

    def __init__(self) -> None:
        super().__init__()
        self.log: list[tuple[float, int, int]] = []

    def send(self, frames: Sequence[Frame]) -> None:
        if self.state is not PortState.BUS_OFF:  # in bus-off, a port raises nothing
            super().send(frames)
        at = round(asyncio.get_running_loop().time() - START, 4)
        self.log += [(at, frame.id, frame.data[0]) for frame in frames]

    async def complete(self) -> list[tuple[float, int, int]]:
        """All frames sent within a second."""
        await asyncio.sleep(1.0)
        return self.log


@pytest.fixture
def log() -> Log:
    return Log()


@pytest.fixture
def gap(log: Log) -> FrameGap:
    return FrameGap(log, GAP_S)


async def test_frames_of_one_transfer_are_sent_with_a_gap(gap: FrameGap, log: Log) -> None:
    gap.send(transfer(1, 4))
    assert await log.complete() == [(0.0, 1, 0), (0.003, 1, 1), (0.006, 1, 2), (0.009, 1, 3)]


async def test_single_frames_and_other_transfers_do_not_wait(gap: FrameGap, log: Log) -> None:
    for each in (transfer(7, 3), transfer(1, 1), transfer(2, 2)):
        gap.send(each)
    assert await log.complete() == [
        (0.0, 7, 0), (0.0, 1, 0), (0.0, 2, 0), (0.003, 7, 1), (0.003, 2, 1), (0.006, 7, 2),
    ]  # fmt: skip


async def test_transfers_of_one_identifier_keep_their_order_and_do_not_mix(gap: FrameGap, log: Log) -> None:
    gap.send(transfer(7, 2) + transfer(7, 1))
    gap.send(transfer(7, 2))
    assert await log.complete() == [(0.0, 7, 0), (0.003, 7, 1), (0.003, 7, 0), (0.003, 7, 0), (0.006, 7, 1)]


@pytest.mark.parametrize("state", [PortState.LOST, PortState.BUS_OFF])
async def test_a_transfer_interrupted_by_a_lost_bus_or_bus_off_is_not_continued(
    gap: FrameGap, log: Log, state: PortState
) -> None:
    gap.send(transfer(7, 3))
    log.state = state
    asyncio.get_running_loop().call_later(0.004, setattr, log, "state", PortState.ACTIVE)
    assert await log.complete() == [(0.0, 7, 0)]


async def test_an_invalid_frame_refuses_the_whole_call(gap: FrameGap, log: Log) -> None:
    with pytest.raises(ValueError, match="29 bits"):
        gap.send([*transfer(7, 3), Frame(1 << 29, ALONE)])
    assert await log.complete() == []


@pytest.mark.parametrize(
    ("address", "plain", "gap_s"),
    [
        ("slcan:/dev/ttyUSB0@1000000?frame_gap_ms=3", "slcan:/dev/ttyUSB0@1000000", 0.003),
        ("socketcan:can0?frame_gap_ms=0.5", "socketcan:can0", 0.0005),
        ("socketcan:can0?frame_gap_ms=0", "socketcan:can0", 0.0),
        ("slcan:loop://?logging=debug", "slcan:loop://?logging=debug", 0.0),
    ],
)
def test_the_gap_is_an_option_of_the_address(address: str, plain: str, gap_s: float) -> None:
    assert parse_frame_gap(address) == (plain, gap_s)


@pytest.mark.parametrize("text", ["", "fast", "-1", "21", "nan", "inf"])
def test_an_invalid_gap_is_refused_with_the_range(text: str) -> None:
    with pytest.raises(PortOpenFailed, match=r"is not 0 to 20 ms\. Enter the pause"):
        adapter_port(f"virtual:x?frame_gap_ms={text}")


def test_options_do_not_change_the_device() -> None:
    assert same_device("slcan:/dev/ttyUSB0@115200", "slcan:/dev/ttyUSB0?frame_gap_ms=3")
    assert not same_device("slcan:/dev/ttyUSB0", "slcan:/dev/ttyUSB1")


def test_the_server_setting_applies_to_adapters_without_their_own() -> None:
    assert with_frame_gap("socketcan:can0", 3) == "socketcan:can0?frame_gap_ms=3"
    assert with_frame_gap("socketcan:can0?frame_gap_ms=1", 3) == "socketcan:can0?frame_gap_ms=1"
    assert with_frame_gap("file:bus.log", 3) == "file:bus.log"
    assert with_frame_gap("socketcan:can0", None) == "socketcan:can0"


async def test_a_reopening_port_has_a_gap_and_drops_queued_frames_when_closed() -> None:
    bus = MemoryBus(history=100)
    other = bus.port("other")

    async def opener(statistics: PortStatistics) -> CanPort:
        inner = bus.port("inner")
        inner.statistics = statistics
        return inner

    port = ReopeningPort(opener, address="memory:inner", bitrate=1_000_000, frame_gap_s=GAP_S)
    await port.open()
    assert port.details.frame_gap_s == GAP_S
    port.send(transfer(7, 4))
    with pytest.raises(ValueError, match="29 bits"):
        port.send([*transfer(7, 3), Frame(1 << 29, ALONE)])
    await asyncio.sleep(0.004)
    await port.close()
    await asyncio.sleep(0.1)
    assert [frame.data[0] for _, frame in bus.history] == [0, 1]
    await other.close()


# Over REST, on a bus with servos.


@scene(connect=False)
async def test_servos_are_written_and_stopped_with_a_gap_shown_by_the_api(rig: Rig) -> None:
    ports = BusPorts(rig.bus, None)  # pyright: ignore[reportArgumentType]
    rig.host._open_port = ports.open  # pyright: ignore[reportPrivateUsage]
    body = {"address": "memory:demo", "frame_gap_ms": 3}
    shown = json(await rig.call("PUT", "/bus", body))
    assert (shown["address"], shown["frame_gap_ms"]) == ("memory:demo", 3.0)
    (servo,) = await rig.ready()
    rig.bus.history.clear()
    json(await rig.call("PUT", f"/servos/{servo.uid}/parameters/angle_p_gain", {"value": 60}))
    frames = [frame for name, frame in rig.bus.history if name == "demo" and frame.id & 0x00FF_8080 == 0x000B_8080]
    write = next(at for at, frame in enumerate(frames) if not frame.data[-1] & 0x40)
    assert frames[write + 1].at - frames[write].at >= GAP_S
    json(await rig.call("POST", "/stop", {}))
    await asyncio.sleep(0.1)
    latch = rig.host.stop.latch
    assert latch is not None
    assert latch.servos
    assert latch.unconfirmed() == []
    json(await rig.call("DELETE", "/stop"))
    problem(await rig.call("PUT", "/bus", {"address": "memory:demo", "frame_gap_ms": 25}), "invalid_value", 422)
    shown = json(await rig.call("PUT", "/bus", {"address": "memory:demo?frame_gap_ms=3", "frame_gap_ms": 0}))
    assert shown["frame_gap_ms"] == 0.0
