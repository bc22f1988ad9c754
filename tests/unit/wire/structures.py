"""Hypothesis strategies for every structure of the wire, shared by unit and contract tests."""

from hypothesis import strategies as st

from hornbill.wire import messages, services
from hornbill.wire.frame import Frame
from hornbill.wire.messages import CommandType, Mode, NodeHealth
from hornbill.wire.services import EMPTY, GetSetResponse, Value, ValueKind, integer
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import AnyStructure


def bits(width: int) -> st.SearchStrategy[int]:
    """Unsigned integers with this number of bits."""
    return st.integers(0, (1 << width) - 1)


def signed(width: int) -> st.SearchStrategy[int]:
    """Signed integers with this number of bits."""
    return st.integers(-(1 << width - 1), (1 << width - 1) - 1)


def text(longest: int) -> st.SearchStrategy[str]:
    """Text with one byte per character."""
    return st.text(st.characters(max_codepoint=0xFF), max_size=longest)


halves = st.floats(width=16, allow_nan=False, allow_infinity=False)
singles = st.floats(width=32, allow_nan=False)

numeric_values = st.one_of(
    st.just(EMPTY), signed(64).map(integer), singles.map(lambda number: Value(ValueKind.REAL, number))
)
values = st.one_of(
    numeric_values,
    bits(8).map(lambda byte: Value(ValueKind.BOOLEAN, byte)),
    text(128).map(lambda string: Value(ValueKind.STRING, string)),
)

commands = st.builds(messages.ActuatorCommand, bits(8), st.sampled_from(CommandType) | bits(8), halves)
node_statuses = st.builds(
    messages.NodeStatus,
    bits(32),
    st.sampled_from(NodeHealth),
    st.sampled_from(Mode) | st.integers(4, 6),
    bits(3),
    bits(16),
)
allocations = st.builds(messages.AllocationMessage, bits(7), st.booleans(), st.binary(max_size=16))
array_commands = st.builds(messages.ArrayCommand, st.lists(commands, max_size=15).map(tuple))
actuator_statuses = st.builds(messages.ActuatorStatus, bits(8), halves, halves, halves, bits(7))
node_infos = st.builds(
    services.GetNodeInfoResponse,
    node_statuses,
    st.builds(services.SoftwareVersion, bits(8), bits(8), bits(8), bits(32), bits(64)),
    st.builds(services.HardwareVersion, bits(8), bits(8), st.binary(min_size=16, max_size=16), st.binary(max_size=255)),
    text(80),
)
get_set_requests = st.builds(services.GetSetRequest, bits(13), values, text(92))
get_set_responses = st.builds(GetSetResponse, values, values, numeric_values, numeric_values, text(92))
empties = st.just(EMPTY)
servo_responses = st.builds(
    GetSetResponse, signed(64).map(integer), empties, empties, empties, st.integers(0, 0x5F).map("0x{:02X}".format)
)

structures: st.SearchStrategy[AnyStructure] = st.one_of(
    node_statuses,
    allocations,
    array_commands,
    actuator_statuses,
    st.builds(services.GetNodeInfoRequest),
    node_infos,
    st.builds(services.RestartNodeRequest, bits(40)),
    st.builds(services.RestartNodeResponse, st.booleans()),
    st.builds(services.ExecuteOpcodeRequest, bits(8), signed(48)),
    st.builds(services.ExecuteOpcodeResponse, signed(48), st.booleans()),
    get_set_requests,
    get_set_responses,
    servo_responses,
)


def transfer(
    structure: AnyStructure,
    *,
    source: int = 10,
    destination: int = 20,
    priority: int = 16,
    transfer_id: int = 0,
) -> Transfer:
    """A transfer that carries a structure; a message ignores the destination."""
    to = destination if structure.TYPE.service else 0
    return Transfer(structure.KIND, structure.TYPE.id, source, to, priority, transfer_id, structure.encode())


def frames(structure: AnyStructure, at: float = 0.0, **header: int) -> list[Frame]:
    """The frames of `transfer`, all with one timestamp."""
    return [frame._replace(at=at) for frame in split(transfer(structure, **header), structure.TYPE)]
