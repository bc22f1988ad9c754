"""Descriptions of a transfer: the JSON object of the conformance vectors, and one line of text."""

import math
from typing import Final

from hornbill.wire.datatype import Kind
from hornbill.wire.fields import Fields, to_fields
from hornbill.wire.messages import (
    POWER_RATING_UNKNOWN,
    ActuatorCommand,
    ActuatorStatus,
    AllocationMessage,
    ArrayCommand,
    CommandType,
    Mode,
    NodeHealth,
    NodeStatus,
)
from hornbill.wire.reassembly import DropReason
from hornbill.wire.services import (
    MAGIC,
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetNodeInfoRequest,
    GetNodeInfoResponse,
    GetSetRequest,
    GetSetResponse,
    Opcode,
    RestartNodeRequest,
    RestartNodeResponse,
    Value,
    ValueKind,
)
from hornbill.wire.transfer import SINGLE_FRAME_BYTES, Transfer
from hornbill.wire.types import BY_KEY, AnyStructure

KINDS: Final = {Kind.MESSAGE: "message", Kind.REQUEST: "request", Kind.RESPONSE: "response"}

PROBLEMS: Final[dict[DropReason, str]] = {
    "bad_identifier": "not a DroneCAN identifier",
    "bad_tail": "missing or invalid tail byte",
    "bad_toggle": "toggle bit error",
    "bad_crc": "CRC error",
    "duplicates": "duplicate frame",
    "unexpected": "start of transfer not received",
    "interrupted": "interrupted by another transfer",
    "timed_out": "end of transfer not received",
    "too_long": "longer than any known transfer",
    "evicted": "dropped, too many transfers in progress",
    "unknown_type": "unknown data type",
    "not_ours": "between other nodes",
}
"""Why a frame was not decoded, to follow the words "not decoded:"."""

_HEALTHS: Final = {
    NodeHealth.OK: "OK",
    NodeHealth.WARNING: "warning",
    NodeHealth.ERROR: "error",
    NodeHealth.CRITICAL: "critical",
}
_OPCODES: Final = {Opcode.SAVE: "save", Opcode.ERASE: "erase"}
_COMMANDS_SHOWN: Final = 6
_ALL_SERVOS: Final = 255
_UID_BYTES: Final = 16
_PART_BYTES: Final = 6


class Names:
    """Knowledge of nodes and parameters used in descriptions. This base class adds none."""

    def register(self, node: int, name: str) -> str:
        """Title of a node's parameter `name` ("0x08"). "" if unknown."""
        return ""

    def value(self, node: int, name: str, raw: int) -> str:
        """Meaning of an integer of that parameter, with unit. "" if unknown."""
        return ""

    def position(self, node: int, position: float) -> str:
        """Text for the position in an actuator Status of that node."""
        return f"position {plain_number(position)}"

    def command(self, command: ActuatorCommand) -> str:
        """Text for one entry of an ArrayCommand."""
        kind = command.command_type
        word = kind.name.lower() if isinstance(kind, CommandType) else f"command type {kind}"
        return f"{word} {plain_number(command.command_value)}"


PLAIN: Final = Names()


def type_name(transfer: Transfer) -> str | None:
    """Full DSDL name of a transfer's data type. None if unknown."""
    data_type = BY_KEY.get((transfer.kind is not Kind.MESSAGE, transfer.type_id))
    return None if data_type is None else data_type.name


