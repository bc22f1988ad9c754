"""Generated files are up to date."""

import shutil
import subprocess
from pathlib import Path
from typing import is_typeddict

import pytest

from hornbill.client import responses
from tools.generate import files

ROOT = Path(__file__).parents[2]
OPENAPI_TYPESCRIPT = ROOT / "web" / "node_modules" / ".bin" / "openapi-typescript"


def test_generated_files_are_up_to_date() -> None:
    for path, text in files():
        assert path.read_text(encoding="utf-8") == text, f"{path} is out of date: run 'make generate' and commit it"


def test_every_type_of_the_client_has_fields() -> None:
    types = {name: one for name, one in vars(responses).items() if is_typeddict(one)}
    assert [name for name, one in types.items() if not one.__annotations__ and name != "TypedDict"] == []


def test_the_types_of_the_page_are_up_to_date(tmp_path: Path) -> None:
    if not OPENAPI_TYPESCRIPT.is_file():
        pytest.skip("web/node_modules is not installed: 'make setup' installs it")
    assert shutil.which("node"), "Node is needed: openapi-typescript is installed but cannot run"
    made = tmp_path / "schema.d.ts"
    source = ROOT / "schemas" / "generated" / "openapi.json"
    subprocess.run(
        [OPENAPI_TYPESCRIPT, source, "--default-non-nullable", "false", "-o", made],
        check=True,
        capture_output=True,
        cwd=ROOT / "web",
    )
    committed = (ROOT / "web" / "src" / "api" / "schema.d.ts").read_text(encoding="utf-8")
    assert committed == made.read_text(encoding="utf-8"), "schema.d.ts is out of date: run 'make generate'"
