"""Owns the printable form of a report: one HTML page that needs nothing but itself."""

from collections.abc import Iterable
from html import escape

from hornbill.schema.catalog import Catalog
from hornbill.schema.scale import Value, with_unit
from hornbill.servo.configuration.report import VERDICT_WORDS, Report, Unit, took, when
from hornbill.servo.steps import Step

_SIGNS = {"done": "✓", "failed": "✕", "waiting": "…", "not_tried": "–", "skipped": "–", "running": "…"}

_STYLE = """
:root { color: #14191b; background: #fff; font: 10pt/1.45 system-ui, "Segoe UI", "Liberation Sans", sans-serif }
body { max-width: 190mm; margin: 12mm auto; padding: 0 6mm }
h1 { font-size: 18pt; margin: 0 0 1mm; letter-spacing: -0.01em }
h2 { font-size: 12pt; margin: 0 0 2mm }
h3 { font-size: 9pt; margin: 4mm 0 1mm; color: #434c50; font-weight: 600 }
p { margin: 0 0 2mm }
.quiet { color: #5a6468 }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums }
th { text-align: left; font-weight: 600; color: #434c50; border-bottom: 1px solid #78827f; padding: 1mm 3mm 1mm 0 }
td { border-bottom: 1px solid #d3d8d6; padding: 1mm 3mm 1mm 0; vertical-align: top; overflow-wrap: anywhere }
td.number, th.number { text-align: right }
.number, .short, .done, .failed { white-space: nowrap }
tr { break-inside: avoid }
thead { display: table-header-group }
dl { display: grid; grid-template-columns: max-content 1fr max-content 1fr; gap: 0.5mm 4mm; margin: 0 }
dt { color: #5a6468 }
dd { margin: 0; overflow-wrap: anywhere }
section { margin-top: 9mm; padding-top: 3mm; border-top: 2px solid #14191b }
.values { columns: 2; column-gap: 8mm }
.values div { display: flex; justify-content: space-between; gap: 3mm; break-inside: avoid;
  border-bottom: 1px solid #d3d8d6; padding: 0.6mm 0 }
.values b { font-weight: 400; text-align: right; font-variant-numeric: tabular-nums }
.done { color: #187a3c } .failed { color: #b8261b; font-weight: 600 }
.problem { border-left: 3px solid #b8261b; padding-left: 3mm }
@page { margin: 14mm 12mm }
@media print {
  :root { font-size: 9pt }
  body { margin: 0; padding: 0; max-width: none }
  section { break-before: page; margin-top: 0; border-top: 0 }
  h1, h2, h3 { break-after: avoid }
  .done, .failed { color: inherit }
}
"""


def as_html(report: Report, catalog: Catalog) -> str:
    """The report as a page to print: a table of all servos, then each on a page of its own. No script, no link."""
    title = f"{report.title}, {when(report.ended_at or report.created_at)[:10]}"
    several = len(report.units) != 1
    parts = [
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head><body>",
        f"<h1>{escape(report.title)}</h1>",
        f'<p class="quiet">{escape(_summary(report))}</p>',
    ]
    if report.problem is not None:
        parts.append(f'<p class="problem">{escape(report.problem)}</p>')
    if report.units and several:
        parts.append(_overview(report))
    if report.steps:
        parts += ["<h3>Steps</h3>", _steps_table(report.steps)]
    parts += [_section(unit, catalog) for unit in report.units]
    parts.append("</body></html>\n")
    return "\n".join(parts)


def _summary(report: Report) -> str:
    counts = [f"{report.count(verdict)} {word.lower()}" for verdict, word in VERDICT_WORDS.items()]
    told = ", ".join(one for one in counts if not one.startswith("0 "))
    began, ended = when(report.created_at), when(report.ended_at)
    span = f"{began} to {ended}" if ended else f"since {began}, {report.state}"
    noun = "servo" if len(report.units) == 1 else "servos"
    servos = f"{len(report.units)} {noun}: {told} · " if report.units else ""
    return f"{servos}{span} · job {report.job_id}"


