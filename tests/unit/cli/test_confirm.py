"""Confirmation: required before a command acts, and prompted for only at a terminal."""

import sys
from types import SimpleNamespace

import pytest
import typer

from hornbill.cli.confirm import require_confirmation


def terminal(monkeypatch: pytest.MonkeyPatch, *, there: bool) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: there))


def test_yes_confirms_without_a_prompt(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal(monkeypatch, there=False)
    require_confirmation("Do it?", True)
    require_confirmation("Do it?", True, as_json=True)


@pytest.mark.parametrize("there", [True, False])
def test_json_requires_yes(monkeypatch: pytest.MonkeyPatch, there: bool) -> None:
    terminal(monkeypatch, there=there)
    with pytest.raises(typer.BadParameter, match="--json requires --yes, or --dry-run"):
        require_confirmation("Do it?", False, as_json=True, instead=", or --dry-run")


def test_without_a_terminal_it_is_a_usage_error(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal(monkeypatch, there=False)
    with pytest.raises(typer.BadParameter, match=r"without a terminal\. Add --yes"):
        require_confirmation("Do it?", False)


def test_at_a_terminal_it_prompts_on_standard_error_and_no_aborts(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal(monkeypatch, there=True)
    prompts: list[tuple[str, dict[str, bool]]] = []

    def confirm(question: str, **how: bool) -> bool:
        prompts.append((question, how))
        return True

    monkeypatch.setattr(typer, "confirm", confirm)
    require_confirmation("Do it?", False)
    assert prompts == [("Do it?", {"abort": True, "err": True})]
