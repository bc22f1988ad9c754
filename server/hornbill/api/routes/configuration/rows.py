"""GET and PUT of each row as the document has them, made from the tables."""

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
from hornbill.schema.effect import no_effect, told
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value, number, to_value, with_unit
from hornbill.servo.device.reading import CIRCUMSTANCES


class RowValue(Model):
    """The value of one row; each row has a class of its own that says what it may be."""

    value: Any
    confirm: Confirmed = Field(default=[])


JsonSchema: TypeAlias = dict[str, Any]

READ_PROBLEMS = ("unknown_servo", "not_in_this_model", "refused_by_servo", "no_response", "bus_disconnected")
WRITE_PROBLEMS = (
    "unknown_servo", "not_in_this_model", "out_of_range", "invalid_value", "busy", "torque_on", "lease_held",
    "refused_by_servo", "no_response", "bus_disconnected", "forbidden_parameter", "unknown_parameter", "read_only",
    "conflict", "needs_confirmation", "configuration_lost", "not_as_wanted", "store_failed",
)  # fmt: skip
COMMAND_PROBLEMS = ("lease_required", "stopped", "mode_off", "torque_off")
_TypedDict: Any = TypedDict
_Alias: Any = TypeAliasType
_Literal: Any = Literal
"""Without their rule that names and members are written out: here they come from the tables."""

_TYPED: Final = ("key", "value", "rom", "configured", "default")
"""Fields of a reading that depend on the row."""


def declared(catalog: Catalog) -> Routes:
    """A GET and, where it can be written, a PUT per row, for the document: the pair of `{key}` serves them all."""
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
    summary = {"operation_id": f"get_{row.key}", "summary": row.label}

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

    shown = {"default": {"summary": "the default", "value": {"value": example(catalog, row)}}}
    extra |= {"requestBody": {"content": {"application/json": {"examples": shown}}}}
    summary = {"operation_id": f"set_{row.key}", "summary": f"Set {row.label.lower()}"}
    make = made.put(path, Role.CONFIGURE, *WRITE_PROBLEMS, *COMMAND_PROBLEMS, **both, **summary, openapi_extra=extra)
    make(put)  # pyright: ignore[reportUnknownArgumentType]


@cache
def reading_types(catalog: Catalog) -> dict[str, type[Model]]:
    """The type of each row's reading, by key: one for all rows of a kind, one for each list of choices."""
    made: dict[str, type[Model]] = {}
    return {row.key: made.setdefault(_reading(row), _reading_type(row)) for row in catalog.readable.values()}


@cache
def reading_set(catalog: Catalog) -> Any:
    """Readings by key, each of its row's type; rows that a servo lacks are absent."""
    made = _TypedDict("ReadingByKey", reading_types(catalog), total=False)
    made.__pydantic_config__ = ConfigDict(extra="forbid", json_schema_extra=_none_required)
    return made


def _none_required(schema: JsonSchema) -> None:
    """For pydantic requires every key of what is answered, by the configuration of the model round it."""
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
    return create_model(_reading(row), __base__=Model, __doc__=Reading.__doc__, **fields)  # pyright: ignore[reportCallIssue, reportArgumentType, reportUnknownVariableType]


def _typed(row: Parameter, one: dataclasses.Field[Any]) -> Any:
    """The type of the key, or of a field that holds a value of the row, described as in Reading."""
    kind: Any = ParameterKey if one.name == "key" else _held(row)
    return Annotated[kind, *one.type.__metadata__]  # pyright: ignore[reportAttributeAccessIssue]


def _held(row: Parameter) -> Any:
    """What a reading holds: raw values that no table names come as they are; null: void or not known."""
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
    """The keys of a row's choices, one component of the document."""
    return _choice_alias(f"{_name(row)}Choice", tuple(choice.key for choice in row.choices))


@cache
def _choice_alias(name: str, keys: tuple[str, ...]) -> Any:
    return _Alias(name, _Literal[keys])


def _reading(row: Parameter) -> str:
    """The component that describes a reading of the row."""
    if row.kind == "choice":
        return f"{_name(row)}Reading"
    if row.kind == "switch":
        return "SwitchReading"
    return "IntegerReading" if row.per_unit == 1 else "NumberReading"


def _name(row: Parameter) -> str:
    return "".join(part.capitalize() for part in row.key.split("_"))


def example(catalog: Catalog, row: Parameter) -> Value:
    """The default of the first model that has the row; 0 for a command, which has none."""
    own = next(model.rows()[row.key] for model in catalog.models.values() if row.key in model.rows())
    return to_value(own, own.default or 0)


def effects(catalog: Catalog, row: Parameter) -> list[str]:
    """Sentences: on what it depends whether the row has an effect."""
    if not row.writable:
        return ["It is only read, and acts on nothing."]
    rules = catalog.effects_of[row.key]
    said = ["`in_effect` of the answer tells whether it has an effect now."]
    said += [] if rules else ["No other row decides that."]
    said += ["It acts after it is saved and the servo has restarted."] if row.after_restart else []
    said += [told(catalog, rule) for rule in rules]
    return said + [no_effect(one.why, f"§ {one.section}") for one in CIRCUMSTANCES if one.rows(row)]


def _range(catalog: Catalog, row: Parameter) -> str:
    """What the row may be in any model, for people."""
    if row.kind == "choice":
        return ", ".join(f"`{choice.key}`" for choice in row.choices)
    if row.kind == "switch":
        return "true or false"
    low, high = catalog.widest(row.key)
    if low is None or high is None:
        return "not stated"
    text = with_unit(f"{number(low, row.per_unit)} to {number(high, row.per_unit)}", row.unit)
    return text + (" at the most; each model has its own" if row.minimum is None else "")


def value_schema(catalog: Catalog, row: Parameter) -> JsonSchema:
    """JSON Schema of a row's value, with the widest range over all models: the servo's own is checked on writing."""
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
    also = "" if other is None else f", or {other.unit} by `{other.parameter}`"
    unit = f" Unit: {row.unit}{also}." if row.unit else ""
    since = "" if row.since == "1.010" else f" Since firmware {row.since}."
    pwm = " Only in models with PWM input." if row.pwm_only else ""
    return f"{row.description}{unit} Register {row.name}, section {row.section}.{since}{pwm}"
