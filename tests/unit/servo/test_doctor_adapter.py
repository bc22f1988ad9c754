"""The findings of the doctor about an adapter, from the state of a port."""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass

import pytest

from hornbill.bus.adapters import socketcan
from hornbill.domain.bus import Finding
from hornbill.errors import PortError, PortOpenFailed
from hornbill.node.allocator import Allocator
from hornbill.node.directory import Directory
from hornbill.servo.doctor.doctor import Doctor
from hornbill.servo.doctor.server_record import ServerRecord
from hornbill.servo.runtime.hub import Hub
from hornbill.servo.runtime.loop_lag import LoopLag
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.store import Store
from hornbill.units import Instant
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from hornbill.wire.port import PortState
from hornbill.wire.transfer import Kind, Transfer, split
from unit.node.peer import participant
from unit.node.recording import RecordingPort
from unit.node.table import MemoryTable


def refused(fault: socketcan.InterfaceFault) -> PortOpenFailed:
    text = f"{fault.reason} {fault.remedy}"
    return PortOpenFailed(text, remedy=fault.remedy, cause=fault.cause, **fault.params)


@dataclass
class Case:
    """A doctor and the port it checks, on which node 20 sends NodeStatus unless it is `quiet`."""

    doctor: Doctor
    port: RecordingPort
    quiet: bool = False
    sent: int = 0

    async def live(self, seconds: float, act: Callable[[], object] = lambda: None) -> None:
        """Let time pass, `act` ten times a second."""
        for number in range(round(seconds * 10)):
            await asyncio.sleep(0.1)
            if not number % 10 and not self.quiet:
                self.receive_status()
            act()
            self.doctor.tick(asyncio.get_running_loop().time())

    def receive_status(self, ahead: int = 0) -> None:
        """Receive a NodeStatus of node 20, or of its twin, whose uptime and transfer IDs are `ahead`."""
        self.sent += not ahead
        status = NodeStatus(self.sent + ahead, NodeHealth.OK, Mode.OPERATIONAL).encode()
        transfer = Transfer(Kind.MESSAGE, NodeStatus.TYPE.id, 20, 0, 24, (self.sent + ahead) % 32, status)
        now = asyncio.get_running_loop().time()
        frames = [frame._replace(at=now) for frame in split(transfer, NodeStatus.TYPE)]
        self.port.statistics.rx_frames += len(frames)
        self.port.deliver(frames)

    def error_frames(self, count: int) -> None:
        self.port.statistics.errors += count
        self.port.statistics.error_frames += count

    def only(self) -> Finding:
        """The only finding."""
        (found,) = self.doctor.findings()
        return found


def doctor_of(clock: Callable[[], Instant]) -> Doctor:
    """A doctor without servos, of a server whose database is in memory."""
    server = ServerRecord(Store("sqlite://"), Hub(), TimeBase(clock), LoopLag())
    return Doctor(clock, list, server)


@asynccontextmanager
async def on_port(
    address: str = "socketcan:can0", bitrate: int = 1_000_000, state: PortState = PortState.ACTIVE
) -> AsyncGenerator[Case]:
    """A doctor that follows this port."""
    port = RecordingPort()
    port.address, port.bitrate, port.state = address, bitrate, state
    node = participant(port)
    doctor = doctor_of(asyncio.get_running_loop().time)
    directory = Directory()
    doctor.follow(port, node, Allocator(MemoryTable(), own_ids=frozenset({127}), known_nodes=directory), directory)
    node.start()
    yield Case(doctor, port)
    await node.close()


@pytest.fixture
def case() -> AbstractAsyncContextManager[Case]:
    return on_port()


@pytest.mark.parametrize(
    ("interface", "code", "remedy"),
    [
        (
            socketcan.Interface("can0", up=False), "interface_down",
            "sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875",
        ),
        (
            socketcan.Interface("can0", up=True, bitrate=500_000, sample_point=0.875), "bit_rate",
            "sudo ip link set can0 down && sudo ip link set can0 up type can bitrate 1000000",
        ),
    ],
)  # fmt: skip
def test_an_interface_that_is_down_or_has_another_bit_rate(
    interface: socketcan.Interface, code: str, remedy: str
) -> None:
    fault = socketcan.fault_of(interface, 1_000_000)
    assert fault is not None
    doctor = doctor_of(lambda: 0.0)
    doctor.could_not_open("socketcan:can0", refused(fault))
    (found,) = doctor.findings()
    assert (found.code, found.severity) == (code, "failure")
    assert remedy in (found.remedy or "")


async def test_an_interface_that_goes_down_while_in_use_and_up_again(case: Case) -> None:
    down = socketcan.fault_of(socketcan.Interface("can0", up=False), 1_000_000)
    assert down is not None
    await case.live(3)
    assert case.doctor.findings() == []
    case.port.state, case.quiet = PortState.LOST, True
    case.port.trouble, case.port.retry_in_s = refused(down), 2.0
    await case.live(7)
    found = case.only()
    assert (found.code, found.severity) == ("interface_down", "failure")
    assert found.evidence == "For 7 s; earlier reconnects: 0. Next attempt in 2 s."
    assert "sudo ip link set can0 up" in (found.remedy or "")
    case.port.state, case.quiet = PortState.ACTIVE, False
    case.port.trouble = case.port.retry_in_s = None
    await case.live(1)
    assert case.doctor.findings() == []


