"""What pyproject.toml declares is what the source imports, bounded and locked; and the notices name all of it."""

import ast
import re
import sys
import tomllib
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from contract.source import nodes
from tools import notices

ROOT = Path(__file__).parents[2]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
REQUIRED = [Requirement(one) for one in PROJECT["project"]["dependencies"]]
EXTRAS = {
    name: [Requirement(one) for one in those] for name, those in PROJECT["project"]["optional-dependencies"].items()
}
GROUPS = PROJECT["dependency-groups"]
DOCUMENTATION = [Requirement(one) for one in GROUPS["docs"]]
DEVELOPERS = [*DOCUMENTATION, *(Requirement(one) for one in GROUPS["dev"] if isinstance(one, str))]
LOCKS = {
    "requirements.lock": [*REQUIRED, *EXTRAS["fast"]],
    "requirements-dev.lock": [*REQUIRED, *EXTRAS["fast"], *DEVELOPERS],
    "requirements-docs.lock": DOCUMENTATION,
}

USED_WITHOUT_IMPORT = {
    "httptools": "uvicorn reads HTTP with it where it is installed",
    "msgpack": "python-can packs frames of udp_multicast with it",
    "psycopg": "SQLAlchemy opens PostgreSQL with it, by the scheme of the URL",
    "build": "make build",
    "furo": "the theme that docs/site/conf.py names",
    "hatchling": "the wheel is made by it; contract/test_wheel.py runs it",
    "import-linter": "make check",
    "myst-parser": "Sphinx reads Markdown with it",
    "mutmut": "tests/mutation runs it",
    "openapi-python-client": "commands/test_generated_client.py runs it",
    "pytest-xdist": "make test runs on every core",
    "ruff": "make check",
    "sphinx-copybutton": "blocks of the documentation can be copied",
}
"""Why something is declared that nothing imports."""

LOADED_BY_IT = {"pytest"}
"""What loads a part of us, and is there whenever that part is."""
BROUGHT_BY_PYTEST = {"_pytest"}
TESTS_OWN = {
    "behaviour",
    "bench",
    "commands",
    "contract",
    "e2e",
    "socketcan",
    "unit",
    "fidelity",
    "hatch_build",
    "tools",
}


installed = cache(packages_distributions)


def called(node: ast.Call) -> str:
    """The last name of what is called."""
    return str(getattr(node.func, "attr", getattr(node.func, "id", "")))


@cache
def imported(folder: Path) -> set[str]:
    """The distributions, by canonical name, that Python files below `folder` import, wherever in them."""
    tops: set[str] = set()
    for path in folder.rglob("*.py"):
        for node in nodes(path):
            if isinstance(node, ast.Import):
                tops |= {one.name.partition(".")[0] for one in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                tops.add(node.module.partition(".")[0])
            elif isinstance(node, ast.Call) and called(node).endswith(("import_module", "importorskip")):
                tops |= {str(one.value).partition(".")[0] for one in node.args if isinstance(one, ast.Constant)}
    local = {path.stem for path in folder.rglob("*") if path.suffix == ".py" or path.is_dir()}
    known = installed()
    tops -= {*sys.stdlib_module_names, *BROUGHT_BY_PYTEST, *TESTS_OWN, "hornbill", *(local - known.keys())}
    return {canonicalize_name(known.get(top, [top])[0]) for top in tops}


def names(requirements: list[Requirement]) -> set[str]:
    return {canonicalize_name(one.name) for one in requirements}


PRODUCT = names(REQUIRED + [one for those in EXTRAS.values() for one in those])


def test_everything_the_product_imports_is_declared() -> None:
    assert imported(ROOT / "server" / "hornbill") - LOADED_BY_IT <= PRODUCT


def test_everything_that_tests_import_is_declared() -> None:
    used = imported(ROOT / "tests") | imported(ROOT / "server") | imported(ROOT / "tools")
    assert used <= PRODUCT | names(DEVELOPERS)


def test_everything_that_builds_the_documentation_is_declared() -> None:
    assert imported(ROOT / "docs" / "site") <= names(DOCUMENTATION)


def test_nothing_declared_for_the_product_is_unused() -> None:
    assert PRODUCT - imported(ROOT / "server" / "hornbill") - USED_WITHOUT_IMPORT.keys() == set()


def test_nothing_declared_for_developers_is_unused() -> None:
    folders = ("tests", "server", "tools", "docs/site")
    used = set[str]().union(USED_WITHOUT_IMPORT, *(imported(ROOT / folder) for folder in folders))
    assert names(DEVELOPERS) - used == set()


def test_every_reason_for_an_unimported_dependency_is_still_needed() -> None:
    assert USED_WITHOUT_IMPORT.keys() <= PRODUCT | names(DEVELOPERS)
    assert not imported(ROOT / "server" / "hornbill") & USED_WITHOUT_IMPORT.keys()


@pytest.mark.parametrize("one", [*REQUIRED, *DEVELOPERS, *(one for those in EXTRAS.values() for one in those)], ids=str)
def test_every_dependency_says_from_which_version_on(one: Requirement) -> None:
    assert any(part.operator in (">=", "==", "~=") for part in one.specifier), f"{one} has no lower bound"
    assert one.url is None, f"{one} names a place"


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_holds_what_pyproject_declares_and_in_its_ranges(lock: str) -> None:
    pinned = _pins((ROOT / lock).read_text(encoding="utf-8"))
    for one in LOCKS[lock]:
        found = pinned.get(canonicalize_name(one.name), [])
        assert found, f"{one.name} is declared and not in {lock}: run 'make lock'"
        assert all(one.specifier.contains(version) for version in found), f"{lock} has {one.name} {found}, not {one}"


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_was_made_from_this_pyproject(lock: str) -> None:
    """Whatever it says it holds on behalf of hornbill itself, pyproject.toml declares, and the other way round."""
    entries = re.split(r"^(?=[\w.-]+==)", (ROOT / lock).read_text(encoding="utf-8"), flags=re.MULTILINE)
    whose = {canonicalize_name(entry.partition("==")[0]): entry for entry in entries}
    ours = {name for name, entry in whose.items() if re.search(r"# .*\bhornbill \(pyproject\.toml", entry)}
    assert ours == names(LOCKS[lock]), f"{lock} does not match pyproject.toml: run 'make lock'"


def test_the_notices_name_what_is_locked_and_what_the_page_holds() -> None:
    if not (ROOT / "web" / "node_modules" / "preact").is_dir():
        pytest.skip("web/node_modules is not installed: 'make setup' installs it")
    committed = notices.PAGE.read_text(encoding="utf-8")
    assert committed == notices.document(), "THIRD_PARTY.md is out of date: run 'make generate'"


def test_a_package_without_a_licence_is_not_passed_over() -> None:
    with pytest.raises(FileNotFoundError, match="no-such-package"):
        notices._licence("no-such-package")  # pyright: ignore[reportPrivateUsage]


def _pins(text: str) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name, version in re.findall(r"^([\w.-]+)==([^\s\\;]+)", text, re.MULTILINE):
        found.setdefault(canonicalize_name(name), []).append(version)
    return found
