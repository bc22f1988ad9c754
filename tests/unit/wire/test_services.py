"""Services: byte layouts, and None for truncated data."""

import re

import pytest
from hypothesis import given

from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from hornbill.wire.services import (
    EMPTY,
    MAGIC,
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetNodeInfoRequest,
    GetNodeInfoResponse,
    GetSetRequest,
    GetSetResponse,
    HardwareVersion,
    Opcode,
    RestartNodeRequest,
    RestartNodeResponse,
    SoftwareVersion,
    Value,
    ValueKind,
    integer,
)
from hornbill.wire.types import AnyStructure
from unit.wire.structures import get_set_responses, node_infos, servo_responses

INFO = GetNodeInfoResponse(
    NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL),
    SoftwareVersion(1, 3),
    HardwareVersion(1, 0, bytes(range(16))),
    "jp.futaba.bla21",
)


def test_a_node_info_request_accepts_the_byte_of_the_table() -> None:
    assert GetNodeInfoRequest.decode(b"") == GetNodeInfoRequest()
    assert GetNodeInfoRequest.decode(b"\x00") == GetNodeInfoRequest()


def test_the_name_follows_the_certificate_and_its_length() -> None:
    plain = INFO.encode()
    assert plain[40] == 0
    assert plain[41:] == b"jp.futaba.bla21"
    assert plain[24:40] == bytes(range(16))
    INFO_WITH = GetNodeInfoResponse(
        INFO.status, INFO.software_version, HardwareVersion(1, 0, bytes(16), b"\xaa\xbb"), "n"
    )
    assert INFO_WITH.encode()[40:] == b"\x02\xaa\xbbn"


@given(node_infos)
def test_truncated_node_info_is_malformed(info: GetNodeInfoResponse) -> None:
    payload = info.encode()
    least = 41 + len(info.hardware_version.certificate_of_authenticity)
    assert GetNodeInfoResponse.decode(payload[: least - 1]) is None
    assert GetNodeInfoResponse.decode(payload[:40]) is None
    assert GetNodeInfoResponse.decode(payload[:least] + bytes(80)) is not None
    assert GetNodeInfoResponse.decode(payload[:least] + bytes(81)) is None


def test_the_magic_number_has_40_bits() -> None:
    assert RestartNodeRequest(MAGIC).encode() == bytes.fromhex("1e1b55ceac")
    assert RestartNodeRequest(0xCE551B1E).encode() == bytes.fromhex("1e1b55ce00")
    assert RestartNodeRequest.decode(bytes.fromhex("1e1b55ce")) is None


def test_ok_is_the_top_bit() -> None:
    assert RestartNodeResponse(True).encode() == b"\x80"
    assert RestartNodeResponse.decode(b"\x7f") == RestartNodeResponse(False)
    assert ExecuteOpcodeResponse(0, True).encode() == bytes(6) + b"\x80"
    assert ExecuteOpcodeResponse.decode(bytes(6) + b"\x01") == ExecuteOpcodeResponse(0, False)


def test_the_argument_is_48_bits_low_byte_first_with_a_sign() -> None:
    assert ExecuteOpcodeRequest(Opcode.ERASE, -2).encode() == b"\x01\xfe\xff\xff\xff\xff\xff"
    decoded = ExecuteOpcodeRequest.decode(b"\x01\x00\x00\x00\x00\x00\x80")
    assert repr(decoded) == repr(ExecuteOpcodeRequest(Opcode.ERASE, -(1 << 47)))
    assert ExecuteOpcodeRequest.decode(b"\x02" + bytes(6)) == ExecuteOpcodeRequest(2, 0)


def test_index_and_tag_share_a_byte() -> None:
    assert GetSetRequest(0x1F55, EMPTY, "").encode() == bytes((0x55, 0x1F << 3))
    assert GetSetRequest(0x0100, integer(1), "").encode() == bytes((0, 1 << 3 | 1, 1, 0, 0, 0, 0, 0, 0, 0))
    assert GetSetRequest.decode(bytes((0x55, 0xF8)) + b"0x2A") == GetSetRequest(0x1F55, EMPTY, "0x2A")


@pytest.mark.parametrize(
    ("requested", "responded", "matches"),
    [("0x2A", "0x2A", True), ("0x2a", "0x2A", True), ("0x2A", "0x2a", True), ("0x2A", "", True), ("", "0x2A", True),
     ("0x2A", "0x2B", False)],
)  # fmt: skip
def test_a_response_matches_a_request_by_its_name_or_has_none(requested: str, responded: str, matches: bool) -> None:
    response = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, responded)
    assert GetSetRequest(0, EMPTY, requested).matches(response) == matches


def test_the_response_for_an_unknown_parameter_is_four_zero_bytes() -> None:
    nothing = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")
    assert nothing.encode() == bytes(4)
    assert GetSetResponse.decode(bytes(4)) == nothing


@given(servo_responses)
def test_the_response_of_a_servo_has_16_bytes(response: GetSetResponse) -> None:
    payload = response.encode()
    assert len(payload) == 16
    assert GetSetResponse.decode(payload) == response


