"""Locations of the parameter tables, the built page and documentation, and the commit, in a wheel or a checkout."""

import subprocess
from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_CHECKOUT = _PACKAGE.parent.parent


def schemas() -> Path:
    """Folder of the parameter tables.

    Raises FileNotFoundError if neither the wheel nor a checkout contains it.
    """
    for folder in (_PACKAGE / "_data" / "schemas", _CHECKOUT / "schemas"):
        if (folder / "parameters.toml").is_file():
            return folder
    raise FileNotFoundError("Parameter tables not found. Reinstall hornbill, or run it from its checkout.")


def openapi() -> Path:
    """The generated OpenAPI document."""
    return schemas() / "generated" / "openapi.json"


def page() -> Path | None:
    """Folder of the built page, or None if it is not built (`make build`)."""
    for folder in (_PACKAGE / "_data" / "web", _CHECKOUT / "web" / "dist"):
        if (folder / "index.html").is_file():
            return folder
    return None


def docs() -> Path | None:
    """Folder of the built documentation, or None if it is not built (`make docs`)."""
    for folder in (_PACKAGE / "_data" / "docs", _CHECKOUT / "docs" / "dist"):
        if (folder / "index.html").is_file():
            return folder
    return None


@cache
def commit() -> str | None:
    """Commit of the program, 12 digits, `+` if a checkout has changes. None if unknown: not built from a repository."""
    built = _PACKAGE / "_data" / "commit"
    if built.is_file():
        return built.read_text(encoding="ascii").strip() or None
    if checkout() is None:
        return None
    described = ("git", "-C", str(_CHECKOUT), "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*")
    try:
        return subprocess.run(described, capture_output=True, text=True, check=True, timeout=5).stdout.strip() or None
    except (OSError, subprocess.SubprocessError):
        return None


def checkout() -> Path | None:
    """Folder of the source checkout, or None in an installed package."""
    return _CHECKOUT if (_CHECKOUT / "docs" / "site" / "conf.py").is_file() else None
