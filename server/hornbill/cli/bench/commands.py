"""`hornbill apply` and `hornbill export`: a bench as a file, to keep beside the tests it is for."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hornbill.cli.confirm import Yes, agree
from hornbill.cli.connection import HERE, AsJson, Server, client, complete_servo
from hornbill.cli.failing import Exit
from hornbill.cli.plain_text import text_of
from hornbill.cli.showing import print_json, progress

if TYPE_CHECKING:
    from hornbill.cli.bench.plan import BenchPlan


def apply(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="bench file, as 'hornbill export' writes")],
    check: Annotated[bool, typer.Option("--check", help="only compare: exit code 1 when something differs")] = False,
    yes: Yes = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Bring servos to what a file says: shows what differs, asks, writes, reads back, saves.

    Everything is checked before the first write. What is as wanted already is not written, saved or restarted.
    """
    from hornbill.cli.bench.file import parse
    from hornbill.cli.bench.plan import carry_out, plan

    if as_json and not (yes or check):
        raise typer.BadParameter("--json cannot ask: add --yes or --check")
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
        agree("Do it?", yes, instead=", or --check to compare only")
        with progress() as bar:
            carry_out(hornbill, file.name, plans, bar)
        if not as_json:
            print(f"Done: {len(differing)} servos written, read back and found as the file says.")


def export(
    servo: Annotated[
        list[str] | None,
        typer.Option(
            help="uid, label or serial; may be repeated; all on the bus unless told", autocompletion=complete_servo
        ),
    ] = None,
    identity: Annotated[bool, typer.Option("--identity", help="origin, servo id and node id, too")] = False,
    server: Server = HERE,
) -> None:
    """Write a bench file of what servos hold to standard output: hornbill export > bench.toml"""
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
            print(f"  {one.servo.title}: as wanted")
            continue
        print(f"± {one.servo.title}")
        for row in one.differences:
            ram, rom, wanted = (literal(one) for one in (row.ram, row.rom, row.wanted))
            if row.write:
                print(f"    - {row.key} = {ram}")
                print(f"    + {row.key} = {wanted}")
            else:
                print(f"    ~ {row.key} = {wanted} is in RAM; ROM holds {'?' if row.rom is None else rom}")
        if one.save:
            print("    saved to ROM: it restarts")
            if one.saved_too:
                print(f"    saved with it, from RAM: {', '.join(one.saved_too)}")
            show_rom(one.rom_changes, one.rom_unknown, one.restart, indent="    ")
    differing = sum(bool(one.differences) for one in plans)
    print(f"{differing} of {len(plans)} servos differ." if differing else "Nothing differs.")
