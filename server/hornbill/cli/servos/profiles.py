"""`hornbill profiles`."""

from pathlib import Path
from typing import Annotated
from urllib.parse import quote

import typer

from hornbill.cli.connection import LOCAL_URL, AsJson, Confirm, DryRun, Save, Server, ServoName, client
from hornbill.cli.plain_text import text_of
from hornbill.cli.showing import print_job, print_json, print_table, progress

app = typer.Typer(no_args_is_help=True, help="Create, apply, import and export profiles (named sets of values).")

Name = Annotated[str, typer.Argument(help="Name of the profile.")]
MEDIA = {".toml": "application/toml", ".json": "application/json"}


@app.command("list")
def list_(server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """List profiles."""
    with client(server) as hornbill:
        found = hornbill.profiles()
    if as_json:
        print_json(found)
    else:
        rows = [(one["name"], one["model"] or "any", len(one["values"]), one["description"]) for one in found]
        print_table(("name", "model", "rows", "description"), rows)


@app.command("export")
def export(name: Name, server: Server = LOCAL_URL, as_json: AsJson = False) -> None:
    """Write a profile as TOML or JSON to standard output: hornbill profiles export NAME > NAME.toml"""
    with client(server) as hornbill:
        form = "json" if as_json else "toml"
        typer.echo(hornbill.download(f"/profiles/{quote(name, safe='')}/file?format={form}"), nl=False)


@app.command("create")
def create(
    name: Name,
    servo: ServoName,
    description: Annotated[str, typer.Option(help="Purpose of the profile.")] = "",
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Create a profile from a servo, without its identity rows. Replaces a profile of the same name."""
    with client(server) as hornbill:
        made = hornbill.store_profile(name, hornbill.look_up(servo), description=description)
    print_json(made) if as_json else print(f"{made['name']}: {len(made['values'])} rows stored.")


@app.command("import")
def import_(
    name: Name,
    file: Annotated[
        Path,
        typer.Argument(exists=True, dir_okay=False, help="TOML or JSON, as written by 'hornbill profiles export'."),
    ],
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Import a profile from a file. If any line is invalid, nothing is imported."""
    if file.suffix.lower() not in MEDIA:
        raise typer.BadParameter("The file must be a .toml or .json file.")
    with client(server) as hornbill:
        done = hornbill.request(
            "PUT", f"/profiles/{quote(name, safe='')}/file", content=text_of(file),
            headers={"Content-Type": MEDIA[file.suffix.lower()]},
        )  # fmt: skip
    print_json(done) if as_json else print(f"{name}: {len(done['profile']['values'])} rows stored.")


@app.command("apply")
def apply(
    name: Name,
    servos: Annotated[list[str], typer.Argument(metavar="SERVO…", help="Servos, in the order of writing.")],
    save: Save = False,
    dry_run: DryRun = False,
    confirm: Confirm = None,
    server: Server = LOCAL_URL,
    as_json: AsJson = False,
) -> None:
    """Apply a profile to servos, each all or nothing."""
    with client(server) as hornbill:
        found = [hornbill.look_up(one) for one in servos]
        with progress() as bar:
            job = hornbill.apply_profile(
                name, found, dry_run=dry_run, save=save, confirm=confirm or (), on_progress=bar
            )
    print_json(job) if as_json else print_job(job)


@app.command("delete")
def delete(name: Name, server: Server = LOCAL_URL) -> None:
    """Delete a profile. Servos that it was applied to stay unchanged."""
    with client(server) as hornbill:
        hornbill.delete_profile(name)
