"""The command that asks a servo what only hardware can tell: probe."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from hornbill.cli.connection import HERE, AsJson, Server, Which, client
from hornbill.cli.failing import Exit
from hornbill.cli.showing import print_json


def probe(
    servo: Which,
    report: Annotated[
        Path | None, typer.Option(help="write NAME.md, NAME.json and NAME.log (the bus meanwhile)", metavar="NAME")
    ] = None,
    yes_move: Annotated[
        bool, typer.Option("--yes-move", help="agree to every step: the horn moves, and the servo restarts twice")
    ] = False,
    read_only: Annotated[
        bool, typer.Option("--read-only", help="agree to none: nothing is written, nothing moves")
    ] = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Answer from one servo what its document leaves open, and write a report.

    It reads first. Every step that moves, writes or restarts says what it will do and asks. The exit code is 1 when a
    step that was agreed to went wrong.
    """
    if yes_move and read_only:
        raise typer.BadParameter("--yes-move and --read-only exclude one another")
    from hornbill.probe.asking import Probe
    from hornbill.probe.report import as_markdown, as_object

    def agree(text: str) -> bool:
        if read_only or yes_move:
            print(f"{'Agreed' if yes_move else 'Left out'}: {text}", file=sys.stderr)
            return yes_move
        return sys.stdin.isatty() and typer.confirm(text, err=True)

    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        probed = Probe(hornbill, found, agree, lambda text: print(text, file=sys.stderr)).run()
        if as_json:
            print_json(as_object(probed))
        else:
            print(as_markdown(probed), end="")
        if report is not None:
            report.with_suffix(".md").write_text(as_markdown(probed), encoding="utf-8")
            text = json.dumps(as_object(probed), indent=2, ensure_ascii=False) + "\n"
            report.with_suffix(".json").write_text(text, encoding="utf-8")
            report.with_suffix(".log").write_bytes(probed.recording)
        if any(why != "not agreed to" for why in probed.left_out.values()):
            raise typer.Exit(Exit.FAILED)
