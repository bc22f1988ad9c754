"""Commands for records: inventory, audit and recordings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.connection import LOCAL_URL, SERVO_HELP, AsJson, Server, client, complete_servo
from hornbill.cli.showing import cell, instant, print_json, print_table, shown
from hornbill.errors import Unknown

if TYPE_CHECKING:
    from hornbill.client import Hornbill, responses

inventory = typer.Typer(no_args_is_help=True, help="All known servos, on the bus or not.")
recordings = typer.Typer(no_args_is_help=True, help="Recordings of bus and telemetry around failures and stops.")

AsCsv = Annotated[bool, typer.Option("--csv", help="Print CSV.")]
Known = Annotated[str, typer.Argument(metavar="SERVO", help=SERVO_HELP)]
RecordingName = Annotated[str, typer.Argument(help="Name, as shown by 'hornbill recordings list'.")]


@inventory.command("list")
def list_(
    search: Annotated[
        str | None, typer.Argument(help="Only servos with this text in serial number, nickname or unique ID.")
    ] = None,
    as_csv: AsCsv = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """List all known servos on all benches, most recently seen first. CSV includes the last known ROM values."""
    with client(server) as hornbill:
        if as_csv:
            typer.echo(hornbill.records.servos_csv(q=search), nl=False)
            return
        found = hornbill.records.servos(q=search)
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["uid"][:8], one["label"] or one["serial"], one["model"], one["firmware"], one["node_id"],
            one["servo_id"], one["bench"], "on the bus" if one["online"] else instant(one["last_seen"]),
            ", ".join(one["drift"]),
        )
        for one in found
    ]  # fmt: skip
    print_table(("uid", "name", "model", "firmware", "node", "id", "bench", "last seen", "ROM changed"), rows)


def site(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List the benches that share the database of the server, with their state and last contact."""
    with client(server) as hornbill:
        found = hornbill.records.benches()
    if as_json:
        print_json(found)
        return
    rows = [
        (
            f"{one['name']}{' (this)' if one['is_this'] else ''}", one["host"], one["state"], one["bus"], one["role"],
            f"{one['servos_online']} of {one['servos_total']}", one["faults"],
            "stopped" if one["torque_stopped"] else one["holder"], instant(one["last_contact"]), one["version"],
        )
        for one in found
    ]  # fmt: skip
    header = ("bench", "host", "state", "bus", "role", "servos", "faults", "control", "last contact", "version")
    print_table(header, rows)


