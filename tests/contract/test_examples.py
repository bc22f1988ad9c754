"""Examples and descriptions of the OpenAPI document: routes accept the examples, and servos behave as described."""

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import pytest
from fastapi import FastAPI
from fastapi.routing import APIRoute
from pydantic import TypeAdapter

from behaviour.rig import Rig, json
from behaviour.scene import scene
from contract.document_server import document
from hornbill.api.http import create_api
from hornbill.api.openapi.examples import EXAMPLES, MODEL, SECOND, SERVO
from hornbill.bus import address
from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import number, to_raw
from hornbill.servo.device.reading import CIRCUMSTANCES
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe

CATALOG = Catalog.load()
WITHOUT = {"import_profile", "import_recording", "renew_lease"}
"""They take a file, described in the guide to file formats; or their body is optional and usually absent."""
PATH = "/api/v1/servos/{uid}/parameters/"


@lru_cache
def api() -> FastAPI:
    return create_api(CATALOG)


@lru_cache
def operations() -> dict[str, dict[str, Any]]:
    return {one["operationId"]: one for verbs in document()["paths"].values() for one in verbs.values()}


def shown(operation: dict[str, Any]) -> dict[str, Any]:
    """The examples of an operation's body, by their name in the document."""
    content = operation.get("requestBody", {}).get("content", {}).get("application/json", {})
    return {name: one["value"] for name, one in content.get("examples", {}).items()}


@lru_cache
def body_of(name: str) -> TypeAdapter[Any]:
    """The body that the route of this operation takes."""
    name = "set_parameter" if name not in EXAMPLES else name
    route = next(one for one in api().routes if isinstance(one, APIRoute) and one.operation_id == name)
    (field,) = route.dependant.body_params
    shape: Any = field.field_info.annotation
    return TypeAdapter[Any](shape)


EVERY = [(name, example) for name, one in operations().items() for example in shown(one).values()]
IDS = [f"{name}-{at}" for at, (name, _) in enumerate(EVERY)]


def test_every_body_has_an_example() -> None:
    bodies = {name for name, one in operations().items() if "requestBody" in one}
    assert {name for name in bodies if not shown(operations()[name])} == WITHOUT
    assert EXAMPLES.keys() <= bodies


@pytest.mark.parametrize(("name", "example"), EVERY, ids=IDS)
def test_every_route_accepts_its_examples(name: str, example: Any) -> None:
    body_of(name).validate_python(example, strict=False)


def mentioned(example: Any, field: str) -> Iterator[Any]:
    """The values of all fields of this name, at any depth."""
    if isinstance(example, dict):
        for name, value in example.items():  # pyright: ignore[reportUnknownVariableType]
            if name == field:
                yield value
            yield from mentioned(value, field)
    elif isinstance(example, list):
        for one in example:  # pyright: ignore[reportUnknownVariableType]
            yield from mentioned(one, field)


def sets(example: Any) -> Iterator[dict[str, Any]]:
    """Values by key of a row, anywhere in a body."""
    for found in mentioned(example, "values"):
        if SERVO not in found:  # a stream's are by uid
            yield found
    for by_uid in mentioned(example, "servos"):
        if isinstance(by_uid, dict):
            yield from by_uid.values()  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType]


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_use_existing_rows_models_and_addresses(name: str) -> None:
    for example in EXAMPLES[name].values():
        for values in sets(example):
            for key, value in values.items():
                assert CATALOG.parameters[key].writable
                to_raw(CATALOG.models[MODEL].rows()[key], value)
        for keys in (*mentioned(example, "channels"), *mentioned(example, "keys")):
            assert set(keys) <= CATALOG.readable.keys()
        for model in mentioned(example, "model"):
            assert model in CATALOG.models
        for firmware in mentioned(example, "firmware"):
            assert firmware in CATALOG.models[MODEL].firmware
        for uids in mentioned(example, "uids"):
            assert set(uids) <= {SERVO, SECOND}
        for where in mentioned(example, "address"):
            address.check(where, example.get("bitrate", 1_000_000))


