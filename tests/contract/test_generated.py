"""`make generate` changes nothing: what is committed is what tables and API make."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from hornbill import generate_client, resources
from hornbill.generate import documents
from hornbill.schema.catalog import Catalog

ROOT = Path(__file__).parents[2]
OPENAPI_TYPESCRIPT = ROOT / "web" / "node_modules" / ".bin" / "openapi-typescript"


@pytest.mark.parametrize("name", ["openapi.json", "parameters.schema.json", "parameters.md"])
def test_generated_files_are_up_to_date(name: str) -> None:
    committed = (resources.schemas() / "generated" / name).read_text(encoding="utf-8")
    assert committed == documents(Catalog.load())[name], f"{name} is out of date: run 'make generate' and commit it"


def test_the_client_is_up_to_date() -> None:
    document = json.loads(documents(Catalog.load())["openapi.json"])
    for path, text in generate_client.files(document).items():
        committed = (generate_client.CLIENT / path).read_text(encoding="utf-8")
        assert committed == text, f"client/{path} is out of date: run 'make generate'"


def test_the_types_of_the_page_are_up_to_date(tmp_path: Path) -> None:
    if not OPENAPI_TYPESCRIPT.is_file():
        pytest.skip("web/node_modules is not installed: 'make setup' installs it")
    assert shutil.which("node"), "Node is needed: openapi-typescript is installed but cannot run"
    made = tmp_path / "schema.d.ts"
    source = ROOT / "schemas" / "generated" / "openapi.json"
    subprocess.run([OPENAPI_TYPESCRIPT, source, "-o", made], check=True, capture_output=True, cwd=ROOT / "web")
    committed = (ROOT / "web" / "src" / "api" / "schema.d.ts").read_text(encoding="utf-8")
    assert committed == made.read_text(encoding="utf-8"), "schema.d.ts is out of date: run 'make generate'"
