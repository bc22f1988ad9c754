"""Shared parts of the OpenAPI document: parameters used by several operations become components."""

from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

import orjson

_PROBLEM: Final = "#/components/responses/Problem"
"""The response whose description is given by each operation."""


def share(made: dict[str, Any]) -> None:
    """Move repeated parameters to components, and drop titles that only repeat the field name."""
    components: dict[str, Any] = made["components"]
    components["parameters"] = _share_parameters(made["paths"])
    for operation in _operations(made["paths"]):
        for response in operation["responses"].values():
            if response.get("$ref", _PROBLEM) != _PROBLEM:
                response.pop("description")  # FastAPI's text would override that of the component
    for schema in components["schemas"].values():
        _drop_titles(schema)


def parameters_of(made: dict[str, Any], operation: dict[str, Any]) -> list[dict[str, Any]]:
    """Parameters of an operation, with references resolved."""
    shared = made["components"]["parameters"]
    return [shared[one["$ref"].rpartition("/")[2]] if "$ref" in one else one for one in operation.get("parameters", ())]


def _operations(paths: dict[str, Any]) -> Iterator[dict[str, Any]]:
    return (operation for verbs in paths.values() for operation in verbs.values())


def _share_parameters(paths: dict[str, Any]) -> dict[str, Any]:
    """Replace repeated parameters by references. Returns the shared ones: the most frequent declaration by name."""
    times: dict[str, Counter[bytes]] = {}
    for operation in _operations(paths):
        for parameter in operation.get("parameters", ()):
            parameter["schema"].pop("title", None)
            if parameter["schema"].get("description") == parameter.get("description"):
                parameter["schema"].pop("description", None)
            times.setdefault(parameter["name"], Counter())[orjson.dumps(parameter)] += 1
    most = {name: found.most_common(1)[0] for name, found in times.items()}
    shared = {name: declaration for name, (declaration, count) in most.items() if count > 1}
    for operation in _operations(paths):
        if "parameters" in operation:
            operation["parameters"] = [
                {"$ref": f"#/components/parameters/{one['name']}"}
                if shared.get(one["name"]) == orjson.dumps(one)
                else one
                for one in operation["parameters"]
            ]
    return {name: orjson.loads(declaration) for name, declaration in sorted(shared.items())}


def _drop_titles(schema: dict[str, Any]) -> None:
    for name, field in schema.get("properties", {}).items():
        if field.get("title") == name.replace("_", " ").title():
            del field["title"]
