"""Conformance vectors: frames are read to fields, and fields written to frames, byte for byte."""

import json
import random
from pathlib import Path
from typing import Any

import pytest

from hornbill.wire import types
from hornbill.wire.datatype import Kind
from hornbill.wire.fields import from_fields, to_fields
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler, ReassemblyCounters
from hornbill.wire.transfer import Transfer, split

Vector = dict[str, Any]

VECTORS: list[Vector] = [
    json.loads(line) for line in (Path(__file__).parent / "vectors" / "dronecan.jsonl").read_text("utf-8").splitlines()
]


def name_of(vector: Vector) -> str:
    return f"{vector['id']}-{vector['type'].rpartition('.')[2]}-{vector['kind']}"


def frames_of(vector: Vector) -> list[Frame]:
    return [Frame(int(can_id, 16), bytes.fromhex(data)) for can_id, data in vector["frames"]]


def transfer_of(vector: Vector) -> Transfer:
    return Transfer(
        kind=Kind[vector["kind"].upper()],
        type_id=vector["data_type_id"],
        source=vector["source"],
        destination=vector["destination"] or 0,
        priority=vector["priority"],
        transfer_id=vector["transfer_id"],
        payload=bytes.fromhex(vector["payload"]),
    )


def test_the_vectors_cover_every_structure() -> None:
    assert len(VECTORS) == 400
    covered = {(vector["type"], vector["kind"]) for vector in VECTORS}
    assert covered == {(structure.TYPE.name, structure.KIND.name.lower()) for structure in types.ALL}


@pytest.mark.parametrize("vector", VECTORS, ids=name_of)
def test_frames_are_read_to_fields_and_fields_written_to_frames(vector: Vector) -> None:
    reassembler = Reassembler()
    expected = transfer_of(vector)
    assert reassembler.feed(frames_of(vector)) == [expected]
    assert reassembler.counters == ReassemblyCounters(frames=len(vector["frames"]), transfers=1)
    structure = types.decode(expected)
    assert structure is not None
    assert structure.TYPE.name == vector["type"]
    assert to_fields(structure) == vector["fields"]

    data_type = types.BY_KEY[expected.kind != Kind.MESSAGE, expected.type_id]
    assert f"{data_type.signature:016x}" == vector["signature"]
    if vector["crc"] is not None:
        first = split(expected, data_type)[0].data
        assert f"{first[0] | first[1] << 8:04x}" == vector["crc"]

    if vector["encode"]:
        payload = from_fields(vector["type"], expected.kind, vector["fields"]).encode()
        assert payload.hex() == vector["payload"]
        frames = split(expected._replace(payload=payload), data_type, discriminator=vector["discriminator"])
        assert [[f"{frame.id:08x}", frame.data.hex()] for frame in frames] == vector["frames"]


def test_all_vectors_at_once_on_one_bus() -> None:
    """Frames of different identifiers mixed at random; those of one identifier keep their order."""
    chance = random.Random(20)
    waiting: dict[int, list[Frame]] = {}
    for vector in VECTORS:
        for frame in frames_of(vector):
            waiting.setdefault(frame.id, []).append(frame)
    frames: list[Frame] = []
    while waiting:
        can_id = chance.choice(list(waiting))
        frames.append(waiting[can_id].pop(0))
        if not waiting[can_id]:
            del waiting[can_id]
    transfers = Reassembler().feed(frames)
    assert sorted(transfers) == sorted(transfer_of(vector) for vector in VECTORS)
