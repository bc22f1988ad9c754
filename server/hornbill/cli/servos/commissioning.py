"""`hornbill commission`: which servos look new, and giving them ids, labels and values."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from hornbill.cli.connection import HERE, AsJson, Confirm, Server, client
from hornbill.cli.showing import print_changes, print_job, print_json, print_table, progress, show_rom
from hornbill.errors import InvalidValue

if TYPE_CHECKING:
    from hornbill.client import Hornbill, answers


def commission(
    servos: Annotated[
        list[str] | None,
        typer.Argument(metavar="SERVO=ID[:LABEL]…", help="61-466861=3:Elevator; without any: says which look new"),
    ] = None,
    profile: Annotated[str | None, typer.Option(help="values to give all of them")] = None,
    save: Annotated[bool, typer.Option(help="save, and read back after the restart")] = True,
    identify: Annotated[bool, typer.Option("--identify", help="wiggle each horn first")] = False,
    go_on: Annotated[bool, typer.Option("--continue", help="go on after a servo that did not do as told")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only say what would be written")] = False,
    confirm: Confirm = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Give new servos their servo ids and labels, and a profile; each all or nothing, saved and proved."""
    with client(server) as hornbill:
        if not servos:
            _candidates(hornbill.candidates(), as_json)
            return
        units: list[dict[str, Any]] = []
        for word in servos:
            name, equals, wanted = word.rpartition("=")
            number, _, label = wanted.partition(":")
            if not equals or not number.isdecimal():
                raise InvalidValue(
                    f"{word!r} is no servo with an id. Write SERVO=ID, for example 61-466861=3:Elevator.", cause=None
                )
            units.append({"uid": hornbill.look_up(name).uid, "servo_id": int(number), "label": label})
        if dry_run:
            preview = hornbill.plan_commission(
                units, profile=profile, save=save, identify=identify, confirm=confirm or ()
            )
            print_json(preview) if as_json else _show(hornbill, preview)
            return
        with progress() as bar:
            job = hornbill.commission(
                units, profile=profile, save=save, identify=identify, confirm=confirm or (),
                on_anomaly="continue" if go_on else "stop", on_progress=bar,
            )  # fmt: skip
    print_json(job) if as_json else print_job(job)


def _show(hornbill: "Hornbill", preview: "answers.CommissioningPreview") -> None:
    titles = {one.uid: one.title for one in hornbill.servos()}
    for one in preview["servos"]:
        print(titles[one["uid"]])
        print_changes(one["changes"])
        show_rom(one["rom_changes"], one["rom_unknown"], one["restart"], indent="  ")


def _candidates(found: "answers.Candidates", as_json: bool) -> None:
    if as_json:
        print_json(found)
        return
    rows = [
        (one["servo"]["serial"] or one["servo"]["uid"], one["servo"]["model"], one["servo_id"])
        for one in found["servos"]
    ]
    print_table(("servo looks new", "model", "free id"), rows)
    if found["pending"]:
        print(f"{len(found['pending'])} more wait for a node id.")
