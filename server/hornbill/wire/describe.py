"""How a transfer is told: as the JSON object of the conformance vectors, and as a sentence for people."""

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
    "bad_identifier": "not an identifier of DroneCAN",
    "bad_tail": "tail byte missing or wrong",
    "bad_toggle": "toggle bit wrong",
    "bad_crc": "checksum wrong",
    "duplicates": "the same frame again",
    "unexpected": "the beginning was not heard",
    "interrupted": "broken off by another transfer",
    "timed_out": "the end never came",
    "too_long": "longer than any transfer",
    "evicted": "given up, too many others are under way",
    "unknown_type": "data type not known",
    "not_ours": "between other nodes",
}
"""Why nothing was made of a frame, to follow the words "not decoded:"."""

_HEALTHS: Final = {
    NodeHealth.OK: "OK",
    NodeHealth.WARNING: "warning",
    NodeHealth.ERROR: "error",
    NodeHealth.CRITICAL: "critical",
}
_OPCODES: Final = {Opcode.SAVE: "save", Opcode.ERASE: "erase"}
_COMMANDS_TOLD: Final = 6
_EVERYBODY: Final = 255
_UID_BYTES: Final = 16
_PART_BYTES: Final = 6


class Names:
    """What whoever tells a transfer may know beyond the wire. This one knows nothing more."""

    def register(self, node: int, name: str) -> str:
        """What a node's parameter `name` ("0x08") is called; "" where that is not known."""
        return ""

    def value(self, node: int, name: str, raw: int) -> str:
        """What an integer of that parameter means, with its unit; "" where that is not known."""
        return ""

    def position(self, node: int, position: float) -> str:
        """The position an actuator Status of that node gives."""
        return f"position {plain_number(position)}"

    def command(self, command: ActuatorCommand) -> str:
        """What one entry of an ArrayCommand asks for."""
        kind = command.command_type
        word = kind.name.lower() if isinstance(kind, CommandType) else f"command type {kind}"
        return f"{word} {plain_number(command.command_value)}"


PLAIN: Final = Names()


def type_name(transfer: Transfer) -> str | None:
    """The full DSDL name of a transfer's data type; None for one that is not known."""
    data_type = BY_KEY.get((transfer.kind is not Kind.MESSAGE, transfer.type_id))
    return None if data_type is None else data_type.name


