"""JUnit XML form of a report, for test systems.

ElementTree and no JUnit library: one would replace only the dozen lines that make elements.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from hornbill.api.reports.data_forms import FACTS
from hornbill.schema.scale import Value
from hornbill.servo.configuration.record import when
from hornbill.servo.runs.report import Report, ReportTarget, took
from hornbill.servo.runtime.steps import Step

_NO_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot represent."""


def as_junit(report: Report) -> str:
    """One test suite per servo, one test case per step; times in seconds. Steps not reached are skipped. A servo that
    failed without a failed step has an additional test case.
    """
    root = ET.Element("testsuites", name=_xml(report.title))
    for target in report.targets:
        _servo_suite(root, report, target)
    if report.steps or not report.targets:
        _job_suite(root, report)
    for element in (*root, root):
        for name, tag in (("tests", "testcase"), ("failures", "failure"), ("skipped", "skipped")):
            element.set(name, str(sum(1 for _ in element.iter(tag))))
        element.set("errors", "0")
        element.set("time", f"{sum(float(case.get('time', '0')) for case in element.iter('testcase')):.3f}")
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _servo_suite(root: ET.Element, report: Report, target: ReportTarget) -> None:
    record = target.record
    suite = _suite(root, record.label or record.serial or record.uid, record.started_at or report.created_at)
    properties = ET.SubElement(suite, "properties")
    for fact in (*FACTS, "verdict", "verified_in"):
        value = getattr(record, fact)
        if value not in (None, ""):
            ET.SubElement(properties, "property", name=fact, value=_xml(str(value)))
    for key, value in record.values.items():
        shown = " ".join(filter(None, (_text(value), record.units.get(key))))
        ET.SubElement(properties, "property", name=key, value=_xml(shown))
    for name, extreme in target.plan.measured.items():
        ET.SubElement(properties, "property", name=name, value=f"{extreme:g}")
    classname = f"hornbill.{report.kind}.{record.serial or record.uid}"
    _steps(suite, classname, target.steps, record.problem_text)
    if record.verdict == "failed" and all(step.state != "failed" for step in target.steps):
        _case(suite, classname, "verdict", failure=record.problem_text or "failed")


def _job_suite(root: ET.Element, report: Report) -> None:
    """Steps that belong to no servo, or the job itself if it has no steps."""
    suite = _suite(root, report.title, report.created_at)
    classname = f"hornbill.{report.kind}"
    _steps(suite, classname, report.steps, report.problem)
    if not report.steps:
        failed, waits = report.state in ("failed", "cancelled"), report.state != "succeeded"
        failure = (report.problem or report.state) if failed else None
        _case(suite, classname, "job", failure=failure, skipped=report.state if waits and not failed else None)


def _suite(root: ET.Element, name: str, began: float) -> ET.Element:
    return ET.SubElement(root, "testsuite", name=_xml(name), timestamp=when(began).rstrip("Z"))


def _steps(suite: ET.Element, classname: str, steps: Sequence[Step], problem: str | None) -> None:
    for step in steps:
        failed, done = step.state == "failed", step.state == "done"
        _case(
            suite, classname, step.text, took(step) or 0.0,
            failure=(step.evidence or problem or "failed") if failed else None,
            skipped=None if failed or done else step.evidence or f"not done: {step.state}",
            evidence=step.evidence if done else None,
        )  # fmt: skip


def _case(
    suite: ET.Element,
    classname: str,
    name: str,
    seconds: float = 0.0,
    *,
    failure: str | None = None,
    skipped: str | None = None,
    evidence: str | None = None,
) -> None:
    case = ET.SubElement(suite, "testcase", classname=_xml(classname), name=_xml(name), time=f"{seconds:.3f}")
    if failure is not None:
        ET.SubElement(case, "failure", message=_xml(failure)).text = _xml(failure)
    if skipped is not None:
        ET.SubElement(case, "skipped", message=_xml(skipped))
    if evidence:
        ET.SubElement(case, "system-out").text = _xml(evidence)


def _xml(text: str) -> str:
    return _NO_XML.sub("\ufffd", text)


def _text(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)
