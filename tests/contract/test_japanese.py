"""Every code of the server has its Japanese text on the page, and every text has its code."""

import re
from pathlib import Path
from typing import get_args

import pytest
from typing_extensions import TypeAliasType

from hornbill.api.problems import STATUS
from hornbill.domain import bus, change, event, job, motion, note, recording, verdict
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
    "frequency_response": job.FrequencyStep,
    "profile": job.ProfileStep,
    "commissioning": job.CommissionStep,
    "restore_output": job.OutputStep,
    "plan": job.RunPlanStep,
}


def test_reasons() -> None:
    codes = {one.reason.code for one in CIRCUMSTANCES} | {"not_saved"}
    for rule in Catalog.load().effects:
        codes |= {rule.code, f"{rule.code}_absent"} if rule.why_absent else {rule.code}
    assert texts("text/ja/why.ts", 2) == codes


@pytest.mark.parametrize("language", ["en", "ja"])
def test_steps_of_jobs(language: str) -> None:
    text = (WORDS / f"change/steps.{language}.ts").read_text(encoding="utf-8")
    shared = set(re.findall(r"^  (\w+):", text.split("const saving = {")[1].split("\n};")[0], re.MULTILINE))
    for kind, codes in STEPS.items():
        found = re.search(rf"^ +{kind}: {{(.*?)}},$", text, re.MULTILINE | re.DOTALL)
        assert found is not None, kind
        named = set(re.findall(r"(\w+): [\"`]", found[1])) | (shared if "...saving" in found[1] else set[str]())
        assert named == set(get_args(codes)), kind


def test_codes_of_steps() -> None:
    assert texts("change/steps.ja.ts", 4, "evidence") == values(job.EvidenceCode)
    for table, codes in ((SAVE_STEPS, job.SaveStep), (RESTART_STEPS, job.RestartStep), (RESET_STEPS, job.ResetStep)):
        assert tuple(table) == get_args(codes)


def test_findings() -> None:
    checks, codes = set(get_args(bus.Check)), values(bus.FindingCode)
    assert texts("bus/findings.ja.ts", 4, "well") == checks
    assert texts("bus/findings.ja.ts", 4, "wrong") == codes - {"adapter"}
    assert texts("bus/findings.ja.ts", 4, "remedy") == values(bus.Advice)
    assert texts("bus/findings.ja.ts", 6, "well") == checks
    assert texts("bus/findings.ja.ts", 6, "wrong") == codes - {"adapter"}


@pytest.mark.parametrize("language", ["en", "ja"])
def test_reasons_of_snapshots(language: str) -> None:
    assert texts(f"servo/audit.{language}.ts", 4, "reasons") == values(change.ReasonCode)


def test_cautions_notes_events_and_marks_of_recordings() -> None:
    verbatim, from_audit = "text", "reason"
    assert texts("text/ja/cautions.ts", 2) == values(motion.CautionCode)
    assert texts("text/ja/notes.ts", 2, "notes", export=True) == values(note.NoteCode) - {verbatim, from_audit}
    assert texts("text/ja/verdicts.ts", 2, "verdicts", export=True) == values(verdict.VerdictCode)
    assert texts("text/ja/events.ts", 2, "happened", export=True) == values(event.EventCode)
    assert texts("text/ja/events.ts", 2, "marks", export=True) == values(recording.MarkReason) - {"manual"}
    assert texts("text/ja/events.ts", 2, "refusals", export=True) == values(bus.RefusalCode)
    assert texts("text/ja/events.ts", 2, "UNSTORED", export=True) == set(get_args(event.Unstored)) - {"servo"}


def test_problems_and_causes() -> None:
    of_the_page = {"no_link", "unexpected"}
    assert texts("text/ja/problems.ts", 2, "codes", export=True) == set(STATUS) | of_the_page
    assert texts("text/ja/problems.ts", 2, "causes", export=True) == set(get_args(Cause))


def values(alias: TypeAliasType) -> set[str]:
    return set(get_args(alias.__value__))


def texts(path: str, indent: int, part: str | None = None, *, export: bool = False) -> set[str]:
    """Keys at an indent in a catalogue of the page, or in one part of it, with `export` in a constant."""
    text = (WORDS / path).read_text(encoding="utf-8")
    if part is not None and export:
        text = re.split(rf"^(?:export )?const {part}\b.*= {{\n", text, flags=re.MULTILINE)[1].split("\n}")[0]
    elif part is not None:
        edge = " " * (indent - 2)
        text = text.split(f"\n{edge}{part}: {{\n")[1].split(f"\n{edge}}},")[0]
    return set(re.findall(rf"^{' ' * indent}(\w+):", text, re.MULTILINE))
