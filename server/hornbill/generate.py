"""Owns `make generate`: writes what is made from the tables and the API, and says whether anything changed."""

import json
import sys
from pathlib import Path

from hornbill import resources
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
    """Write them, and name each file whose content changed."""
    target = (resources.schemas() if folder is None else folder) / "generated"
    target.mkdir(exist_ok=True)
    for name, text in documents(Catalog.load()).items():
        file = target / name
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")
            sys.stdout.write(f"changed: {file.name}\n")


def _json(what: object) -> str:
    return json.dumps(what, indent=2, ensure_ascii=False, sort_keys=True) + "\n"


if __name__ == "__main__":
    main()
