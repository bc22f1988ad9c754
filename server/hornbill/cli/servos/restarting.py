"""Commands for a servo as a whole: label, identify, torque, restart, factory-reset."""

import sys
from typing import Annotated, Literal

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import LOCAL_URL, AsJson, DryRun, Server, ServoName, client
from hornbill.cli.showing import print_changes, print_job, print_json, progress, shown


def label(
    servo: ServoName, text: Annotated[str, typer.Argument(help="Up to 64 characters.")], server: Server = LOCAL_URL
) -> None:
    """Set the nickname of a servo, which is stored on the server."""
    with client(server) as hornbill:
        hornbill.records.label(hornbill.look_up(servo).uid, text)


def identify(servo: ServoName, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Wiggle the horn of a servo by a few degrees to identify it."""
    with client(server) as hornbill:
        with progress() as bar:
            job = hornbill.look_up(servo).identify(on_progress=bar)
        print_json(job) if as_json else print_job(job)


def torque(
    servo: ServoName,
    mode: Annotated[
        Literal["off", "brake"], typer.Argument(help="To turn torque on, use 'hornbill move --torque-on'.")
    ],
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Turn torque off, or brake. A loaded horn may drop."""
    with client(server) as hornbill:
        reading = hornbill.look_up(servo).torque(mode)
    print_json(reading) if as_json else print(f"torque {reading['value']}")


def restart(servo: ServoName, yes: Yes = False, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Restart a servo. Unsaved values are lost, and its horn may move slowly to 0°. Prompts for confirmation."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        if not yes:
            forecast = found.forecast_restart()
            lost = found.refresh()["unsaved"]
            for line in (forecast["text"], *forecast["warnings"]):
                print(line, file=sys.stderr)
            if lost:
                print(f"Unsaved values that will be lost: {', '.join(lost)}.", file=sys.stderr)
        require_confirmation(f"Restart {found.title}?", yes, as_json=as_json)
        with progress() as bar:
            job = found.restart(on_progress=bar)
        print_json(job) if as_json else print_job(job)


def factory_reset(
    servo: ServoName,
    identity: Annotated[bool, typer.Option("--identity", help="Also reset origin, servo ID and node ID.")] = False,
    dry_run: DryRun = False,
    yes: Yes = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Reset a servo to the defaults of its model, in RAM and ROM. Its horn moves. Prompts for confirmation."""
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
                    print("unchanged: " + ", ".join(f"{key} {shown(value)}" for key, value in preview["kept"].items()))
                print("\n".join((preview["restart"]["text"], *preview["restart"]["warnings"])))
            if dry_run:
                return
        require_confirmation(
            f"Reset {found.title} to factory defaults?", yes, as_json=as_json, instead=", or --dry-run"
        )
        with progress() as bar:
            job = found.factory_reset(keep_identity=not identity, on_progress=bar)
        print_json(job) if as_json else print_job(job)
