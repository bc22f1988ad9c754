"""CAN over MAVLink, against an autopilot with pymavlink's implementation, in real time."""

import asyncio
import time
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import httpx
import pytest

pytest.importorskip("termios", reason="pseudo terminals exist on POSIX only")

from behaviour.rig import CATALOG, PLAIN, SETTINGS, json, until
from hornbill.api.http import create_api
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.listing import Adapters
from hornbill.bus.ports.mavcan import FILTER, KEY, MavcanLink
from hornbill.bus.ports.mavlink_codec import key_of
from hornbill.bus.reopening import adapter_port
from hornbill.errors import PortOpenFailed
from hornbill.node.role import ConnectionRole
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.host import Host
from hornbill.sim.bench.bench import Bench
from hornbill.store.store import Store
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState
from links.mavlink_autopilot import Autopilot, Terminal, Udp, Way

BAUD = 57_600
GAIN = 0x2C
FRAME = Frame(0x1E0B_94FF, bytes.fromhex("000030783243c5"))
STATUS = Frame(0x1003_F30B, bytes.fromhex("0102030405060780"))


def received(link: MavcanLink, count: int, within_s: float = 5.0) -> list[Frame]:
    frames: list[Frame] = []
    end = time.monotonic() + within_s
    while len(frames) < count and time.monotonic() < end:
        frames += link.receive(0.05, 0.0).frames
    return frames


def way_of(kind: str) -> Way:
    return Udp() if kind == "udp" else Terminal(BAUD)


def channel(autopilot: Autopilot) -> str:
    return autopilot.address.removeprefix("mavcan:")


