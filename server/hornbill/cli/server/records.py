"""The commands about what the server keeps: inventory, audit, and recordings of the recorder."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hornbill.cli.confirm import Yes, agree
from hornbill.cli.connection import HERE, AsJson, Server, client, complete_servo
from hornbill.cli.showing import cell, instant, print_json, print_table, shown
from hornbill.errors import Unknown

if TYPE_CHECKING:
    from hornbill.client import Hornbill, answers

inventory = typer.Typer(no_args_is_help=True, help="Every servo ever met, on the bus or not.")
recordings = typer.Typer(no_args_is_help=True, help="What the recorder kept around failures, stops and losses.")

AsCsv = Annotated[bool, typer.Option("--csv", help="print CSV")]
Known = Annotated[str, typer.Argument(metavar="SERVO", help="uid (or the start of it), label or serial")]
RecordingName = Annotated[str, typer.Argument(help="as 'hornbill recordings list' has it")]


@inventory.command("list")
def list_(as_csv: AsCsv = False, server: Server = HERE, as_json: AsJson = False) -> None:
    """Every servo ever met, the one seen last first; as CSV with what is known of its ROM."""
    with client(server) as hornbill:
        if as_csv:
            typer.echo(hornbill.records.servos_csv(), nl=False)
            return
        found = hornbill.records.servos()
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["uid"][:8], one["label"] or one["serial"], one["model"], one["firmware"], one["node_id"],
            one["servo_id"], "on the bus" if one["online"] else instant(one["last_seen"]), ", ".join(one["drift"]),
        )
        for one in found
    ]  # fmt: skip
    print_table(("uid", "name", "model", "firmware", "node", "id", "last seen", "ROM changed"), rows)


@inventory.command("show")
def show(servo: Known, server: Server = HERE, as_json: AsJson = False) -> None:
    """A servo, and what its ROM was last known to hold."""
    with client(server) as hornbill:
        found = hornbill.records.servo(_known(hornbill, servo)["uid"])
    if as_json:
        print_json(found)
        return
    print(f"{found['label'] or found['serial']}: {found['model']}, firmware {found['firmware']}, uid {found['uid']}")
    if found["notes"]:
        print(found["notes"])
    print_table(("parameter", "ROM"), [(key, shown(value)) for key, value in found["rom"].items()])


@inventory.command("note")
def note(
    servo: Known, text: Annotated[str, typer.Argument(help="up to 4000 characters")], server: Server = HERE
) -> None:
    """Write something down about a servo. It replaces what was there; "" takes it away."""
    with client(server) as hornbill:
        hornbill.records.write_down(_known(hornbill, servo)["uid"], text)


@inventory.command("forget")
def forget(
    servo: Known,
    history: Annotated[bool, typer.Option("--history", help="its snapshots and faults, too")] = False,
    yes: Yes = False,
    server: Server = HERE,
) -> None:
    """Forget a servo that is not on the bus. Asks first."""
    with client(server) as hornbill:
        known = _known(hornbill, servo)
        what = " with its snapshots and faults" if history else ""
        agree(f"Forget {known['label'] or known['serial'] or known['uid']}{what}?", yes)
        hornbill.records.forget(known["uid"], history=history)


def audit(
    servo: Annotated[
        str | None, typer.Option(help="only what was done to this one", autocompletion=complete_servo)
    ] = None,
    key: Annotated[str | None, typer.Option(help="only of this parameter")] = None,
    action: Annotated[str | None, typer.Option(help="only this, for example write or stop")] = None,
    limit: Annotated[int, typer.Option(help="so many", min=1, max=1000)] = 50,
    as_csv: AsCsv = False,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Who did what, and what came of it, the newest first; as CSV all of it."""
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
    print_table(("when", "who", "what", "outcome", "uid", "parameter", "after", "detail"), rows)


@recordings.command("list")
def list_recordings(server: Server = HERE, as_json: AsJson = False) -> None:
    """The recordings there are, the newest first, and how far the recorder reaches back."""
    with client(server) as hornbill:
        found, state = hornbill.records.recordings(), hornbill.records.recorder()
    if as_json:
        print_json(found)
        return
    rows = [
        (one["name"], instant(one["at"]), one["reason"], f"{one['bytes'] / 1000:.0f}", one["problem"] or one["text"])
        for one in found
    ]
    print_table(("name", "written", "reason", "kB", "what happened"), rows)
    print(f"The recorder reaches back {state['reach_s']:.0f} s.")


@recordings.command("take")
def take(
    reason: Annotated[str, typer.Option(help="for people; goes into its name")] = "",
    before: Annotated[float | None, typer.Option(help="seconds before now; as configured unless told", min=1)] = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Keep what happened lately, and in the next ten seconds; waits for them."""
    with client(server) as hornbill:
        made = hornbill.records.create_recording(reason, before_s=before)
    print_json(made) if as_json else print(made["name"])


@recordings.command("show")
def show_recording(name: RecordingName, server: Server = HERE, as_json: AsJson = False) -> None:
    """What is in a recording: its events, and what was written."""
    with client(server) as hornbill:
        found = hornbill.records.recording_content(name)
    if as_json:
        print_json(found)
        return
    for one in found["events"]:
        # What other versions, or other hands, wrote into it may lack anything.
        facts = " ".join(f"{key}={value}" for key, value in one.items() if key not in ("time", "type", "text", "code"))
        at = one.get("time")
        when = instant(at) if isinstance(at, (int, float)) else "?"
        print(cell(f"{when}  {one.get('type', '?')}: {one.get('text') or facts}"))
    samples = sum(len(column["t"]) for column in found["telemetry"])
    print(f"{len(found['events'])} events, {len(found['writes'])} writes, {samples} samples.")


@recordings.command("get")
def get(name: RecordingName, server: Server = HERE) -> None:
    """Write a recording, a ZIP file, to standard output: hornbill recordings get NAME > NAME"""
    with client(server) as hornbill:
        typer.echo(hornbill.records.recording(name), nl=False)


@recordings.command("put")
def put(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="a recording of elsewhere")],
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Have the server keep a recording, to look at it on the page."""
    with client(server) as hornbill:
        made = hornbill.records.import_recording(file.name, file.read_bytes())
    print_json(made) if as_json else print(made["name"])


@recordings.command("delete")
def delete(name: RecordingName, server: Server = HERE) -> None:
    """Delete a recording."""
    with client(server) as hornbill:
        hornbill.records.delete_recording(name)


def _known(hornbill: "Hornbill", name: str) -> "answers.KnownServo":
    """The one servo ever met with this label or serial, or whose unique id begins so."""
    begun = name.lower() or "nobody"
    every = hornbill.records.servos()
    found = [one for one in every if name in (one["label"], one["serial"]) or one["uid"].startswith(begun)]
    if len(found) == 1:
        return found[0]
    text = f"{len(found)} servos were" if found else "No servo was ever"
    raise Unknown("unknown_servo", f"{text} known as {name!r}. 'hornbill inventory list' shows them.", cause=None)
