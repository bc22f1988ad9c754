"""Damaged rows of frames, each with what it shows: reassembly still treats each as recorded."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler, ReassemblyCounters
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import decode
from unit.wire.reference import transfers_in

ROWS = sorted((Path(__file__).parent / "corpus").glob("*.json"))
MAX_SESSIONS = 4
"""Maximum number of sessions, reached by few frames."""


def one_by_one(row: Sequence[Frame], node_id: int | None) -> tuple[list[Transfer], dict[str, int], set[str]]:
    """Feed a row frame by frame. Returns transfers, counters above 0, and successive events of one identifier."""
    last: dict[int, str] = {}
    seen: set[str] = set()
    received: list[Transfer] = []

    def happened(what: str, can_id: int) -> None:
        seen.add(f"{what} after {last.get(can_id, 'nothing')}")
        last[can_id] = what

    reassembler = Reassembler(
        node_id, max_sessions=MAX_SESSIONS, on_drop=lambda reason, can_id, _data: happened(reason, can_id)
    )
    for frame in row:
        for transfer in reassembler.feed([frame]):
            received.append(transfer)
            happened("alone" if frame.data[-1] & 0x80 else "transfer", frame.id)
    return received, {name: count for name, count in asdict(reassembler.counters).items() if count}, seen


def stored(received: Sequence[Transfer]) -> list[list[Any]]:
    """Transfers as they are stored."""
    return [[*map(int, found[:6]), found.payload.hex(), found.at] for found in received]


@pytest.mark.parametrize("path", ROWS, ids=lambda path: path.stem)
def test_a_row_is_decoded_as_recorded_and_as_by_the_reference_receiver(path: Path) -> None:
    kept = json.loads(path.read_text())
    row = [Frame(int(can_id, 16), bytes.fromhex(data), at) for can_id, data, at in kept["frames"]]
    node_id = kept["node_id"]
    received, counters, seen = one_by_one(row, node_id)
    assert (stored(received), counters) == (kept["transfers"], kept["counters"])
    assert kept["shows"] in seen
    # in one batch only the name of a drop may differ: late transfers are dropped once a batch, or at their next frame
    assert Reassembler(node_id, max_sessions=MAX_SESSIONS).feed(row) == received
    for transfer in received:
        decode(transfer)
    expected = [one for one in transfers_in(row) if one.kind == Kind.MESSAGE or node_id in (None, one.destination)]
    missing = len(expected) - len(received)
    assert missing == 0 or 0 < missing <= kept["counters"]["evicted"]
    assert all(one in stored(expected) for one in kept["transfers"])


def test_every_reason_for_a_drop_is_in_the_corpus() -> None:
    counted = {name for path in ROWS for name in json.loads(path.read_text())["counters"]}
    assert counted == set(asdict(ReassemblyCounters()))
