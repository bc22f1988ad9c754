"""Commands for parameters: list, get, set, save."""

from typing import Annotated

import typer

from hornbill.cli.connection import (
    LOCAL_URL,
    AsJson,
    Changes,
    Confirm,
    DryRun,
    Key,
    Save,
    Server,
    ServoName,
    changes_of,
    client,
)
from hornbill.cli.showing import print_changes, print_job, print_json, print_readings, print_table, progress, show_rom


def list_(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List servos."""
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
    print_table(("uid", "name", "model", "firmware", "node", "ID", "state", "angle", "unsaved"), rows)


def get(servo: ServoName, key: Key = None, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Read one or all parameters of a servo."""
    with client(server) as hornbill:
        found = hornbill.look_up(servo)
        if key is not None:
            reading = found.reading(key)
            print_json(reading) if as_json else print_readings([reading])
            return
        every = found.read_all()
        print_json(every) if as_json else print_readings(every["parameters"].values())


def set_(
    servo: ServoName,
    changes: Changes,
    server: Server = LOCAL_URL,
    save: Save = False,
    dry_run: DryRun = False,
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
        outcomes = {"planned": "dry run: nothing was written", "rolled_back": "rolled back"}
        print(outcomes.get(done["outcome"], done["outcome"]))
        if job is not None:
            print_job(job)


def save(
    servo: ServoName,
    server: Server = LOCAL_URL,
    confirm: Confirm = None,
    torque_on: Annotated[bool, typer.Option("--torque-on", help="Write torque on to ROM.")] = False,
    dry_run: DryRun = False,
    as_json: AsJson = False,
) -> None:
    """Save RAM to ROM. The servo restarts, its horn may move to 0°, and all values are read back.

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