@pytest.mark.parametrize("row", CATALOG.readable.values(), ids=list(CATALOG.readable))
def test_every_route_of_a_row_has_type_unit_range_description_and_effect(row: Parameter) -> None:
    verbs = document()["paths"][PATH + row.key]
    low, high = CATALOG.widest(row.key)
    for operation in verbs.values():
        text = operation["description"]
        assert operation["x-unit"] == row.unit
        assert row.description in text
        if row.unit:
            assert f"Unit: {row.unit}" in text
        if row.unit_when is not None:
            assert row.unit_when.unit in text
        words = [f"`{one.key}`" for one in row.choices] if row.kind == "choice" else []
        words += ["true or false"] if row.kind == "switch" else []
        if row.kind in ("number", "bits"):
            words += (
                ["not specified"] if low is None or high is None else [number(one, row.per_unit) for one in (low, high)]
            )
        assert words
        scope = text.partition("Range: ")[2]
        assert [one for one in words if one not in scope] == []
        assert operation["x-effect"]
        assert text.endswith(" ".join(operation["x-effect"]))
    for operation in verbs.values():
        ref = operation["responses"]["200"]["content"]["application/json"]["schema"]["$ref"]
        components = document()["components"]["schemas"]
        fields, common = components[ref.rpartition("/")[2]]["properties"], components["Reading"]["properties"]
        assert fields.keys() == common.keys()
        typed = {name for name, one in fields.items() if one != common[name]}
        assert typed == {"key", "value", "rom", "configured", "default"}
        assert all("type" in fields[name] or "anyOf" in fields[name] for name in typed - {"key"})
    assert ("put" in verbs) == row.writable


@pytest.mark.parametrize("row", [row for row in CATALOG.readable.values() if row.writable], ids=lambda row: row.key)
def test_the_body_of_a_row_has_type_unit_range_and_default(row: Parameter) -> None:
    put = document()["paths"][PATH + row.key]["put"]
    content = put["requestBody"]["content"]["application/json"]
    value = document()["components"]["schemas"][content["schema"]["$ref"].rsplit("/", 1)[-1]]["properties"]["value"]
    low, high = CATALOG.widest(row.key)
    assert low is not None
    assert high is not None
    if row.kind == "choice":
        assert value["enum"] == [one.key for one in row.choices]
    elif row.kind == "switch":
        assert value["type"] == "boolean"
    else:
        assert value["type"] == ("integer" if row.per_unit == 1 else "number")
        assert (value["minimum"], value["maximum"]) == (low / row.per_unit, high / row.per_unit)
        assert value["x-unit"] == row.unit
    own = next(rows_[row.key] for rows_ in (one.rows() for one in CATALOG.models.values()) if row.key in rows_)
    (example,) = shown(put).values()
    assert to_raw(own, example["value"]) == (own.default or 0)


@pytest.mark.parametrize("row", [row for row in CATALOG.readable.values() if row.writable], ids=lambda row: row.key)
def test_the_effect_of_a_row_contains_every_rule_and_every_state_of_the_servo(row: Parameter) -> None:
    text = " ".join(document()["paths"][PATH + row.key]["put"]["x-effect"])
    rules = CATALOG.effects_of[row.key]
    for rule in rules:
        assert rule.why.replace("{last_command}", "speed or torque") in text
        assert rule.unless_row is None or CATALOG.by_key[rule.unless_row].name in text
    for one in CIRCUMSTANCES:
        assert (one.why in text) == one.rows(row)
    assert ("depends on no other row" in text) == (not rules)
    assert ("after a save and restart" in text) == row.after_restart
    assert "{" not in text


@pytest.mark.parametrize("model", ["BLA15-06U-A0", "BLA21-06U-AB"])
@scene(lambda model: Recipe(model, "1.300", servo_id=1, node_id=11, rom={"speed_torque_control": 1}))
async def test_a_servo_accepts_the_example_of_each_row_and_reads_as_documented(
    rig: Rig, servo: Servo, model: str
) -> None:
    kinds = {"integer": int, "number": (int, float), "boolean": bool, "string": str, "null": type(None)}
    lease = await rig.lease()
    paths = document()["paths"]
    for key in servo.registers:
        path = f"/servos/{servo.uid}/parameters/{key}"
        verbs = paths[PATH + key]
        read = json(await rig.call("GET", path))
        assert read["unit"] == verbs["get"]["x-unit"]
        ref = verbs["get"]["responses"]["200"]["content"]["application/json"]["schema"]["$ref"]
        components = document()["components"]["schemas"]
        declared = components[ref.rpartition("/")[2]]["properties"]
        for name in ("value", "rom", "configured", "default"):
            every = [
                components[one["$ref"].rpartition("/")[2]] if "$ref" in one else one
                for one in declared[name].get("anyOf", [declared[name]])
            ]
            kinds_of = tuple(kinds[one] for part in every for one in part["type"] if "enum" not in part)
            words = [word for part in every for word in part.get("enum", ())]
            assert isinstance(read[name], kinds_of) or read[name] in words, (key, name, read[name])
        own = CATALOG.models[model].rows()[key]
        for example in shown(verbs.get("put", {})).values():
            if model == "BLA15-06U-A0" or own.pwm_only:
                json(await rig.call("PUT", path, example, lease=lease))
