"""Output of commands: JSON for programs, tables for people, and a progress bar."""

import json
import sys
import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hornbill.client import responses


def print_json(what: object) -> None:
    """Print a JSON document."""
    print(json.dumps(what, indent=2, ensure_ascii=False))


def print_table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a table with a header. Columns are as wide as their content, never truncated, also in a pipe."""
    table = [heads, *([cell(one) for one in row] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for row in table:
        print("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


def print_readings(readings: Iterable["responses.Reading"]) -> None:
    """Print one parameter per line: RAM, ROM, default, and the reason if it has no effect."""
    rows = [
        (
            one["key"], _value(one["value"], "inactive"), one["unit"], _value(one["rom"], "unknown"),
            _value(one["default"], ""), one["why_not"] or "",
        )
        for one in readings
    ]  # fmt: skip
    print_table(("parameter", "value", "unit", "ROM", "default", "note"), rows)


def print_changes(changes: Iterable["responses.Change"]) -> None:
    """Print changes with old value, new value and result."""
    rows = [
        (
            one["key"], f"{_value(one['before'], '?')} → {_value(_outcome(one), '?')}", one["verdict"],
        )
        for one in changes
    ]  # fmt: skip
    print_table(("parameter", "change", "result"), rows)


def print_job(job: "responses.Job") -> None:
    """Print the steps of a job with their evidence."""
    for step in job["steps"]:
        print(f"{step['state']:<8} {step['text']}: {step['evidence'] or ''}")


@contextmanager
def progress() -> "Generator[Callable[[responses.Job], None]]":
    """Progress bar on standard error, if that is a terminal. Call the yielded function with every update of the job."""
    if not sys.stderr.isatty():
        yield lambda _job: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        bar = bars.add_task("", total=1.0)

        def show(job: "responses.Job") -> None:
            bars.update(bar, completed=job["progress"], description=(job["step"] or job["kind"]).replace("[", r"\["))

        yield show


def shown(value: object) -> str:
    """Value of a parameter as text."""
    return _value(value, "inactive")


def instant(at: float | None) -> str:
    """Time in seconds since 1970 UTC as local time."""
    return "never" if at is None else time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(at))


def cell(value: object) -> str:
    """Text for a terminal, without control characters: names may contain them."""
    return "–" if value is None else "".join(char if char.isprintable() else "·" for char in str(value))


def _outcome(change: "responses.Change") -> Any:
    return change["requested"] if change["verdict"] == "planned" else change["after"]


def _value(value: Any, unknown: str) -> str:
    if value is None:
        return unknown
    return str(value).lower() if isinstance(value, bool) else str(value)


def show_rom(
    changes: Iterable[Mapping[str, Any]], unknown: Sequence[str], restart: Mapping[str, Any] | None, *, indent: str = ""
) -> None:
    """Print the ROM changes of a save and its effect on the horn."""
    for one in changes:
        before = "?" if one["before"] is None else shown(one["before"])
        print(f"{indent}ROM: {one['key']} {before} → {shown(one['after'])}")
    if unknown:
        print(f"{indent}ROM value unknown, saved unchanged from RAM: {', '.join(unknown)}")
    if restart is not None:
        for line in (restart["text"], *restart["warnings"]):
            print(f"{indent}{line}")
