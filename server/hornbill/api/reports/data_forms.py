"""Reports as data: CSV with one row per servo, and JSON."""

import json
from collections.abc import Iterator
from dataclasses import asdict, fields

from hornbill.csv_text import csv_text
from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration.record import when
from hornbill.servo.runs.plan_run import StepCount
from hornbill.servo.runs.report import Report, ReportTarget, took
from hornbill.servo.runtime.steps import Step

FACTS = (
    "serial", "model", "firmware", "hardware_version", "production_date", "uid", "label", "servo_id", "node_id",
    "profile", "profile_revision", "by",
)  # fmt: skip
"""CSV columns before those of the values, by name in the record."""


RESULTS = tuple(one.name for one in fields(StepCount))
"""CSV columns of the results of a test plan, by name in StepCount."""
MEASURED = ("temperature_c_max", "torque_pct_max", "voltage_v_min", "voltage_v_max")


def as_csv(report: Report, catalog: Catalog) -> str:
    """One row per servo, of a test plan one row per servo and step. The columns are the same for every report of the
    same tables.
    """
    return csv_text(_results(report) if report.kind == "plan" else _table(report, catalog))


def _results(report: Report) -> Iterator[list[object]]:
    yield ["job", "plan", "when", *FACTS, *RESULTS, "action", *MEASURED]
    for target in report.targets:
        head = report.job_id, report.subject, when(target.record.ended_at or report.ended_at or report.created_at)
        facts = [getattr(target.record, name) for name in FACTS]
        for count in target.plan.counts:
            values = [getattr(count, name) for name in RESULTS]
            yield [*head, *facts, *values, target.action(count), *(target.plan.measured.get(name) for name in MEASURED)]


def _table(report: Report, catalog: Catalog) -> Iterator[list[object]]:
    rows = [row for row in catalog.parameters.values() if row.rom and row.key != "servo_id"]
    names = [*("job", "kind", "when"), *FACTS, *("verdict", "problem", "duration_s", "verified_in", "steps")]
    yield [*names, *(_column(row) for row in rows)]
    for target in report.targets:
        record = target.record
        head = report.job_id, report.kind, when(record.ended_at or report.ended_at or report.created_at)
        facts = [getattr(record, name) for name in FACTS]
        steps = "; ".join(f"{step.text}: {step.state}" for step in target.steps)
        tail = record.verdict, record.problem_text, _seconds(record.duration_s), record.verified_in, steps
        yield [*head, *facts, *tail, *(record.values.get(row.key) for row in rows)]


def as_json(report: Report) -> str:
    """The whole report, with the unit of every value; instants as ISO 8601."""
    document = {
        "title": report.title,
        "job": report.job_id,
        "kind": report.kind,
        "state": report.state,
        "created_at": when(report.created_at),
        "ended_at": when(report.ended_at) or None,
        "problem": report.problem,
        "servos": [_target(target) for target in report.targets],
        "steps": [_step(step) for step in report.steps],
    }
    return json.dumps(document, indent=2) + "\n"


def _column(row: Parameter) -> str:
    """Column name of a value. `node_id` among the facts is the current node ID, so 0x46 is named `fixed_node_id`."""
    key = "fixed_node_id" if row.key == "node_id" else row.key
    units = " or ".join(filter(None, (row.unit, row.unit_when.unit if row.unit_when else "")))
    return f"{key} [{units}]" if units else key


def _seconds(duration: float | None) -> float | None:
    return None if duration is None else round(duration, 3)


def _target(target: ReportTarget) -> dict[str, object]:
    record = target.record
    return {
        **{name: getattr(record, name) for name in FACTS},
        "verdict": record.verdict,
        "problem": record.problem_text,
        "started_at": when(record.started_at) or None,
        "ended_at": when(record.ended_at) or None,
        "duration_s": _seconds(record.duration_s),
        "verified_in": record.verified_in or None,
        "values": {key: {"value": value, "unit": record.units.get(key, "")} for key, value in record.values.items()},
        "steps": [_step(step) for step in target.steps],
        **_plan(target),
    }


def _plan(target: ReportTarget) -> dict[str, object]:
    if not target.plan.counts:
        return {}
    return {
        "results": [{**asdict(one), "action": target.action(one)} for one in target.plan.counts],
        "exceeded": [{**asdict(one), "at": when(one.at)} for one in target.plan.exceeded],
        "measured": dict(target.plan.measured),
    }


def _step(step: Step) -> dict[str, object]:
    return {
        "name": step.name, "text": step.text, "state": step.state, "evidence": step.evidence,
        "started_at": when(step.started_at) or None, "duration_s": _seconds(took(step)),
    }  # fmt: skip
