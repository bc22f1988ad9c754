"""Dependencies: declared where imported, bounded, locked by hash, and listed with their licences."""

import ast
import json
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
    "requirements.lock": [*REQUIRED, *EXTRAS["fast"], *EXTRAS["tune"]],
    "requirements-dev.lock": [*REQUIRED, *EXTRAS["fast"], *EXTRAS["tune"], *DEVELOPERS],
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
    "openapi-python-client": "release/test_generated_client.py runs it",
    "pytest-xdist": "make test runs on every core",
    "ruff": "make check",
    "sphinx-copybutton": "blocks of the documentation can be copied",
}
"""Why a package is declared that no file imports."""

LOADED_BY_IT = {"pytest"}
"""It loads the plugin, so it is installed whenever the plugin is used."""
BROUGHT_BY_PYTEST = {"_pytest"}
TESTS_OWN = {
    "behaviour",
    "bench",
    "commands",
    "contract",
    "e2e",
    "links",
    "socketcan",
    "unit",
    "fidelity",
    "hatch_build",
    "tools",
}


installed = cache(packages_distributions)


def called(node: ast.Call) -> str:
    """The last name of the called function."""
    return str(getattr(node.func, "attr", getattr(node.func, "id", "")))


@cache
def imported(folder: Path) -> set[str]:
    """The distributions, by canonical name, that Python files below `folder` import, at any level."""
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


def test_every_imported_package_is_declared() -> None:
    product, tests = imported(ROOT / "server" / "hornbill"), imported(ROOT / "tests")
    assert product - LOADED_BY_IT <= PRODUCT
    assert tests | imported(ROOT / "server") | imported(ROOT / "tools") <= PRODUCT | names(DEVELOPERS)
    assert imported(ROOT / "docs" / "site") <= names(DOCUMENTATION)


def test_every_declared_package_is_used() -> None:
    product = imported(ROOT / "server" / "hornbill")
    everything = product.union(*(imported(ROOT / folder) for folder in ("tests", "server", "tools", "docs/site")))
    assert PRODUCT - product - USED_WITHOUT_IMPORT.keys() == set()
    assert names(DEVELOPERS) - everything - USED_WITHOUT_IMPORT.keys() == set()
    assert USED_WITHOUT_IMPORT.keys() <= PRODUCT | names(DEVELOPERS)
    assert not product & USED_WITHOUT_IMPORT.keys()


def test_every_dependency_has_a_lower_bound() -> None:
    for one in [*REQUIRED, *DEVELOPERS, *(one for those in EXTRAS.values() for one in those)]:
        assert any(part.operator in (">=", "==", "~=") for part in one.specifier), one
        assert one.url is None, one


@pytest.mark.parametrize("lock", LOCKS)
def test_a_python_lock_matches_pyproject_and_has_hashes(lock: str) -> None:
    text = (ROOT / lock).read_text(encoding="utf-8")
    assert "://" not in text, "a lock names no package index"
    pinned: dict[str, list[str]] = {}
    for name, version in re.findall(r"^([\w.-]+)==([^\s\\;]+)", text, re.MULTILINE):
        pinned.setdefault(canonicalize_name(name), []).append(version)
    hashed = re.findall(r"^[\w.-]+==[^\\\n]+\\\n +--hash=sha256:", text, re.MULTILINE)
    assert len(hashed) == sum(map(len, pinned.values())) > 30
    for one in LOCKS[lock]:
        found = pinned.get(canonicalize_name(one.name), [])
        assert found, f"{one.name} is not in {lock}: run 'make lock'"
        assert all(one.specifier.contains(version) for version in found), f"{lock} has {one.name} {found}, not {one}"
    entries = re.split(r"^(?=[\w.-]+==)", text, flags=re.MULTILINE)
    direct = {
        canonicalize_name(entry.partition("==")[0])
        for entry in entries
        if re.search(r"# .*\bhornbill \(pyproject\.toml", entry)
    }
    assert direct == names(LOCKS[lock]), f"{lock} does not match pyproject.toml: run 'make lock'"


def test_the_lock_of_the_page_has_hashes_and_no_address() -> None:
    packages = json.loads((ROOT / "web" / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    assert len(packages) > 20
    for name, package in packages.items():
        assert "resolved" not in package, name
        if name and not package.get("link"):
            assert package["integrity"].startswith("sha512-"), name
    declared = json.loads((ROOT / "web" / "package.json").read_text(encoding="utf-8"))["dependencies"]
    assert sorted(declared) == ["@preact/signals", "preact", "uplot"], "the page has three runtime dependencies"


def test_the_notices_list_every_locked_package() -> None:
    if not (ROOT / "web" / "node_modules" / "preact").is_dir():
        pytest.skip("web/node_modules is not installed: 'make setup' installs it")
    committed = notices.PAGE.read_text(encoding="utf-8")
    assert committed == notices.document(), "THIRD_PARTY.md is out of date: run 'make generate'"


def test_a_package_without_a_licence_is_an_error() -> None:
    with pytest.raises(FileNotFoundError, match="no-such-package"):
        notices._licence("no-such-package")  # pyright: ignore[reportPrivateUsage]
