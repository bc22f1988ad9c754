"""The commands about what servos held: snapshots, compare, copy, undo, drift, lost values."""

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from hornbill.cli.confirm import Yes, agree
from hornbill.cli.connection import HERE, AsJson, Confirm, Server, Which, client, complete_key
from hornbill.cli.showing import cell, instant, print_changes, print_job, print_json, print_table, progress, shown
from hornbill.errors import Unknown

if TYPE_CHECKING:
    from hornbill.client import Hornbill, answers

snapshots = typer.Typer(no_args_is_help=True, help="What servos held: one is kept before every change.")
drift = typer.Typer(no_args_is_help=True, help="What somebody else changed in ROM since a servo was last known.")

lost = typer.Typer(no_args_is_help=True, help="RAM values that a servo lost when it restarted without a save.")

Number = Annotated[int, typer.Argument(metavar="SNAPSHOT", help="its number, as 'hornbill snapshots list' has it")]
Side = "SERVO, rom:SERVO, snapshot:N, snapshot-rom:N, profile:NAME, default:MODEL"
Keys = Annotated[
    list[str] | None,
    typer.Option("--key", help="only this row; may be repeated; all unless told", autocompletion=complete_key),
]
Identity = Annotated[bool, typer.Option("--identity", help="origin, servo id and node id, too")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="only say what would change")]
Save = Annotated[bool, typer.Option(help="save to ROM as well: the servo restarts and its horn may move")]


@snapshots.command("list")
def list_(servo: Which, server: Server = HERE, as_json: AsJson = False) -> None:
    """Every snapshot of a servo, the newest first."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo).history.snapshots()
    if as_json:
        print_json(found)
        return
    rows = [(one["id"], instant(one["at"]), one["by"], one["reason"], len(one["values"])) for one in found]
    print_table(("snapshot", "taken", "by", "reason", "rows"), rows)


@snapshots.command("take")
def take(
    servo: Which,
    reason: Annotated[str, typer.Option(help="for people")] = "by hand",
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Keep what a servo holds now, read from it."""
    with client(server) as hornbill:
        made = hornbill.look_up(servo).history.take(reason)
    print_json(made) if as_json else print(f"snapshot {made['id']}: {len(made['values'])} rows kept.")


@snapshots.command("show")
def show(servo: Which, number: Number, server: Server = HERE, as_json: AsJson = False) -> None:
    """What a snapshot holds: RAM then, and what was known of ROM."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo).history.snapshot(number)
    if as_json:
        print_json(found)
        return
    rows = [
        (key, shown(value), shown(found["rom"][key]) if key in found["rom"] else None)
        for key, value in found["values"].items()
    ]
    print_table(("parameter", "value", "ROM"), rows)


@snapshots.command("diff")
def diff(
    servo: Which,
    number: Number,
    other: Annotated[int | None, typer.Argument(metavar="SNAPSHOT", help="what it holds now unless given")] = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Where a snapshot differs from what the servo holds now, or from another one."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        found.history.snapshot(number)  # of this servo, or the answer says whose
        right = f"servo:{found.uid}" if other is None else f"snapshot:{other}"
        _show_comparison(hornbill.compare(f"snapshot:{number}", right, identity=True), as_json)


@snapshots.command("restore")
def restore(
    servo: Which,
    number: Number,
    key: Keys = None,
    rom: Annotated[bool, typer.Option("--rom", help="what was known of ROM then, not RAM")] = False,
    identity: Identity = False,
    save: Save = False,
    dry_run: DryRun = False,
    yes: Yes = False,
    confirm: Confirm = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Write what a snapshot holds, all or nothing: shows what changes, and asks."""
    side = f"snapshot-rom:{number}" if rom else f"snapshot:{number}"
    with client(server) as hornbill:
        hornbill.look_up(servo).history.snapshot(number)
        _write(hornbill, servo, side, key, identity, save, dry_run, yes, confirm, as_json)


