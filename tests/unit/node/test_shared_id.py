"""Another program with our node ID: which transfers count, and how they identify the program."""

import asyncio

import pytest

from hornbill.node.shared_id import ECHO_S, SharedNodeId
from hornbill.wire.frame import Frame
from unit.node.peer import HOST, participant
from unit.node.recording import RecordingPort

READ_BY_NAME = Frame(0x1E0B94FF, bytes.fromhex("000030783243c5"))
WRITE_BEGINS = Frame(0x1E0B94FF, bytes.fromhex("5f2f00012d000086"))
WRITE_GOES_ON = Frame(0x1E0B94FF, bytes.fromhex("0000000000307826"))
RESPONSE = Frame(0x180BAAFF & ~0x8000, bytes.fromhex("000030783243c5"))
NODE_STATUS = Frame(0x1801557F, bytes.fromhex("01000000000000c0"))
ALLOCATION = Frame(0x1800017F, bytes.fromhex("fac0"))


@pytest.mark.parametrize(
    ("frames", "requests", "makers", "allocates"),
    [
        ([READ_BY_NAME], 1, True, False),
        ([READ_BY_NAME._replace(id=0x180B94FF)], 1, False, False),
        ([WRITE_BEGINS, WRITE_GOES_ON], 1, False, False),
        ([RESPONSE], 0, False, False),
        ([READ_BY_NAME, NODE_STATUS], 1, False, False),
        ([READ_BY_NAME, ALLOCATION], 1, True, True),
    ],
)
def test_its_transfers_of_known_types_identify_the_program(
    frames: list[Frame], requests: int, makers: bool, allocates: bool
) -> None:
    it = SharedNodeId(HOST)
    reported: list[float] = []
    it.on_seen.append(reported.append)
    it.receive([READ_BY_NAME._replace(id=unknown) for unknown in (0x0012347F, 0x187794FF, 0x18FF15FF)], 1.0)
    assert (it.frames, it.last_seen) == (0, None)
    it.receive(frames, 5.0)
    assert (it.frames, it.requests, it.is_makers_program, it.allocates) == (len(frames), requests, makers, allocates)
    assert (it.last_seen, reported) == (5.0, [5.0])


def test_several_transfers_within_seconds_or_allocations_indicate_a_program() -> None:
    it = SharedNodeId(HOST)
    for second in (1.0, 2.0, 11.5):
        it.receive([NODE_STATUS], second)
        assert not it.is_program
    it.receive([NODE_STATUS], 11.9)
    assert it.is_program
    giving = SharedNodeId(HOST)
    giving.receive([ALLOCATION], 1.0)
    assert giving.is_program


def test_a_soon_returned_frame_of_ours_is_an_echo() -> None:
    it = SharedNodeId(HOST)
    it.sent([READ_BY_NAME], 1.0)
    it.receive([READ_BY_NAME], 1.0 + ECHO_S - 0.1)
    assert (it.frames, it.last_seen) == (0, None)
    it.receive([READ_BY_NAME, WRITE_BEGINS], 1.0 + ECHO_S - 0.1)
    assert it.frames == 1
    it.receive([READ_BY_NAME], 1.0 + ECHO_S + 0.1)
    assert it.frames == 2


@pytest.mark.parametrize(("address", "frames"), [("slcan:COM3", 1), ("file:morning.log", 0)])
async def test_own_frames_in_a_replayed_recording_are_not_another_program(address: str, frames: int) -> None:
    port = RecordingPort()
    port.address = address
    host = participant(port)
    host.start()
    port.deliver([READ_BY_NAME])
    await asyncio.sleep(0.01)
    assert host.shared_id.frames == frames