def frame_count(transfer: Transfer) -> int:
    """Number of frames of a transfer with this payload."""
    size = len(transfer.payload)
    return 1 if size <= SINGLE_FRAME_BYTES else -(-(size + 2) // SINGLE_FRAME_BYTES)


def as_object(transfer: Transfer, structure: AnyStructure | None, timestamp: float) -> Fields:
    """The ten keys of a decoded transfer, ready for JSON.

    `timestamp` is in seconds since 1970 UTC. `type` is null for an unknown type, `fields` also for an invalid
    payload, `destination` for messages. Source 0 is anonymous.
    """
    return {
        "timestamp": timestamp,
        "type": type_name(transfer),
        "kind": KINDS[transfer.kind],
        "data_type_id": transfer.type_id,
        "source": transfer.source,
        "destination": transfer.destination if transfer.kind is not Kind.MESSAGE else None,
        "priority": transfer.priority,
        "transfer_id": transfer.transfer_id,
        "fields": None if structure is None else to_fields(structure),
        "payload": transfer.payload.hex(),
    }


def sentence(transfer: Transfer, structure: AnyStructure | None, names: Names = PLAIN) -> str:
    """Describe a transfer in one line, without source and destination. Never raises."""
    source, destination = transfer.source, transfer.destination
    match structure:
        case NodeStatus():
            return f"NodeStatus {_status(structure)}"
        case AllocationMessage():
            return f"Allocation {_allocation(structure, source)}"
        case ArrayCommand():
            return f"ArrayCommand {_commands(structure, names)}"
        case ActuatorStatus():
            return f"Status {_actuator(structure, source, names)}"
        case GetNodeInfoRequest():
            return "GetNodeInfo request"
        case GetNodeInfoResponse():
            return f"GetNodeInfo response {_info(structure)}"
        case RestartNodeRequest(magic):
            return "RestartNode request" + ("" if magic == MAGIC else f", invalid magic number {magic:#x}")
        case RestartNodeResponse(ok):
            return f"RestartNode response {'OK' if ok else 'refused'}"
        case ExecuteOpcodeRequest(opcode, argument):
            word = _OPCODES[opcode] if isinstance(opcode, Opcode) else f"opcode {opcode}"
            return f"ExecuteOpcode request {word}" + (f", argument {argument}" if argument else "")
        case ExecuteOpcodeResponse(argument, ok):
            return f"ExecuteOpcode response {'OK' if ok else 'refused'}" + (
                f", argument {argument}" if argument else ""
            )
        case GetSetRequest():
            return f"GetSet request {_get_set(structure, destination, names)}"
        case GetSetResponse(value, name=name):
            if value.kind is ValueKind.EMPTY:
                return "GetSet response empty: no such parameter, or refused"
            return f"GetSet response {printable(name) or 'unnamed'} = {_value(value, source, name, names)}"
        case None:
            return _undecoded(transfer)


def printable(text: str) -> str:
    """Text from the bus with control characters escaped, safe to print on a terminal."""
    return "".join(char if char.isprintable() else f"\\x{ord(char):02x}" for char in text)


def plain_number(value: float) -> str:
    """A number with the significant digits of float16 and a true minus sign."""
    return f"{value:.5g}".replace("-", "−")


def duration(seconds: int) -> str:
    """An uptime in its two largest units: "12 s", "3 min 20 s", "1 h 12 min", "3 d 4 h"."""
    for size, unit, part, smaller in ((86400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if seconds >= size:
            return f"{seconds // size} {unit} {seconds % size // part} {smaller}"
    return f"{seconds} s"


def _undecoded(transfer: Transfer) -> str:
    size = len(transfer.payload)
    length = f"{size} byte{'' if size == 1 else 's'}"
    kind = {Kind.MESSAGE: "", Kind.REQUEST: " request", Kind.RESPONSE: " response"}[transfer.kind]
    name = type_name(transfer)
    if name is not None:
        return f"{name.rpartition('.')[2]}{kind} not decoded: invalid payload of {length}"
    return f"Unknown {'service' if kind else 'message'} {transfer.type_id}{kind}, {length}"


def _status(status: NodeStatus) -> str:
    mode = status.mode.name.lower().replace("_", " ") if isinstance(status.mode, Mode) else f"mode {status.mode}"
    text = f"{_HEALTHS[status.health]}, {mode}, up {duration(status.uptime_sec)}"
    if status.sub_mode:
        text += f", sub mode {status.sub_mode}"
    if status.vendor_specific_status_code:
        text += f", code {status.vendor_specific_status_code:#06x}"
    return text


def _allocation(message: AllocationMessage, source: int) -> str:
    """Tables 2-7 and 2-8: the three-part request of a node without an ID, and the allocator's response."""
    uid, size = message.unique_id.hex(), len(message.unique_id)
    short = f"{uid[:4]}…" if uid else "nothing"
    if source:
        if size == _UID_BYTES and message.node_id:
            return f"assigns node ID {message.node_id} to {uid[:8]}…"
        return f"received {size} of {_UID_BYTES} bytes, {short}"
    preference = f", prefers node ID {message.node_id}" if message.node_id else ""
    if message.first_part_of_unique_id:
        return f"uid part 1 of 3, {short}{preference}"
    part = 2 if size == _PART_BYTES else 3
    return f"uid part {part} of 3, {short}{preference}"


def _commands(message: ArrayCommand, names: Names) -> str:
    shown = [
        f"{'all servos' if each.actuator_id == _ALL_SERVOS else f'servo {each.actuator_id}'} {names.command(each)}"
        for each in message.commands[:_COMMANDS_SHOWN]
    ]
    more = len(message.commands) - len(shown)
    if more:
        shown.append(f"{more} more")
    return ", ".join(shown) or "empty"


def _actuator(status: ActuatorStatus, source: int, names: Names) -> str:
    parts = [f"servo {status.actuator_id}", names.position(source, status.position)]
    # a servo that measures neither sends 0 or NaN
    parts += [
        f"{word} {plain_number(value)}"
        for word, value in (("force", status.force), ("speed", status.speed))
        if value and not math.isnan(value)
    ]
    if status.power_rating_pct not in (0, POWER_RATING_UNKNOWN):
        parts.append(f"power {status.power_rating_pct} %")
    return ", ".join(parts)


def _info(info: GetNodeInfoResponse) -> str:
    software, hardware = info.software_version, info.hardware_version
    return (
        f"{printable(info.name) or 'unnamed'}, software {software.major}.{software.minor}, "
        f"hardware {hardware.major}.{hardware.minor}, uid {hardware.unique_id.hex()[:8]}…"
    )


def _get_set(request: GetSetRequest, destination: int, names: Names) -> str:
    """By name, or by index if the name is empty (table 2-14)."""
    name = request.name
    register = printable(name) or f"index {request.index}"
    title = names.register(destination, name) if name else ""
    register = f"{register} {title}" if title else register
    if request.value.kind is ValueKind.EMPTY:
        return f"read {register}"
    return f"write {register} = {_value(request.value, destination, name, names)}"


def _value(value: Value, node: int, name: str, names: Names) -> str:
    content = value.value
    match content:
        case str():
            return f'"{printable(content)}"'
        case float():
            return f"{content:.7g}".replace("-", "−")
        case int() if value.kind is ValueKind.INTEGER:
            shown = str(content).replace("-", "−")
            meaning = names.value(node, name, content) if name else ""
            return f"{shown}, {meaning}" if meaning and meaning != shown else shown
        case _:
            return str(content)
