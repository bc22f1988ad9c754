"""The documentation is complete: operations, settings, exit codes, switches of the simulator, public names."""

import ast
import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from contract.document_server import document
from contract.source import tree
from hornbill.app.settings import Settings
from hornbill.cli.failing import MEANS
from hornbill.sim.behaviour import Behaviour
from tools.generate.reference import pages

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "server" / "hornbill"
REFERENCE = ROOT / "docs" / "reference"
WRITTEN = {"file-formats.md", "fidelity.md"}
FILES = [file for file in sorted(PACKAGE.rglob("*.py")) if "migrations" not in file.parts]


@pytest.fixture(scope="module")
def reference() -> dict[str, str]:
    return pages(document())


def test_the_reference_is_up_to_date(reference: dict[str, str]) -> None:
    """That the pages are as generated is checked by test_generated.py."""
    committed = {file.relative_to(REFERENCE).as_posix() for file in REFERENCE.rglob("*.md")}
    assert committed == set(reference) | WRITTEN, "run 'make generate', and remove what it no longer writes"


def test_the_reference_describes_every_operation_command_setting_and_type(
    reference: dict[str, str],
) -> None:
    text = "\n".join(text for path, text in reference.items() if path.startswith("api/"))
    described = set(re.findall(r"^## (GET|PUT|POST|PATCH|DELETE) (\S+)$", text, re.MULTILINE))
    row = re.compile(r"/servos/\{uid\}/parameters/[a-z0-9_]+$")
    for path, operations in document()["paths"].items():
        short = path.removeprefix("/api/v1")
        for method in operations:
            assert (method.upper(), short) in described or row.match(short), f"{method} {path}"
    for command in ("demo", "serve", "probe", "tokens create", "profiles apply", "logs start"):
        assert f"\n### hornbill {command}\n" in reference["command-line.md"]
    for name in Settings.model_fields:
        variable = rf"^\| `HORNBILL_{name.upper()}` \|.*\| \S.* \|$"
        assert re.search(variable, reference["command-line.md"], re.MULTILINE), name
    for name, shape in document()["components"]["schemas"].items():
        if shape.get("properties") and not name.endswith(("Value", "Message")):
            _, _, section = reference["api/types.md"].partition(f"\n## {name}\n")
            section = section.partition("\n## ")[0]
            assert all(f"| `{field}`" in section for field in shape["properties"]), name
    assert "](types.md#burstsent)" in reference["api/motion.md"]


def test_the_guide_for_rigs_lists_the_exit_codes() -> None:
    guide = (ROOT / "docs" / "rigs.md").read_text(encoding="utf-8")
    for code, means in MEANS.items():
        assert f"\n| {int(code)} | {means} |\n" in guide


def test_the_hardware_checklist_contains_every_switch_of_the_simulator() -> None:
    page = (ROOT / "docs" / "explanation" / "hardware.md").read_text(encoding="utf-8")
    for field in dataclasses.fields(Behaviour):
        assert f"`{field.name}`" in page, f"docs/explanation/hardware.md lacks {field.name}"


def test_the_guide_to_simulated_servos_lists_every_switch_with_its_default() -> None:
    page = (ROOT / "docs" / "how-to" / "simulate.md").read_text(encoding="utf-8").partition("## Switches")[2]
    listed = {
        name: values.partition(",")[0].strip("`")
        for name, values in re.findall(r"^\| `(\w+)` \| ([^|]+) \|", page, re.MULTILINE)
    }
    defaults = {
        name: str(default).replace("True", "true").replace("False", "false")
        for name, default in dataclasses.asdict(Behaviour()).items()
    }
    assert listed == defaults


def test_the_probe_decides_the_switches_that_the_checklist_says() -> None:
    page = (ROOT / "docs" / "explanation" / "hardware.md").read_text(encoding="utf-8")
    source = "".join(file.read_text(encoding="utf-8") for file in (PACKAGE / "probe").glob("*.py"))
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) == 5 and not cells[2].startswith(("no", "probe", "---")):
            for switch in re.findall(r"`(\w+)`", cells[3]):
                assert f'"{switch}"' in source, f"the probe does not decide {switch}"


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_every_public_name_has_a_docstring(file: Path) -> None:
    def missing(nodes: list[ast.stmt]) -> Iterator[str]:
        for node in nodes:
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) or node.name.startswith("_"):
                continue
            decorators = {getattr(one, "attr", getattr(one, "id", "")) for one in node.decorator_list}
            if not ast.get_docstring(node) and not decorators & {"setter", "overload", "override"}:
                yield f"{node.name}, line {node.lineno}"
            if isinstance(node, ast.ClassDef):
                yield from missing(node.body)

    assert list(missing(tree(file).body)) == []
