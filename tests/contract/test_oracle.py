"""Comparison with the public Python stack: both write the same frames and read the same fields."""

# The stack is dynamic and has no type hints.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# pyright: reportUnknownParameterType=false, reportMissingTypeStubs=false

from typing import Any

import pytest
from dronecan import transport
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from contract.oracle import oracle_fields, oracle_frames, oracle_reads, oracle_type
from hornbill.wire import types
from hornbill.wire.datatype import DataType, Kind
from hornbill.wire.fields import to_fields
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import GetNodeInfoRequest
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import AnyStructure
from unit.wire.structures import actuator_statuses, allocations, structures, transfer


@pytest.mark.parametrize("data_type", types.BY_KEY.values(), ids=lambda t: t.name)
def test_both_have_the_same_name_signature_and_crc_seed(data_type: DataType) -> None:
    public = oracle_type(data_type)
    assert data_type.name == public.full_name
    assert data_type.signature == public.get_data_type_signature()
    assert data_type.crc_seed == public.base_crc


@given(structures, st.integers(0, 31), st.integers(0, 31), st.integers(1, 127), st.integers(1, 127))
@settings(max_examples=150, deadline=None)
def test_both_write_the_same_frames(
    structure: AnyStructure, priority: int, transfer_id: int, source: int, destination: int
) -> None:
    # pydronecan writes an infinite real value as the largest finite one; libcanard and hornbill do not
    assume(b"\x80\x7f" not in structure.encode() and b"\x80\xff" not in structure.encode())
    sent = transfer(structure, source=source, destination=destination, priority=priority, transfer_id=transfer_id)
    assert split(sent, structure.TYPE) == oracle_frames(structure, sent)


@given(allocations.filter(lambda message: len(message.unique_id) <= 6), st.integers(0, 0x3FFF))
@settings(max_examples=50, deadline=None)
def test_both_write_the_same_anonymous_frame(message: AnyStructure, discriminator: int) -> None:
    sent = transfer(message, source=0)
    ours = split(sent, message.TYPE, discriminator=discriminator)
    assert ours == oracle_frames(message, sent, discriminator)


@given(structures)
@settings(max_examples=150, deadline=None)
def test_both_read_the_same_fields(structure: AnyStructure) -> None:
    frames = split(transfer(structure), structure.TYPE)
    assert oracle_fields(oracle_reads(frames).payload) == to_fields(structure)


@pytest.mark.parametrize("structure", [s for s in types.ALL if s is not GetNodeInfoRequest])
@given(payload=st.binary(max_size=60))
@settings(max_examples=60, deadline=None)
def test_both_read_the_same_from_random_bytes(structure: type[AnyStructure], payload: bytes) -> None:
    decoded = structure.decode(payload)
    if decoded is None:
        return
    destination = 20 if structure.TYPE.service else 0
    sent = Transfer(structure.KIND, structure.TYPE.id, 10, destination, 16, 0, payload)
    assert oracle_fields(oracle_reads(split(sent, structure.TYPE)).payload) == to_fields(decoded)


@given(actuator_statuses, st.integers(0, 0xFFFF))
@settings(max_examples=300, deadline=None)
def test_both_read_the_same_from_every_float16_pattern(status: ActuatorStatus, pattern: int) -> None:
    payload = bytearray(status.encode())
    payload[1:3] = pattern.to_bytes(2, "little")
    decoded = ActuatorStatus.decode(bytes(payload))
    assert decoded is not None
    sent = Transfer(Kind.MESSAGE, ActuatorStatus.TYPE.id, 10, 0, 16, 0, bytes(payload))
    assert oracle_fields(oracle_reads(split(sent, ActuatorStatus.TYPE)).payload) == to_fields(decoded)


@given(st.lists(structures, min_size=2, max_size=6), st.randoms(use_true_random=False))
@settings(max_examples=40, deadline=None)
def test_both_reassemble_mixed_traffic_alike(structures_: list[AnyStructure], chance: Any) -> None:
    rows = [split(transfer(s, source=n + 1, transfer_id=n), s.TYPE) for n, s in enumerate(structures_)]
    mixed: list[Frame] = []
    while rows:
        row = chance.choice(rows)
        mixed.append(row.pop(0))
        rows = [row for row in rows if row]
    manager = transport.TransferManager()
    theirs: list[Any] = []
    for frame in mixed:
        done = manager.receive_frame(transport.Frame(frame.id, frame.data, 1.0, 1.0))
        if done:
            read = transport.Transfer()
            read.from_frames(done)
            theirs.append((read.source_node_id, read.data_type_id, read.transfer_id, oracle_fields(read.payload)))
    ours: list[Any] = []
    for received in Reassembler().feed(mixed):
        structure = types.decode(received)
        assert structure is not None
        ours.append((received.source, received.type_id, received.transfer_id, to_fields(structure)))
    assert ours == theirs
