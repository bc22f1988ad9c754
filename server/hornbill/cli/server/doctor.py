"""Commands for the health of the bus: doctor, and log with its subcommands."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from hornbill.cli.connection import HERE, AsJson, Server, client
from hornbill.cli.failing import Exit
from hornbill.cli.showing import print_json, print_table

if TYPE_CHECKING:
    from hornbill.client import answers

log = typer.Typer(no_args_is_help=True, help="Log every frame on the bus to a file in the server's data folder.")


def doctor(server: Server = HERE, as_json: AsJson = False) -> None:
    """Say what is wrong with the bus and what helps. The exit code is 1 when there is a warning or a failure."""
    with client(server) as hornbill:
        examined = hornbill.doctor()
    found = [one for one in examined if one["severity"] != "ok"]
    if as_json:
        print_json(found)
    else:
        for one in found:
            print(f"{one['severity'].capitalize()}: {one['text']}\n  {one['evidence']}")
            if one["remedy"]:
                print(f"  → {one['remedy']}")
        passed = len(examined) - len(found)
        print(f"{f'{len(found)} found' if found else 'Nothing wrong found'}: {passed} checks passed.")
    if any(one["severity"] in ("warning", "failure") for one in found):
        raise typer.Exit(Exit.FAILED)


@log.command("start")
def start(
    form: Annotated[Literal["candump", "asc", "blf", "csv"], typer.Option("--format", help="of the file")] = "candump",
    name: Annotated[
        str | None, typer.Option(help="file name without ending; the time of the start unless told")
    ] = None,
    limit_mb: Annotated[float, typer.Option(help="it ends by itself at so many MB", min=0.001, max=10_000)] = 100.0,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Begin to log; it goes on until it is stopped or full."""
    with client(server) as hornbill:
        _show(hornbill.bus.start_log(form=form, name=name, limit_mb=limit_mb), as_json)


@log.command("stop")
def stop(server: Server = HERE, as_json: AsJson = False) -> None:
    """End the log; says so when the file is complete."""
    with client(server) as hornbill:
        _show(hornbill.bus.stop_log(), as_json)


@log.command("status")
def status(server: Server = HERE, as_json: AsJson = False) -> None:
    """How far the log is."""
    with client(server) as hornbill:
        _show(hornbill.bus.log(), as_json)


@log.command("list")
def list_(server: Server = HERE, as_json: AsJson = False) -> None:
    """The logs there are, the newest first."""
    with client(server) as hornbill:
        logs = hornbill.bus.logs()
    if as_json:
        print_json(logs)
    else:
        print_table(("name", "kB"), [(one["name"], f"{one['bytes'] / 1000:.0f}") for one in logs])


@log.command("get")
def get(name: Annotated[str, typer.Argument(help="as 'hornbill log list' has it")], server: Server = HERE) -> None:
    """Write a log to standard output: hornbill log get NAME > bus.log"""
    with client(server) as hornbill:
        typer.echo(hornbill.bus.log_file(name), nl=False)


@log.command("delete")
def delete(name: Annotated[str, typer.Argument(help="as 'hornbill log list' has it")], server: Server = HERE) -> None:
    """Delete a log."""
    with client(server) as hornbill:
        hornbill.bus.delete_log(name)


def _show(state: "answers.LogState", as_json: bool) -> None:
    if as_json:
        print_json(state)
        return
    dropped = f", {state['dropped']} dropped" if state["dropped"] else ""
    reason = f" {state['reason']}" if state["reason"] else ""
    print(f"{state['state']}: {state['name'] or 'no log'}, {state['frames']} frames{dropped}.{reason}")
