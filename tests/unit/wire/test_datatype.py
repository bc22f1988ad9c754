"""Data types: constants of the specification, and derived numbers."""

import pytest

from hornbill.wire import types
from hornbill.wire.datatype import DataType, Kind
from hornbill.wire.transfer import Transfer

# Section 2.3: name, id, signature. The id of Allocation is left blank there; it is 1 in the public DSDL.
PRINTED = {
    ("uavcan.protocol.GetNodeInfo", 1, 0xEE468A8121C46A9E, True),
    ("uavcan.protocol.dynamic_node_id.Allocation", 1, 0x0B2A812620A11D40, False),
    ("uavcan.protocol.RestartNode", 5, 0x569E05394A3017F0, True),
    ("uavcan.protocol.param.ExecuteOpcode", 10, 0x3B131AC5EB69D2CD, True),
    ("uavcan.protocol.param.GetSet", 11, 0xA7B622F939D1A4D5, True),
    ("uavcan.protocol.NodeStatus", 341, 0x0F0868D0C1A7C6F1, False),
    ("uavcan.equipment.actuator.ArrayCommand", 1010, 0xD8A7486238EC3AF3, False),
    ("uavcan.equipment.actuator.Status", 1011, 0x5E9BBA44FAF1EA04, False),
}


def test_the_eight_types_are_those_of_the_specification() -> None:
    assert {(t.name, t.id, t.signature, t.service) for t in types.BY_KEY.values()} == PRINTED


def test_a_service_has_two_structures_and_a_message_one() -> None:
    kinds = {t: {s.KIND for s in types.ALL if s.TYPE is t} for t in types.BY_KEY.values()}
    for data_type, found in kinds.items():
        assert found == ({Kind.REQUEST, Kind.RESPONSE} if data_type.service else {Kind.MESSAGE})


@pytest.mark.parametrize(
    ("type_id", "signature", "service"),
    [(256, 0, True), (65536, 0, False), (-1, 0, False), (1, 1 << 64, False)],
)
def test_an_invalid_type_is_refused(type_id: int, signature: int, service: bool) -> None:
    with pytest.raises(ValueError, match="Some"):
        DataType("Some", type_id, signature, service)


def test_an_unknown_type_has_no_structure() -> None:
    unknown = Transfer(Kind.MESSAGE, 342, 1, 0, 16, 0, b"")
    assert types.decode(unknown) is None
