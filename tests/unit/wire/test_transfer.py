"""Splitting of transfers: number of frames, tail bytes, CRC, and refusals."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.wire.datatype import Kind
from hornbill.wire.identifier import parse
from hornbill.wire.messages import ActuatorCommand, AllocationMessage, ArrayCommand, CommandType, NodeStatus
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import GetNodeInfoRequest, GetSetRequest, integer
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import AnyStructure
from unit.wire.structures import bits, structures, transfer


@given(structures, bits(5), bits(5), st.integers(1, 127), st.integers(1, 127))
def test_split_transfers_are_reassembled(
    structure: AnyStructure, priority: int, transfer_id: int, source: int, destination: int
) -> None:
    sent = transfer(structure, source=source, destination=destination, priority=priority, transfer_id=transfer_id)
    assert Reassembler().feed(split(sent, structure.TYPE)) == [sent]


@given(structures)
def test_frames_are_full_and_the_toggle_alternates(structure: AnyStructure) -> None:
    frames = split(transfer(structure, transfer_id=9), structure.TYPE)
    tails = [frame.data[-1] for frame in frames]
    assert [len(frame.data) for frame in frames[:-1]] == [8] * (len(frames) - 1)
    assert len({frame.id for frame in frames}) == 1
    assert {tail & 0x1F for tail in tails} == {9}
    assert [bool(tail & 0x20) for tail in tails] == [bool(number % 2) for number in range(len(tails))]
    assert [bool(tail & 0x80) for tail in tails] == [True] + [False] * (len(tails) - 1)
    assert [bool(tail & 0x40) for tail in tails] == [False] * (len(tails) - 1) + [True]


@pytest.mark.parametrize(("commands", "frames"), [(1, 1), (2, 2), (3, 2), (5, 4), (15, 9)])
def test_frames_of_an_array_command(commands: int, frames: int) -> None:
    message = ArrayCommand([ActuatorCommand(1, CommandType.POSITION, 0.0)] * commands)
    assert len(split(transfer(message), ArrayCommand.TYPE)) == frames


def test_a_request_without_payload_is_its_tail_byte() -> None:
    (frame,) = split(transfer(GetNodeInfoRequest(), transfer_id=5), GetNodeInfoRequest.TYPE)
    assert frame.data == b"\xc5"


def test_the_write_of_a_parameter_byte_for_byte() -> None:
    write = GetSetRequest(0, integer(-360_000_000), "0x22")
    sent = transfer(write, source=127, destination=52, priority=16, transfer_id=11)
    frames = split(sent, GetSetRequest.TYPE)
    assert {frame.id for frame in frames} == {0x100BB4FF}
    assert [frame.data.hex(" ") for frame in frames] == [
        "22 b4 00 01 00 d6 8a 8b",
        "ea ff ff ff ff 30 78 2b",
        "32 32 4b",
    ]


def test_anonymous_messages_of_different_unique_ids_get_different_identifiers() -> None:
    made: set[int] = set()
    for number in range(50):
        message = AllocationMessage(0, True, bytes((number, 2, 3, 4, 5, 6)))
        (frame,) = split(transfer(message, source=0), AllocationMessage.TYPE)
        assert parse(frame.id).source == 0
        made.add(frame.id)
    assert len(made) == 50


def test_an_anonymous_discriminator_can_be_given() -> None:
    message = AllocationMessage(0, True, b"abcdef")
    (frame,) = split(transfer(message, source=0), AllocationMessage.TYPE, discriminator=77)
    assert parse(frame.id).discriminator == 77


def test_an_anonymous_message_must_fit_one_frame() -> None:
    with pytest.raises(ValueError, match=r"8 bytes exceed the 7"):
        split(transfer(AllocationMessage(0, True, b"1234567"), source=0), AllocationMessage.TYPE)


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"type_id": 342}, "A MESSAGE with type ID 342 is not a transfer of uavcan.protocol.NodeStatus."),
        ({"kind": Kind.REQUEST}, "A REQUEST with type ID 341 is not a transfer of uavcan.protocol.NodeStatus."),
        ({"destination": 5}, "Messages are broadcast: destination 5 must be 0."),
        ({"destination": 5, "source": 0}, "Messages are broadcast: destination 5 must be 0."),
        ({"transfer_id": 32}, "transfer_id is 32. Enter 0 to 31."),
        ({"priority": 32}, "priority is 32. Enter 0 to 31."),
        ({"source": 128}, "source is 128. Enter a node ID, 1 to 127."),
        ({"source": 0}, "type_id of an anonymous message is 341. Enter 0 to 3."),
    ],
)
def test_a_transfer_that_cannot_be_sent_is_refused(changed: dict[str, int], named: str) -> None:
    good = Transfer(Kind.MESSAGE, NodeStatus.TYPE.id, 1, 0, 16, 0, bytes(7))
    with pytest.raises(ValueError, match=f"^{re.escape(named)}$"):
        split(good._replace(**changed), NodeStatus.TYPE)  # pyright: ignore[reportArgumentType]
