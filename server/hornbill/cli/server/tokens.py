"""`hornbill tokens`: access tokens in the data folder. A running server picks up changes within seconds."""

from collections.abc import Generator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hornbill.cli.connection import AsJson
from hornbill.cli.failing import failures
from hornbill.cli.server.server_settings import DataDir, settings_of
from hornbill.cli.showing import instant, print_json

if TYPE_CHECKING:
    from hornbill.store.tokens import Tokens

app = typer.Typer(no_args_is_help=True, help="Create, list and revoke access tokens.")

Name = Annotated[str, typer.Argument(help="Name of the token, shown in the audit and as the holder of leases.")]
DatabaseUrl = Annotated[str | None, typer.Option(help="Database URL. Also HORNBILL_DATABASE.")]


class RoleName(StrEnum):
    """Role of a token. Each includes the lower ones."""

    view = "view"
    operate = "operate"
    configure = "configure"
    admin = "admin"


@app.command("create")
def create(
    name: Name,
    role: Annotated[
        RoleName, typer.Option(help="view: read and stop; operate: move; configure: write and save; admin: everything.")
    ],
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Create a token and print it. Only its digest is stored, so it cannot be shown again."""
    with _tokens(data_dir, database) as tokens:
        made, secret = tokens.add(name, role.value)
    if as_json:
        print_json({"name": made.name, "role": made.role, "token": secret})
        return
    print(secret)
    typer.echo(
        f"Token {made.name!r} with role {made.role}. It is not shown again. Use it to log in on the page, in "
        "HORNBILL_TOKEN for the command line, or as 'Authorization: Bearer TOKEN' in requests.",
        err=True,
    )


@app.command("list")
def list_(data_dir: DataDir = None, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List tokens, without their secrets."""
    with _tokens(data_dir, database) as tokens:
        found = tokens.all()
    if as_json:
        print_json(
            [
                {"name": one.name, "role": one.role, "created_at": one.created_at, "last_used_at": one.last_used_at}
                for one in found
            ]
        )
        return
    if not found:
        print("No tokens. Clients on this machine have full access; others have none.")
    for one in found:
        created, used = instant(one.created_at), instant(one.last_used_at)
        print(f"{one.name:<32} {one.role:<10} created {created}  last used {used}")


@app.command()
def revoke(name: Name, data_dir: DataDir = None, database: DatabaseUrl = None) -> None:
    """Revoke a token. Its sessions and sockets end."""
    with _tokens(data_dir, database) as tokens:
        tokens.drop(name)
    print(f"Token {name} revoked.")


def first_link(token: str | None, scheme: str, port: int) -> str:
    """Announcement of a token created at the first start; empty without one.

    The token is in the fragment of the link, which browsers do not send, so that it appears in no log.
    """
    if token is None:
        return ""
    return (
        f"\nFirst start: an admin token was created. It is not shown again:\n"
        f"  {scheme}://localhost:{port}/#token={token}\n"
        "Open this link, or send the token as 'Authorization: Bearer TOKEN'. Manage tokens with 'hornbill tokens'."
    )


@contextmanager
def _tokens(data_dir: Path | None, database: str | None) -> "Generator[Tokens]":
    from hornbill.store.store import Store

    with failures():
        settings = settings_of(data_dir=data_dir, database=database)
        with Store(settings.database or settings.data_dir, bench=settings.bench) as store:
            yield store.tokens
