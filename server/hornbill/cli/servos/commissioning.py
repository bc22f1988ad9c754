"""`hornbill commission`: new servos, and setting their IDs, labels and values."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from hornbill.cli.connection import LOCAL_URL, AsJson, Confirm, DryRun, Server, client
from hornbill.cli.showing import print_changes, print_job, print_json, print_table, progress, show_rom
from hornbill.errors import InvalidValue

if TYPE_CHECKING:
    from hornbill.client import Hornbill, responses


def commission(
    servos: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="SERVO=ID[:LABEL]…", help="For example 61-466861=3:Elevator. Without any: list new servos."
        ),
    ] = None,
    profile: Annotated[str | None, typer.Option(help="Profile to apply to all servos.")] = None,
    save: Annotated[bool, typer.Option(help="Save, and read back after the restart.")] = True,
    identify: Annotated[bool, typer.Option("--identify", help="Wiggle each horn first.")] = False,
    go_on: Annotated[
        bool, typer.Option("--continue", help="Continue after a servo with an unexpected result.")
    ] = False,
    dry_run: DryRun = False,
    confirm: Confirm = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Commission new servos: set servo IDs, labels and a profile, each all or nothing, then save and verify."""
    with client(server) as hornbill:
        if not servos:
            _candidates(hornbill.candidates(), as_json)
            return
        targets: list[dict[str, Any]] = []
        for word in servos:
            name, equals, wanted = word.rpartition("=")
            number, _, label = wanted.partition(":")
            if not equals or not number.isdecimal():
                raise InvalidValue(
                    f"Invalid argument {word!r}. Use SERVO=ID, for example 61-466861=3:Elevator.", cause=None
                )
            targets.append({"uid": hornbill.look_up(name).uid, "servo_id": int(number), "label": label})
        if dry_run:
            preview = hornbill.plan_commission(
                targets, profile=profile, save=save, identify=identify, confirm=confirm or ()
            )
            print_json(preview) if as_json else _show(hornbill, preview)
            return
        with progress() as bar:
            job = hornbill.commission(
                targets, profile=profile, save=save, identify=identify, confirm=confirm or (),
                on_anomaly="continue" if go_on else "stop", on_progress=bar,
            )  # fmt: skip
    print_json(job) if as_json else print_job(job)


def _show(hornbill: "Hornbill", preview: "responses.CommissioningPreview") -> None:
    titles = {one.uid: one.title for one in hornbill.servos()}
    for one in preview["servos"]:
        print(titles[one["uid"]])
        print_changes(one["changes"])
        show_rom(one["rom_changes"], one["rom_unknown"], one["restart"], indent="  ")


def _candidates(found: "responses.Candidates", as_json: bool) -> None:
    if as_json:
        print_json(found)
        return
    rows = [
        (one["servo"]["serial"] or one["servo"]["uid"], one["servo"]["model"], one["servo_id"])
        for one in found["servos"]
    ]
    print_table(("new servo", "model", "next free ID"), rows)
    if found["pending"]:
        print(f"{len(found['pending'])} more nodes are waiting for a node ID.")
