"""GET and PUT of each row as the document has them, made from the tables."""

from typing import Annotated, Any, Final, TypeAlias

from pydantic import Field, WithJsonSchema, create_model

from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Confirmed, Model
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

READ_PROBLEMS = ("unknown_servo", "not_in_this_model", "refused_by_servo", "no_answer", "bus_disconnected")
WRITE_PROBLEMS = (
    "unknown_servo", "not_in_this_model", "out_of_range", "invalid_value", "busy", "torque_on", "lease_held",
    "refused_by_servo", "no_answer", "bus_disconnected", "forbidden_parameter", "unknown_parameter", "read_only",
    "conflict", "needs_confirmation", "configuration_lost", "not_as_wanted", "store_failed",
)  # fmt: skip
COMMAND_PROBLEMS = ("lease_required", "stopped", "mode_off", "torque_off")
_TYPED: Final = ("value", "rom", "configured", "default")
"""Fields of a reading that hold values of the row."""


def declared(catalog: Catalog) -> Routes:
    """A GET and, where it can be written, a PUT per row, for the document: the pair of `{key}` serves them all."""
    made = Routes("parameters")
    for row in catalog.readable.values():
        _declare(made, catalog, row)
    return made


def _declare(made: Routes, catalog: Catalog, row: Parameter) -> None:
    path, name = f"/servos/{{uid}}/parameters/{row.key}", _name(row)
    answer: JsonSchema = {"schema": {"$ref": f"#/components/schemas/{_reading(row)}"}}
    effect = effects(catalog, row)
    both: dict[str, Any] = {
        "description": " ".join((_description(row), f"Range: {_range(catalog, row)}.", *effect)),
        "responses": {200: {"content": {"application/json": answer}}},
    }
    extra: dict[str, Any] = {"x-unit": row.unit, "x-effect": effect}
    summary = {"operation_id": f"get_{row.key}", "summary": row.label}

    async def get(host: TheHost, servo: TheServo) -> None: ...

    made.get(path, Role.VIEW, *READ_PROBLEMS, **both, **summary, openapi_extra=extra)(get)
    if not row.writable:
        return
    value_type = Annotated[Any, WithJsonSchema(value_schema(catalog, row))]
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


def readings(catalog: Catalog) -> dict[str, JsonSchema]:
    """The readings of rows as components of the document: what all have in common, with the type of the values."""
    made: dict[str, JsonSchema] = {}
    for row in catalog.readable.values():
        own: JsonSchema = {"type": "object", "properties": dict.fromkeys(_TYPED, _read(row)), "required": list(_TYPED)}
        name = _reading(row)
        made[name] = {"title": name, "allOf": [{"$ref": "#/components/schemas/Reading"}, own]}
    return made


def _reading(row: Parameter) -> str:
    """The component that describes a reading of the row: one for all rows of a type, one for each list of choices."""
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


def _read(row: Parameter) -> JsonSchema:
    """What a reading holds: what no table names comes as it is; null: void or not known."""
    kinds = ["integer" if row.per_unit == 1 else "number", "null"]
    if row.kind == "switch":
        return {"type": ["boolean", *kinds]}
    if row.kind == "choice":
        return {"anyOf": [{"enum": [choice.key for choice in row.choices]}, {"type": kinds}]}
    return {"type": kinds}


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
