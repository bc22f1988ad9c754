"""Text of all files generated from the parameter tables and the API."""

import json
from collections.abc import Iterator
from pathlib import Path

from hornbill.api.http import create_api
from hornbill.domain.plan import RunPlan
from hornbill.schema.catalog import Catalog

from . import client, reference
from .manual import JSON_SCHEMA, parameters_markdown, tables_json_schema

ROOT = Path(__file__).parents[2]


def documents(catalog: Catalog) -> dict[str, str]:
    """Text of the files in schemas/generated, by name."""
    return {
        "openapi.json": _json(create_api(catalog).openapi()),
        "parameters.schema.json": _json(tables_json_schema()),
        "parameters.md": parameters_markdown(catalog),
        "plan.schema.json": _json({"$schema": JSON_SCHEMA, **RunPlan.model_json_schema()}),
    }


def files() -> Iterator[tuple[Path, str]]:
    """Path and text of every generated file."""
    made = documents(Catalog.load())
    document = json.loads(made["openapi.json"])
    for folder, texts in (
        (ROOT / "schemas" / "generated", made),
        (ROOT / "server" / "hornbill" / "client", client.files(document)),
        (ROOT / "docs" / "reference", reference.pages(document)),
    ):
        yield from ((folder / path, text) for path, text in texts.items())


def _json(what: object) -> str:
    return json.dumps(what, indent=2, ensure_ascii=False, sort_keys=True) + "\n"
