"""Headers and media types of the files that routes offer."""

from typing import Final

CSV: Final = "text/csv; charset=utf-8"


def attachment(name: str) -> dict[str, str]:
    """The header that offers a response as a file; `name` is plain ASCII without quotes."""
    return {"Content-Disposition": f'attachment; filename="{name}"'}
