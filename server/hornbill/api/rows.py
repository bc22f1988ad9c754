"""Owns what the OpenAPI document says of each row's GET and PUT, which one pair of routes serves for all rows."""

from copy import deepcopy
from typing import Any, Final, TypeAlias

from hornbill.api import PREFIX
from hornbill.schema.catalog import Catalog
from hornbill.schema.effect import no_effect, told
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value, number, to_value, with_unit
from hornbill.servo.reading import CIRCUMSTANCES

JsonSchema: TypeAlias = dict[str, Any]

PATH: Final = "/servos/{uid}/parameters/{key}"
GET: Final = "get_row"
PUT: Final = "set_row"
_BODY: Final = "RowValue"


def declare(made: dict[str, Any], catalog: Catalog) -> None:
    """Put a GET (and PUT) a row, each with its own name, description and body, in the place of the one pair."""
    schemas: dict[str, JsonSchema] = made["components"]["schemas"]
    body = schemas.pop(_BODY)
    paths: dict[str, Any] = {}
    for path, operations in made["paths"].items():
        if path != PREFIX + PATH:
            paths[path] = operations
            continue
        for operation in operations.values():
            operation["parameters"] = [one for one in operation["parameters"] if one["name"] != "key"]
        for row in catalog.readable.values():
            paths[path.replace("{key}", row.key)] = _operations(catalog, row, operations)
            if row.writable:
                schemas[_name(row)] = _body(catalog, row, body)
    made["paths"] = paths
    made["components"]["schemas"] = dict(sorted(schemas.items()))


def _operations(catalog: Catalog, row: Parameter, anys: dict[str, Any]) -> dict[str, Any]:
    """The operations of one row, from those of any."""
    effect = effects(catalog, row)
    described = " ".join((_description(row), f"Range: {_range(catalog, row)}.", *effect))
    both = {"description": described, "x-unit": row.unit, "x-effect": effect}
    get = deepcopy(anys["get"])
    get |= {"operationId": f"get_{row.key}", "summary": row.label, **both}
    answer: JsonSchema = get["responses"]["200"]["content"]["application/json"]["schema"]
    answer["properties"] = {"value": _read(row)}
    if not row.writable:
        return {"get": get}
    put = deepcopy(anys["put"])
    put |= {"operationId": f"set_{row.key}", "summary": f"Set {row.label.lower()}", **both}
    body = put["requestBody"]["content"]["application/json"]
    body["schema"] = {"$ref": f"#/components/schemas/{_name(row)}"}
    body["examples"] = {"default": {"summary": "the default", "value": {"value": example(catalog, row)}}}
    return {"get": get, "put": put}


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
    return said + [
        no_effect(one.why, f"§ {one.section}") for one in CIRCUMSTANCES if one.rows is None or row.key in one.rows
    ]


def _read(row: Parameter) -> JsonSchema:
    """What a reading holds: what no table names comes as it is, and what is void as null."""
    number = "integer" if row.per_unit == 1 else "number"
    first = {"choice": "string", "switch": "boolean"}.get(row.kind)
    kinds = [*([first] if first else []), number, *(["null"] if row.dummy else [])]
    return {"title": row.label, "type": kinds[0] if len(kinds) == 1 else kinds, "x-unit": row.unit}


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


def _body(catalog: Catalog, row: Parameter, anys: JsonSchema) -> JsonSchema:
    """The body of one row's PUT, from that of any."""
    made = deepcopy(anys)
    made["title"] = _name(row)
    del made["description"]  # of the class, which is nothing a client knows
    made["properties"]["value"] = value_schema(catalog, row)
    return made


def _name(row: Parameter) -> str:
    return "".join(part.capitalize() for part in row.key.split("_")) + "Value"


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
