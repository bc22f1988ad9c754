"""candump as an independent witness on a Linux CAN bus: the same frames, and the same decoded fields."""

import json
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import NamedTuple

import pytest

from commands.command_line import hornbill
from contract.oracle import oracle_transfers
from hornbill.wire.frame import Frame
from socketcan import can_utils
from socketcan.can_utils import Line
from socketcan.server.bench import Bench

pytestmark = pytest.mark.release

OURS = 127


class Witnesses(NamedTuple):
    """What candump and our own log have of one busy bus, from the mark "first" to the mark "last" and a bit around."""

    file: Path
    theirs: list[Line]
    ours: list[Line]


@pytest.fixture(scope="module")
def seen(bench: Bench, tmp_path_factory: pytest.TempPathFactory) -> Witnesses:
    """What both saw while every parameter was read, one was written, and candump received the same."""
    can_utils.needed()
    file = Path(tmp_path_factory.mktemp("candump")) / "candump.log"
    begun = bench.api.post("/bus/log", json={"format": "candump", "name": "beside-candump"})
    assert begun.status_code == 201, begun.text
    with can_utils.candump(file):
        can_utils.mark("first")
        found = bench.api.get(f"/servos/{bench.resident}/parameters?refresh=true").json()["parameters"]
        assert len(found) == 51
        changed = bench.api.patch(f"/servos/{bench.resident}/parameters", json={"values": {"angle_limit_cw": 71}})
        assert changed.json()["outcome"] == "applied"
        can_utils.mark("last")
    stopped = bench.api.delete("/bus/log").json()
    assert (stopped["state"], stopped["dropped"]) == ("stopped", 0)
    logged = bench.api.get(f"/bus/logs/{stopped['name']}").text
    return Witnesses(file, can_utils.lines(file.read_text()), can_utils.lines(logged))


def stretch(lines: list[Line], *, sent_by_us: bool) -> list[Line]:
    """What node 127, or any other node, said between the marks."""
    found = can_utils.between(lines, "first", "last")
    return [line for line in found if (int(line.can_id, 16) & 0x7F == OURS) == sent_by_us]


def data(lines: list[Line], can_id: str) -> str:
    """What the frames of one identifier held, in order."""
    return " ".join(line.data for line in lines if line.can_id == can_id)


def test_candump_receives_exactly_the_frames_of_our_log(seen: Witnesses) -> None:
    theirs, ours = (stretch(lines, sent_by_us=False) for lines in (seen.theirs, seen.ours))
    assert len(theirs) > 3 * 51, "three frames per response"
    assert [line[1:] for line in ours] == [line[1:] for line in theirs]
    # What we sent stands in our log where the adapter got it: it lets lower identifiers go first, and takes its time.
    theirs, ours = (stretch(lines, sent_by_us=True) for lines in (seen.theirs, seen.ours))
    assert len(theirs) > 51, "a frame a request"
    for part, whole in ((theirs, seen.ours), (ours, seen.theirs)):
        for can_id in {line.can_id for line in part}:
            assert data(part, can_id) in data(whole, can_id)


def test_our_log_has_kernel_timestamps_of_received_frames(seen: Witnesses) -> None:
    pairs = [*zip(*(stretch(lines, sent_by_us=False) for lines in (seen.ours, seen.theirs)), strict=True)]
    # A frame that waited for us for a second gets the time of its receipt, and none after it an earlier one.
    apart = [
        abs(ours.at - theirs.at)
        for (before, _), (ours, theirs) in pairwise(pairs)
        if before.at < ours.at < theirs.at + 0.9
    ]
    assert median(apart) < 0.001
    assert max(apart) < 0.1, "however long it took us to look"
    times = [line.at for line in seen.ours]
    assert times == sorted(times), "and what we send stands among it where we gave it to the adapter"


def test_a_candump_recording_decodes_as_in_the_public_stack(seen: Witnesses) -> None:
    done = hornbill(None, "decode", "--json", seen.file)
    ours = [json.loads(each) for each in done.stdout.splitlines()]
    recorded = can_utils.lines(seen.file.read_text())
    theirs = oracle_transfers(Frame(int(line.can_id, 16), bytes.fromhex(line.data), line.at) for line in recorded)
    assert {each["kind"] for each in theirs} == {"message", "request", "response"}
    assert [each for each in ours if each["type"] is not None] == theirs
    assert [each["payload"] for each in ours if each["type"] is None][-1] == b"end".hex()
    assert f"{len(recorded)} frames, {len(ours)} transfers" in done.stderr