@pytest.mark.parametrize("kind", ["udp", "serial"])
def test_frames_pass_in_both_directions(kind: str) -> None:
    sent: list[Frame] = []
    with Autopilot(way_of(kind), baud=None if kind == "udp" else BAUD, on_frame=sent.append) as autopilot:
        link = MavcanLink(channel(autopilot), environment={})
        try:
            line = link.line_info
            assert (line and line.budget) == (None if kind == "udp" else BAUD // 10 // 28)
            assert autopilot.clients == {(250, 192)}
            assert autopilot.filter == ([] if kind == "udp" else list(FILTER))
            for number in range(50):
                autopilot.put(STATUS._replace(data=bytes([number])))
            assert [frame.data[0] for frame in received(link, 50)] == list(range(50))
            left = 50
            while left:
                left -= link.transmit([FRAME] * min(left, 8))
            end = time.monotonic() + 5
            while len(sent) < 50 and time.monotonic() < end:
                assert link.receive(0.05, 0.0).frames == [], "our frames do not come back"
            assert sent == [FRAME] * 50
            assert 0 < link.round_trip_s < 0.5
        finally:
            link.shutdown()
        time.sleep(0.3)
        assert not autopilot.forwarding, "closing ends the forwarding"


def test_the_forwarding_is_renewed_and_ends_without_it() -> None:
    with Autopilot(Udp()) as autopilot:
        link = MavcanLink(channel(autopilot), environment={})
        end = time.monotonic() + 3.5
        before = autopilot.requests
        while time.monotonic() < end:
            link.receive(0.05, 0.0)
        assert 3 <= autopilot.requests - before <= 4
        link.shutdown()


@pytest.mark.parametrize("kind", ["udp", "serial"])
@pytest.mark.parametrize("fault", ["loss", "damage"])
def test_lost_and_damaged_messages_are_counted(kind: str, fault: str) -> None:
    with Autopilot(way_of(kind), loss=0.05 * (fault == "loss"), damage=0.05 * (fault == "damage")) as autopilot:
        link = MavcanLink(channel(autopilot), environment={})
        begun, lost, garbled, frames = autopilot.lost + autopilot.damaged, 0, 0, 0
        for _ in range(40):
            for number in range(25):
                autopilot.put(STATUS._replace(data=bytes([number])))
            end = time.monotonic() + 0.04
            while time.monotonic() < end:
                got = link.receive(0.01, 0.0)
                lost, garbled, frames = lost + got.lost, garbled + got.garbled, frames + len(got.frames)
        link.shutdown()
        expected = autopilot.lost + autopilot.damaged - begun
        assert expected > 20
        assert 900 < frames < 1000
        assert abs(lost - expected) <= 8, "some were lost in the other direction, or at the end"
        assert garbled == 0 if fault == "loss" else abs(garbled - expected) <= 8


@pytest.mark.parametrize(
    ("theirs", "ours", "cause"),
    [
        ("right", "wrong", "mavcan_key_wrong"),
        ("right", None, "mavcan_key_missing"),
        (None, "right", "mavcan_not_signed"),
    ],
)
def test_a_wrong_key_is_named(theirs: str | None, ours: str | None, cause: str) -> None:
    environment = {} if ours is None else {KEY: ours}
    with (
        Autopilot(Udp(), key=None if theirs is None else key_of(theirs)) as autopilot,
        pytest.raises(PortOpenFailed, match=KEY) as refused,
    ):
        MavcanLink(channel(autopilot), environment=environment)
    assert refused.value.facts["cause"] == cause
    assert "right" not in refused.value.detail
    assert "wrong" not in refused.value.detail


def test_with_the_right_key_frames_pass_signed() -> None:
    sent: list[Frame] = []
    with Autopilot(Udp(), key=key_of("right"), on_frame=sent.append) as autopilot:
        link = MavcanLink(channel(autopilot), environment={KEY: "right"})
        autopilot.put(STATUS)
        assert received(link, 1)[0].data == STATUS.data
        assert link.transmit([FRAME]) == 1
        time.sleep(0.2)
        assert sent == [FRAME]
        assert autopilot.wrongly_signed == 0
        link.shutdown()


def test_a_bus_the_autopilot_does_not_have_is_refused() -> None:
    with Autopilot(Udp()) as autopilot, pytest.raises(PortOpenFailed, match="CAN bus 2") as refused:
        MavcanLink(f"{channel(autopilot)}?bus=2", environment={})
    assert refused.value.facts["cause"] == "mavcan_refused"
    assert "CAN_P2_DRIVER" in refused.value.detail


def test_the_second_bus_is_selected_by_an_option() -> None:
    sent: list[Frame] = []
    with Autopilot(Udp(), buses=2, on_frame=sent.append) as autopilot:
        link = MavcanLink(f"{channel(autopilot)}?bus=2", environment={})
        autopilot.put(STATUS)
        assert received(link, 1)[0].data == STATUS.data
        link.shutdown()


def test_silence_is_an_error_with_a_remedy() -> None:
    silent = Udp()
    with pytest.raises(PortOpenFailed, match="no MAVLink heartbeat") as refused:
        MavcanLink(silent.address.removeprefix("mavcan:"), environment={})
    silent.close()
    assert refused.value.facts["cause"] == "mavcan_silent"
    assert "host and port" in refused.value.detail


@dataclass
class Bench57:
    """A host behind an autopilot whose bus has one servo."""

    host: Host
    http: httpx.AsyncClient
    autopilot: Autopilot
    port: CanPort
    servos: Bench

    async def servo(self, within_s: float) -> Servo:
        async with asyncio.timeout(within_s):
            while not (found := [one for one in self.host.fleet.all() if one.state is State.READY]):
                await asyncio.sleep(0.02)
        return found[0]

    async def call(self, verb: str, path: str, body: object = None) -> Any:
        return json(await self.http.request(verb, path, json=body))


@asynccontextmanager
async def bench(autopilot: Autopilot) -> AsyncGenerator[Bench57]:
    loop = asyncio.get_running_loop()
    bus = MemoryBus()
    wire = bus.port("autopilot bridge")

    def to_computer(frames: list[Frame]) -> None:
        for frame in frames:
            autopilot.put(frame)

    wire.listen(to_computer)

    def to_bus(frame: Frame) -> None:
        loop.call_soon_threadsafe(wire.send, [frame])

    autopilot.on_frame = to_bus
    servos = Bench(bus.port, CATALOG, 1)
    servos.add(PLAIN)
    store = Store("sqlite://")

    async def open_port(address: str, bitrate: int, **_options: bool) -> CanPort:
        port = adapter_port(address, bitrate)
        await port.open()
        return port

    host = Host(CATALOG, store, open_port, SETTINGS)
    app = create_api(CATALOG)
    app.state.host, app.state.adapters = host, Adapters(detectors={})
    transport = httpx.ASGITransport(app, raise_app_exceptions=True)
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1/api/v1", timeout=None) as client:
        try:
            await servos.set_autopilot("ardupilot", outputs=0)
            await servos.start()
            while not any(one.node_id for one in servos.servos.values()):
                await asyncio.sleep(0.05)
            connection = await host.connect(autopilot.address, 1_000_000, ConnectionRole.GUEST)
            yield Bench57(host, client, autopilot, connection.port, servos)
        finally:
            await host.close()
            await servos.close()
            store.close()


@pytest.mark.release
@pytest.mark.parametrize("kind", ["udp", "serial"])
def test_a_servo_is_read_and_saved_through_a_lossy_autopilot(kind: str) -> None:
    async def main(autopilot: Autopilot) -> None:
        async with bench(autopilot) as made:
            began = time.monotonic()
            servo = await made.servo(within_s=30)
            first_s = time.monotonic() - began
            began = time.monotonic()
            await made.call("GET", f"/servos/{servo.uid}/parameters?refresh=true")
            again_s = time.monotonic() - began
            print(f"{kind}: read in {first_s:.1f} s and {again_s:.1f} s")
            assert max(first_s, again_s) <= 10
            changed = await made.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_p_gain": 55}})
            assert changed["outcome"] == "applied"
            began = time.monotonic()
            job = await made.call("POST", f"/servos/{servo.uid}/save?wait=true")
            print(f"{kind}: saved in {time.monotonic() - began:.1f} s")
            assert job["state"] == "succeeded", job
            assert [one["name"] for one in job["steps"]][-3:] == ["back", "soft_start", "read_back"]
            simulated = next(iter(made.servos.servos.values()))
            assert simulated.memory.stored(GAIN) == 55
            statistics = made.port.statistics
            assert statistics.rx_dropped > 0
            assert statistics.errors == 0
            assert made.port.statistics.reopened == 0

    with Autopilot(way_of(kind), baud=BAUD if kind == "serial" else None, loss=0.05) as autopilot:
        asyncio.run(main(autopilot))


def test_a_lost_autopilot_is_reconnected() -> None:
    async def main(autopilot: Autopilot) -> None:
        async with bench(autopilot) as made:
            await made.servo(within_s=30)
            autopilot.silent = True
            await until(lambda: made.port.state is not PortState.ACTIVE)
            assert made.port.trouble is not None
            autopilot.silent = False
            await until(lambda: made.port.state is PortState.ACTIVE)
            assert made.port.statistics.reopened == 1
            await made.servo(within_s=15)

    with Autopilot(Udp()) as autopilot:
        asyncio.run(main(autopilot))


async def worst_lag_s(during_s: float) -> float:
    """By how much the event loop was late at most in this time."""
    clock = asyncio.get_running_loop().time
    end, worst = clock() + during_s, 0.0
    while (before := clock()) < end:
        await asyncio.sleep(0.01)
        worst = max(worst, clock() - before - 0.01)
    return worst


def test_requests_wait_for_the_measured_round_trip() -> None:
    """At 150 ms, longer than the timeout of a read, no request is repeated before its response arrives."""

    async def main(autopilot: Autopilot) -> None:
        async with bench(autopilot) as made:
            await until(lambda: made.port.details.round_trip_s >= 0.15)
            await asyncio.sleep(1.2)  # fitted once a second
            connection = made.host.connection
            assert connection is not None
            counters = connection.participant.request_counters
            late = counters.late
            for _ in range(5):
                late, responses = counters.late, counters.responses
                lag_s = await worst_lag_s(4)
                assert counters.responses - responses >= 15
                if counters.late == late or lag_s < 0.02:  # else the machine was too busy to tell
                    break
            assert counters.late == late, "none was given up before its response arrived"

    with Autopilot(Udp(), delay_s=0.15) as autopilot:
        asyncio.run(main(autopilot))
