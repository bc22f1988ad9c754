"""The commands about what servos hold: list, get, set, save."""

from typing import Annotated

import typer

from hornbill.cli.connection import HERE, AsJson, Changes, Confirm, Key, Server, Which, changes_of, client
from hornbill.cli.showing import print_changes, print_job, print_json, print_readings, print_table, progress, show_rom


def list_(server: Server = HERE, as_json: AsJson = False) -> None:
    """List the servos."""
    with client(server) as hornbill:
        servos = [one.known for one in hornbill.servos()]
    if as_json:
        print_json(servos)
        return
    rows = [
        (
            one["uid"][:8], one["label"] or one["serial"], one["model"] or "unknown", one["firmware"],
            one["node_id"], one["servo_id"], one["state"],
            None if one["angle_deg"] is None else f"{one['angle_deg']:+.1f}°", ", ".join(one["unsaved"]),
        )
        for one in servos
    ]  # fmt: skip
    print_table(("uid", "name", "model", "firmware", "node", "id", "state", "angle", "not saved"), rows)


def get(servo: Which, key: Key = None, server: Server = HERE, as_json: AsJson = False) -> None:
    """Read one parameter from the servo, or all of them."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        if key is not None:
            reading = found.reading(key)
            print_json(reading) if as_json else print_readings([reading])
            return
        every = found.read_all()
        print_json(every) if as_json else print_readings(every["parameters"].values())


def set_(
    servo: Which,
    changes: Changes,
    server: Server = HERE,
    save: Annotated[bool, typer.Option(help="save to ROM as well: the servo restarts and its horn may move")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only say what would change")] = False,
    confirm: Confirm = None,
    as_json: AsJson = False,
) -> None:
    """Write parameters to RAM, all or nothing."""
    with client(server) as hornbill:
        values = changes_of(changes)
        with progress() as show:
            done = hornbill.look_up(servo).write_many(
                values, dry_run=dry_run, save=save, confirm=confirm or (), on_progress=show
            )
        job = None if done["job"] is None else hornbill.wait(done["job"])
        if as_json:
            print_json({**done, "job": job} if job is not None else done)
            return
        print_changes(done["changes"])
        show_rom(done["rom_changes"], done["rom_unknown"], done["restart"])
        print({"planned": "planned: nothing was written"}.get(done["outcome"], done["outcome"]))
        if job is not None:
            print_job(job)


def save(
    servo: Which,
    server: Server = HERE,
    confirm: Confirm = None,
    torque_on: Annotated[bool, typer.Option("--torque-on", help="ROM is to have torque on, whatever it has")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only say what ROM would hold, and what moves")] = False,
    as_json: AsJson = False,
) -> None:
    """Write RAM to ROM, and read it back after the restart. The servo restarts; its horn may move to 0°.

    ROM keeps its torque mode unless another was set.
    """
    with client(server) as hornbill:
        if dry_run:
            plan = hornbill.look_up(servo).plan_save(confirm=confirm or (), torque_on=torque_on)
            if as_json:
                print_json(plan)
            else:
                show_rom(plan["rom_changes"], plan["rom_unknown"], plan["restart"])
            return
        with progress() as show:
            job = hornbill.look_up(servo).save(confirm=confirm or (), torque_on=torque_on, on_progress=show)
        print_json(job) if as_json else print_job(job)
