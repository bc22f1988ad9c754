"""Ask before something that moves a horn, restarts a servo or cannot be taken back."""

import sys
from typing import Annotated

import typer

Yes = Annotated[bool, typer.Option("--yes", "-y", help="do not ask")]


def agree(question: str, yes: bool, *, as_json: bool = False, instead: str = "") -> None:
    """Go on only when somebody agreed, by --yes or at the terminal; else the command ends, with nothing done.

    Without a terminal, or where the output is JSON, nobody can be asked: that is wrong usage. `instead`: what else
    could be added to the command.
    """
    if yes:
        return
    if as_json:
        raise typer.BadParameter(f"--json cannot ask: add --yes{instead}")
    if not sys.stdin.isatty():
        raise typer.BadParameter(f"nobody is there to ask: add --yes{instead}")
    typer.confirm(question, abort=True, err=True)
