"""Table of the supported data types and structures, and decoding of transfers."""

from typing import Final, TypeAlias

from hornbill.wire.datatype import DataType
from hornbill.wire.messages import ActuatorStatus, AllocationMessage, ArrayCommand, NodeStatus
from hornbill.wire.services import (
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetNodeInfoRequest,
    GetNodeInfoResponse,
    GetSetRequest,
    GetSetResponse,
    RestartNodeRequest,
    RestartNodeResponse,
)
from hornbill.wire.transfer import Transfer

AnyStructure: TypeAlias = (
    NodeStatus
    | AllocationMessage
    | ArrayCommand
    | ActuatorStatus
    | GetNodeInfoRequest
    | GetNodeInfoResponse
    | RestartNodeRequest
    | RestartNodeResponse
    | ExecuteOpcodeRequest
    | ExecuteOpcodeResponse
    | GetSetRequest
    | GetSetResponse
)

ALL: Final[tuple[type[AnyStructure], ...]] = (
    NodeStatus,
    AllocationMessage,
    ArrayCommand,
    ActuatorStatus,
    GetNodeInfoRequest,
    GetNodeInfoResponse,
    RestartNodeRequest,
    RestartNodeResponse,
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetSetRequest,
    GetSetResponse,
)
"""The twelve structures of the eight data types of tables 2-2 to 2-4."""

BY_KEY: Final[dict[tuple[bool, int], DataType]] = {(s.TYPE.service, s.TYPE.id): s.TYPE for s in ALL}
"""Data types by (is a service, ID)."""

_DECODERS: Final = {(s.KIND, s.TYPE.id): s.decode for s in ALL}


def decode(transfer: Transfer) -> AnyStructure | None:
    """Decode the structure of a transfer. None for an unknown type or a malformed payload. Never raises."""
    decoder = _DECODERS.get(transfer[:2])
    return None if decoder is None else decoder(transfer[6])
