"""`hornbill faults`."""

from typing import Annotated

import typer

from hornbill.cli.connection import LOCAL_URL, SERVO_HELP, AsJson, Server, ServoName, client, complete_servo
from hornbill.cli.showing import instant, print_json, print_table

app = typer.Typer(no_args_is_help=True, help="List and acknowledge faults.")


@app.command("list")
def list_(
    servos: Annotated[
        list[str] | None,
        typer.Argument(metavar="SERVO…", help=f"{SERVO_HELP} Default: all.", autocompletion=complete_servo),
    ] = None,
    past: Annotated[bool, typer.Option("--all", help="Include past faults.")] = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """List active faults with advice."""
    with client(server) as hornbill:
        chosen = [hornbill.look_up(one) for one in servos] if servos else hornbill.servos()
        found = [(one, one.faults(active=not past)) for one in chosen]
    if as_json:
        print_json([{**fault, "uid": one.uid} for one, every in found for fault in every])
        return
    rows = [
        (
            one.title, fault["level"], fault["key"], "yes" if fault["active"] else "past", instant(fault["last_seen"]),
            fault["count"], fault["acknowledged_by"] or "–", fault["advice"],
        )
        for one, every in found
        for fault in every
    ]  # fmt: skip
    if rows:
        print_table(("servo", "level", "fault", "active", "last seen", "count", "acknowledged by", "advice"), rows)
    else:
        print("No faults.")


@app.command("acknowledge")
def acknowledge(
    servo: ServoName,
    key: Annotated[str | None, typer.Argument(help="Key of the fault. Default: all faults.")] = None,
    server: Server = LOCAL_URL,
) -> None:
    """Acknowledge faults of a servo. Sends nothing to the servo and clears no bits."""
    with client(server) as hornbill:
        hornbill.look_up(servo).acknowledge_faults(key, by=hornbill.by)
