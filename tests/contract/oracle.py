"""The public Python stack: its objects from hornbill's structures, and its fields in hornbill's form."""

# The stack is dynamic and has no type hints.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# pyright: reportUnknownParameterType=false, reportMissingTypeStubs=false

import math
from collections.abc import Iterable
from typing import Any

import dronecan
from dronecan import dsdl, transport

from hornbill.wire.datatype import DataType, Kind
from hornbill.wire.fields import Fields, to_fields
from hornbill.wire.frame import Frame
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import AnyStructure

UNIONS = {"value", "default_value", "max_value", "min_value"}
BYTES = {"unique_id", "certificate_of_authenticity"}
TEXT = {"name", "string_value"}
NO_NUMBERS = {"NaN", "Infinity", "-Infinity"}


def oracle_type(data_type: DataType) -> Any:
    kind = dsdl.CompoundType.KIND_SERVICE if data_type.service else dsdl.CompoundType.KIND_MESSAGE
    return dronecan.DATATYPES[data_type.id, kind]


def oracle_value(structure: AnyStructure) -> Any:
    """The same structure as an object of the oracle, filled from its fields."""
    make = oracle_type(structure.TYPE)
    value = make(_mode=structure.KIND.name.lower()) if structure.TYPE.service else make()
    fill(value, to_fields(structure))
    return value


def fill(value: Any, fields: Fields) -> None:
    for name, content in fields.items():
        if name in UNIONS:
            union = getattr(value, name)
            kind = content["kind"]
            if kind == "empty":
                transport.switch_union_field(union, "empty")
            else:
                setattr(union, kind, content["value"].encode("latin-1") if kind in TEXT else content["value"])
        elif name in BYTES:
            setattr(value, name, list(bytes.fromhex(content)))
        elif name in TEXT:
            setattr(value, name, content.encode("latin-1"))
        elif name == "commands":
            for entry in content:
                command = dronecan.uavcan.equipment.actuator.Command()
                fill(command, entry)
                value.commands.append(command)
        elif isinstance(content, dict):
            fill(getattr(value, name), content)
        else:
            setattr(value, name, real(content))


def real(content: Any) -> Any:
    """Fields contain text for numbers that JSON lacks."""
    return float(content) if content in NO_NUMBERS else content


def oracle_fields(value: Any) -> Fields:
    """An object of the oracle in hornbill's form of fields."""
    fields: Fields = {}
    for name, content in transport.get_fields(value).items():
        if name.startswith("_void"):
            continue
        if name in UNIONS:
            kind = transport.get_active_union_field(content)
            fields[name] = {"kind": kind} if kind == "empty" else {"kind": kind, "value": plain(kind, content)}
        elif name == "commands":
            fields[name] = [oracle_fields(entry) for entry in content]
        elif isinstance(content, transport.CompoundValue):
            fields[name] = oracle_fields(content)
        else:
            fields[name] = plain(name, value)
    return fields


def plain(name: str, owner: Any) -> object:
    value = getattr(owner, name)
    if name in BYTES:
        return bytes(list(value)).hex()
    if name in TEXT:
        return bytes(list(value)).decode("latin-1")
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    return value


def oracle_frames(structure: AnyStructure, sent: Transfer, discriminator: int | None = None) -> list[Frame]:
    made = transport.Transfer(
        transfer_id=sent.transfer_id,
        source_node_id=sent.source,
        dest_node_id=sent.destination or None,
        payload=oracle_value(structure),
        transfer_priority=sent.priority,
        request_not_response=sent.kind == Kind.REQUEST,
        service_not_message=sent.kind != Kind.MESSAGE,
        discriminator=discriminator,
    )
    return [Frame(frame.message_id, bytes(frame.bytes)) for frame in made.to_frames()]


def oracle_reads(frames: list[Frame]) -> Any:
    read = transport.Transfer()
    read.from_frames([transport.Frame(frame.id, frame.data, 1.0, 1.0) for frame in frames])
    return read


def oracle_transfers(frames: Iterable[Frame]) -> list[Fields]:
    """The transfers the stack finds in frames, each in the form of the conformance vectors; unknown types left out."""
    manager = transport.TransferManager()
    found: list[Fields] = []
    for frame in frames:
        done = manager.receive_frame(transport.Frame(frame.id, frame.data, frame.at, frame.at))
        if not done:
            continue
        read = transport.Transfer()
        try:
            read.from_frames(done)
        except transport.TransferError:
            continue
        stream = b"".join(bytes(each.bytes[:-1]) for each in done)
        direction = "request" if read.request_not_response else "response"
        found.append(
            {
                "timestamp": done[-1].ts_real,
                "type": dronecan.get_dronecan_data_type(read.payload).full_name,
                "kind": direction if read.service_not_message else "message",
                "data_type_id": read.data_type_id,
                "source": read.source_node_id,
                "destination": read.dest_node_id,
                "priority": read.transfer_priority,
                "transfer_id": read.transfer_id,
                "fields": oracle_fields(read.payload),
                "payload": (stream if len(done) == 1 else stream[2:]).hex(),
            }
        )
    return found
