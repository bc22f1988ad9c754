"""Settings of the server, for commands that work without one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hornbill.errors import CannotStart

if TYPE_CHECKING:
    from hornbill.app.settings import Settings

DataDir = Annotated[Path | None, typer.Option(help="Data folder, as for 'hornbill serve'.")]


def settings_of(**flags: Any) -> "Settings":
    """Settings from these options and the environment. None in `flags` is omitted. Raises CannotStart."""
    from pydantic import ValidationError

    from hornbill.app.settings import Settings

    try:
        return Settings(**{name: value for name, value in flags.items() if value is not None})
    except ValidationError as error:
        wrong = error.errors(include_input=False, include_url=False)[0]  # an input may be a token
        name = str(wrong["loc"][0])
        raise CannotStart(
            f"Invalid setting {name}: {wrong['msg']}. Correct HORNBILL_{name.upper()}, or the option.",
            cause=None, part="settings", retry=False,
        ) from None  # fmt: skip
