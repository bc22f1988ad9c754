"""The findings of the doctor about an adapter, from the state of a port."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from hornbill.bus.adapters import socketcan
from hornbill.domain.bus import Finding
from hornbill.errors import PortError, PortOpenFailed
from hornbill.node.allocator import Allocator
from hornbill.node.directory import Directory
from hornbill.servo.doctor.doctor import Doctor
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from hornbill.wire.port import PortState
from hornbill.wire.transfer import Kind, Transfer, split
from jumping_clock import run
from unit.node.peer import participant
from unit.node.recording import RecordingPort
from unit.node.table import MemoryTable

DOWN = socketcan.fault_of(socketcan.Interface("can0", up=False), 1_000_000)


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


def on_port(
    address: str = "socketcan:can0", bitrate: int = 1_000_000
) -> Callable[[Callable[[Case], Coroutine[Any, Any, None]]], Callable[[], None]]:
    """Decorate a scene: a test with this port."""
    return lambda scene: lambda: with_case(scene, address, bitrate)


def with_case(
    scene: Callable[[Case], Coroutine[Any, Any, None]], address: str = "socketcan:can0", bitrate: int = 1_000_000
) -> None:
    async def main() -> None:
        port = RecordingPort()
        port.address, port.bitrate = address, bitrate
        node = participant(port)
        doctor = Doctor(asyncio.get_running_loop().time, list)
        directory = Directory()
        allocator = Allocator(MemoryTable(), own_ids=frozenset({127}), known_nodes=directory)
        doctor.follow(port, node, allocator, directory)
        node.start()
        await scene(Case(doctor, port))
        await node.close()

    run(main())


def test_an_interface_that_is_down() -> None:
    assert DOWN is not None
    doctor = Doctor(lambda: 0.0, list)
    doctor.could_not_open("socketcan:can0", refused(DOWN))
    (found,) = doctor.findings()
    assert (found.code, found.severity, found.text) == ("interface_down", "failure", "socketcan:can0 is down")
    assert found.remedy == "sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875"


def test_an_interface_with_another_bit_rate() -> None:
    fault = socketcan.fault_of(socketcan.Interface("can0", up=True, bitrate=500_000, sample_point=0.875), 1_000_000)
    assert fault is not None
    doctor = Doctor(lambda: 0.0, list)
    doctor.could_not_open("socketcan:can0", refused(fault))
    (found,) = doctor.findings()
    assert (found.code, found.severity) == ("bit_rate", "failure")
    assert found.remedy is not None
    assert "sudo ip link set can0 down && sudo ip link set can0 up type can bitrate 1000000" in found.remedy


@on_port()
async def test_an_interface_that_goes_down_while_in_use_and_up_again(case: Case) -> None:
    assert DOWN is not None
    await case.live(3)
    assert case.doctor.findings() == []
    case.port.state, case.quiet = PortState.LOST, True
    case.port.trouble, case.port.retry_in_s = refused(DOWN), 2.0
    await case.live(7)
    found = case.only()
    assert (found.code, found.severity) == ("interface_down", "failure")
    assert found.evidence == "For 7 s; earlier reconnects: 0. Next attempt in 2 s."
    assert found.remedy is not None
    assert "sudo ip link set can0 up" in found.remedy
    case.port.state, case.quiet = PortState.ACTIVE, False
    case.port.trouble = case.port.retry_in_s = None
    await case.live(1)
    assert case.doctor.findings() == []


def test_an_adapter_that_never_opened_is_not_called_lost() -> None:
    async def main() -> None:
        port = RecordingPort()
        port.state, port.trouble = (
            PortState.LOST,
            PortError("There is no such device. Plug the adapter in.", cause=None),
        )
        doctor = Doctor(asyncio.get_running_loop().time, list)
        directory = Directory()
        allocator = Allocator(MemoryTable(), own_ids=frozenset(), known_nodes=directory)
        doctor.follow(port, participant(port), allocator, directory)
        doctor.tick(asyncio.get_running_loop().time())
        (found,) = doctor.findings()
        assert (found.code, found.text, found.remedy) == (
            "adapter_failed",
            "recording:0 cannot be opened",
            "There is no such device. Plug the adapter in.",
        )

    run(main())


@on_port()
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


def test_another_bit_rate_is_a_failure_until_frames_come_in() -> None:
    async def scene(case: Case) -> None:
        await case.live(1)
        found = case.only()
        assert (found.code, found.severity) == ("bit_rate", "notice")
        assert found.remedy == "Connect again at 1000000 bit/s."

    with_case(scene, "slcan:/dev/ttyACM0", 500_000)

    async def silent(case: Case) -> None:
        case.quiet = True
        await case.live(4)
        assert [(one.code, one.severity) for one in case.doctor.findings()] == [
            ("no_traffic", "failure"),
            ("bit_rate", "failure"),
        ]

    with_case(silent, "slcan:/dev/ttyACM0", 500_000)


@on_port()
async def test_standard_and_fd_frames_are_a_notice_for_ten_seconds(case: Case) -> None:
    def foreign() -> None:
        case.port.statistics.ignored += 3

    await case.live(5, foreign)
    found = case.only()
    assert (found.code, found.severity) == ("foreign_frames", "notice")
    assert found.evidence.startswith("150 standard, remote or CAN FD frames in 5 s")
    await case.live(12)
    assert case.doctor.findings() == []


@on_port()
async def test_a_passive_adapter_is_unacknowledged_or_receives_errors(case: Case) -> None:
    case.quiet = True
    case.port.state = PortState.PASSIVE
    await case.live(3)
    assert case.only().code == "unacknowledged"

    def errors() -> None:
        case.error_frames(2)

    await case.live(3, errors)
    assert case.only().code == "only_errors"
    case.port.state, case.quiet = PortState.ACTIVE, False
    await case.live(1)
    assert case.only().code == "errors_rising"
    await case.live(11)
    assert case.doctor.findings() == []


@on_port()
async def test_past_errors_do_not_explain_a_silence(case: Case) -> None:
    await case.live(2)
    case.error_frames(50)
    case.quiet = True
    await case.live(2.5)
    assert case.only().code == "only_errors"
    await case.live(5)
    assert case.only().code == "no_traffic"


@on_port()
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


@on_port()
async def test_a_burst_of_errors_is_not_rising_errors(case: Case) -> None:
    await case.live(3)
    case.error_frames(40)
    await case.live(5)
    assert case.doctor.findings() == []

    def now_and_then() -> None:
        case.port.statistics.errors += 1

    await case.live(4, now_and_then)
    found = case.only()
    assert found.code == "errors_rising"
    assert "40 on the bus" in found.evidence
    await case.live(12)
    assert case.doctor.findings() == []


@on_port("file:can0.log")
async def test_only_the_identity_of_nodes_is_checked_in_a_recording(case: Case) -> None:
    await case.live(2)
    case.quiet = True
    await case.live(30)
    assert case.doctor.findings() == []
    listed = {one.code for one in case.doctor.findings(everything=True)}
    assert listed == {"adapter", "duplicate_node_id", "duplicate_servo_id", "foreign_frames"}


@on_port()
async def test_bus_off_is_a_warning_for_a_while_after_the_adapter_was_reopened(case: Case) -> None:
    await case.live(2)
    case.port.state = PortState.BUS_OFF
    case.port.statistics.bus_offs = 1
    case.quiet = True
    await case.live(1)
    assert (case.only().code, case.only().severity) == ("bus_off", "failure")
    case.port.state = PortState.LOST
    case.port.trouble = PortError("socketcan:can0 is off the bus after too many errors.", cause=None)
    await case.live(1)
    assert (case.only().code, case.only().severity) == ("bus_off", "failure")
    case.port.state, case.quiet = PortState.ACTIVE, False
    case.port.statistics.reopened = 1
    await case.live(1)
    assert (case.only().code, case.only().severity) == ("bus_off", "warning")
    await case.live(31)
    assert case.doctor.findings() == []
