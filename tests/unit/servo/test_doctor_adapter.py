"""The tests of what the doctor says of an adapter, from what a port says of itself."""

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
class Ward:
    """A doctor, and the port he looks at, on which node 20 says NodeStatus unless it is `quiet`."""

    doctor: Doctor
    port: RecordingPort
    quiet: bool = False
    said: int = 0

    async def live(self, seconds: float, act: Callable[[], object] = lambda: None) -> None:
        """Let time pass, `act` ten times a second."""
        for number in range(round(seconds * 10)):
            await asyncio.sleep(0.1)
            if not number % 10 and not self.quiet:
                self.say_status()
            act()
            self.doctor.tick(asyncio.get_running_loop().time())

    def say_status(self, ahead: int = 0) -> None:
        """Node 20 is heard; `ahead`: or its twin, whose uptime and transfer ids are so far ahead."""
        self.said += not ahead
        status = NodeStatus(self.said + ahead, NodeHealth.OK, Mode.OPERATIONAL).encode()
        transfer = Transfer(Kind.MESSAGE, NodeStatus.TYPE.id, 20, 0, 24, (self.said + ahead) % 32, status)
        now = asyncio.get_running_loop().time()
        frames = [frame._replace(at=now) for frame in split(transfer, NodeStatus.TYPE)]
        self.port.statistics.rx_frames += len(frames)
        self.port.deliver(frames)

    def only(self) -> Finding:
        """The one thing he finds."""
        (found,) = self.doctor.findings()
        return found


