"""Finds the parameter tables, the built page and the built documentation, in an installed wheel or in a checkout."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_CHECKOUT = _PACKAGE.parent.parent


def schemas() -> Path:
    """The folder of the parameter tables.

    Raises FileNotFoundError when neither the wheel nor a checkout holds it.
    """
    for folder in (_PACKAGE / "_data" / "schemas", _CHECKOUT / "schemas"):
        if (folder / "parameters.toml").is_file():
            return folder
    raise FileNotFoundError("the parameter tables are missing: reinstall hornbill, or run it from its checkout")


def page() -> Path | None:
    """The folder of the built page, or None when it has not been built (`make build` builds it)."""
    for folder in (_PACKAGE / "_data" / "web", _CHECKOUT / "web" / "dist"):
        if (folder / "index.html").is_file():
            return folder
    return None


def docs() -> Path | None:
    """The folder of the built documentation, or None when it has not been built (`make docs` builds it)."""
    for folder in (_PACKAGE / "_data" / "docs", _CHECKOUT / "docs" / "dist"):
        if (folder / "index.html").is_file():
            return folder
    return None


def checkout() -> Path | None:
    """The folder of the sources with everything that builds them, or None in an installed package."""
    return _CHECKOUT if (_CHECKOUT / "docs" / "site" / "conf.py").is_file() else None