def test_void_bits_of_a_response_are_ignored() -> None:
    response = GetSetResponse(integer(-7), EMPTY, EMPTY, EMPTY, "0x08")
    payload = bytearray(response.encode())
    payload[0] |= 0xF8
    payload[9] |= 0xF8
    payload[10] |= 0xFC
    payload[11] |= 0xFC
    assert GetSetResponse.decode(bytes(payload)) == response


@given(get_set_responses)
def test_a_response_truncated_inside_its_unions_is_malformed(response: GetSetResponse) -> None:
    payload = response.encode()
    unions = len(payload) - len(response.name)
    for length in range(unions):
        assert GetSetResponse.decode(payload[:length]) is None
    assert GetSetResponse.decode(payload[:unions] + bytes(93)) is None


@pytest.mark.parametrize("tag", [5, 6, 7])
def test_an_undefined_value_tag_is_malformed(tag: int) -> None:
    assert GetSetRequest.decode(bytes((0, tag)) + bytes(20)) is None
    assert GetSetResponse.decode(bytes((tag,)) + bytes(20)) is None


def test_a_third_kind_of_limit_is_malformed() -> None:
    assert GetSetResponse.decode(b"\x00\x00\x03\x00\x00\x00") is None


def test_a_string_longer_than_its_type_is_malformed() -> None:
    assert GetSetRequest.decode(b"\x00\x04\x81" + bytes(0x81)) is None
    assert GetSetRequest.decode(b"\x00\x04\x80" + bytes(0x80)) is not None


def info(
    software: SoftwareVersion | None = None, hardware: HardwareVersion | None = None, name: str = ""
) -> AnyStructure:
    return GetNodeInfoResponse(INFO.status, software or INFO.software_version, hardware or INFO.hardware_version, name)


BYTE, U = "256. Enter 0 to 255.", bytes(16)


@pytest.mark.parametrize(
    ("structure", "refusal"),
    [
        (RestartNodeRequest(1 << 40), f"magic_number is {1 << 40}. Enter 0 to {(1 << 40) - 1}."),
        (ExecuteOpcodeRequest(256), f"opcode is {BYTE}"),
        (ExecuteOpcodeRequest(0, 1 << 47), f"argument is {1 << 47}. It must fit a signed 48-bit integer."),
        (ExecuteOpcodeResponse(-(1 << 47) - 1, True),
         "argument is -140737488355329. It must fit a signed 48-bit integer."),
        (GetSetRequest(0x2000, EMPTY, ""), "index is 8192. Enter 0 to 8191."),
        (GetSetRequest(0, EMPTY, "x" * 93), "name is 93 bytes long. The limit is 92."),
        (GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "x" * 93), "name is 93 bytes long. The limit is 92."),
        (GetSetRequest(0, EMPTY, "角度"), "name is '角度'. Use single-byte characters (Latin-1) only."),
        (GetSetRequest(0, integer(1 << 63), ""), f"{1 << 63} does not fit a value of kind INTEGER."),
        (GetSetRequest(0, Value(ValueKind.INTEGER, "1"), ""), "'1' is not a value of kind INTEGER."),
        (GetSetRequest(0, Value(ValueKind.EMPTY, 1), ""), "1 is not a value of kind EMPTY."),
        (GetSetRequest(0, Value(ValueKind.REAL, 1e39), ""), "1e+39 does not fit a value of kind REAL."),
        (GetSetRequest(0, Value(ValueKind.BOOLEAN, 256), ""), "256 does not fit a value of kind BOOLEAN."),
        (GetSetRequest(0, Value(ValueKind.STRING, "x" * 129), ""), "value is 129 bytes long. The limit is 128."),
        *((GetSetResponse(EMPTY, EMPTY, *limits, ""), "A limit cannot be BOOLEAN. Use EMPTY, INTEGER or REAL.")
          for limits in ((Value(ValueKind.BOOLEAN, 1), EMPTY), (EMPTY, Value(ValueKind.BOOLEAN, 1)))),
        (info(name="x" * 81), "name is 81 bytes long. The limit is 80."),
        (info(SoftwareVersion(256, 0)), f"software_version.major is {BYTE}"),
        (info(SoftwareVersion(0, 256)), f"software_version.minor is {BYTE}"),
        (info(SoftwareVersion(0, 0, 256)), f"optional_field_flags is {BYTE}"),
        (info(SoftwareVersion(0, 0, 0, 1 << 32)), f"vcs_commit is {1 << 32}. Enter 0 to {(1 << 32) - 1}."),
        (info(SoftwareVersion(0, 0, 0, 0, 1 << 64)), f"image_crc is {1 << 64}. Enter 0 to {(1 << 64) - 1}."),
        (info(hardware=HardwareVersion(256, 1, U)), f"hardware_version.major is {BYTE}"),
        (info(hardware=HardwareVersion(1, 256, U)), f"hardware_version.minor is {BYTE}"),
        (info(hardware=HardwareVersion(1, 1, bytes(15))), "unique_id is 15 bytes long. It must have 16."),
        (info(hardware=HardwareVersion(1, 1, U, bytes(256))),
         "certificate_of_authenticity is 256 bytes long. The limit is 255."),
    ],
)  # fmt: skip
def test_a_refusal_names_field_value_and_limit(structure: AnyStructure, refusal: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(refusal)}$"):
        structure.encode()
