"""Structures as plain fields: the JSON form used by the conformance vectors and the decode command."""

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Final, TypeAlias, cast

from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorCommand, NodeHealth, NodeStatus
from hornbill.wire.services import HardwareVersion, SoftwareVersion
from hornbill.wire.types import ALL, AnyStructure
from hornbill.wire.value import EMPTY, Value, ValueKind

Fields: TypeAlias = dict[str, Any]
"""Field values under their DSDL names: bytes as hex, unions as {"kind": ..., "value": ...}.

NaN and infinity, which JSON lacks, are "NaN", "Infinity" and "-Infinity".
"""

_BY_NAME: Final = {(s.TYPE.name, s.KIND): s for s in ALL}
_NESTED: Final[dict[str, type]] = {
    "status": NodeStatus,
    "software_version": SoftwareVersion,
    "hardware_version": HardwareVersion,
}
_BYTES: Final = frozenset({"unique_id", "certificate_of_authenticity"})
_UNIONS: Final = frozenset({"value", "default_value", "max_value", "min_value"})
_UNION_KINDS: Final = {
    ValueKind.EMPTY: "empty",
    ValueKind.INTEGER: "integer_value",
    ValueKind.REAL: "real_value",
    ValueKind.BOOLEAN: "boolean_value",
    ValueKind.STRING: "string_value",
}
_KINDS_OF_UNION: Final = {name: kind for kind, name in _UNION_KINDS.items()}
_NON_FINITE: Final = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}


def to_fields(structure: AnyStructure) -> Fields:
    """The fields of a structure, ready for JSON. Void fields are omitted."""
    return {field.name: _plain(getattr(structure, field.name)) for field in fields(structure)}


def from_fields(name: str, kind: Kind, plain: Mapping[str, Any]) -> AnyStructure:
    """Build a structure from the form returned by `to_fields`, given the full name of its data type and its kind.

    Raises ValueError for an unknown type, and for missing, unknown or invalid fields.
    """
    structure = _BY_NAME.get((name, kind))
    if structure is None:
        raise ValueError(f"{name} {kind.name.lower()} is not supported.")
    return cast(AnyStructure, _build(structure, plain))


def _plain(value: object) -> object:
    match value:
        case bytes():
            return value.hex()
        case Value(kind, content):
            name = _UNION_KINDS[kind]
            return {"kind": name} if kind == ValueKind.EMPTY else {"kind": name, "value": _plain(content)}
        case tuple() | list():
            return [_plain(item) for item in cast("list[object]", value)]
        case bool() | str():
            return value
        case int():
            return int(value)
        case float():
            if math.isfinite(value):
                return value
            return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
        case _:
            return {field.name: _plain(getattr(value, field.name)) for field in fields(cast(Any, value))}


def _build(structure: type, plain: Mapping[str, Any]) -> object:
    try:
        return structure(**{name: _value(name, value) for name, value in plain.items()})
    except (TypeError, AttributeError, KeyError) as error:
        raise ValueError(f"Invalid fields for {structure.__name__}: {error}.") from error


def _value(name: str, plain: Any) -> object:
    if name in _BYTES:
        return bytes.fromhex(plain)
    if name in _NESTED:
        return _build(_NESTED[name], plain)
    if name in _UNIONS:
        return _union(plain)
    if name == "health":
        return NodeHealth(plain)
    if name == "commands":
        return tuple(_build(ActuatorCommand, entry) for entry in plain)
    return _NON_FINITE.get(plain, plain) if isinstance(plain, str) and name != "name" else plain


def _union(plain: Mapping[str, Any]) -> Value:
    kind = _KINDS_OF_UNION.get(plain["kind"])
    if kind is None:
        raise ValueError(f"{plain['kind']} is not a value kind. Use one of {', '.join(_KINDS_OF_UNION)}.")
    if kind == ValueKind.EMPTY:
        return EMPTY
    content = plain["value"]
    return Value(kind, _NON_FINITE.get(content, content) if kind == ValueKind.REAL else content)