@inventory.command("show")
def show(servo: Known, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show a servo with its last known ROM values."""
    with client(server) as hornbill:
        found = hornbill.records.servo(_known(hornbill, servo)["uid"])
    if as_json:
        print_json(found)
        return
    print(f"{found['label'] or found['serial']}: {found['model']}, firmware {found['firmware']}, uid {found['uid']}")
    if found["notes"]:
        print(found["notes"])
    print_table(("parameter", "ROM"), [(key, shown(value)) for key, value in found["rom"].items()])


@inventory.command("annotate")
def annotate(
    servo: Known, text: Annotated[str, typer.Argument(help="Up to 4000 characters.")], server: Server = LOCAL_URL
) -> None:
    """Replace the notes on a servo. "" deletes them."""
    with client(server) as hornbill:
        hornbill.records.set_notes(_known(hornbill, servo)["uid"], text)


@inventory.command("forget")
def forget(
    servo: Known,
    history: Annotated[bool, typer.Option("--history", help="Also delete its snapshots and fault history.")] = False,
    yes: Yes = False,
    server: Server = LOCAL_URL,
) -> None:
    """Forget a servo that is off the bus. Prompts for confirmation."""
    with client(server) as hornbill:
        known = _known(hornbill, servo)
        what = " and its snapshots and faults" if history else ""
        require_confirmation(f"Forget {known['label'] or known['serial'] or known['uid']}{what}?", yes)
        hornbill.records.forget(known["uid"], history=history)


def audit(
    servo: Annotated[
        str | None, typer.Option(help="Only actions on this servo.", autocompletion=complete_servo)
    ] = None,
    key: Annotated[str | None, typer.Option(help="Only actions on this parameter.")] = None,
    action: Annotated[str | None, typer.Option(help="Only this action, for example write or stop.")] = None,
    limit: Annotated[int, typer.Option(help="Maximum number of rows.", min=1, max=1000)] = 50,
    as_csv: AsCsv = False,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """List audit rows, newest first. --csv prints all rows."""
    with client(server) as hornbill:
        uid = None if servo is None else _known(hornbill, servo)["uid"]
        if as_csv:
            typer.echo(hornbill.records.audit_csv(uid=uid, key=key, action=action), nl=False)
            return
        found = hornbill.records.audit(limit=limit, uid=uid, key=key, action=action)
    if as_json:
        print_json(found)
        return
    rows = [
        (
            instant(one["at"]), one["by"], one["action"], one["outcome"], (one["uid"] or "")[:8], one["key"] or "",
            "" if one["after"] is None else one["after"], one["detail"],
        )
        for one in found
    ]  # fmt: skip
    print_table(("time", "client", "action", "result", "uid", "parameter", "new value", "detail"), rows)


@recordings.command("list")
def list_recordings(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List the recordings on the server, newest first, and the time span of the recorder."""
    with client(server) as hornbill:
        found, state = hornbill.records.recordings(), hornbill.records.recorder()
    if as_json:
        print_json(found)
        return
    rows = [
        (one["name"], instant(one["at"]), one["reason"], f"{one['bytes'] / 1000:.0f}", one["problem"] or one["text"])
        for one in found
    ]
    print_table(("name", "time", "trigger", "kB", "description"), rows)
    print(f"The recorder covers the last {state['reach_s']:.0f} s.")


@recordings.command("create")
def create(
    reason: Annotated[str, typer.Option(help="Reason, shown to users and used in the file name.")] = "",
    before: Annotated[
        float | None, typer.Option(help="Time to cover before now, s. Default: as configured.", min=1)
    ] = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Create a recording of recent events and the next ten seconds, and wait for it."""
    with client(server) as hornbill:
        made = hornbill.records.create_recording(reason, before_s=before)
    print_json(made) if as_json else print(made["name"])


@recordings.command("show")
def show_recording(name: RecordingName, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Show the events of a recording, and the number of writes and samples."""
    with client(server) as hornbill:
        found = hornbill.records.recording_content(name)
    if as_json:
        print_json(found)
        return
    for one in found["events"]:
        # Recordings of other versions may lack any field.
        facts = " ".join(f"{key}={value}" for key, value in one.items() if key not in ("time", "type", "text", "code"))
        at = one.get("time")
        when = instant(at) if isinstance(at, (int, float)) else "?"
        print(cell(f"{when}  {one.get('type', '?')}: {one.get('text') or facts}"))
    samples = sum(len(column["t"]) for column in found["telemetry"])
    print(f"{len(found['events'])} events, {len(found['writes'])} writes, {samples} samples.")


@recordings.command("export")
def export(name: RecordingName, server: Server = LOCAL_URL) -> None:
    """Write a recording, a ZIP file, to standard output: hornbill recordings export NAME > NAME"""
    with client(server) as hornbill:
        typer.echo(hornbill.records.recording(name), nl=False)


@recordings.command("import")
def import_(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="Recording, a ZIP file.")],
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Import a recording, to view it on the page."""
    with client(server) as hornbill:
        made = hornbill.records.import_recording(file.name, file.read_bytes())
    print_json(made) if as_json else print(made["name"])


@recordings.command("delete")
def delete(name: RecordingName, server: Server = LOCAL_URL) -> None:
    """Delete a recording."""
    with client(server) as hornbill:
        hornbill.records.delete_recording(name)


def _known(hornbill: "Hornbill", name: str) -> "responses.KnownServo":
    """Known servo with this label, serial or start of its unique ID."""
    start = name.lower() or "–"
    every = hornbill.records.servos()
    found = [one for one in every if name in (one["label"], one["serial"]) or one["uid"].startswith(start)]
    if len(found) == 1:
        return found[0]
    text = f"{len(found)} known servos match" if found else "No known servo matches"
    raise Unknown("unknown_servo", f"{text} {name!r}. 'hornbill inventory list' lists them.", cause=None)