@snapshots.command("delete")
def delete(servo: Which, number: Number, server: Server = HERE) -> None:
    """Forget a snapshot."""
    with client(server) as hornbill:
        hornbill.look_up(servo).history.drop(number)


def compare(
    left: Annotated[str, typer.Argument(help=Side)],
    right: Annotated[str, typer.Argument(help="the same")],
    identity: Identity = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Where two servos, snapshots, profiles or models differ, row by row."""
    with client(server) as hornbill:
        found = hornbill.compare(_side(hornbill, left), _side(hornbill, right), identity=identity)
        _show_comparison(found, as_json)


def copy(
    servo: Which,
    source: Annotated[str, typer.Argument(metavar="FROM", help=Side)],
    key: Keys = None,
    identity: Identity = False,
    save: Save = False,
    dry_run: DryRun = False,
    yes: Yes = False,
    confirm: Confirm = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Write to a servo what another one, a snapshot, a profile or a model's defaults hold: shows it, and asks."""
    with client(server) as hornbill:
        _write(hornbill, servo, _side(hornbill, source), key, identity, save, dry_run, yes, confirm, as_json)


def undo(
    servo: Which,
    identity: Identity = False,
    save: Save = False,
    dry_run: DryRun = False,
    yes: Yes = False,
    confirm: Confirm = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Write back what a servo held before it was last changed: shows it, and asks. A second undo takes it back."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        for one in found.history.snapshots():
            compared = hornbill.compare(f"snapshot:{one['id']}", f"servo:{found.uid}", identity=True)
            keys = [
                row["key"]
                for row in compared["differences"]
                if row["left_has"] and row["left"] is not None and row["key"] != "torque_mode"
            ]
            if keys:
                break
        else:
            raise Unknown(
                "unknown_snapshot", f"Nothing is kept of {found.title} that differs from what it holds now.", cause=None
            )
        print(cell(f"Snapshot {one['id']}, {instant(one['at'])}: {one['reason']}"), file=sys.stderr)
        _write(hornbill, servo, f"snapshot:{one['id']}", None, identity, save, dry_run, yes, confirm, as_json)


@drift.command("show")
def show_drift(servo: Which, server: Server = HERE, as_json: AsJson = False) -> None:
    """Rows of ROM that changed meanwhile. The exit code is 0 with and without."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo).history.drift()
    if as_json:
        print_json(found)
    elif not found["rows"]:
        print("ROM is as it was last known.")
    else:
        rows = [
            (one["key"], shown(one["was"]), shown(one["now"]), "" if one["proved"] else "most likely")
            for one in found["rows"]
        ]
        print_table(("parameter", "was", "is", ""), rows)


@drift.command("restore")
def restore_drift(
    servo: Which, save: Save = False, yes: Yes = False, confirm: Confirm = None, server: Server = HERE,
    as_json: AsJson = False,
) -> None:  # fmt: skip
    """Write back what ROM held, identity rows too, all or nothing. Asks first."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        if not yes and not as_json:
            for one in found.history.drift()["rows"]:
                print(f"{one['key']}: {shown(one['now'])} → {shown(one['was'])}")
        agree(_question(found.title, save), yes, as_json=as_json)
        _show_written(hornbill, found.history.restore_drift(save=save, confirm=confirm or ()), as_json)


@drift.command("accept")
def accept_drift(servo: Which, server: Server = HERE) -> None:
    """Take what was found for what is wanted."""
    with client(server) as hornbill:
        hornbill.look_up(servo).history.accept_drift()


@lost.command("show")
def show_lost(servo: Which, server: Server = HERE, as_json: AsJson = False) -> None:
    """Values that were only in RAM when the servo restarted. The exit code is 0 with and without."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo).refresh()["lost"]
    if as_json:
        print_json(found)
    elif not found:
        print("No RAM values were lost.")
    else:
        print_table(
            ("parameter", "value", "lost"), [(one["key"], shown(one["value"]), instant(one["at"])) for one in found]
        )


@lost.command("apply")
def apply_lost(
    servo: Which, save: Save = False, confirm: Confirm = None, server: Server = HERE, as_json: AsJson = False
) -> None:
    """Write the lost values to RAM again, all or nothing."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        values = {one["key"]: one["value"] for one in found.refresh()["lost"] if one["value"] is not None}
        if not values:
            raise Unknown(
                "unknown_parameter", f"{found.title} has lost no RAM values. Nothing was written.", cause=None
            )
        _show_written(hornbill, found.write_many(values, save=save, confirm=confirm or ()), as_json)


@lost.command("dismiss")
def dismiss_lost(servo: Which, server: Server = HERE) -> None:
    """Forget the lost values. The servo is not told."""
    with client(server) as hornbill:
        hornbill.look_up(servo).history.dismiss_lost()


def _write(
    hornbill: "Hornbill", servo: str, side: str, keys: list[str] | None, identity: bool, save: bool, dry_run: bool,
    yes: bool, confirm: list[str] | None, as_json: bool,
) -> None:  # fmt: skip
    """Show what a side would change, ask, and write it."""
    found = hornbill.look_up(servo)

    def write(*, planned: bool) -> "answers.Restored":
        return found.history.copy(
            side, keys=keys, identity=identity, dry_run=planned, save=save and not planned, confirm=confirm or ()
        )

    if dry_run or not (yes or as_json):
        plan = write(planned=True)
        changing = [one for one in plan["changes"] if one["before"] != one["requested"]]
        if as_json:
            print_json(plan)
        else:
            print_changes(changing)
            compared = hornbill.compare(side, f"servo:{found.uid}", identity=True)
            differing = {one["key"] for one in compared["differences"]}
            for one in plan["left_out"]:
                if one["key"] in differing:
                    print(f"{one['key']} is left out: {one['why']}")
        if dry_run:
            return
        if not changing and not save:
            print("Nothing to do.")
            return
    agree(_question(found.title, save), yes, as_json=as_json, instead=", or --dry-run")
    _show_written(hornbill, write(planned=False), as_json)


def _show_written(hornbill: "Hornbill", done: "answers.Restored | answers.ParametersPatched", as_json: bool) -> None:
    job = None
    if done["job"] is not None:
        with progress() as bar:
            job = hornbill.wait(done["job"], on_progress=bar)
    if as_json:
        print_json(done if job is None else {**done, "job": job})
        return
    print_changes(one for one in done["changes"] if one["verdict"] != "unchanged")
    print(done["outcome"])
    if job is not None:
        print_job(job)


def _question(title: str, save: bool) -> str:
    return f"Write it to {title} and save? It restarts, and its horn may move." if save else f"Write it to {title}?"


def _show_comparison(found: "answers.Comparison", as_json: bool) -> None:
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["key"],
            _held(one["left"], one["left_has"], one["left_unit"]),
            _held(one["right"], one["right_has"], one["right_unit"]),
        )
        for one in found["differences"]
    ]
    if rows:
        print_table(("parameter", found["left"], found["right"]), rows)
    print(f"{len(rows)} differ, {found['same']} are the same.")


def _held(value: bool | int | float | str | None, has: bool, unit: str) -> str:
    if value is None:
        return "not known" if has else "no such row"
    return f"{shown(value)} {unit}".rstrip()


def _side(hornbill: "Hornbill", name: str) -> str:
    """A side as the API names it; servos by what people call them."""
    kind, colon, rest = name.partition(":")
    if colon and kind in ("snapshot", "snapshot-rom", "profile", "default"):
        return name
    if colon and kind in ("servo", "rom"):
        return f"{kind}:{hornbill.look_up(rest).uid}"
    return f"servo:{hornbill.look_up(name).uid}"
