"""Documentation of GET and PUT of each row, generated from the tables."""

import dataclasses
from dataclasses import MISSING
from functools import cache
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import ConfigDict, Field, WithJsonSchema, create_model
from typing_extensions import TypeAliasType, TypedDict

from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.by_key import ParameterKey
from hornbill.domain.fields import Confirmed, Model
from hornbill.domain.servo import Reading
from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import no_effect, rule_text
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value, number, to_value, with_unit
from hornbill.servo.device.reading import CIRCUMSTANCES


class RowValue(Model):
    """Value to write to a row. Typed routes have a type and range for each row."""

    value: Any = Field(description="Value, in the unit of the row.")
    confirm: Confirmed = Field(default=[])


JsonSchema: TypeAlias = dict[str, Any]

READ_PROBLEMS = ("unknown_servo", "not_in_this_model", "refused_by_servo", "no_response", "bus_disconnected")
WRITE_PROBLEMS = (
    "unknown_servo", "not_in_this_model", "out_of_range", "invalid_value", "busy", "torque_on", "lease_held",
    "refused_by_servo", "no_response", "bus_disconnected", "forbidden_parameter", "unknown_parameter", "read_only",
    "conflict", "needs_confirmation", "configuration_lost", "unexpected_result", "store_failed",
)  # fmt: skip
COMMAND_PROBLEMS = ("lease_required", "stopped", "mode_off", "torque_off")
_TypedDict: Any = TypedDict
_Alias: Any = TypeAliasType
_Literal: Any = Literal
"""Typed as Any, because type checkers require literal names and members, and here they come from the tables."""

_TYPED: Final = ("key", "value", "rom", "configured", "default")
"""Fields of a reading that depend on the row."""


def declared(catalog: Catalog) -> Routes:
    """GET and, if writable, PUT of each row, for the document only: the `{key}` routes serve them all."""
    made = Routes("parameters")
    for row in catalog.readable.values():
        _declare(made, catalog, row)
    return made


def _declare(made: Routes, catalog: Catalog, row: Parameter) -> None:
    path, name = f"/servos/{{uid}}/parameters/{row.key}", _name(row)
    effect = effects(catalog, row)
    both: dict[str, Any] = {
        "description": " ".join((_description(row), f"Range: {_range(catalog, row)}.", *effect)),
        "response_model": reading_types(catalog)[row.key],
    }
    extra: dict[str, Any] = {"x-unit": row.unit, "x-effect": effect}
    summary: dict[str, Any] = {"operation_id": f"get_{row.key}", "summary": row.label}

    async def get(host: TheHost, servo: TheServo) -> None: ...

    made.get(path, Role.VIEW, *READ_PROBLEMS, **both, **summary, openapi_extra=extra)(get)
    if not row.writable:
        return
    value_type: Any = Annotated[Any, WithJsonSchema(value_schema(catalog, row))]
    body_type = create_model(f"{name}Value", __base__=RowValue, value=(value_type, ...))
    body_type.__doc__ = None

    async def put(
        host: TheHost,
        servo: TheServo,
        body: body_type,  # pyright: ignore[reportInvalidTypeForm, reportUnknownParameterType]
        lease: LeaseHeader = None,
    ) -> None: ...

    shown = {"default": {"summary": "default", "value": {"value": example(catalog, row)}}}
    extra = {**extra, "requestBody": {"content": {"application/json": {"examples": shown}}}}
    summary = {"operation_id": f"set_{row.key}", "summary": f"Set {_within_sentence(row.label)}"}
    make = made.put(path, Role.CONFIGURE, *WRITE_PROBLEMS, *COMMAND_PROBLEMS, **both, **summary, openapi_extra=extra)
    make(put)  # pyright: ignore[reportUnknownArgumentType]


@cache
def reading_types(catalog: Catalog) -> dict[str, type[Model]]:
    """Reading type of each row, by key: one per kind, and one per list of choices."""
    rows = catalog.readable.values()
    made = {name: _reading_type(row) for name, row in {_reading(row): row for row in rows}.items()}
    return {row.key: made[_reading(row)] for row in rows}


@cache
def reading_set(catalog: Catalog) -> Any:
    """Typed readings by key; rows that a servo lacks are absent."""
    made = _TypedDict("ReadingByKey", reading_types(catalog), total=False)
    made.__pydantic_config__ = ConfigDict(extra="forbid", json_schema_extra=_none_required)
    return made


def _none_required(schema: JsonSchema) -> None:
    """Make all keys optional: the configuration of the enclosing model would make them required."""
    schema.pop("required", None)


@cache
def input_set(catalog: Catalog) -> Any:
    """Values to write by key."""
    rows = [row for row in catalog.readable.values() if row.writable and row.group != "command"]
    schema: JsonSchema = {
        "type": "object",
        "description": "Values by key, in the units of the parameter manual.",
        "minProperties": 1,
        "additionalProperties": False,
        "properties": {row.key: value_schema(catalog, row) for row in rows},
    }
    return _Alias("InputByKey", Annotated[dict[str, Any], WithJsonSchema(schema)])


