"""`hornbill token`: who may come in, kept in the data folder; a running server notices within seconds."""

from collections.abc import Generator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hornbill.cli.failing import failures
from hornbill.cli.showing import instant, print_json

if TYPE_CHECKING:
    from hornbill.store.tokens import Tokens

app = typer.Typer(no_args_is_help=True, help="Make, list and revoke the tokens by which others come in.")

Name = Annotated[str, typer.Argument(help="what it is called in the audit and as holder of motion control")]
DataDir = Annotated[Path | None, typer.Option(help="folder of the database, as for 'hornbill serve'")]
DatabaseUrl = Annotated[str | None, typer.Option(help="URL of a database elsewhere; or set HORNBILL_DATABASE")]
AsJson = Annotated[bool, typer.Option("--json", help="print JSON")]


class RoleName(StrEnum):
    """What a token is for; each may do all that those before it may."""

    view = "view"
    operate = "operate"
    configure = "configure"
    admin = "admin"


@app.command()
def add(
    name: Name,
    role: Annotated[
        RoleName, typer.Option(help="view: look and stop; operate: move; configure: write and save; admin: all")
    ],
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Make a token and print it. It is not kept, only its digest: nobody can be told it again."""
    with _tokens(data_dir, database) as tokens:
        made, secret = tokens.add(name, role.value)
    if as_json:
        print_json({"name": made.name, "role": made.role, "token": secret})
        return
    print(secret)
    typer.echo(
        f"The token of {made.name!r} for {made.role}; it is shown this once. Programs send it as "
        "'Authorization: Bearer TOKEN', the command line reads HORNBILL_TOKEN, people log in with it on the page.",
        err=True,
    )


@app.command("list")
def list_(data_dir: DataDir = None, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List the tokens, without their secrets."""
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
        print("No token: on this machine everybody may do everything, and nobody else gets in.")
    for one in found:
        print(f"{one.name:<32} {one.role:<10} made {instant(one.created_at)}  last used {instant(one.last_used_at)}")


@app.command()
def revoke(name: Name, data_dir: DataDir = None, database: DatabaseUrl = None) -> None:
    """Revoke a token: it opens nothing any more, and whoever came in with it is put out."""
    with _tokens(data_dir, database) as tokens:
        tokens.drop(name)
    print(f"{name} is revoked.")


def first_link(token: str | None, scheme: str, port: int) -> str:
    """What is said of a token that was made at the first start; nothing without one.

    It stands behind the #, which browsers send to nobody: it gets into no log of a server or proxy.
    """
    if token is None:
        return ""
    return (
        f"\nThis is the first start, so a token for admin was made. It is shown this once:\n"
        f"  {scheme}://localhost:{port}/#token={token}\n"
        "Open that link, or send the token as 'Authorization: Bearer TOKEN'. 'hornbill token' makes and revokes others."
    )


@contextmanager
def _tokens(data_dir: Path | None, database: str | None) -> "Generator[Tokens]":
    from hornbill.app.settings import Settings
    from hornbill.store.store import Store

    given = {"data_dir": data_dir, "database": database}
    with failures():
        settings = Settings(**{name: value for name, value in given.items() if value is not None})  # pyright: ignore[reportArgumentType]
        with Store(settings.database or settings.data_dir) as store:
            yield store.tokens
