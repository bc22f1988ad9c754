"""Owns the forms of a report for programs: CSV with one row a servo, JSON, and JUnit XML for test systems."""

import csv
import io
import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value
from hornbill.servo.configuration.report import Report, Unit, took, when
from hornbill.servo.steps import Step

FACTS = (
    "serial", "model", "firmware", "hardware_version", "production_date", "uid", "label", "servo_id", "node_id",
    "profile", "profile_revision", "by",
)  # fmt: skip
"""Columns of the CSV before those of the values, by the names of the sheet."""

_FORMULA = ("=", "+", "-", "@")
_NO_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters XML 1.0 has no way to write."""


def as_csv(report: Report, catalog: Catalog) -> str:
    """One row a servo; the columns are the same for every report of the same tables.

    A text that a spreadsheet would take for a formula (it starts with = + - @) has a ' before it.
    """
    rows = [row for row in catalog.parameters.values() if row.rom and row.key != "servo_id"]
    out = io.StringIO()
    writer = csv.writer(out)
    names = [*("job", "kind", "when"), *FACTS, *("verdict", "problem", "duration_s", "held_in", "steps")]
    writer.writerow([*names, *(_column(row) for row in rows)])
    for unit in report.units:
        sheet = unit.sheet
        head = report.job_id, report.kind, when(sheet.ended_at or report.ended_at or report.created_at)
        facts = [getattr(sheet, name) for name in FACTS]
        steps = "; ".join(f"{step.text}: {step.state}" for step in unit.steps)
        tail = sheet.verdict, sheet.problem, _seconds(sheet.duration_s), sheet.held_in, steps
        values = [sheet.values.get(row.key) for row in rows]
        writer.writerow([cell(one) for one in (*head, *facts, *tail, *values)])
    return out.getvalue()


def cell(value: object) -> str | int | float:
    """A value as a cell of a CSV file; a text no spreadsheet will run."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return value
    text = str(value).encode(errors="replace").decode().replace("\0", "")
    starts = text.lstrip()[:1] in _FORMULA or text[:1] in ("\t", "\r")
    return f"'{text}" if text and starts else text


def as_json(report: Report) -> str:
    """Everything, with the unit beside every value; instants as ISO 8601."""
    document = {
        "title": report.title,
        "job": report.job_id,
        "kind": report.kind,
        "state": report.state,
        "created_at": when(report.created_at),
        "ended_at": when(report.ended_at) or None,
        "problem": report.problem,
        "servos": [_unit(unit) for unit in report.units],
        "steps": [_step(step) for step in report.steps],
    }
    return json.dumps(document, indent=2) + "\n"


def as_junit(report: Report) -> str:
    """A test suite a servo, a test case a step; times in seconds. Steps not reached are skipped, a servo that failed
    without a failed step has a case of its own.
    """
    root = ET.Element("testsuites", name=_xml(report.title))
    totals = [_suite(root, report, unit) for unit in report.units]
    if report.steps or not report.units:
        totals.append(_job_suite(root, report))
    for index, name in enumerate(("tests", "failures", "skipped")):
        root.set(name, str(sum(one[index] for one in totals)))
    root.set("errors", "0")
    root.set("time", f"{sum(float(suite.get('time', '0')) for suite in root):.3f}")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=False).join(
        ('<?xml version="1.0" encoding="UTF-8"?>\n', "\n")
    )


def _suite(root: ET.Element, report: Report, unit: Unit) -> tuple[int, int, int]:
    sheet = unit.sheet
    name = sheet.label or sheet.serial or sheet.uid
    suite = ET.SubElement(
        root, "testsuite", name=_xml(name), timestamp=when(sheet.started_at or report.created_at).rstrip("Z")
    )
    properties = ET.SubElement(suite, "properties")
    for fact in (*FACTS, "verdict", "held_in"):
        value = getattr(sheet, fact)
        if value not in (None, ""):
            ET.SubElement(properties, "property", name=fact, value=_xml(str(value)))
    for key, value in sheet.values.items():
        shown = " ".join(filter(None, (_text(value), sheet.units.get(key))))
        ET.SubElement(properties, "property", name=key, value=_xml(shown))
    classname = f"hornbill.{report.kind}.{sheet.serial or sheet.uid}"
    told = any(step.state == "failed" for step in unit.steps)
    counts = _cases(suite, classname, unit.steps, sheet.problem)
    if sheet.verdict == "failed" and not told:
        case = ET.SubElement(suite, "testcase", classname=classname, name="verdict", time="0.000")
        _failure(case, sheet.problem or "failed")
        counts = counts[0] + 1, counts[1] + 1, counts[2]
    return _total(suite, counts)


