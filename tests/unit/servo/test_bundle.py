"""The form of a bundle: what is written is read again, and nothing that is read does harm."""

from typing import Any

import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.errors import LogFailed
from hornbill.schema.catalog import Catalog
from hornbill.servo import bundle
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ArrayCommand, Command, CommandType
from hornbill.wire.services import EMPTY, ExecuteOpcodeRequest, GetSetRequest, Opcode, RestartNodeRequest, integer
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import AnyStructure

UID = "0" * 31 + "a"
ABOUT: dict[str, Any] = {
    "format": 1, "version": "1", "reason": "stop", "text": "Stop.", "started_at": 1.0, "ended_at": 2.0,
    "utc_offset": 0.5, "bus": None, "servos": [], "schema_revision": "x", "frames": 0,
    "marks": [{"at": 1.5, "reason": "stop", "text": "Stop."}],
}  # fmt: skip


def test_what_a_newer_hornbill_adds_is_passed_over() -> None:
    assert bundle.read_about(orjson.dumps({**ABOUT, "new": 1}), "a.zip").frames == 0


WRONG: list[dict[str, Any]] = [
    {"format": 2}, {"marks": []}, {"marks": [{}]}, {"frames": -1}, {"reason": "boredom"}, {"servos": [{"uid": "x"}]},
    {"text": "x" * 2001}, {"started_at": "soon"}, {"bus": {"address": "a", "bitrate": 0, "node_id": 1}},
]  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: next(iter(wrong)))
def test_a_wrong_about_is_named_and_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(LogFailed, match=f"^a.zip is no bundle that this hornbill can read: {next(iter(wrong))}"):
        bundle.read_about(orjson.dumps({**ABOUT, **wrong}), "a.zip")


@given(st.binary(max_size=200))
def test_bytes_never_do_worse_than_log_failed(data: bytes) -> None:
    with pytest.raises(LogFailed):
        bundle.read_about(data, "a.zip")
    bundle.columns(data)
    bundle.events(data)
    bundle.writes(data)


def test_deep_json_is_refused() -> None:
    with pytest.raises(LogFailed):
        bundle.read_about(b"[" * 100_000, "a.zip")
    assert bundle.events(b"[" * 100_000) == []


def test_samples_come_back_with_their_gaps() -> None:
    data = bundle.TELEMETRY_HEAD.encode() + bundle.samples(UID, "current_angle", [1.0, 2.0], [-0.1, None], 100.0)
    (column,), complete = bundle.columns(data)
    assert complete
    assert (column.uid, column.channel, column.t, column.v) == (UID, "current_angle", [101.0, 102.0], [-0.1, None])


def test_telemetry_without_end_is_cut_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bundle, "SAMPLES_MOST", 10)
    data = bundle.TELEMETRY_HEAD.encode() + bundle.samples(UID, "a", [1.0] * 20, [1.0] * 20, 0.0)
    (column,), complete = bundle.columns(data)
    assert (len(column.t), complete) == (10, False)


def test_only_what_could_change_a_servo_is_a_write_of_ours() -> None:
    finder = bundle.Writes(Catalog.load(), {11: UID}, 1000.0)

    def frames(structure: AnyStructure, sent: bool = True) -> list[bundle.Kept]:
        destination = 11 if structure.KIND is not Kind.MESSAGE else 0
        transfer = Transfer(structure.KIND, structure.TYPE.id, 127, destination, 16, 3, structure.encode())
        return [(1.0, frame.id, frame.data, sent, "can0") for frame in split(transfer, structure.TYPE)]

    def lines(structure: AnyStructure, sent: bool = True) -> list[str]:
        return finder.lines(frames(structure, sent)).decode().splitlines()

    assert lines(GetSetRequest(0, integer(610), "0x38")) == [
        f"1001.000000,11,{UID},parameter,angle_limit_cw,0x38,610,61.0"
    ]
    assert lines(GetSetRequest(0, EMPTY, "0x38")) == []
    assert lines(GetSetRequest(0, integer(610), "0x38"), sent=False) == []
    assert lines(ExecuteOpcodeRequest(Opcode.SAVE)) == [f"1001.000000,11,{UID},opcode,,0,0,"]
    assert lines(RestartNodeRequest()) == [f"1001.000000,11,{UID},restart,,,,"]
    moved = ArrayCommand((Command(7, CommandType.UNITLESS, 0.5), Command(8, CommandType.SPEED, -1.0)))
    assert lines(moved) == [
        "1001.000000,,,array_command,unitless,actuator 7,,0.5",
        "1001.000000,,,array_command,speed,actuator 8,,-1",
    ]
    assert bundle.writes(bundle.WRITES_HEAD.encode() + finder.lines(frames(moved)))[0]["name"] == "actuator 7"