def _reading_type(row: Parameter) -> type[Model]:
    fields = {
        one.name: (_typed(row, one) if one.name in _TYPED else one.type, ... if one.default is MISSING else one.default)
        for one in dataclasses.fields(Reading)
    }
    return create_model(_reading(row), __base__=Model, __doc__=(Reading.__doc__ or "").partition("\n")[0], **fields)  # pyright: ignore[reportCallIssue, reportArgumentType, reportUnknownVariableType]


def _typed(row: Parameter, one: dataclasses.Field[Any]) -> Any:
    """Type of the key, or of a field that contains a value of the row, described as in Reading."""
    kind: Any = ParameterKey if one.name == "key" else _value_type(row)
    return Annotated[kind, *one.type.__metadata__]  # pyright: ignore[reportAttributeAccessIssue]


def _value_type(row: Parameter) -> Any:
    """Type of a value in a reading. Values missing from the tables are raw integers; null is inactive or unknown."""
    match row.kind:
        case "switch":
            return Annotated[bool | int | None, WithJsonSchema({"type": ["boolean", "integer", "null"]})]
        case "choice":
            return choice_type(row) | Annotated[int | None, WithJsonSchema({"type": ["integer", "null"]})]
        case _ if row.per_unit == 1:
            return Annotated[int | None, WithJsonSchema({"type": ["integer", "null"]})]
        case _:
            return Annotated[int | float | None, WithJsonSchema({"type": ["number", "null"]})]


def choice_type(row: Parameter) -> Any:
    """Keys of a row's choices, as one component of the document."""
    return _choice_alias(f"{_name(row)}Choice", tuple(choice.key for choice in row.choices))


@cache
def _choice_alias(name: str, keys: tuple[str, ...]) -> Any:
    return _Alias(name, _Literal[keys])


def _within_sentence(label: str) -> str:
    """Label with a lower-case first letter, unless it begins with an abbreviation."""
    return label if label[:2].isupper() else label[0].lower() + label[1:]


def _reading(row: Parameter) -> str:
    """Component that describes a reading of the row."""
    if row.kind == "choice":
        return f"{_name(row)}Reading"
    if row.kind == "switch":
        return "SwitchReading"
    return "IntegerReading" if row.per_unit == 1 else "NumberReading"


def _name(row: Parameter) -> str:
    return "".join(part.capitalize() for part in row.key.split("_"))


def example(catalog: Catalog, row: Parameter) -> Value:
    """Default of the first model that has the row; 0 for commands, which have none."""
    own = next(model.rows()[row.key] for model in catalog.models.values() if row.key in model.rows())
    return to_value(own, own.default or 0)


def effects(catalog: Catalog, row: Parameter) -> list[str]:
    """Sentences on the conditions under which the row has an effect."""
    if not row.writable:
        return ["Read-only."]
    rules = catalog.effects_of[row.key]
    sentences = ["`in_effect` in the response shows whether it has an effect now."]
    sentences += [] if rules else ["This depends on no other row."]
    sentences += ["Takes effect after a save and restart."] if row.after_restart else []
    sentences += [rule_text(catalog, rule) for rule in rules]
    return sentences + [no_effect(one.why, f"§ {one.section}") for one in CIRCUMSTANCES if one.rows(row)]


def _range(catalog: Catalog, row: Parameter) -> str:
    """Range of the row over all models, as text."""
    if row.kind == "choice":
        return ", ".join(f"`{choice.key}`" for choice in row.choices)
    if row.kind == "switch":
        return "true or false"
    low, high = catalog.widest(row.key)
    if low is None or high is None:
        return "not specified"
    text = with_unit(f"{number(low, row.per_unit)} to {number(high, row.per_unit)}", row.unit)
    return text + (" at most, depending on the model" if row.minimum is None else "")


def value_schema(catalog: Catalog, row: Parameter) -> JsonSchema:
    """JSON Schema of a row's value, with the widest range over all models. Writing checks the servo's own range."""
    shown: JsonSchema = {"title": row.label, "description": _description(row)}
    if row.kind == "choice":
        return {**shown, "type": "string", "enum": [choice.key for choice in row.choices]}
    if row.kind == "switch":
        return {**shown, "type": "boolean"}
    low, high = catalog.widest(row.key)
    if low is not None and high is not None:
        shown |= {"minimum": low / row.per_unit, "maximum": high / row.per_unit}
    if row.per_unit == 1:
        return {**shown, "type": "integer", "x-unit": row.unit}
    return {**shown, "type": "number", "multipleOf": 1 / row.per_unit, "x-unit": row.unit}


def _description(row: Parameter) -> str:
    other = row.unit_when
    also = "" if other is None else f", or {other.unit} depending on `{other.parameter}`"
    unit = f" Unit: {row.unit}{also}." if row.unit else ""
    since = "" if row.since == "1.010" else f" Since firmware {row.since}."
    pwm = " Only in models with PWM input." if row.pwm_only else ""
    return f"{row.description}{unit} Register {row.name}, section {row.section}.{since}{pwm}"
