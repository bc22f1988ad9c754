"""Descriptions of transfers: readable sentences and valid JSON, without exceptions."""

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.wire import messages, services
from hornbill.wire.datatype import Kind
from hornbill.wire.describe import PROBLEMS, Names, as_object, duration, frame_count, sentence
from hornbill.wire.messages import AllocationMessage, CommandType, Mode, NodeHealth
from hornbill.wire.reassembly import ReassemblyCounters
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, Value, ValueKind, integer
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import AnyStructure, decode
from unit.wire.structures import bits, structures, transfer

UID = bytes.fromhex("4f0a91c3d2e15566778899aabbccddee")

transfers = st.builds(
    Transfer, st.sampled_from(Kind), st.sampled_from([0, 1, 2, 5, 10, 11, 341, 1010, 1011, 20003]), bits(7), bits(7),
    bits(5), bits(5), st.binary(max_size=80), st.floats(0, 2e9),
)  # fmt: skip


def command(*commands: tuple[int, int, float]) -> messages.ArrayCommand:
    return messages.ArrayCommand([messages.ActuatorCommand(*each) for each in commands])


def response(value: Value, name: str) -> GetSetResponse:
    return GetSetResponse(value, EMPTY, EMPTY, EMPTY, name)


@pytest.mark.parametrize(
    ("structure", "reported"),
    [
        (messages.NodeStatus(4355, NodeHealth.OK, Mode.OPERATIONAL), "NodeStatus OK, operational, up 1 h 12 min"),
        (messages.NodeStatus(3, NodeHealth.ERROR, Mode.SOFTWARE_UPDATE), "NodeStatus error, software update, up 3 s"),
        (
            messages.NodeStatus(61, NodeHealth.CRITICAL, 5, 2, 0x12),
            "NodeStatus critical, mode 5, up 1 min 1 s, sub mode 2, code 0x0012",
        ),
        (messages.ActuatorStatus(1, 0.125, math.nan, 0.0, 127), "Status servo 1, position 0.125"),
        (
            messages.ActuatorStatus(1, -0.5, 2.5, -3.0, 40),
            "Status servo 1, position −0.5, force 2.5, speed −3, power 40 %",
        ),
        (
            command((1, CommandType.POSITION, 0.5), (2, CommandType.SPEED, -20)),
            "ArrayCommand servo 1 position 0.5, servo 2 speed −20",
        ),
        (command((255, 9, 1.0)), "ArrayCommand all servos command type 9 1"),
        (
            command(*((n, CommandType.UNITLESS, 0) for n in range(1, 9))),
            "ArrayCommand " + ", ".join(f"servo {n} unitless 0" for n in range(1, 7)) + ", 2 more",
        ),
        (command(), "ArrayCommand empty"),
        (services.GetNodeInfoRequest(), "GetNodeInfo request"),
        (
            services.GetNodeInfoResponse(
                messages.NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL),
                services.SoftwareVersion(1, 3),
                services.HardwareVersion(6, 1, UID),
                "com.futaba",
            ),
            "GetNodeInfo response com.futaba, software 1.3, hardware 6.1, uid 4f0a91c3…",
        ),
        (services.RestartNodeRequest(), "RestartNode request"),
        (services.RestartNodeRequest(7), "RestartNode request, invalid magic number 0x7"),
        (services.RestartNodeResponse(True), "RestartNode response OK"),
        (services.RestartNodeResponse(False), "RestartNode response refused"),
        (services.ExecuteOpcodeRequest(services.Opcode.SAVE), "ExecuteOpcode request save"),
        (services.ExecuteOpcodeRequest(7, 9), "ExecuteOpcode request opcode 7, argument 9"),
        (services.ExecuteOpcodeResponse(0, True), "ExecuteOpcode response OK"),
        (services.ExecuteOpcodeResponse(-1, False), "ExecuteOpcode response refused, argument -1"),
        (GetSetRequest(0, EMPTY, "0x08"), "GetSet request read 0x08"),
        (GetSetRequest(8, EMPTY, ""), "GetSet request read index 8"),
        (GetSetRequest(0, integer(-600), "0x39"), "GetSet request write 0x39 = −600"),
        (response(integer(600), "0x38"), "GetSet response 0x38 = 600"),
        (response(EMPTY, ""), "GetSet response empty: no such parameter, or refused"),
        (response(Value(ValueKind.REAL, 0.5), "gain"), "GetSet response gain = 0.5"),
        (response(Value(ValueKind.BOOLEAN, 255), "on"), "GetSet response on = 255"),
        (response(Value(ValueKind.STRING, "a\x1b[2J"), "s"), 'GetSet response s = "a\\x1b[2J"'),
    ],
    ids=lambda value: value if isinstance(value, str) else type(value).__name__,
)
def test_a_transfer_reads_as_a_sentence(structure: AnyStructure, reported: str) -> None:
    assert sentence(transfer(structure), structure) == reported


