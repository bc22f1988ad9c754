"""Mutation tests of critical modules: `python tests/mutation [NAME…]`, or `make mutate`.

Each entry of modules.toml is mutated in a copy of the checkout under build/mutation, and tested with its tests. An
entry with `sample` has slow tests: of its mutants only that many are tested, chosen at random but always the same.
Prints the score of each entry, and the survivors. Exit status 1 if a score is below the floor.
"""

import ast
import json
import os
import shutil
import subprocess
import sys
import tomllib
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Final

ROOT: Final = Path(__file__).parents[2]
WORK: Final = ROOT / "build" / "mutation"
TABLE: Final = Path(__file__).with_name("modules.toml")
FLOOR_PCT: Final = 90
DETECTED: Final = frozenset({1, 3, -24, 24, 36, 152, 255})
"""Exit statuses of the tests of a mutant if one failed, or if they timed out."""
COPIED: Final = ("tests", "schemas", "examples", "docs", "pyproject.toml")


@dataclass(frozen=True)
class Entry:
    """Modules that are mutated together, and their tests."""

    name: str
    modules: tuple[str, ...]
    tests: tuple[str, ...]
    sample: int | None
    """Number of mutants to test. None: all."""


def entries() -> list[Entry]:
    """The table."""
    read = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    return [Entry(name, tuple(row["modules"]), tuple(row["tests"]), row.get("sample")) for name, row in read.items()]


def prepare(entry: Entry) -> Path:
    """A copy of the checkout in mutmut's layout: the package under src/."""
    folder = WORK / entry.name
    shutil.rmtree(folder, ignore_errors=True)
    ignore = shutil.ignore_patterns("__pycache__", "dist", "e2e", "mutation")
    for name in COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=ignore)
        else:
            shutil.copy(source, folder / name)
    shutil.copytree(ROOT / "server" / "hornbill", folder / "src" / "hornbill", ignore=ignore)
    lists = {
        "source_paths": ["src/hornbill"],
        "only_mutate": [f"src/{module}" for module in entry.modules],
        "also_copy": ["schemas", "examples", "docs"],
        "pytest_add_cli_args": ["-p", "no:cacheprovider", "-p", "no:randomly"],
        "pytest_add_cli_args_test_selection": list(entry.tests),
    }
    lines = [f"{key} =\n" + "".join(f"    {each}\n" for each in values) for key, values in lists.items()]
    settings = "timeout_constant = 10.0\nuse_git_change_detection = false\n"
    (folder / "setup.cfg").write_text("[mutmut]\n" + "".join(lines) + settings, encoding="utf-8")
    return folder


class _WithoutTexts(ast.NodeTransformer):
    """Removes texts from a function, and its name."""

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.AST:
        self.generic_visit(node)
        node.values = [each for each in node.values if not isinstance(each, ast.Constant)]
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if isinstance(node.value, str) and " " in node.value:
            node.value = ""
        return node


def _without_texts(function: ast.FunctionDef | ast.AsyncFunctionDef) -> str:
    return "".join(ast.dump(_WithoutTexts().visit(deepcopy(each))) for each in function.body)


def results(folder: Path) -> tuple[dict[str, int | None], int]:
    """Exit status of the tests of each mutant, as mutmut wrote it next to the mutated modules; None if not tested.

    Mutants that change only a text are not in it; their number is the second value.
    """
    codes: dict[str, int | None] = {}
    texts = 0
    for meta in (folder / "mutants").rglob("*.meta"):
        found: dict[str, int | None] = json.loads(meta.read_text(encoding="utf-8")).get("exit_code_by_key", {})
        if not found:
            continue
        tree = ast.parse(meta.with_suffix("").read_text(encoding="utf-8"))
        functions = {
            each.name: each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)
        }
        for name, code in found.items():
            short = name.rpartition(".")[2]
            original = functions[short.rpartition("__mutmut_")[0] + "__mutmut_orig"]
            if _without_texts(functions[short]) == _without_texts(original):
                texts += 1
            else:
                codes[name] = code
    return codes, texts


def mutate(folder: Path, names: list[str]) -> None:
    """Run mutmut for the named mutants, or for all."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    with (folder / "log").open("a", encoding="utf-8") as log:
        command = [sys.executable, "-m", "mutmut", "run", "--max-children", "1", *names]
        subprocess.run(command, cwd=folder, env=environment, stdout=log, stderr=subprocess.STDOUT, check=False)


def main(names: list[str]) -> int:
    """Exit status: 0 if no score is below the floor."""
    known = entries()
    worst = 100.0
    for entry in [each for each in known if not names or each.name in names]:
        folder = prepare(entry)
        chosen: list[str] = []
        if entry.sample is not None:
            mutate(folder, ["none"])  # only makes the mutants
            all_names = sorted(results(folder)[0])
            chosen = Random(0).sample(all_names, min(entry.sample, len(all_names)))
        mutate(folder, chosen)
        codes, texts = results(folder)
        tested = {name: codes[name] for name in chosen or codes}
        survived = sorted(name for name, code in tested.items() if code not in DETECTED)
        if len(survived) == len(tested):
            print(f"{entry.name}: no mutant was tested; see {folder / 'log'}", flush=True)
            return 1
        pct = 100 * (1 - len(survived) / len(tested))
        of = f"{len(tested)} of {len(codes)}" if chosen else f"{len(tested)}"
        print(f"{entry.name}: {pct:.1f} % of {of} mutants detected, {texts} of texts not counted", flush=True)
        print("".join(f"  survived: {name}\n" for name in survived), end="", flush=True)
        worst = min(worst, pct)
    return int(worst < FLOOR_PCT)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
