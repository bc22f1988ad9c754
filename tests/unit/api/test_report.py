"""Reports of jobs: every format contains every servo, can be read back, and escapes labels."""

import csv
import io
import json
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

from hypothesis import given
from hypothesis import strategies as st

from hornbill.api.reports.data_forms import as_csv, as_json
from hornbill.api.reports.html_form import as_html
from hornbill.api.reports.junit_form import as_junit
from hornbill.errors import NoResponse
from hornbill.schema.catalog import Catalog
from hornbill.servo.configuration.record import ServoRecord, of_result
from hornbill.servo.runs.report import Report, report
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.steps import Step
from hornbill.store.servos import ServoFacts, StoredServo
from hornbill.units import Uid

CATALOG = Catalog.load()
FIRST, SECOND = Uid("aa" * 16), Uid("bb" * 16)
LABELS = st.text(st.characters(exclude_categories=()), max_size=64)


def record(uid: Uid = FIRST, label: str = "knee", **more: object) -> ServoRecord:
    known: dict[str, object] = {
        "title": label, "label": label, "serial": "61-000123", "model": "BLA21-06U-A0", "firmware": "1.300",
        "hardware_version": 3, "production_date": "2025-03-04T10:20", "servo_id": 1, "node_id": 21, "by": "ann",
        "profile": "bench", "profile_revision": "7", "values": {"angle_limit_ccw": -60.5, "smoothing": False},
        "units": {"angle_limit_ccw": "°"}, "verified_in": "rom", "verdict": "done", "started_at": 10.0,
        "ended_at": 12.5,
    }  # fmt: skip
    if isinstance(problem := more.get("problem"), str):
        more["problem"] = {"code": "no_response", "detail": problem}
    (made,) = of_result({"servos": [{"uid": uid, **known, **more}]}).values()
    return made


def steps(uid: Uid, place: int, state: str = "done") -> list[Step]:
    return [
        Step(f"write {place}", "knee: Written", "done", "9 rows", 10.0, 10.25, uid),
        Step(f"save {place}", "knee: Saved", state, "timeout <8 s>" if state == "failed" else None, 10.25, 12.5, uid),
        Step(f"verify {place}", "knee: Verified", "skipped" if state == "failed" else "done", uid=uid),
    ]


def job(*records: ServoRecord, failed: bool = False, kind: str = "commissioning", **more: object) -> RunningJob:
    listed: list[Step] = []
    for place, one in enumerate(records, start=1):
        listed += steps(Uid(one.uid), place, "failed" if one.verdict == "failed" else "done")
    made = RunningJob("f00d" * 4, kind, None, listed, 10.0, lambda: 0.0, lambda _job: None)
    made.result = {"servos": [one.document() for one in records], **more}
    made.state, made.ended_at = ("failed" if failed else "succeeded"), 13.0
    made.error = NoResponse("The second servo did not respond.", cause=None) if failed else None
    return made


def made_of(one: RunningJob) -> Report:
    return report(one, lambda _uid: None)


def test_csv_has_one_row_per_servo_and_fixed_columns() -> None:
    both = made_of(job(record(), record(SECOND, "hip", values={"reverse": True}, units={})))
    rows = list(csv.DictReader(io.StringIO(as_csv(both, CATALOG))))
    assert [row["label"] for row in rows] == ["knee", "hip"]
    first = rows[0]
    assert (first["serial"], first["servo_id"], first["node_id"], first["by"]) == ("61-000123", "1", "21", "ann")
    assert (first["angle_limit_ccw [°]"], first["smoothing"], first["reverse"]) == ("-60.5", "false", "")
    assert (first["duration_s"], first["verdict"], first["verified_in"]) == ("2.5", "done", "rom")
    assert first["when"] == "1970-01-01T00:00:12Z"
    empty = as_csv(made_of(job()), CATALOG)
    assert empty.splitlines()[0] == as_csv(both, CATALOG).splitlines()[0]
    assert len(first) == len(empty.splitlines()[0].split(",")), "no two columns of one name"
    assert len([name for name in first if name.split(" ")[0] in CATALOG.parameters]) > 25


@given(LABELS)
def test_any_label_can_be_read_from_the_csv_and_is_no_formula(label: str) -> None:
    text = as_csv(made_of(job(record(label=label))), CATALOG)
    rows = list(csv.DictReader(io.StringIO(text, newline="")))
    assert len(rows) == 1
    found = rows[0]["label"]
    assert not found.lstrip().startswith(("=", "+", "-", "@"))
    plain = label.encode(errors="replace").decode().replace("\0", "")
    assert found.removeprefix("'") == plain.removeprefix("'")


def test_json_has_the_unit_of_every_value() -> None:
    found = json.loads(as_json(made_of(job(record()))))
    assert found["servos"][0]["values"]["angle_limit_ccw"] == {"value": -60.5, "unit": "°"}
    assert found["servos"][0]["uid"] == FIRST
    assert [step["duration_s"] for step in found["servos"][0]["steps"]] == [0.25, 2.25, None]


