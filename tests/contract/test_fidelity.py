"""docs/reference/fidelity.md is up to date; every row has a test or a reason, every switch a question and a test."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

import fidelity
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.mechanics.conditions import Conditions

TABLE, PROOFS = fidelity.table(), fidelity.proofs()
SWITCHES = {each.name for each in fields(Behaviour)}


def test_the_page_is_up_to_date() -> None:
    committed = fidelity.PAGE.read_text(encoding="utf-8")
    assert committed == fidelity.written(), "fidelity.md is out of date: run 'make generate' and commit it"


@pytest.mark.parametrize("number", TABLE.rows)
def test_every_row_has_a_test_or_a_reason(number: str) -> None:
    assert TABLE.rows[number].open or any(number in proof.states for proof in PROOFS)


def test_tests_prove_existing_rows_and_switches() -> None:
    assert {number for proof in PROOFS for number in proof.states} <= set(TABLE.rows)
    assert {name for proof in PROOFS for name in proof.switches} <= SWITCHES


@pytest.mark.parametrize("name", sorted(SWITCHES))
def test_every_switch_has_a_question_a_reason_and_a_test(name: str) -> None:
    assert any(name in names for names in TABLE.questions.values())
    assert any(name in proof.switches for proof in PROOFS)
    (listed,) = (switch for switch in fidelity.switches() if switch.name == name)
    assert str(getattr(Behaviour(), name)).lower() == listed.settings[0]
    assert len(listed.settings) > 1
    assert listed.reason


def test_every_question_has_a_switch_or_a_condition() -> None:
    known = SWITCHES | {each.name for each in fields(Conditions)}
    assert {name for names in TABLE.questions.values() for name in names} <= known
    assert all(TABLE.questions.values())


def test_the_page_includes_every_marker() -> None:
    for path in fidelity.TESTS.rglob("test_*.py"):
        if path == Path(__file__):
            continue
        written = len(re.findall(r"\bmark\.(?:states|switch)\(", path.read_text(encoding="utf-8")))
        read = sum(bool(proof.states) + bool(proof.switches) for proof in PROOFS if proof.path == path)
        assert read == written, path