def with_ward(
    scene: Callable[[Ward], Coroutine[Any, Any, None]], address: str = "socketcan:can0", bitrate: int = 1_000_000
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
        await scene(Ward(doctor, port))
        await node.close()

    run(main())


def test_an_interface_that_is_down_when_it_is_to_be_opened() -> None:
    assert DOWN is not None
    doctor = Doctor(lambda: 0.0, list)
    doctor.could_not_open("socketcan:can0", refused(DOWN))
    (found,) = doctor.findings()
    assert (found.code, found.severity, found.text) == ("interface_down", "failure", "socketcan:can0 is down")
    assert found.remedy == "sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875"


def test_an_interface_that_runs_at_another_bit_rate() -> None:
    fault = socketcan.fault_of(socketcan.Interface("can0", up=True, bitrate=500_000, sample_point=0.875), 1_000_000)
    assert fault is not None
    doctor = Doctor(lambda: 0.0, list)
    doctor.could_not_open("socketcan:can0", refused(fault))
    (found,) = doctor.findings()
    assert (found.code, found.severity) == ("bit_rate", "failure")
    assert found.remedy is not None
    assert "sudo ip link set can0 down && sudo ip link set can0 up type can bitrate 1000000" in found.remedy


def test_an_interface_that_is_taken_down_while_it_is_used_and_up_again() -> None:
    async def scene(ward: Ward) -> None:
        assert DOWN is not None
        await ward.live(3)
        assert ward.doctor.findings() == []
        ward.port.state, ward.quiet = PortState.LOST, True
        ward.port.trouble, ward.port.retry_in_s = refused(DOWN), 2.0
        await ward.live(7)
        found = ward.only()
        assert (found.code, found.severity) == ("interface_down", "failure")
        assert found.evidence == "For 7 s; earlier reconnects: 0. Next attempt in 2 s."
        assert found.remedy is not None
        assert "sudo ip link set can0 up" in found.remedy
        ward.port.state, ward.quiet = PortState.ACTIVE, False
        ward.port.trouble = ward.port.retry_in_s = None
        await ward.live(1)
        assert ward.doctor.findings() == []

    with_ward(scene)


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


def test_the_sample_point_of_the_servos_and_others() -> None:
    async def scene(ward: Ward) -> None:
        await ward.live(2)
        ward.port.sample_point = 0.8751
        assert ward.doctor.findings() == []
        (told,) = [one for one in ward.doctor.findings(everything=True) if one.code == "bit_rate"]
        assert told.evidence == "1 Mbit/s, 87.5 %, read back from socketcan:can0."
        ward.port.sample_point = 0.857
        assert (ward.only().code, ward.only().severity) == ("sample_point", "notice")
        ward.port.sample_point = 0.75
        found = ward.only()
        assert (found.code, found.severity) == ("sample_point", "warning")
        assert found.text == "The sample point is 75.0 %, but the servos use 87.5 %"
        assert found.remedy == (
            "sudo ip link set can0 down && sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875"
        )

    with_ward(scene)


def test_another_bit_rate_is_a_failure_until_frames_come_in() -> None:
    async def scene(ward: Ward) -> None:
        await ward.live(1)
        found = ward.only()
        assert (found.code, found.severity) == ("bit_rate", "notice")
        assert found.remedy == "Connect again at 1000000 bit/s."

    with_ward(scene, "slcan:/dev/ttyACM0", 500_000)

    async def silent(ward: Ward) -> None:
        ward.quiet = True
        await ward.live(4)
        assert [(one.code, one.severity) for one in ward.doctor.findings()] == [
            ("no_traffic", "failure"),
            ("bit_rate", "failure"),
        ]

    with_ward(silent, "slcan:/dev/ttyACM0", 500_000)


def test_standard_and_fd_frames_are_a_notice_for_ten_seconds() -> None:
    async def scene(ward: Ward) -> None:
        def foreign() -> None:
            ward.port.statistics.ignored += 3

        await ward.live(5, foreign)
        found = ward.only()
        assert (found.code, found.severity) == ("foreign_frames", "notice")
        assert found.evidence.startswith("150 standard, remote or CAN FD frames in 5 s")
        await ward.live(12)
        assert ward.doctor.findings() == []

    with_ward(scene)


def test_an_adapter_that_only_says_passive_is_alone_and_one_that_counts_errors_sees_errors() -> None:
    async def scene(ward: Ward) -> None:
        ward.quiet = True
        ward.port.state = PortState.PASSIVE
        await ward.live(3)
        assert ward.only().code == "unacknowledged"

        def errors() -> None:
            ward.port.statistics.errors += 2
            ward.port.statistics.error_frames += 2

        await ward.live(3, errors)
        assert ward.only().code == "only_errors"
        ward.port.state, ward.quiet = PortState.ACTIVE, False
        await ward.live(1)
        assert ward.only().code == "errors_rising"
        await ward.live(11)
        assert ward.doctor.findings() == []

    with_ward(scene)


def test_errors_of_a_while_ago_do_not_explain_a_silence() -> None:
    async def scene(ward: Ward) -> None:
        await ward.live(2)
        ward.port.statistics.errors += 50
        ward.port.statistics.error_frames += 50
        ward.quiet = True
        await ward.live(2.5)
        assert ward.only().code == "only_errors"
        await ward.live(5)
        assert ward.only().code == "no_traffic"

    with_ward(scene)


def test_two_nodes_with_one_node_id_are_told_and_not_the_errors_they_make() -> None:
    async def scene(ward: Ward) -> None:
        number = 0

        def clash() -> None:
            nonlocal number
            number += 1
            if number % 10 == 5:
                ward.say_status(ahead=13)
                ward.port.statistics.errors += 3
                ward.port.statistics.error_frames += 3

        await ward.live(8, clash)
        assert (ward.only().code, ward.only().node_ids) == ("duplicate_node_id", (20,))
        await ward.live(4)  # one of them is gone; the errors were a moment ago
        assert ward.only().code == "errors_rising"
        await ward.live(8)
        assert ward.doctor.findings() == []

    with_ward(scene)


def test_a_burst_of_errors_is_not_a_counter_that_rises() -> None:
    async def scene(ward: Ward) -> None:
        await ward.live(3)
        ward.port.statistics.errors += 40
        ward.port.statistics.error_frames += 40
        await ward.live(5)
        assert ward.doctor.findings() == []

        def now_and_then() -> None:
            ward.port.statistics.errors += 1

        await ward.live(4, now_and_then)
        found = ward.only()
        assert found.code == "errors_rising"
        assert "40 on the bus" in found.evidence
        await ward.live(12)
        assert ward.doctor.findings() == []

    with_ward(scene)


def test_of_a_recording_only_who_is_who_is_told() -> None:
    async def scene(ward: Ward) -> None:
        await ward.live(2)
        ward.quiet = True
        await ward.live(30)
        assert ward.doctor.findings() == []
        told = {one.code for one in ward.doctor.findings(everything=True)}
        assert told == {"adapter", "duplicate_node_id", "duplicate_servo_id", "foreign_frames"}

    with_ward(scene, "file:can0.log")


def test_the_reopened_adapter_goes_on_where_it_was() -> None:
    async def scene(ward: Ward) -> None:
        await ward.live(2)
        ward.port.state = PortState.BUS_OFF
        ward.port.statistics.bus_offs = 1
        ward.quiet = True
        await ward.live(1)
        assert (ward.only().code, ward.only().severity) == ("bus_off", "failure")
        ward.port.state = PortState.LOST
        ward.port.trouble = PortError("socketcan:can0 is off the bus after too many errors.", cause=None)
        await ward.live(1)
        assert (ward.only().code, ward.only().severity) == ("bus_off", "failure")
        ward.port.state, ward.quiet = PortState.ACTIVE, False
        ward.port.statistics.reopened = 1
        await ward.live(1)
        assert (ward.only().code, ward.only().severity) == ("bus_off", "warning")
        await ward.live(31)
        assert ward.doctor.findings() == []

    with_ward(scene)