def _job_suite(root: ET.Element, report: Report) -> tuple[int, int, int]:
    """The steps that are about no one servo, and the job itself."""
    suite = ET.SubElement(root, "testsuite", name=_xml(report.title), timestamp=when(report.created_at).rstrip("Z"))
    classname = f"hornbill.{report.kind}"
    tests, failures, skipped = _cases(suite, classname, report.steps, report.problem)
    if not report.steps:
        case = ET.SubElement(suite, "testcase", classname=classname, name="job", time="0.000")
        tests += 1
        if report.state in ("failed", "cancelled"):
            _failure(case, report.problem or report.state)
            failures += 1
        elif report.state != "succeeded":
            ET.SubElement(case, "skipped", message=report.state)
            skipped += 1
    return _total(suite, (tests, failures, skipped))


def _cases(suite: ET.Element, classname: str, steps: Sequence[Step], problem: str | None) -> tuple[int, int, int]:
    failures = skipped = 0
    for step in steps:
        case = ET.SubElement(
            suite, "testcase", classname=_xml(classname), name=_xml(step.text), time=f"{took(step) or 0.0:.3f}"
        )
        if step.state == "failed":
            _failure(case, step.evidence or problem or "failed")
            failures += 1
        elif step.state != "done":
            ET.SubElement(case, "skipped", message=_xml(step.evidence or f"not done: {step.state}"))
            skipped += 1
        elif step.evidence:
            ET.SubElement(case, "system-out").text = _xml(step.evidence)
    return len(steps), failures, skipped


def _total(suite: ET.Element, counts: tuple[int, int, int]) -> tuple[int, int, int]:
    for name, count in zip(("tests", "failures", "skipped"), counts, strict=True):
        suite.set(name, str(count))
    suite.set("errors", "0")
    suite.set("time", f"{sum(float(case.get('time', '0')) for case in suite.iter('testcase')):.3f}")
    return counts


def _failure(case: ET.Element, text: str) -> None:
    ET.SubElement(case, "failure", message=_xml(text)).text = _xml(text)


def _xml(text: str) -> str:
    return _NO_XML.sub("\ufffd", text)


def _text(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)


def _column(row: Parameter) -> str:
    """The column of a value. Servo id and node id are among the facts: the node id the servo is on, whereas that of
    0x46 is the fixed one, or 0.
    """
    key = "fixed_node_id" if row.key == "node_id" else row.key
    units = " or ".join(filter(None, (row.unit, row.unit_when.unit if row.unit_when else "")))
    return f"{key} [{units}]" if units else key


def _seconds(duration: float | None) -> float | None:
    return None if duration is None else round(duration, 3)


def _unit(unit: Unit) -> dict[str, object]:
    sheet = unit.sheet
    return {
        **{name: getattr(sheet, name) for name in FACTS},
        "verdict": sheet.verdict,
        "problem": sheet.problem,
        "started_at": when(sheet.started_at) or None,
        "ended_at": when(sheet.ended_at) or None,
        "duration_s": _seconds(sheet.duration_s),
        "held_in": sheet.held_in or None,
        "values": {key: {"value": value, "unit": sheet.units.get(key, "")} for key, value in sheet.values.items()},
        "steps": [_step(step) for step in unit.steps],
    }


def _step(step: Step) -> dict[str, object]:
    return {
        "name": step.name, "text": step.text, "state": step.state, "evidence": step.evidence,
        "started_at": when(step.started_at) or None, "duration_s": _seconds(took(step)),
    }  # fmt: skip
