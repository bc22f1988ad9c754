"""Each code with which the server speaks to people has its wording on the page, and no wording is left over."""

import re
from pathlib import Path
from typing import get_args

import pytest
from typing_extensions import TypeAliasType

from hornbill.api.problems import STATUS
from hornbill.domain import bus, change, event, job, motion, note, recording
from hornbill.errors import Cause
from hornbill.schema.catalog import Catalog
from hornbill.servo.configuration.resetting import RESET_STEPS
from hornbill.servo.configuration.restarting import RESTART_STEPS
from hornbill.servo.configuration.saving import SAVE_STEPS
from hornbill.servo.device.reading import CIRCUMSTANCES

WORDS = Path(__file__).parents[2] / "web/src"

STEPS = {
    "save": job.SaveStep,
    "restart": job.RestartStep,
    "factory_reset": job.ResetStep,
    "identify": job.IdentifyStep,
    "step_test": job.StepTestStep,
    "profile": job.ProfileStep,
    "commissioning": job.CommissionStep,
    "restore_output": job.OutputStep,
}


def test_each_reason_has_its_sentence_and_no_sentence_is_left_over() -> None:
    codes = {one.reason.code for one in CIRCUMSTANCES} | {"not_saved"}
    for rule in Catalog.load().effects:
        codes |= {rule.code, f"{rule.code}_absent"} if rule.why_absent else {rule.code}
    assert worded("text/ja/why.ts", 2) == codes


@pytest.mark.parametrize("language", ["en", "ja"])
def test_each_step_of_each_kind_of_job_has_a_name(language: str) -> None:
    text = (WORDS / f"change/steps.{language}.ts").read_text(encoding="utf-8")
    shared = set(re.findall(r"^  (\w+):", text.split("const saving = {")[1].split("\n};")[0], re.MULTILINE))
    for kind, codes in STEPS.items():
        found = re.search(rf"^ +{kind}: {{(.*?)}},$", text, re.MULTILINE | re.DOTALL)
        assert found is not None, kind
        named = set(re.findall(r"(\w+): [\"`]", found[1])) | (shared if "...saving" in found[1] else set[str]())
        assert named == set(get_args(codes)), kind


def test_each_evidence_of_a_step_has_a_wording() -> None:
    assert worded("change/steps.ja.ts", 4, "evidence") == values(job.EvidenceCode)


def test_steps_of_jobs_have_the_codes_of_their_kind() -> None:
    for table, codes in ((SAVE_STEPS, job.SaveStep), (RESTART_STEPS, job.RestartStep), (RESET_STEPS, job.ResetStep)):
        assert tuple(table) == get_args(codes)


def test_each_finding_has_title_evidence_and_remedy() -> None:
    checks, codes = set(get_args(bus.Check)), values(bus.FindingCode)
    assert worded("bus/findings.ja.ts", 4, "well") == checks
    assert worded("bus/findings.ja.ts", 4, "wrong") == codes - {"adapter"}
    assert worded("bus/findings.ja.ts", 4, "remedy") == values(bus.Advice)
    assert worded("bus/findings.ja.ts", 6, "well") == checks
    assert worded("bus/findings.ja.ts", 6, "wrong") == codes - {"adapter"}


@pytest.mark.parametrize("language", ["en", "ja"])
def test_each_reason_of_a_snapshot_has_a_wording(language: str) -> None:
    assert worded(f"servo/audit.{language}.ts", 4, "reasons") == values(change.ReasonCode)


def test_each_caution_before_a_command_has_a_sentence() -> None:
    assert worded("text/ja/cautions.ts", 2) == values(motion.CautionCode)


def test_each_event_and_each_mark_of_a_recording_has_a_sentence() -> None:
    assert worded("text/ja/events.ts", 2, "happened", export=True) == values(event.EventCode)
    assert worded("text/ja/events.ts", 2, "marks", export=True) == values(recording.MarkReason) - {"manual"}
    assert worded("text/ja/events.ts", 2, "refusals", export=True) == values(bus.RefusalCode)
    assert worded("text/ja/events.ts", 2, "UNSTORED", export=True) == set(get_args(event.Unstored)) - {"servo"}


def test_each_note_beside_a_value_has_a_sentence() -> None:
    as_it_is, by_the_audit = "text", "reason"
    assert worded("text/ja/notes.ts", 2, "notes", export=True) == values(note.NoteCode) - {as_it_is, by_the_audit}


def test_each_problem_has_a_sentence_and_each_of_its_causes() -> None:
    by_the_page = {"no_link", "unexpected"}
    assert worded("text/ja/problems.ts", 2, "codes", export=True) == set(STATUS) | by_the_page
    assert worded("text/ja/problems.ts", 2, "causes", export=True) == set(get_args(Cause))


def values(alias: TypeAliasType) -> set[str]:
    return set(get_args(alias.__value__))


def worded(path: str, indent: int, part: str | None = None, *, export: bool = False) -> set[str]:
    """Keys at an indent in a catalogue of the page, or in one part of it, which `export` is a constant of its own."""
    text = (WORDS / path).read_text(encoding="utf-8")
    if part is not None and export:
        text = re.split(rf"^(?:export )?const {part}\b.*= {{\n", text, flags=re.MULTILINE)[1].split("\n}")[0]
    elif part is not None:
        edge = " " * (indent - 2)
        text = text.split(f"\n{edge}{part}: {{\n")[1].split(f"\n{edge}}},")[0]
    return set(re.findall(rf"^{' ' * indent}(\w+):", text, re.MULTILINE))
