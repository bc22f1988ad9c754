"""`hornbill faults`: what bits tell, now and in the past, with advice, and that somebody has seen them."""

from typing import Annotated

import typer

from hornbill.cli.connection import HERE, AsJson, Server, Which, client, complete_servo
from hornbill.cli.showing import instant, print_json, print_table

app = typer.Typer(no_args_is_help=True, help="Fault bits, now and in the past.")


@app.command("list")
def list_(
    servos: Annotated[
        list[str] | None, typer.Argument(metavar="SERVO…", help="all unless given", autocompletion=complete_servo)
    ] = None,
    past: Annotated[bool, typer.Option("--all", help="those that are over, too")] = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Say which bits are set, since when, and what helps."""
    with client(server) as hornbill:
        chosen = [hornbill.look_up(one) for one in servos] if servos else hornbill.servos()
        found = [(one, one.faults(active=not past)) for one in chosen]
    if as_json:
        print_json([{**fault, "uid": one.uid} for one, every in found for fault in every])
        return
    rows = [
        (
            one.title, fault["level"], fault["key"], "yes" if fault["active"] else "past", instant(fault["last_seen"]),
            fault["count"], fault["acknowledged_by"] or "nobody", fault["advice"],
        )
        for one, every in found
        for fault in every
    ]  # fmt: skip
    if rows:
        print_table(("servo", "level", "fault", "active", "last seen", "times", "seen by", "what helps"), rows)
    else:
        print("No fault.")


@app.command("acknowledge")
def acknowledge(
    servo: Which,
    key: Annotated[str | None, typer.Argument(help="of the fault; all unless given")] = None,
    server: Server = HERE,
) -> None:
    """Note that somebody has seen a servo's faults. The servo is not told, and no bit is cleared by it."""
    with client(server) as hornbill:
        hornbill.look_up(servo).acknowledge_faults(key, by=hornbill.by)
