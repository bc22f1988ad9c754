"""The commands that take a servo as a whole: label, identify, torque, restart, factory-reset."""

import sys
from typing import Annotated, Literal

import typer

from hornbill.cli.confirm import Yes, agree
from hornbill.cli.connection import HERE, AsJson, Server, Which, client
from hornbill.cli.showing import print_changes, print_job, print_json, progress, shown


def label(
    servo: Which, text: Annotated[str, typer.Argument(help="up to 64 characters")], server: Server = HERE
) -> None:
    """Give a servo a nickname. The server keeps it; the servo is not told."""
    with client(server) as hornbill:
        hornbill.records.label(hornbill.look_up(servo).uid, text)


def identify(servo: Which, server: Server = HERE, as_json: AsJson = False) -> None:
    """Show which one it is: its horn wiggles by a few degrees."""
    with client(server) as hornbill:
        with progress() as bar:
            job = hornbill.look_up(servo).identify(on_progress=bar)
        print_json(job) if as_json else print_job(job)


def torque(
    servo: Which,
    mode: Annotated[
        Literal["off", "brake"], typer.Argument(help="on ends with motion control: hornbill command --torque-on")
    ],
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Take the output of one servo away, or have it brake. It may fall."""
    with client(server) as hornbill:
        reading = hornbill.look_up(servo).torque(mode)
    print_json(reading) if as_json else print(f"torque {reading['value']}")


def restart(servo: Which, yes: Yes = False, server: Server = HERE, as_json: AsJson = False) -> None:
    """Restart a servo: what is only in RAM is lost, and with soft start its horn goes slowly to 0°. Asks first."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        if not yes:
            forecast = found.forecast_restart()
            lost = found.refresh()["unsaved"]
            for line in (forecast["text"], *forecast["warnings"]):
                print(line, file=sys.stderr)
            if lost:
                print(f"Not saved, and lost with it: {', '.join(lost)}.", file=sys.stderr)
        agree(f"Restart {found.title}?", yes, as_json=as_json)
        with progress() as bar:
            job = found.restart(on_progress=bar)
        print_json(job) if as_json else print_job(job)


def factory_reset(
    servo: Which,
    identity: Annotated[bool, typer.Option("--identity", help="origin, servo id and node id, too")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only say what would change")] = False,
    yes: Yes = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Give a servo the defaults of its model, in RAM and ROM. Its horn moves. Shows what changes, and asks."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        if dry_run or not yes:
            preview = found.preview_factory_reset(keep_identity=not identity)
            if as_json and dry_run:
                print_json(preview)
                return
            if not as_json:
                print_changes(preview["changes"])
                if preview["kept"]:
                    print("stays: " + ", ".join(f"{key} {shown(value)}" for key, value in preview["kept"].items()))
                print("\n".join((preview["restart"]["text"], *preview["restart"]["warnings"])))
            if dry_run:
                return
        agree(f"Reset {found.title}?", yes, as_json=as_json, instead=", or --dry-run")
        with progress() as bar:
            job = found.factory_reset(keep_identity=not identity, on_progress=bar)
        print_json(job) if as_json else print_job(job)
