"""`hornbill profile`: named sets of values, kept, shown, applied and forgotten."""

from pathlib import Path
from typing import Annotated
from urllib.parse import quote

import typer

from hornbill.cli.connection import HERE, AsJson, Confirm, Server, Which, client
from hornbill.cli.plain_text import text_of
from hornbill.cli.showing import print_job, print_json, print_table, progress

app = typer.Typer(no_args_is_help=True, help="Named sets of values.")

Name = Annotated[str, typer.Argument(help="of the profile")]
MEDIA = {".toml": "application/toml", ".json": "application/json"}


@app.command("list")
def list_(server: Server = HERE, as_json: AsJson = False) -> None:
    """Every profile."""
    with client(server) as hornbill:
        kept = hornbill.profiles()
    if as_json:
        print_json(kept)
    else:
        rows = [(one["name"], one["model"] or "any", len(one["values"]), one["description"]) for one in kept]
        print_table(("name", "model", "rows", "description"), rows)


@app.command("show")
def show(name: Name, server: Server = HERE, as_json: AsJson = False) -> None:
    """A profile as the file that `profile put` takes."""
    with client(server) as hornbill:
        form = "json" if as_json else "toml"
        typer.echo(hornbill.download(f"/profiles/{quote(name, safe='')}/file?format={form}"), nl=False)


@app.command("take")
def take(
    name: Name,
    servo: Which,
    description: Annotated[str, typer.Option(help="what it is for")] = "",
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Keep what a servo holds, without its identity. A profile of the same name is replaced."""
    with client(server) as hornbill:
        kept = hornbill.put_profile(name, hornbill.look_up(servo), description=description)
    print_json(kept) if as_json else print(f"{kept['name']}: {len(kept['values'])} rows kept.")


@app.command("put")
def put(
    name: Name,
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="TOML or JSON, as `profile show` writes")],
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Keep what a file says: all of it, or nothing and why."""
    if file.suffix.lower() not in MEDIA:
        raise typer.BadParameter("a profile is a .toml or a .json file")
    with client(server) as hornbill:
        done = hornbill.ask(
            "PUT", f"/profiles/{quote(name, safe='')}/file", content=text_of(file),
            headers={"Content-Type": MEDIA[file.suffix.lower()]},
        )  # fmt: skip
    print_json(done) if as_json else print(f"{name}: {len(done['profile']['values'])} rows kept.")


@app.command("apply")
def apply(
    name: Name,
    servos: Annotated[list[str], typer.Argument(metavar="SERVO…", help="one after the other, in this order")],
    save: Annotated[bool, typer.Option(help="save to ROM as well: servos restart and horns may move")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only say what would change")] = False,
    confirm: Confirm = None,
    server: Server = HERE,
    as_json: AsJson = False,
) -> None:
    """Bring servos to a profile, each all or nothing."""
    with client(server) as hornbill:
        found = [hornbill.look_up(one) for one in servos]
        with progress() as bar:
            job = hornbill.apply_profile(
                name, found, dry_run=dry_run, save=save, confirm=confirm or (), on_progress=bar
            )
    print_json(job) if as_json else print_job(job)


@app.command("delete")
def delete(name: Name, server: Server = HERE) -> None:
    """Forget a profile. Servos it was applied to stay as they are."""
    with client(server) as hornbill:
        hornbill.delete_profile(name)
