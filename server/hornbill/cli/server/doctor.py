"""Commands for the health of the bus: doctor and logs."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from hornbill.cli import remedies
from hornbill.cli.connection import LOCAL_URL, AsJson, Server, client
from hornbill.cli.failing import Exit
from hornbill.cli.showing import print_json, print_table

if TYPE_CHECKING:
    from hornbill.client import responses

logs = typer.Typer(no_args_is_help=True, help="Log all frames on the bus to a file on the server.")

LogName = Annotated[str, typer.Argument(help="Name, as shown by 'hornbill logs list'.")]


def doctor(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Diagnose the bus: problems and remedies. The exit code is 1 if there is a warning or failure."""
    with client(server) as hornbill:
        checks = hornbill.doctor()
    for one in checks:
        one["remedy"] = remedies.of_finding(one["remedy"], one.get("advice"))
    found = [one for one in checks if one["severity"] != "ok"]
    if as_json:
        print_json(found)
    else:
        for one in found:
            print(f"{one['severity'].capitalize()}: {one['text']}\n  {one['evidence']}")
            if one["remedy"]:
                print(f"  → {one['remedy']}")
        print(f"{len(found)} findings, {len(checks) - len(found)} checks passed.")
    if any(one["severity"] in ("warning", "failure") for one in found):
        raise typer.Exit(Exit.FAILED)


@logs.command("start")
def start(
    form: Annotated[Literal["candump", "asc", "blf", "csv"], typer.Option("--format", help="File format.")] = "candump",
    name: Annotated[str | None, typer.Option(help="File name without extension. Default: the start time.")] = None,
    limit_mb: Annotated[float, typer.Option(help="Size at which logging ends, MB.", min=0.001, max=10_000)] = 100.0,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Start logging. It continues until stopped or full."""
    with client(server) as hornbill:
        _show(hornbill.bus.start_log(form=form, name=name, limit_mb=limit_mb), as_json)


@logs.command("stop")
def stop(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Stop logging, and wait until the file is complete."""
    with client(server) as hornbill:
        _show(hornbill.bus.stop_log(), as_json)


@logs.command("status")
def status(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show the state of the current or last log."""
    with client(server) as hornbill:
        _show(hornbill.bus.log(), as_json)


@logs.command("list")
def list_(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List the logs on the server, newest first."""
    with client(server) as hornbill:
        found = hornbill.bus.logs()
    if as_json:
        print_json(found)
    else:
        print_table(("name", "kB"), [(one["name"], f"{one['bytes'] / 1000:.0f}") for one in found])


@logs.command("export")
def export(name: LogName, server: Server = LOCAL_URL) -> None:
    """Write a log to standard output: hornbill logs export NAME > bus.log"""
    with client(server) as hornbill:
        typer.echo(hornbill.bus.log_file(name), nl=False)


@logs.command("delete")
def delete(name: LogName, server: Server = LOCAL_URL) -> None:
    """Delete a log."""
    with client(server) as hornbill:
        hornbill.bus.delete_log(name)


def _show(state: "responses.LogState", as_json: bool) -> None:
    if as_json:
        print_json(state)
        return
    dropped = f", {state['dropped']} dropped" if state["dropped"] else ""
    reason = f" {state['reason']}" if state["reason"] else ""
    print(f"{state['state']}: {state['name'] or 'no log'}, {state['frames']} frames{dropped}.{reason}")
