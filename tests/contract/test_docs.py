"""Documentation and code agree: what is made is up to date, what is open is listed, every public name is told."""

import ast
import dataclasses
import json
import re
from pathlib import Path

import pytest

from hornbill.app.settings import Settings
from hornbill.cli.failing import MEANS
from hornbill.schema.catalog import Catalog
from hornbill.sim.behaviour import Behaviour
from tools.generate import documents
from tools.generate.reference import pages

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "server" / "hornbill"
REFERENCE = ROOT / "docs" / "reference"
BY_HAND = {"file-formats.md", "fidelity.md"}
FILES = [file for file in sorted(PACKAGE.rglob("*.py")) if "migrations" not in file.parts]


@pytest.fixture(scope="module")
def reference() -> dict[str, str]:
    return pages(json.loads(documents(Catalog.load())["openapi.json"]))


def test_the_reference_is_up_to_date(reference: dict[str, str]) -> None:
    kept = {file.relative_to(REFERENCE).as_posix(): file for file in REFERENCE.rglob("*.md")}
    assert set(kept) == set(reference) | BY_HAND, "run 'make generate', and remove what it no longer writes"
    for path, text in reference.items():
        assert kept[path].read_text(encoding="utf-8") == text, f"{path} is out of date: run 'make generate'"


def test_the_reference_names_every_operation_and_every_command(reference: dict[str, str]) -> None:
    document = json.loads(documents(Catalog.load())["openapi.json"])
    text = "\n".join(text for path, text in reference.items() if path.startswith("api/"))
    told = set(re.findall(r"^## (GET|PUT|POST|PATCH|DELETE) (\S+)$", text, re.MULTILINE))
    row = re.compile(r"/servos/\{uid\}/parameters/[a-z0-9_]+$")
    for path, operations in document["paths"].items():
        short = path.removeprefix("/api/v1")
        for method in operations:
            assert (method.upper(), short) in told or row.match(short), f"{method} {path}"
    for command in ("demo", "serve", "probe", "tokens create", "profiles apply", "logs start"):
        assert f"\n### hornbill {command}\n" in reference["command-line.md"]


def test_every_setting_is_told_as_an_environment_variable(reference: dict[str, str]) -> None:
    for name in Settings.model_fields:
        assert re.search(
            rf"^\| `HORNBILL_{name.upper()}` \|.*\| \S.* \|$", reference["command-line.md"], re.MULTILINE
        ), name


def test_exit_codes_mean_the_same_in_the_guide_for_rigs() -> None:
    guide = (ROOT / "docs" / "rigs.md").read_text(encoding="utf-8")
    for code, means in MEANS.items():
        assert f"\n| {int(code)} | {means} |\n" in guide


def test_every_type_of_a_body_or_answer_is_told_with_its_fields(reference: dict[str, str]) -> None:
    document = json.loads(documents(Catalog.load())["openapi.json"])
    page = reference["api/types.md"]
    for name, shape in document["components"]["schemas"].items():
        if shape.get("properties") and not name.endswith(("Value", "Message")):
            _, _, told = page.partition(f"\n## {name}\n")
            told = told.partition("\n## ")[0]
            assert all(f"| `{field}`" in told for field in shape["properties"]), name
    assert "{shape" not in "".join(reference.values())
    assert "](types.md#burstsent)" in reference["api/motion.md"]


def test_every_open_question_of_the_simulator_is_on_the_checklist() -> None:
    page = (ROOT / "docs" / "explanation" / "hardware.md").read_text(encoding="utf-8")
    for field in dataclasses.fields(Behaviour):
        assert f"`{field.name}`" in page, f"docs/explanation/hardware.md does not say who can tell {field.name}"


def test_the_guide_to_simulated_servos_lists_every_switch_with_its_default() -> None:
    page = (ROOT / "docs" / "how-to" / "simulate.md").read_text(encoding="utf-8")
    listed = {
        name: values.partition(",")[0].strip("`")
        for name, values in re.findall(r"^\| `(\w+)` \| ([^|]+) \|", page, re.MULTILINE)
    }
    defaults = {field.name: str(field.default).replace("True", "true").replace("False", "false") for field in
                dataclasses.fields(Behaviour)}  # fmt: skip
    assert listed == defaults


def test_what_the_checklist_says_a_probe_answers_it_does() -> None:
    page = (ROOT / "docs" / "explanation" / "hardware.md").read_text(encoding="utf-8")
    source = "".join(file.read_text(encoding="utf-8") for file in (PACKAGE / "probe").glob("*.py"))
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) == 5 and not cells[2].startswith(("no", "probe", "---")):
            for switch in re.findall(r"`(\w+)`", cells[3]):
                assert f'"{switch}"' in source, f"no answer of the probe decides {switch}"


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_every_public_name_says_what_it_is(file: Path) -> None:
    missing: list[str] = []

    def look(nodes: list[ast.stmt], within: str) -> None:
        for node in nodes:
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) and not node.name.startswith(
                "_"
            ):
                again = any(
                    getattr(one, "attr", getattr(one, "id", "")) in ("setter", "overload", "override")
                    for one in node.decorator_list
                )
                if not ast.get_docstring(node) and not again:
                    missing.append(f"{within}{node.name}, line {node.lineno}")
                if isinstance(node, ast.ClassDef):
                    look(node.body, f"{within}{node.name}.")

    look(ast.parse(file.read_text(encoding="utf-8")).body, "")
    assert missing == [], f"{file.relative_to(PACKAGE)}: no docstring"
