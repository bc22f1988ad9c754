"""Fuzzer: finds and stores rows of frames that reassembly treats in a way no stored row shows.

`PYTHONPATH=tests python -m unit.wire.fuzz [SEED [ROUNDS]]` adds what it finds to corpus/, each row cut down to the
frames it needs. What a file expects is what reassembly did when the row was found: read it before it is committed.
"""

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from random import Random
from typing import Any

from hornbill.wire.frame import Frame
from hornbill.wire.messages import (
    ActuatorCommand,
    ActuatorStatus,
    AllocationMessage,
    ArrayCommand,
    Mode,
    NodeHealth,
    NodeStatus,
)
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import (
    EMPTY,
    ExecuteOpcodeRequest,
    GetNodeInfoRequest,
    GetSetRequest,
    GetSetResponse,
    Value,
    ValueKind,
    integer,
)
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import AnyStructure
from unit.wire.damage import damage
from unit.wire.structures import frames

CORPUS = Path(__file__).parent / "corpus"
MAX_SESSIONS = 4
"""Maximum number of sessions, reached by few frames."""

FRAME_S = 0.00014
ROUNDS = 20_000

STRUCTURES: tuple[AnyStructure, ...] = (
    NodeStatus(77, NodeHealth.OK, Mode.OPERATIONAL),
    ActuatorStatus(1, 0.9, 0.0, 0.0, 0),
    AllocationMessage(0, True, b"\x01\x02\x03\x04\x05\x06"),
    AllocationMessage(99, False, bytes(range(16))),
    ArrayCommand([ActuatorCommand(number, 1, 0.5) for number in range(1, 6)]),
    GetNodeInfoRequest(),
    ExecuteOpcodeRequest(0),
    GetSetRequest(0, EMPTY, "0x38"),
    GetSetRequest(0, integer(-450), "0x39"),
    GetSetResponse(integer(900), EMPTY, EMPTY, EMPTY, "0x38"),
    GetSetResponse(Value(ValueKind.STRING, "text"), EMPTY, EMPTY, EMPTY, "NAME"),
)

Seen = tuple[str, str]
"""An event on one identifier, and the next one there."""


def replay(row: Sequence[Frame], node_id: int | None) -> tuple[list[Transfer], dict[str, int], set[Seen]]:
    """Feed a row frame by frame. Returns transfers, counters above 0, and pairs of events."""
    last: dict[int, str] = {}
    seen: set[Seen] = set()
    received: list[Transfer] = []

    def happened(what: str, can_id: int) -> None:
        seen.add((last.get(can_id, "nothing"), what))
        last[can_id] = what

    reassembler = Reassembler(
        node_id, max_sessions=MAX_SESSIONS, on_drop=lambda reason, can_id, _data: happened(reason, can_id)
    )
    for frame in row:
        for transfer in reassembler.feed([frame]):
            received.append(transfer)
            happened("alone" if frame.data[-1] & 0x80 else "transfer", frame.id)
    counters = {name: count for name, count in asdict(reassembler.counters).items() if count}
    return received, counters, seen


def find(seed: int, rounds: int, known: set[Seen]) -> Iterator[tuple[Seen, list[Frame], int | None]]:
    """Rows with events not in `known` (which grows), each reduced to those."""
    chance = Random(seed)
    for _ in range(rounds):
        node_id = chance.choice((None, 127))
        row = _traffic(chance)
        damage(row, chance, chance.randrange(1, 6))
        for new in sorted(replay(row, node_id)[2] - known):
            known.add(new)
            yield new, _cut_down(row, node_id, new), node_id


def _traffic(chance: Random) -> list[Frame]:
    """Up to six nodes with up to three transfers each, mixed; transfer ids count on past 31."""
    rows: list[list[Frame]] = []
    for source in chance.sample(range(1, 127), chance.randrange(1, 7)):
        number = chance.randrange(32)
        talk = [chance.choice(STRUCTURES)] * chance.randrange(1, 4)
        destination, priority = chance.choice((127, 127, 42)), chance.choice((16, 24))
        rows.append([
            frame
            for place, structure in enumerate(talk)
            for frame in frames(
                structure, source=source, destination=destination, priority=priority, transfer_id=(number + place) % 32
            )
        ])  # fmt: skip
    mixed: list[Frame] = []
    while rows:
        row = chance.choice(rows)
        mixed.append(row.pop(0)._replace(at=round(100.0 + len(mixed) * FRAME_S, 6)))
        rows = [row for row in rows if row]
    return mixed


def _cut_down(row: list[Frame], node_id: int | None, wanted: Seen) -> list[Frame]:
    """Drop the frames that `wanted` does not need."""
    for place in range(len(row) - 1, -1, -1):
        shorter = row[:place] + row[place + 1 :]
        if wanted in replay(shorter, node_id)[2]:
            row = shorter
    return row


def load(path: Path) -> tuple[list[Frame], int | None, dict[str, Any]]:
    """A stored row, the node ID it is received with, and the content of the file."""
    kept = json.loads(path.read_text())
    row = [Frame(int(can_id, 16), bytes.fromhex(data), at) for can_id, data, at in kept["frames"]]
    return row, kept["node_id"], kept


def reported(received: Sequence[Transfer]) -> list[list[Any]]:
    """Transfers in file format."""
    return [[*map(int, found[:6]), found.payload.hex(), found.at] for found in received]


def _keep(new: Seen, row: list[Frame], node_id: int | None) -> Path:
    received, counters, _ = replay(row, node_id)
    lines = [
        f'"shows": {json.dumps(f"{new[1]} after {new[0]}")}',
        f'"node_id": {json.dumps(node_id)}',
        '"frames": [\n    ' + ",\n    ".join(json.dumps([f"{f.id:08x}", f.data.hex(), f.at]) for f in row) + "\n  ]",
        '"transfers": [' + ", ".join(map(json.dumps, reported(received))) + "]",
        f'"counters": {json.dumps(counters)}',
    ]
    path = CORPUS / f"{new[1]}-after-{new[0]}.json"
    path.write_text("{\n  " + ",\n  ".join(lines) + "\n}\n")
    return path


def main(seed: int = 1, rounds: int = ROUNDS) -> None:
    """Search for new rows."""
    CORPUS.mkdir(exist_ok=True)
    known: set[Seen] = set()
    for path in CORPUS.glob("*.json"):
        row, node_id, _ = load(path)
        known |= replay(row, node_id)[2]
    for new, row, node_id in find(seed, rounds, known):
        print(_keep(new, row, node_id).name, len(row))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