def test_junit_has_a_case_per_servo_and_step_with_seconds_and_failure() -> None:
    bad = record(SECOND, "hip", verdict="failed", problem="It did not respond.", verified_in="")
    root = ET.fromstring(as_junit(made_of(job(record(), bad, failed=True))))
    assert root.tag == "testsuites"
    assert {name: root.get(name) for name in ("tests", "failures", "skipped", "errors")} == {
        "tests": "6", "failures": "1", "skipped": "1", "errors": "0"
    }  # fmt: skip
    first, second = root.findall("testsuite")
    assert [case.get("time") for case in first.findall("testcase")] == ["0.250", "2.250", "0.000"]
    assert float(first.get("time", "")) == 2.5
    failure = second.find("testcase/failure")
    assert failure is not None
    assert failure.text == "timeout <8 s>"
    assert float(root.get("time", "")) == 5.0


def test_junit_fails_a_servo_without_a_failed_step() -> None:
    one = job(record(verdict="failed", problem="It was not found."))
    for step in one.steps:
        step.state = "done"
    root = ET.fromstring(as_junit(made_of(one)))
    found = root.find("testsuite/testcase/failure")
    assert root.get("failures") == "1"
    assert found is not None
    assert found.text == "It was not found."


@given(LABELS)
def test_junit_is_well_formed_for_any_label(label: str) -> None:
    bad = record(label=label, title=label, verdict="failed", problem=label)
    text = as_junit(made_of(job(bad, failed=True))).encode()
    root = ET.fromstring(text)
    assert len(root.findall("testsuite")) == 1


class Page(HTMLParser):
    """Tags, attributes and text as parsed by a browser."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[str] = []
        self.attributes: set[str] = set()
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes |= {name for name, _ in attrs}

    def handle_data(self, data: str) -> None:
        self.text += data


def parsed(text: str) -> Page:
    page = Page()
    page.feed(text)
    page.close()
    return page


def test_html_is_self_contained_and_has_page_breaks_for_printing() -> None:
    text = as_html(made_of(job(record(), record(SECOND, "hip", verdict="failed", problem="It is gone."))), CATALOG)
    page = parsed(text)
    assert not {"script", "link", "img", "iframe"} & set(page.tags)
    assert not re.search(r"https?:|@import|url\(", text)
    for style in ("@media print", "break-before: page", "@page"):
        assert style in text
    assert (page.tags.count("section"), page.tags.count("h1")) == (2, 1)
    for text_ in ("knee", "hip", "61-000123", "−60.5°", "It is gone.", "1970-01-01", "9 rows", "2025-03-04T10:20"):
        assert text_ in page.text, text_


PLAIN = parsed(as_html(made_of(job(record(label="x", title="x", problem="x", by="x"))), CATALOG))


@given(LABELS)
def test_no_label_becomes_markup(label: str) -> None:
    nasty = f"{label}<script>alert(1)</script>\" onload='x' &amp; </style>"
    page = parsed(as_html(made_of(job(record(label=nasty, title=nasty, problem=nasty, by=nasty))), CATALOG))
    assert page.tags == PLAIN.tags
    assert page.attributes == PLAIN.attributes


def test_a_job_without_records_is_reported_from_its_steps_and_the_inventory() -> None:
    facts = ServoFacts(model="BLA21-06U-A0", model_number=61, serial=123, firmware=1300, servo_id=4, node_id=9)
    one = RunningJob(
        "a" * 16, "save", FIRST, [Step("check", "RAM read", "done", None, 1.0, 2.0)], 1.0, float, lambda _: None
    )
    one.state, one.ended_at, one.result = "succeeded", 3.0, {"node_id": 9}
    made = report(one, lambda uid: StoredServo(uid, "knee", facts))
    assert [len(unit.steps) for unit in made.targets] == [1]
    found = made.targets[0].record
    assert (found.serial, found.label, found.firmware, found.verdict) == ("61-000123", "knee", "1.300", "done")
    one.state, one.error = "failed", NoResponse("It is gone.", cause=None)
    assert report(one, lambda _uid: None).targets[0].record.problem_text == "It is gone."


def test_a_result_in_an_older_form_is_reported_from_its_steps() -> None:
    one = job(record(), record(SECOND, "hip"))
    one.result = {"units": [{"uid": FIRST, "verdict": "done", "problem": None}]}
    assert [target.record.verdict for target in made_of(one).targets] == ["done", "done"]
    one.kind, one.result = "profile", {"profile": "bench", "servos": [{"uid": FIRST, "outcome": "applied"}, 7]}
    assert [target.record.verdict for target in made_of(one).targets] == ["done", "done"]


def test_a_job_without_a_servo_has_only_its_steps() -> None:
    one = RunningJob(
        "b" * 16, "odd", None, [Step("a", "Computed", "done", "42", 1.0, 1.5)], 1.0, lambda: 0.0, lambda _: None
    )
    one.state, one.ended_at = "succeeded", 2.0
    made = made_of(one)
    root = ET.fromstring(as_junit(made))
    assert (root.get("tests"), root.get("time")) == ("1", "0.500")
    assert "Computed" in parsed(as_html(made, CATALOG)).text
    assert json.loads(as_json(made))["steps"][0]["evidence"] == "42"
