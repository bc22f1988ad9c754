"""Confirmation prompts before moving a horn, restarting a servo or anything that cannot be undone."""

import sys
from typing import Annotated

import typer

Yes = Annotated[bool, typer.Option("--yes", "-y", help="Skip the confirmation prompt.")]


def require_confirmation(question: str, yes: bool, *, as_json: bool = False, instead: str = "") -> None:
    """Require confirmation by --yes or at the terminal; otherwise exit without doing anything.

    Without a terminal, or with JSON output, a missing --yes is a usage error. `instead`: alternatives to --yes, for its
    text.
    """
    if yes:
        return
    if as_json:
        raise typer.BadParameter(f"--json requires --yes{instead}")
    if not sys.stdin.isatty():
        raise typer.BadParameter(f"Cannot prompt for confirmation without a terminal. Add --yes{instead}")
    typer.confirm(question, abort=True, err=True)
