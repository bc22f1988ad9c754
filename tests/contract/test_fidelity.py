"""docs/reference/fidelity.md is what table, tests and switches make of it; every row has a test or a reason."""

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
def test_every_row_has_a_test_or_says_why_not(number: str) -> None:
    assert TABLE.rows[number].open or any(number in proof.states for proof in PROOFS)


def test_rows_are_numbered_once_and_in_order() -> None:
    numbers = list(TABLE.rows)
    assert all(re.fullmatch(r"B\d{2,3}", number) for number in numbers)
    assert numbers == sorted(numbers, key=lambda number: int(number[1:]))


def test_no_test_proves_a_row_or_a_switch_that_does_not_exist() -> None:
    assert {number for proof in PROOFS for number in proof.states} <= set(TABLE.rows)
    assert {name for proof in PROOFS for name in proof.switches} <= SWITCHES


@pytest.mark.parametrize("name", sorted(SWITCHES))
def test_every_switch_answers_a_question_has_a_reason_and_is_tested(name: str) -> None:
    assert any(name in names for names in TABLE.questions.values())
    assert any(name in proof.switches for proof in PROOFS)
    (told,) = (switch for switch in fidelity.switches() if switch.name == name)
    assert str(getattr(Behaviour(), name)).lower() == told.settings[0]
    assert len(told.settings) > 1
    assert told.reason


def test_every_question_has_a_switch_or_a_condition() -> None:
    known = SWITCHES | {each.name for each in fields(Conditions)}
    assert {name for names in TABLE.questions.values() for name in names} <= known
    assert all(TABLE.questions.values())


def test_no_marker_stands_where_the_page_would_miss_it() -> None:
    for path in fidelity.TESTS.rglob("test_*.py"):
        if path == Path(__file__):
            continue
        written = len(re.findall(r"\bmark\.(?:states|switch)\(", path.read_text(encoding="utf-8")))
        read = sum(bool(proof.states) + bool(proof.switches) for proof in PROOFS if proof.path == path)
        assert read == written, path


def test_a_marker_is_read_from_a_function_and_from_a_module(tmp_path: Path) -> None:
    folder = tmp_path / "unit"
    folder.mkdir()
    (folder / "test_one.py").write_text(
        "import pytest\n"
        '@pytest.mark.parametrize("n", [1])\n@pytest.mark.states("B02", "B03")\n@pytest.mark.switch("reserved")\n'
        "def test_this(n): ...\n"
        "def test_that(): ...\n"
        '@pytest.mark.states("B04")\nasync def test_there(): ...\n'
    )
    (folder / "test_two.py").write_text('import pytest\npytestmark = [pytest.mark.slow, pytest.mark.states("B05")]\n')
    (folder / "test_three.py").write_text('import pytest\npytestmark = pytest.mark.states("B06")\n')
    (folder / "other.py").write_text('import pytest\n@pytest.mark.states("B07")\ndef test_hidden(): ...\n')
    read = [(proof.path.name, proof.name, proof.states, proof.switches) for proof in fidelity.proofs(tmp_path)]
    assert read == [
        ("test_one.py", "test_this", ("B02", "B03"), ("reserved",)),
        ("test_one.py", "test_there", ("B04",), ()),
        ("test_three.py", "", ("B06",), ()),
        ("test_two.py", "", ("B05",), ()),
    ]


def test_the_page_shows_tests_reasons_and_switches() -> None:
    rows = {"B02": fidelity.Row("1.2", "It | does."), "B03": fidelity.Row("1.3", "It rests.", "nobody knows")}
    proof = fidelity.Proof(fidelity.TESTS / "unit" / "test_x.py", "test_it", ("B02",), ("loud",))
    shown = fidelity.page(
        fidelity.Table(rows, {"How loud?": ["loud"]}),
        [proof],
        [fidelity.Switch("loud", ("no", "yes"), "Quiet is good.")],
    )
    link = "[test_x.py::test_it](../../tests/unit/test_x.py)"
    for line in (
        f"| B02 | 1.2 | It \\| does. | {link} | `loud` |",
        "| B03 | 1.3 | It rests. | *open:* nobody knows |  |",
        "| How loud? | `loud` |",
        f"| `loud` | **no**, yes | Quiet is good. | {link} |",
    ):
        assert line in shown.splitlines()


def test_a_key_no_row_has_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "table.toml"
    path.write_text('[B02]\nsection = "1"\nstatement = "x"\nopened = "y"\n')
    with pytest.raises(TypeError, match="opened"):
        fidelity.table(path)
