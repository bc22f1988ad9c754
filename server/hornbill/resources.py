"""Locations of the parameter tables, the built page and the built documentation, in a wheel or a checkout."""

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


def checkout() -> Path | None:
    """Folder of the source checkout, or None in an installed package."""
    return _CHECKOUT if (_CHECKOUT / "docs" / "site" / "conf.py").is_file() else None
