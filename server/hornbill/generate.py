"""Owns `make generate`: writes what is made from the tables and the API, and says whether anything changed."""

import json
import sys
from pathlib import Path

from hornbill import generate_client, generate_reference, resources
from hornbill.api.http import create_api
from hornbill.schema.catalog import Catalog
from hornbill.schema.manual import parameters_markdown, tables_json_schema


def documents(catalog: Catalog) -> dict[str, str]:
    """Text of every generated file, by its name in schemas/generated."""
    return {
        "openapi.json": _json(create_api(catalog).openapi()),
        "parameters.schema.json": _json(tables_json_schema()),
        "parameters.md": parameters_markdown(catalog),
    }


def main(folder: Path | None = None) -> None:
    """Write them, and the half of the client that is made; name each file whose content changed."""
    target = (resources.schemas() if folder is None else folder) / "generated"
    target.mkdir(exist_ok=True)
    made = documents(Catalog.load())
    wanted = {target / name: text for name, text in made.items()}
    document = json.loads(made["openapi.json"])
    wanted |= {generate_client.CLIENT / path: text for path, text in generate_client.files(document).items()}
    reference = target.parent.parent / "docs" / "reference"
    wanted |= {reference / path: text for path, text in generate_reference.pages(document).items()}
    for file, text in wanted.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")
            sys.stdout.write(f"changed: {file.name}\n")


def _json(what: object) -> str:
    return json.dumps(what, indent=2, ensure_ascii=False, sort_keys=True) + "\n"


if __name__ == "__main__":
    main()
