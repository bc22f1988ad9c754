"""All structures: round trips, and arbitrary bytes without an exception."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.wire.datatype import Kind
from hornbill.wire.fields import from_fields, to_fields
from hornbill.wire.messages import ActuatorStatus
from hornbill.wire.services import GetSetRequest, GetSetResponse, Value, ValueKind
from hornbill.wire.types import ALL, AnyStructure
from unit.wire.structures import structures


@given(structures)
def test_encoding_and_decoding_round_trip(structure: AnyStructure) -> None:
    assert type(structure).decode(structure.encode()) == structure


@given(structures)
def test_fields_round_trip(structure: AnyStructure) -> None:
    assert from_fields(structure.TYPE.name, structure.KIND, to_fields(structure)) == structure


@pytest.mark.parametrize("structure", ALL)
@given(payload=st.binary(max_size=400))
def test_any_bytes_decode_or_yield_none(structure: type[AnyStructure], payload: bytes) -> None:
    decoded = structure.decode(payload)
    assert decoded is None or isinstance(decoded, structure)
    if decoded is not None:
        again = structure.decode(decoded.encode())
        assert again is not None
        # Infinity is clamped when encoded, so the second round trip is stable.
        assert again.encode() == decoded.encode()


@pytest.mark.parametrize("structure", [GetSetRequest, GetSetResponse])
@given(
    start=st.binary(min_size=1, max_size=1),
    tags=st.lists(st.integers(0, 7), min_size=4, max_size=4),
    filling=st.binary(max_size=140),
)
def test_any_unions_decode_or_yield_none(
    structure: type[GetSetRequest | GetSetResponse], start: bytes, tags: list[int], filling: bytes
) -> None:
    """Bytes that resemble unions more often than random ones."""
    payload = start + b"".join(bytes((tag,)) + filling[:8] for tag in tags) + filling
    decoded = structure.decode(payload)
    assert decoded is None or structure.decode(decoded.encode()) is not None


@pytest.mark.parametrize(
    ("number", "word"), [(math.nan, "NaN"), (math.inf, "Infinity"), (-math.inf, "-Infinity"), (2.0, 2.0)]
)
def test_numbers_that_json_lacks_are_text_in_fields(number: float, word: str | float) -> None:
    fields = to_fields(ActuatorStatus(1, 2.0, number, number, 127))
    assert (fields["force"], fields["speed"]) == (word, word)
    back = from_fields(ActuatorStatus.TYPE.name, Kind.MESSAGE, fields)
    assert isinstance(back, ActuatorStatus)
    assert repr(back.force) == repr(back.speed) == repr(number)


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity"])
def test_names_and_strings_stay_text_and_reals_become_numbers(word: str) -> None:
    request = GetSetRequest(0, Value(ValueKind.STRING, word), word)
    assert from_fields(GetSetRequest.TYPE.name, Kind.REQUEST, to_fields(request)) == request
    request.value = Value(ValueKind.REAL, float(word))
    fields = to_fields(request)
    assert fields["value"] == {"kind": "real_value", "value": word}
    assert repr(from_fields(GetSetRequest.TYPE.name, Kind.REQUEST, fields)) == repr(request)


GET_SET = "uavcan.protocol.param.GetSet"
KINDS = "Use one of empty, integer_value, real_value, boolean_value, string_value."


@pytest.mark.parametrize(
    ("name", "kind", "fields", "refusal"),
    [
        ("uavcan.protocol.Panic", Kind.MESSAGE, {}, "uavcan.protocol.Panic message is not supported."),
        ("uavcan.protocol.NodeStatus", Kind.REQUEST, {}, "uavcan.protocol.NodeStatus request is not supported."),
        ("uavcan.protocol.NodeStatus", Kind.MESSAGE, {"uptime_sec": 1}, "Invalid fields for NodeStatus: "),
        ("uavcan.protocol.RestartNode", Kind.RESPONSE, {"ok": True, "why": 1},
         "Invalid fields for RestartNodeResponse: "),
        (GET_SET, Kind.REQUEST, {"index": 0, "value": {"kind": "x"}, "name": ""}, f"x is not a value kind. {KINDS}"),
        (GET_SET, Kind.REQUEST, {"index": 0, "value": {}, "name": ""}, "Invalid fields for GetSetRequest: 'kind'."),
        (GET_SET, Kind.REQUEST, {"index": 0, "value": 5, "name": ""}, "Invalid fields for GetSetRequest: "),
        ("uavcan.protocol.dynamic_node_id.Allocation", Kind.MESSAGE,
         {"node_id": 0, "first_part_of_unique_id": True, "unique_id": "zz"}, "non-hexadecimal number"),
    ],
)  # fmt: skip
def test_invalid_fields_are_refused(name: str, kind: Kind, fields: dict[str, object], refusal: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(refusal)}"):
        from_fields(name, kind, fields)