def _overview(report: Report) -> str:
    head = "Serial", "Label", "Model", "Firmware", "Servo ID", "Node ID", "Verdict"
    rows = [
        [
            _short(s.serial), _text(s.label), _short(s.model), _text(s.firmware), _text(s.servo_id), _text(s.node_id),
            _verdict(s.verdict),
        ]
        for s in (unit.sheet for unit in report.units)
    ]  # fmt: skip
    return _table(head, rows, numbers=(4, 5))


def _section(unit: Unit, catalog: Catalog) -> str:
    sheet = unit.sheet
    took_s = "" if sheet.duration_s is None else f"{sheet.duration_s:.1f} s"
    profile = _text(sheet.profile)
    if sheet.profile_revision:
        profile += f' <small class="quiet">{escape(sheet.profile_revision)}</small>'
    facts = [
        ("Verdict", _verdict(sheet.verdict)), ("When", _text(when(sheet.ended_at))),
        ("Serial", _text(sheet.serial)), ("Label", _text(sheet.label)),
        ("Model", _text(sheet.model)), ("Firmware", _text(sheet.firmware)),
        ("Hardware version", _text(sheet.hardware_version)), ("Produced", _text(sheet.production_date)),
        ("Servo ID", _text(sheet.servo_id)), ("Node ID", _text(sheet.node_id)),
        ("Profile", profile), ("By", _text(sheet.by)),
        ("Unique ID", _text(sheet.uid)), ("Took", _text(took_s)),
    ]  # fmt: skip
    told = "".join(f"<dt>{escape(name)}</dt><dd>{value}</dd>" for name, value in facts)
    parts = ["<section>", f"<h2>{escape(sheet.title or sheet.label or sheet.serial or sheet.uid)}</h2>"]
    if sheet.problem:
        parts.append(f'<p class="problem">{escape(sheet.problem)}</p>')
    parts.append(f"<dl>{told}</dl>")
    if sheet.values:
        where = {"rom": "read back from ROM after the restart", "ram": "in RAM only: lost at the next restart"}
        parts.append(f"<h3>Values, {where.get(sheet.held_in, 'as written')}</h3>")
        lines = [f"<div><span>{_label(key, catalog)}</span><b>{_value(unit, key)}</b></div>" for key in sheet.values]
        parts.append(f'<div class="values">{"".join(lines)}</div>')
    if unit.steps:
        parts += ["<h3>Steps</h3>", _steps_table(unit.steps)]
    parts.append("</section>")
    return "\n".join(parts)


def _steps_table(steps: Iterable[Step]) -> str:
    rows: list[list[str]] = []
    for step in steps:
        seconds = took(step)
        state = f'<span class="{escape(step.state)}">{_SIGNS.get(step.state, "")} {escape(step.state)}</span>'
        rows.append([_text(step.text), state, _text(step.evidence), "" if seconds is None else f"{seconds:.2f} s"])
    return _table(("Step", "State", "Evidence", "Took"), rows, numbers=(3,))


def _table(head: Iterable[str], rows: Iterable[Iterable[str]], numbers: tuple[int, ...] = ()) -> str:
    """`rows` are HTML already; `numbers` are the columns set flush right."""

    def style(index: int) -> str:
        return ' class="number"' if index in numbers else ""

    top = "".join(f"<th{style(index)}>{escape(name)}</th>" for index, name in enumerate(head))
    body = "\n".join(
        "<tr>" + "".join(f"<td{style(index)}>{cell}</td>" for index, cell in enumerate(row)) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>\n{body}\n</tbody></table>"


def _verdict(verdict: str) -> str:
    word = VERDICT_WORDS.get(verdict, verdict)
    return f'<span class="{escape(verdict)}">{_SIGNS.get(verdict, "")} {escape(word)}</span>'


def _label(key: str, catalog: Catalog) -> str:
    row = catalog.parameters.get(key)
    return escape(key if row is None else row.label)


def _value(unit: Unit, key: str) -> str:
    value: Value = unit.sheet.values[key]
    if isinstance(value, bool):
        return "On" if value else "Off"
    shown = "inactive" if value is None else str(value)
    if isinstance(value, int | float):
        shown = with_unit(shown.replace("-", "−"), unit.sheet.units.get(key, ""))
    return escape(shown)


def _short(value: object) -> str:
    return f'<span class="short">{_text(value)}</span>'


def _text(value: object) -> str:
    return "" if value is None else escape(str(value))
