"""The tests of asking first: nothing is done before somebody agreed, and nobody is asked who cannot answer."""

import sys
from types import SimpleNamespace

import pytest
import typer

from hornbill.cli.confirm import require_confirmation


def terminal(monkeypatch: pytest.MonkeyPatch, *, there: bool) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: there))


def test_yes_asks_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal(monkeypatch, there=False)
    require_confirmation("Do it?", True)
    require_confirmation("Do it?", True, as_json=True)


@pytest.mark.parametrize("there", [True, False])
def test_json_cannot_ask(monkeypatch: pytest.MonkeyPatch, there: bool) -> None:
    terminal(monkeypatch, there=there)
    with pytest.raises(typer.BadParameter, match="--json requires --yes, or --dry-run"):
        require_confirmation("Do it?", False, as_json=True, instead=", or --dry-run")


def test_without_a_terminal_it_is_wrong_usage(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal(monkeypatch, there=False)
    with pytest.raises(typer.BadParameter, match=r"without a terminal\. Add --yes"):
        require_confirmation("Do it?", False)


def test_at_a_terminal_the_question_is_asked_beside_the_output_and_a_no_ends_the_command(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    terminal(monkeypatch, there=True)
    asked: list[tuple[str, dict[str, bool]]] = []

    def confirm(question: str, **how: bool) -> bool:
        asked.append((question, how))
        return True

    monkeypatch.setattr(typer, "confirm", confirm)
    require_confirmation("Do it?", False)
    assert asked == [("Do it?", {"abort": True, "err": True})]
