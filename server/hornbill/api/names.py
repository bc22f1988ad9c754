"""Nearest known name, for errors about unknown names."""

from collections.abc import Collection
from difflib import get_close_matches


def nearest(name: str, known: Collection[str]) -> str | None:
    """The known name that is most similar, or None if none is."""
    return next(iter(get_close_matches(name[:60].lower(), known, n=1)), None)