async def test_an_adapter_that_never_opened_is_not_called_lost() -> None:
    async with on_port(state=PortState.LOST) as case:
        case.port.trouble = PortError("There is no such device. Plug the adapter in.", cause=None)
        case.doctor.tick(asyncio.get_running_loop().time())
        found = case.only()
    assert (found.code, found.text) == ("adapter_failed", "socketcan:can0 cannot be opened")
    assert found.remedy == "There is no such device. Plug the adapter in."


async def test_a_sample_point_other_than_that_of_the_servos(case: Case) -> None:
    await case.live(2)
    case.port.sample_point = 0.8751
    assert case.doctor.findings() == []
    (listed,) = [one for one in case.doctor.findings(everything=True) if one.code == "bit_rate"]
    assert listed.evidence == "1 Mbit/s, 87.5 %, read back from socketcan:can0."
    case.port.sample_point = 0.857
    assert (case.only().code, case.only().severity) == ("sample_point", "notice")
    case.port.sample_point = 0.75
    found = case.only()
    assert (found.code, found.severity) == ("sample_point", "warning")
    assert found.text == "The sample point is 75.0 %, but the servos use 87.5 %"
    assert found.remedy == (
        "sudo ip link set can0 down && sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875"
    )


@pytest.mark.parametrize(
    ("quiet", "seconds", "found"),
    [(False, 1, [("bit_rate", "notice")]), (True, 4, [("no_traffic", "failure"), ("bit_rate", "failure")])],
)
async def test_another_bit_rate_is_a_failure_until_frames_come_in(
    quiet: bool, seconds: float, found: list[tuple[str, str]]
) -> None:
    async with on_port("slcan:/dev/ttyACM0", 500_000) as case:
        case.quiet = quiet
        await case.live(seconds)
        assert [(one.code, one.severity) for one in case.doctor.findings()] == found
        assert case.doctor.findings()[-1].remedy == "Connect again at 1000000 bit/s."


async def test_standard_and_fd_frames_are_a_notice_for_ten_seconds(case: Case) -> None:
    def foreign() -> None:
        case.port.statistics.ignored += 3

    await case.live(5, foreign)
    found = case.only()
    assert (found.code, found.severity) == ("foreign_frames", "notice")
    assert found.evidence.startswith("150 standard, remote or CAN FD frames in 5 s")
    await case.live(12)
    assert case.doctor.findings() == []


async def test_a_passive_adapter_is_unacknowledged_or_receives_errors(case: Case) -> None:
    case.quiet = True
    case.port.state = PortState.PASSIVE
    await case.live(3)
    assert case.only().code == "unacknowledged"
    await case.live(3, lambda: case.error_frames(2))
    assert case.only().code == "only_errors"
    case.port.state, case.quiet = PortState.ACTIVE, False
    await case.live(1)
    assert case.only().code == "errors_rising"
    await case.live(11)
    assert case.doctor.findings() == []


async def test_past_errors_do_not_explain_a_silence(case: Case) -> None:
    await case.live(2)
    case.error_frames(50)
    case.quiet = True
    await case.live(2.5)
    assert case.only().code == "only_errors"
    await case.live(5)
    assert case.only().code == "no_traffic"


async def test_a_duplicate_node_id_is_reported_instead_of_its_errors(case: Case) -> None:
    number = 0

    def clash() -> None:
        nonlocal number
        number += 1
        if number % 10 == 5:
            case.receive_status(ahead=13)
            case.error_frames(3)

    await case.live(8, clash)
    assert (case.only().code, case.only().node_ids) == ("duplicate_node_id", (20,))
    await case.live(4)  # one of them is gone; the errors were recent
    assert case.only().code == "errors_rising"
    await case.live(8)
    assert case.doctor.findings() == []


async def test_a_burst_of_errors_is_not_rising_errors(case: Case) -> None:
    await case.live(3)
    case.error_frames(40)
    await case.live(5)
    assert case.doctor.findings() == []

    def now_and_then() -> None:
        case.port.statistics.errors += 1

    await case.live(4, now_and_then)
    assert case.only().code == "errors_rising"
    assert "40 on the bus" in case.only().evidence
    await case.live(12)
    assert case.doctor.findings() == []


async def test_only_the_identity_of_nodes_is_checked_in_a_recording() -> None:
    async with on_port("file:can0.log") as case:
        await case.live(2)
        case.quiet = True
        await case.live(30)
        assert case.doctor.findings() == []
        listed = {one.code for one in case.doctor.findings(everything=True)}
    assert listed == {
        "adapter",
        "duplicate_node_id",
        "duplicate_servo_id",
        "foreign_frames",
        "database",
        "computer_busy",
    }


async def test_bus_off_is_a_failure_while_the_adapter_is_reopened(case: Case) -> None:
    await case.live(2)
    case.quiet, case.port.statistics.bus_offs = True, 1
    case.port.trouble = PortError("socketcan:can0 is off the bus after too many errors.", cause=None)
    for state in (PortState.BUS_OFF, PortState.LOST):
        case.port.state = state
        await case.live(1)
        assert (case.only().code, case.only().severity) == ("bus_off", "failure")
