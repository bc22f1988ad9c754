"""Printable form of a report: one HTML page without scripts or links."""

from functools import cache
from typing import TYPE_CHECKING

from hornbill.schema.catalog import Catalog
from hornbill.schema.scale import Value, with_unit
from hornbill.servo.configuration.record import when
from hornbill.servo.runs.report import Report, took
from hornbill.servo.runtime.steps import Step

if TYPE_CHECKING:
    from jinja2 import Environment

VERDICTS = {"waiting": "Not finished", "done": "Done", "failed": "Failed", "not_tried": "Not tried"}
_SIGNS = {"done": "✓", "failed": "✕", "waiting": "…", "not_tried": "–", "skipped": "–", "running": "…"}


def as_html(report: Report, catalog: Catalog) -> str:
    """Printable report: a table of all servos, then one page per servo."""

    def label(key: str) -> str:
        row = catalog.parameters.get(key)
        return key if row is None else row.label

    page = _pages().get_template("report.html")
    return page.render(report=report, label=label, signs=_SIGNS, summary=_summary(report), verdicts=VERDICTS)


def _summary(report: Report) -> str:
    counts = [f"{number} {word.lower()}" for verdict, word in VERDICTS.items() if (number := report.count(verdict))]
    began, ended = when(report.created_at), when(report.ended_at)
    span = f"{began} to {ended}" if ended else f"since {began}, {report.state}"
    noun = "servo" if len(report.targets) == 1 else "servos"
    servos = f"{len(report.targets)} {noun}: {', '.join(counts)} · " if report.targets else ""
    return f"{servos}{span} · job {report.job_id}"


def _took(step: Step) -> str:
    seconds = took(step)
    return "" if seconds is None else f"{seconds:.2f} s"


def _seconds(seconds: float | None) -> str:
    return "" if seconds is None else f"{seconds:.3f} s"


def _value_text(value: Value, unit: str) -> str:
    if isinstance(value, bool):
        return "On" if value else "Off"
    shown = "inactive" if value is None else str(value)
    return with_unit(shown.replace("-", "−"), unit) if isinstance(value, int | float) else shown


def _none_is_empty(value: object) -> object:
    return "" if value is None else value


@cache
def _pages() -> "Environment":
    from jinja2 import Environment, PackageLoader  # late: few servers print a report

    pages = Environment(
        loader=PackageLoader("hornbill.api.reports", ""), autoescape=True, trim_blocks=True, finalize=_none_is_empty
    )
    pages.filters |= {"took": _took, "value_text": _value_text, "when": when, "seconds": _seconds}
    return pages
