"""Headers and media types of file downloads."""

from typing import Final

CSV: Final = "text/csv; charset=utf-8"


def attachment(name: str) -> dict[str, str]:
    """Content-Disposition header of a download; `name` is plain ASCII without quotes."""
    return {"Content-Disposition": f'attachment; filename="{name}"'}
