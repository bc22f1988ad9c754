"""`hornbill version` and `hornbill --version`."""

from typing import Annotated

import typer

import hornbill
from hornbill import resources
from hornbill.cli.connection import AnyServer, AsJson
from hornbill.cli.showing import print_json


def version(as_json: AsJson = False) -> None:
    """Show the version and the commit it was built from."""
    if as_json:
        print_json({"version": hornbill.__version__, "commit": resources.commit()})
    else:
        print(_text())


def _show(requested: bool) -> None:
    if requested:
        print(_text())
        raise typer.Exit


ShowVersion = Annotated[
    bool,
    typer.Option("--version", is_eager=True, callback=_show, help="Show the version and the commit it was built from."),
]


def options(version: ShowVersion = False, server: AnyServer = None) -> None:
    """Configure BLA15, BLA21 and BLA34 servos over DroneCAN."""


def _text() -> str:
    return shown(hornbill.__version__, resources.commit())


def shown(number: str, commit: str | None) -> str:
    """A version and its commit, if known, in a sentence."""
    return f"hornbill {number}" + (f" (commit {commit})" if commit else "")