@pytest.mark.parametrize(
    ("message", "source", "reported"),
    [
        (AllocationMessage(0, True, UID[:6]), 0, "uid part 1 of 3, 4f0a…"),
        (AllocationMessage(20, True, UID[:6]), 0, "uid part 1 of 3, 4f0a…, prefers node ID 20"),
        (AllocationMessage(0, False, UID[6:12]), 0, "uid part 2 of 3, 5566…".replace("5566", UID[6:8].hex())),
        (AllocationMessage(0, False, UID[12:]), 0, f"uid part 3 of 3, {UID[12:14].hex()}…"),
        (AllocationMessage(0, False, UID[:12]), 127, "received 12 of 16 bytes, 4f0a…"),
        (AllocationMessage(12, False, UID), 127, "assigns node ID 12 to 4f0a91c3…"),
        (AllocationMessage(0, False, b""), 127, "received 0 of 16 bytes, nothing"),
    ],
)
def test_both_sides_of_an_allocation_are_described(message: AllocationMessage, source: int, reported: str) -> None:
    assert sentence(transfer(message, source=source), message) == f"Allocation {reported}"


@pytest.mark.parametrize(
    ("kind", "type_id", "payload", "reported"),
    [
        (Kind.MESSAGE, 20003, b"12345", "Unknown message 20003, 5 bytes"),
        (Kind.REQUEST, 200, b"1", "Unknown service 200 request, 1 byte"),
        (Kind.RESPONSE, 200, b"", "Unknown service 200 response, 0 bytes"),
        (Kind.MESSAGE, 341, b"123456", "NodeStatus not decoded: invalid payload of 6 bytes"),
        (Kind.RESPONSE, 5, b"", "RestartNode response not decoded: invalid payload of 0 bytes"),
    ],
)
def test_undecodable_transfers_are_described_as_such(kind: Kind, type_id: int, payload: bytes, reported: str) -> None:
    assert sentence(Transfer(kind, type_id, 10, 20, 16, 0, payload), None) == reported


class Known(Names):
    """A reader that knows one register."""

    def register(self, node: int, name: str) -> str:
        return "limit" if (node, name) == (20, "0x38") else ""

    def value(self, node: int, name: str, raw: int) -> str:
        return f"{raw / 10:.1f}°" if name == "0x38" else str(raw)


def test_known_names_are_added() -> None:
    written = GetSetRequest(0, integer(600), "0x38")
    assert sentence(transfer(written), written, Known()) == "GetSet request write 0x38 limit = 600, 60.0°"
    held = response(integer(600), "0x38")
    assert sentence(transfer(held), held, Known()) == "GetSet response 0x38 = 600, 60.0°"
    plain = response(integer(7), "0x2C")
    assert sentence(transfer(plain), plain, Known()) == "GetSet response 0x2C = 7"


@given(structures)
def test_every_structure_has_a_sentence_that_is_safe_to_print(structure: AnyStructure) -> None:
    reported = sentence(transfer(structure), structure)
    assert reported
    assert reported.isprintable()


@given(transfers)
@settings(max_examples=200)
def test_any_bytes_of_any_type_are_described_without_raising(received: Transfer) -> None:
    structure = decode(received)
    assert sentence(received, structure).isprintable()
    reported = as_object(received, structure, received.at)
    again = json.loads(json.dumps(reported, allow_nan=False))
    assert list(again) == [
        "timestamp", "type", "kind", "data_type_id", "source", "destination", "priority", "transfer_id", "fields",
        "payload",
    ]  # fmt: skip
    assert again["payload"] == received.payload.hex()
    assert (again["destination"] is None) == (received.kind is Kind.MESSAGE)
    if again["type"] is None:
        assert again["fields"] is None


@given(structures)
def test_the_number_of_frames_is_that_of_the_transfer(structure: AnyStructure) -> None:
    sent = transfer(structure)
    assert frame_count(sent) == len(split(sent, structure.TYPE))


@pytest.mark.parametrize(
    ("seconds", "reported"),
    [(0, "0 s"), (59, "59 s"), (60, "1 min 0 s"), (3600, "1 h 0 min"), (7383, "2 h 3 min"), (273_600, "3 d 4 h")],
)
def test_a_duration_is_given_in_its_two_largest_units(seconds: int, reported: str) -> None:
    assert duration(seconds) == reported


def test_every_reason_for_a_drop_has_a_text() -> None:
    reasons = set(ReassemblyCounters.__slots__) - {"frames", "transfers"}
    assert set(PROBLEMS) == reasons
