"""Commands for stored values: snapshots, compare, copy, undo, drift, lost-values."""

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import (
    LOCAL_URL,
    AsJson,
    Confirm,
    DryRun,
    Identity,
    Save,
    Server,
    ServoName,
    client,
    complete_key,
)
from hornbill.cli.showing import cell, instant, print_changes, print_job, print_json, print_table, progress, shown
from hornbill.errors import Unknown

if TYPE_CHECKING:
    from hornbill.client import Hornbill, responses

snapshots = typer.Typer(no_args_is_help=True, help="Snapshots of servos. One is taken before every change.")
drift = typer.Typer(no_args_is_help=True, help="Values that another tool changed in ROM.")

lost_values = typer.Typer(no_args_is_help=True, help="RAM values that a servo lost in a restart without a save.")

Number = Annotated[int, typer.Argument(metavar="SNAPSHOT", help="ID, as shown by 'hornbill snapshots list'.")]
Side = "SERVO, rom:SERVO, snapshot:N, snapshot-rom:N, profile:NAME or default:MODEL."
Keys = Annotated[
    list[str] | None,
    typer.Option("--key", help="Parameter to write. Repeatable. Default: all.", autocompletion=complete_key),
]


@snapshots.command("list")
def list_(servo: ServoName, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List the snapshots of a servo, newest first."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo).history.snapshots()
    if as_json:
        print_json(found)
        return
    rows = [(one["id"], instant(one["at"]), one["by"], one["reason"], len(one["values"])) for one in found]
    print_table(("snapshot", "taken", "by", "reason", "rows"), rows)


@snapshots.command("create")
def create(
    servo: ServoName,
    reason: Annotated[str, typer.Option(help="Reason, shown to users.")] = "manual",
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Take a snapshot of a servo, read from the servo."""
    with client(server) as hornbill:
        made = hornbill.look_up(servo).history.take(reason)
    print_json(made) if as_json else print(f"Snapshot {made['id']}: {len(made['values'])} rows stored.")


@snapshots.command("show")
def show(servo: ServoName, number: Number, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show the values of a snapshot in RAM and ROM."""
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


@snapshots.command("compare")
def compare_snapshot(
    servo: ServoName,
    number: Number,
    other: Annotated[
        int | None, typer.Argument(metavar="SNAPSHOT", help="Other snapshot. Default: the current values.")
    ] = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Compare a snapshot with the current values, or with another snapshot."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        found.history.snapshot(number)  # fails if it belongs to another servo
        right = f"servo:{found.uid}" if other is None else f"snapshot:{other}"
        _show_comparison(hornbill.compare(f"snapshot:{number}", right, identity=True), as_json)


@snapshots.command("restore")
def restore(
    servo: ServoName,
    number: Number,
    key: Keys = None,
    rom: Annotated[bool, typer.Option("--rom", help="Write the known ROM values instead of the RAM values.")] = False,
    identity: Identity = False,
    save: Save = False,
    dry_run: DryRun = False,
    yes: Yes = False,
    confirm: Confirm = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Restore a snapshot, all or nothing. Prompts for confirmation."""
    side = f"snapshot-rom:{number}" if rom else f"snapshot:{number}"
    with client(server) as hornbill:
        hornbill.look_up(servo).history.snapshot(number)
        _write(hornbill, servo, side, key, identity, save, dry_run, yes, confirm, as_json)


@snapshots.command("delete")
def delete(servo: ServoName, number: Number, server: Server = LOCAL_URL) -> None:
    """Delete a snapshot."""
    with client(server) as hornbill:
        hornbill.look_up(servo).history.delete(number)


def compare(
    left: Annotated[str, typer.Argument(help=Side)],
    right: Annotated[str, typer.Argument(help=Side)],
    identity: Identity = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Compare two servos, snapshots, profiles or models."""
    with client(server) as hornbill:
        found = hornbill.compare(_side(hornbill, left), _side(hornbill, right), identity=identity)
        _show_comparison(found, as_json)


def copy(
    servo: ServoName,
    source: Annotated[str, typer.Argument(metavar="FROM", help=Side)],
    key: Keys = None,
    identity: Identity = False,
    save: Save = False,
    dry_run: DryRun = False,
    yes: Yes = False,
    confirm: Confirm = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Copy values from a servo, snapshot, profile or model defaults. Prompts for confirmation."""
    with client(server) as hornbill:
        _write(hornbill, servo, _side(hornbill, source), key, identity, save, dry_run, yes, confirm, as_json)


def undo(
    servo: ServoName,
    identity: Identity = False,
    save: Save = False,
    dry_run: DryRun = False,
    yes: Yes = False,
    confirm: Confirm = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Undo the last change of a servo. Prompts for confirmation. A second undo reverts the first."""
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
                "unknown_snapshot", f"No snapshot of {found.title} differs from its current values.", cause=None
            )
        print(cell(f"Snapshot {one['id']}, {instant(one['at'])}: {one['reason']}"), file=sys.stderr)
        _write(hornbill, servo, f"snapshot:{one['id']}", None, identity, save, dry_run, yes, confirm, as_json)


@drift.command("show")
def show_drift(servo: ServoName, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show rows whose ROM value changed. The exit code is 0 in either case."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo).history.drift()
    if as_json:
        print_json(found)
    elif not found["rows"]:
        print("No drift.")
    else:
        rows = [
            (one["key"], shown(one["was"]), shown(one["now"]), "" if one["proved"] else "probable")
            for one in found["rows"]
        ]
        print_table(("parameter", "previous", "current", ""), rows)


@drift.command("restore")
def restore_drift(
    servo: ServoName, save: Save = False, yes: Yes = False, confirm: Confirm = None, server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:  # fmt: skip
    """Write back the previous ROM values, all or nothing, including identity rows. Prompts for confirmation."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        if not yes and not as_json:
            for one in found.history.drift()["rows"]:
                print(f"{one['key']}: {shown(one['now'])} → {shown(one['was'])}")
        require_confirmation(_question(found.title, save), yes, as_json=as_json)
        _show_written(hornbill, found.history.restore_drift(save=save, confirm=confirm or ()), as_json)


@drift.command("accept")
def accept_drift(servo: ServoName, server: Server = LOCAL_URL) -> None:
    """Accept the changed values as intended."""
    with client(server) as hornbill:
        hornbill.look_up(servo).history.accept_drift()


@lost_values.command("show")
def show_lost(servo: ServoName, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show the lost values. The exit code is 0 in either case."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo).refresh()["lost"]
    if as_json:
        print_json(found)
    elif not found:
        print("No lost values.")
    else:
        print_table(
            ("parameter", "value", "lost"), [(one["key"], shown(one["value"]), instant(one["at"])) for one in found]
        )


@lost_values.command("restore")
def restore_lost(
    servo: ServoName, save: Save = False, confirm: Confirm = None, server: Server = LOCAL_URL, as_json: AsJson = False
) -> None:
    """Write the lost values back to RAM, all or nothing."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        values = {one["key"]: one["value"] for one in found.refresh()["lost"] if one["value"] is not None}
        if not values:
            raise Unknown("unknown_parameter", f"{found.title} has no lost values. Nothing was written.", cause=None)
        _show_written(hornbill, found.write_many(values, save=save, confirm=confirm or ()), as_json)


@lost_values.command("dismiss")
def dismiss_lost(servo: ServoName, server: Server = LOCAL_URL) -> None:
    """Dismiss the lost values. Sends nothing to the servo."""
    with client(server) as hornbill:
        hornbill.look_up(servo).history.dismiss_lost()


def _write(
    hornbill: "Hornbill", servo: str, side: str, keys: list[str] | None, identity: bool, save: bool, dry_run: bool,
    yes: bool, confirm: list[str] | None, as_json: bool,
) -> None:  # fmt: skip
    """Show the changes from a side, confirm and write them."""
    found = hornbill.look_up(servo)

    def write(*, planned: bool) -> "responses.Restored":
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
                    print(f"{one['key']} is not included: {one['why']}")
        if dry_run:
            return
        if not changing and not save:
            print("No changes.")
            return
    require_confirmation(_question(found.title, save), yes, as_json=as_json, instead=", or --dry-run")
    _show_written(hornbill, write(planned=False), as_json)


def _show_written(
    hornbill: "Hornbill", done: "responses.Restored | responses.ParametersPatched", as_json: bool
) -> None:
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
    if save:
        return f"Write to {title} and save? The servo restarts and its horn may move."
    return f"Write to {title}?"


def _show_comparison(found: "responses.Comparison", as_json: bool) -> None:
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["key"],
            _value_text(one["left"], one["left_has"], one["left_unit"]),
            _value_text(one["right"], one["right_has"], one["right_unit"]),
        )
        for one in found["differences"]
    ]
    if rows:
        print_table(("parameter", found["left"], found["right"]), rows)
    print(f"{len(rows)} rows differ, {found['same']} are equal.")


def _value_text(value: bool | int | float | str | None, has: bool, unit: str) -> str:
    if value is None:
        return "unknown" if has else "not available"
    return f"{shown(value)} {unit}".rstrip()


def _side(hornbill: "Hornbill", name: str) -> str:
    """Side in the syntax of the API, with names of servos replaced by unique IDs."""
    kind, colon, rest = name.partition(":")
    if colon and kind in ("snapshot", "snapshot-rom", "profile", "default"):
        return name
    if colon and kind in ("servo", "rom"):
        return f"{kind}:{hornbill.look_up(rest).uid}"
    return f"servo:{hornbill.look_up(name).uid}"
