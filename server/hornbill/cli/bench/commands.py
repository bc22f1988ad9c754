"""`hornbill apply` and `hornbill export`: bench files."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import LOCAL_URL, SERVO_HELP, AsJson, Identity, Server, client, complete_servo
from hornbill.cli.failing import Exit
from hornbill.cli.plain_text import text_of
from hornbill.cli.showing import print_json, progress

if TYPE_CHECKING:
    from hornbill.cli.bench.plan import BenchPlan


def apply(
    file: Annotated[
        Path, typer.Argument(exists=True, dir_okay=False, help="Bench file, as written by 'hornbill export'.")
    ],
    check: Annotated[bool, typer.Option("--check", help="Only compare. Exit code 1 if there are differences.")] = False,
    yes: Yes = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Apply a bench file: show the differences, confirm, write, verify and save.

    Everything is checked before the first write. Servos without differences are not written, saved or restarted.
    """
    from hornbill.cli.bench.file import parse
    from hornbill.cli.bench.plan import apply_plans, plan

    if as_json and not (yes or check):
        raise typer.BadParameter("--json requires --yes or --check")
    with client(server) as hornbill:
        entries = parse(file, text_of(file))
        plans = plan(hornbill, file.name, entries, saves=not check)
        differing = [one for one in plans if one.differences]
        if as_json:
            print_json([one.as_json() for one in plans])
        else:
            _show(plans)
        if check:
            raise typer.Exit(Exit.FAILED if differing else Exit.DONE)
        if not differing:
            return
        require_confirmation("Apply these changes?", yes, instead=", or --check to compare only")
        with progress() as bar:
            apply_plans(hornbill, file.name, plans, bar)
        if not as_json:
            print(f"Done: {len(differing)} servos written and verified.")


def export(
    servo: Annotated[
        list[str] | None,
        typer.Option(help=f"{SERVO_HELP} Repeatable. Default: all servos on the bus.", autocompletion=complete_servo),
    ] = None,
    identity: Identity = False,
    server: Server = LOCAL_URL,
) -> None:
    """Export the current values of servos as a bench file: hornbill export > bench.toml"""
    from hornbill.cli.bench.file import LEFT_OUT, configuration, write

    with client(server) as hornbill:
        if servo:
            found = [hornbill.look_up(one) for one in servo]
        else:
            found = [one for one in hornbill.servos() if one.known["online"] and one.known["known_model"]]
        rows = [
            row for row in configuration(hornbill.schema()["parameters"])
            if row["key"] != LEFT_OUT and (identity or not row["identity"])
        ]  # fmt: skip
        typer.echo(write([(one.known, one.read_all()) for one in found], rows), nl=False)


def _show(plans: "list[BenchPlan]") -> None:
    from hornbill.cli.bench.file import literal
    from hornbill.cli.showing import show_rom

    for one in plans:
        if not one.differences:
            print(f"  {one.servo.title}: no differences")
            continue
        print(f"± {one.servo.title}")
        for row in one.differences:
            ram, rom, wanted = (literal(one) for one in (row.ram, row.rom, row.wanted))
            if row.write:
                print(f"    - {row.key} = {ram}")
                print(f"    + {row.key} = {wanted}")
            else:
                print(f"    ~ {row.key} = {wanted} in RAM, {'?' if row.rom is None else rom} in ROM")
        if one.save:
            print("    save to ROM: the servo restarts")
            if one.saved_too:
                print(f"    also saved from RAM: {', '.join(one.saved_too)}")
            show_rom(one.rom_changes, one.rom_unknown, one.restart, indent="    ")
    differing = sum(bool(one.differences) for one in plans)
    print(f"{differing} of {len(plans)} servos differ." if differing else "No differences.")