def frame_count(transfer: Transfer) -> int:
    """How many frames a transfer of this payload takes."""
    size = len(transfer.payload)
    return 1 if size <= SINGLE_FRAME_BYTES else -(-(size + 2) // SINGLE_FRAME_BYTES)


def as_object(transfer: Transfer, structure: AnyStructure | None, timestamp: float) -> Fields:
    """The ten keys of a decoded transfer, ready for JSON.

    `timestamp` is in seconds since 1970 UTC. `type` is null for an unknown type, `fields` also for a payload that
    does not fit its type, `destination` for messages; source 0 is anonymous.
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
    """One line on a transfer, without who sent it to whom. Never raises, whatever the bytes are."""
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
            return f"GetNodeInfo answer {_info(structure)}"
        case RestartNodeRequest(magic):
            return "RestartNode request" + ("" if magic == MAGIC else f", wrong number {magic:#x}")
        case RestartNodeResponse(ok):
            return f"RestartNode answer {'restarts' if ok else 'refused'}"
        case ExecuteOpcodeRequest(opcode, argument):
            word = _OPCODES[opcode] if isinstance(opcode, Opcode) else f"opcode {opcode}"
            return f"ExecuteOpcode request {word}" + (f", argument {argument}" if argument else "")
        case ExecuteOpcodeResponse(argument, ok):
            return f"ExecuteOpcode answer {'done' if ok else 'refused'}" + (
                f", argument {argument}" if argument else ""
            )
        case GetSetRequest():
            return f"GetSet request {_get_set(structure, destination, names)}"
        case GetSetResponse(value, name=name):
            if value.kind is ValueKind.EMPTY:
                return "GetSet answer empty: no such parameter, or refused"
            return f"GetSet answer {printable(name) or 'without a name'} = {_value(value, source, name, names)}"
        case None:
            return _undecoded(transfer)


def printable(text: str) -> str:
    """Text from the bus, safe to print: whatever a terminal might act on is written as its number."""
    return "".join(one if one.isprintable() else f"\\x{ord(one):02x}" for one in text)


def plain_number(value: float) -> str:
    """A number from the wire with as many digits as float16 can mean, and a real minus sign."""
    return f"{value:.5g}".replace("-", "−")


def duration(seconds: int) -> str:
    """An uptime in its two largest units: "12 s", "3 min 20 s", "1 h 12 min", "3 d 4 h"."""
    for size, unit, part, smaller in ((86400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if seconds >= size:
            return f"{seconds // size} {unit} {seconds % size // part} {smaller}"
    return f"{seconds} s"


def _undecoded(transfer: Transfer) -> str:
    size = len(transfer.payload)
    told = f"{size} byte{'' if size == 1 else 's'}"
    kind = {Kind.MESSAGE: "", Kind.REQUEST: " request", Kind.RESPONSE: " answer"}[transfer.kind]
    name = type_name(transfer)
    if name is not None:
        return f"{name.rpartition('.')[2]}{kind} not decoded: a payload of {told} does not fit"
    return f"Unknown {'service' if kind else 'message'} {transfer.type_id}{kind}, {told}"


def _status(status: NodeStatus) -> str:
    mode = status.mode.name.lower().replace("_", " ") if isinstance(status.mode, Mode) else f"mode {status.mode}"
    text = f"{_HEALTHS[status.health]}, {mode}, up {duration(status.uptime_sec)}"
    if status.sub_mode:
        text += f", sub mode {status.sub_mode}"
    if status.vendor_specific_status_code:
        text += f", code {status.vendor_specific_status_code:#06x}"
    return text


def _allocation(message: AllocationMessage, source: int) -> str:
    """Tables 2-7 and 2-8: what a node without an id tells in three parts, and what the allocator says back."""
    uid, size = message.unique_id.hex(), len(message.unique_id)
    short = f"{uid[:4]}…" if uid else "nothing"
    if source:
        if size == _UID_BYTES and message.node_id:
            return f"gives node id {message.node_id} to {uid[:8]}…"
        return f"heard {size} of {_UID_BYTES} bytes, {short}"
    wish = f", asks for node id {message.node_id}" if message.node_id else ""
    if message.first_part_of_unique_id:
        return f"uid part 1 of 3, {short}{wish}"
    part = 2 if size == _PART_BYTES else 3
    return f"uid part {part} of 3, {short}{wish}"


def _commands(message: ArrayCommand, names: Names) -> str:
    told = [
        f"{'every servo' if one.actuator_id == _EVERYBODY else f'servo {one.actuator_id}'} {names.command(one)}"
        for one in message.commands[:_COMMANDS_TOLD]
    ]
    more = len(message.commands) - len(told)
    if more:
        told.append(f"{more} more")
    return ", ".join(told) or "to nobody"


def _actuator(status: ActuatorStatus, source: int, names: Names) -> str:
    parts = [f"servo {status.actuator_id}", names.position(source, status.position)]
    # 0 and NaN are what a servo that measures neither sends
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
        f"{printable(info.name) or 'without a name'}, software {software.major}.{software.minor}, "
        f"hardware {hardware.major}.{hardware.minor}, uid {hardware.unique_id.hex()[:8]}…"
    )


def _get_set(request: GetSetRequest, destination: int, names: Names) -> str:
    """By name, and by index where the name is empty (table 2-14)."""
    name = request.name
    what = printable(name) or f"index {request.index}"
    called = names.register(destination, name) if name else ""
    what = f"{what} {called}" if called else what
    if request.value.kind is ValueKind.EMPTY:
        return f"read {what}"
    return f"write {what} = {_value(request.value, destination, name, names)}"


def _value(value: Value, node: int, name: str, names: Names) -> str:
    content = value.value
    match content:
        case str():
            return f'"{printable(content)}"'
        case float():
            return f"{content:.7g}".replace("-", "−")
        case int() if value.kind is ValueKind.INTEGER:
            shown = str(content).replace("-", "−")
            meant = names.value(node, name, content) if name else ""
            return f"{shown}, {meant}" if meant and meant != shown else shown
        case _:
            return str(content)
