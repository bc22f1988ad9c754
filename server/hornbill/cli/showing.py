"""What commands print: JSON for programs, tables for people, and a bar while a job runs."""

import json
import sys
import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hornbill.client import answers


def print_json(what: object) -> None:
    """One JSON document."""
    print(json.dumps(what, indent=2, ensure_ascii=False))


def print_table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Columns as wide as what is in them, under a head: the same in a terminal and in a pipe, and never cut."""
    table = [heads, *([cell(one) for one in row] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for row in table:
        print("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


def print_readings(readings: Iterable["answers.Reading"]) -> None:
    """One parameter a line: RAM, ROM, default, and why it has no effect, if it has none."""
    rows = [
        (
            one["key"], _value(one["value"], "inactive"), one["unit"], _value(one["rom"], "not known"),
            _value(one["default"], ""), one["why_not"] or "",
        )
        for one in readings
    ]  # fmt: skip
    print_table(("parameter", "value", "unit", "ROM", "default", "note"), rows)


def print_changes(changes: Iterable["answers.Change"]) -> None:
    """What was, what is, and what became of it."""
    rows = [
        (
            one["key"], f"{_value(one['before'], '?')} → {_value(_outcome(one), '?')}", one["verdict"],
        )
        for one in changes
    ]  # fmt: skip
    print_table(("parameter", "change", "verdict"), rows)


def print_job(job: "answers.Job") -> None:
    """Every step of a job with its evidence."""
    for step in job["steps"]:
        print(f"{step['state']:<8} {step['text']}: {step['evidence'] or ''}")


@contextmanager
def progress() -> "Generator[Callable[[answers.Job], None]]":
    """What to call with a job whenever it was looked at: a bar on standard error, where that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _job: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        bar = bars.add_task("", total=1.0)

        def show(job: "answers.Job") -> None:
            bars.update(bar, completed=job["progress"], description=(job["step"] or job["kind"]).replace("[", r"\["))

        yield show


def shown(value: object) -> str:
    """A value of a parameter as people write it."""
    return _value(value, "inactive")


def instant(at: float | None) -> str:
    """An instant in seconds since 1970 UTC, in the time of this machine."""
    return "never" if at is None else time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(at))


def cell(value: object) -> str:
    """Text for a terminal: what a servo or a person called it may hold signs that a terminal obeys."""
    return "–" if value is None else "".join(sign if sign.isprintable() else "·" for sign in str(value))


def _outcome(change: "answers.Change") -> Any:
    return change["requested"] if change["verdict"] == "planned" else change["after"]


def _value(value: Any, unknown: str) -> str:
    if value is None:
        return unknown
    return str(value).lower() if isinstance(value, bool) else str(value)


def show_rom(
    changes: Iterable[Mapping[str, Any]], unknown: Sequence[str], restart: Mapping[str, Any] | None, *, indent: str = ""
) -> None:
    """What a save would put into ROM, and what it does to the horn."""
    for one in changes:
        before = "?" if one["before"] is None else shown(one["before"])
        print(f"{indent}ROM: {one['key']} {before} → {shown(one['after'])}")
    if unknown:
        print(f"{indent}ROM not known, saved as it is in RAM: {', '.join(unknown)}")
    if restart is not None:
        for line in (restart["text"], *restart["warnings"]):
            print(f"{indent}{line}")
