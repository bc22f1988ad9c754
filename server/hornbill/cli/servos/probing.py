"""`hornbill probe`: measure behaviour that the specification leaves open."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from hornbill.cli.connection import LOCAL_URL, AsJson, Server, ServoName, client
from hornbill.cli.failing import Exit
from hornbill.cli.showing import print_json


def probe(
    servo: ServoName,
    report: Annotated[
        Path | None, typer.Option(help="Write NAME.md, NAME.json and NAME.log (bus log).", metavar="NAME")
    ] = None,
    yes_move: Annotated[
        bool,
        typer.Option(
            "--yes", "-y", "--yes-move", help="Confirm every step: the horn moves, and the servo restarts twice."
        ),
    ] = False,
    read_only: Annotated[bool, typer.Option("--read-only", help="Skip every step that writes or moves.")] = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Measure behaviour of a servo that the specification leaves open, and write a report.

    Every step that moves, writes or restarts the servo is described and must be confirmed. The exit code is 1 if a
    confirmed step failed.
    """
    if yes_move and read_only:
        raise typer.BadParameter("--yes and --read-only are mutually exclusive")
    from hornbill.probe.report import as_markdown, as_object
    from hornbill.probe.steps import Probe

    def confirm(text: str) -> bool:
        if read_only or yes_move:
            print(f"{'Confirmed' if yes_move else 'Skipped'}: {text}", file=sys.stderr)
            return yes_move
        return sys.stdin.isatty() and typer.confirm(text, err=True)

    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        result = Probe(hornbill, found, confirm, lambda text: print(text, file=sys.stderr)).run()
        if as_json:
            print_json(as_object(result))
        else:
            print(as_markdown(result), end="")
        if report is not None:
            report.with_suffix(".md").write_text(as_markdown(result), encoding="utf-8")
            text = json.dumps(as_object(result), indent=2, ensure_ascii=False) + "\n"
            report.with_suffix(".json").write_text(text, encoding="utf-8")
            report.with_suffix(".log").write_bytes(result.recording)
        if any(why != "not confirmed" for why in result.skipped.values()):
            raise typer.Exit(Exit.FAILED)
