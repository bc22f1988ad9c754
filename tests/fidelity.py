"""docs/reference/fidelity.md: what the simulated servo does, row by row, and the tests that prove it.

`python tests/fidelity.py` writes it from fidelity.toml beside it, from the markers `states` and `switch` of the
tests, which are read as source, and from the switches of hornbill.sim.behaviour.
"""

import ast
import tomllib
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast, get_args, get_type_hints

from pydantic.fields import FieldInfo

from hornbill.sim.behaviour import Behaviour

TESTS = Path(__file__).parent
ROOT = TESTS.parent
TABLE = ROOT / "docs" / "reference" / "fidelity.toml"
PAGE = TABLE.with_suffix(".md")

_HEAD = """\
<!-- Written by `make generate` from fidelity.toml, the tests and hornbill/sim/behaviour.py. Do not edit. -->

# What the simulated servo does, and which test says so

Every statement of the servo's specification that concerns the servo itself, in our own words, with the tests that
prove it on the simulated one. *open* says what is not simulated, or what the document does not tell; a switch is
named where a row has two readings. {rows} rows, {tests} tests, {open} with something open.
"""
_QUESTIONS = """
## Questions only a servo can answer

Where the document is silent the simulator has a switch, and the host is tested with every setting.

| question | switch |
| --- | --- |
"""
_SWITCHES = """
## The switches

Set them in a recipe, or at any time with `PATCH /api/v1/sim/servos/{uid}` and `{"behaviour": {…}}`.

| switch | settings | why the default is what it is | tests |
| --- | --- | --- | --- |
"""


@dataclass(frozen=True)
class Proof:
    """One test function, or a whole module by its `pytestmark`, and what its markers name."""

    path: Path
    name: str
    states: tuple[str, ...]
    switches: tuple[str, ...]

    @property
    def link(self) -> str:
        """As the page shows it."""
        shown = f"{self.path.name}::{self.name}" if self.name else self.path.name
        return f"[{shown}](../../{self.path.relative_to(ROOT).as_posix()})"


@dataclass(frozen=True)
class Switch:
    """One switch: its settings as source, the default first, and its reason."""

    name: str
    settings: tuple[str, ...]
    reason: str


@dataclass(frozen=True)
class Row:
    """One statement of fidelity.toml."""

    section: str
    statement: str
    open: str = ""


@dataclass(frozen=True)
class Table:
    """fidelity.toml: the rows by number, and the questions with the switches or conditions that stand for them."""

    rows: Mapping[str, Row]
    questions: Mapping[str, Sequence[str]] = field(default_factory=dict[str, Sequence[str]])


def table(path: Path = TABLE) -> Table:
    """The table as it is written. Raises TypeError for a key no row has."""
    read = tomllib.loads(path.read_text(encoding="utf-8"))
    questions = {each["text"]: each["switches"] for each in read.pop("question", [])}
    return Table({number: Row(**row) for number, row in read.items()}, questions)


def proofs(folder: Path = TESTS) -> list[Proof]:
    """Every test with a marker, by file and place in it."""
    return [proof for path in sorted(folder.rglob("test_*.py")) for proof in _marked(path)]


def switches() -> list[Switch]:
    """The fields of Behaviour, with the description of each."""
    annotations = get_type_hints(Behaviour)
    fields = cast("dict[str, FieldInfo]", vars(Behaviour)["__pydantic_fields__"])
    return [_switch(name, annotations[name], one) for name, one in fields.items()]


def _switch(name: str, annotation: Any, of: FieldInfo) -> Switch:
    settings = sorted(get_args(annotation) or (True, False), key=lambda setting: setting != of.default)
    return Switch(name, tuple(str(each).lower() for each in settings), of.description or "")


def page(shown: Table, marked: Sequence[Proof], known: Sequence[Switch]) -> str:
    """The whole page."""
    by_row: dict[str, list[Proof]] = defaultdict(list)
    by_switch: dict[str, list[Proof]] = defaultdict(list)
    for proof in marked:
        for number in proof.states:
            by_row[number].append(proof)
        for name in proof.switches:
            by_switch[name].append(proof)
    lines = ["", "| row | section | what the servo does | tests | switches |", "| --- | --- | --- | --- | --- |"]
    for number, row in shown.rows.items():
        told = [proof.link for proof in by_row[number]] + ([f"*open:* {row.open}"] if row.open else [])
        named = dict.fromkeys(name for proof in by_row[number] for name in proof.switches)
        lines.append(_line(number, row.section, row.statement, "<br>".join(told), ", ".join(map(_code, named))))
    head = _HEAD.format(
        rows=len(shown.rows),
        tests=len(marked),
        open=sum(bool(row.open) for row in shown.rows.values()),
    )
    asked = [_line(text, ", ".join(map(_code, names))) for text, names in shown.questions.items()]
    thrown = [
        _line(
            _code(switch.name),
            ", ".join(f"**{each}**" if not n else each for n, each in enumerate(switch.settings)),
            switch.reason,
            "<br>".join(proof.link for proof in by_switch[switch.name]),
        )
        for switch in known
    ]
    return head + "\n".join(lines) + "\n" + _QUESTIONS + "\n".join(asked) + "\n" + _SWITCHES + "\n".join(thrown) + "\n"


def _marked(path: Path) -> Iterator[Proof]:
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            name, marks = node.name, node.decorator_list
        elif isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "pytestmark":
            name, marks = "", node.value.elts if isinstance(node.value, ast.List) else [node.value]
        else:
            continue
        states, named = _arguments(marks, "states"), _arguments(marks, "switch")
        if states or named:
            yield Proof(path, name, states, named)


def _arguments(marks: Sequence[ast.expr], marker: str) -> tuple[str, ...]:
    calls = [mark for mark in marks if isinstance(mark, ast.Call) and ast.unparse(mark.func) == f"pytest.mark.{marker}"]
    return tuple(ast.literal_eval(argument) for call in calls for argument in call.args)


def _code(name: str) -> str:
    return f"`{name}`"


def _line(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def written() -> str:
    """What the page should be now."""
    return page(table(), proofs(), switches())


if __name__ == "__main__":
    PAGE.write_text(written(), encoding="utf-8")
