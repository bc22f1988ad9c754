"""THIRD_PARTY.md: what hornbill is built on, under which licences, from the locks and what is installed.

`python -m tools.notices` writes it. The Python packages are installed beside hornbill and bring their own licence
files; what the page is built with is inside its scripts, so those texts are given whole.
"""

import json
import re
from email.message import Message
from importlib.metadata import PackageNotFoundError, distribution, metadata
from pathlib import Path
from typing import Any, Final, cast

ROOT: Final = Path(__file__).parents[1]
PAGE: Final = ROOT / "THIRD_PARTY.md"
WEB: Final = ROOT / "web"

ELSEWHERE: Final = {"colorama": "BSD-3-Clause"}
"""What is not installed on every system, so that the page is the same on all."""
SPDX: Final = {
    "MIT License": "MIT", "BSD License": "BSD", "ISC License (ISCL)": "ISC", "ISC License": "ISC",
    "Apache Software License": "Apache-2.0",
}  # fmt: skip
"""What older packages write, in today's words."""

_HEAD: Final = """\
<!-- Written by `python -m tools.notices` from the locks and what is installed. Do not edit. -->

# Notices of third parties

hornbill itself is under the Apache License 2.0 (`LICENSE`). It stands on the following.

## Python packages

Installed beside hornbill, not inside it; each brings its licence in its own `.dist-info`. python-can is under the
LGPL 3.0: it is used unchanged, as a library of its own that can be exchanged. These are the packages of
`requirements.lock`.

| package | version | licence |
| --- | --- | --- |
"""
_WEB: Final = """
## Inside the page

These are compiled into the scripts of the page, or served beside them; the page travels in the wheel.
"""
_DOCUMENTATION: Final = """
## Inside the documentation

Style sheets and scripts of these are part of the documentation, which travels in the wheel. Furo contains normalize.css
(Nicolas Gallagher and Jonathan Neal, MIT) and Gumshoe (Chris Ferdinandi, MIT), sphinx-copybutton contains clipboard.js
(Zeno Rocha, MIT).
"""
BUILDERS: Final = ("furo", "sphinx", "sphinx-copybutton")


class Unknown(Exception):
    """A package does not tell its licence."""


def document() -> str:
    """The whole page. Raises Unknown for a package without a licence, FileNotFoundError where one is not installed."""
    pinned: dict[str, list[str]] = {}
    for name, version in re.findall(r"^([\w.-]+)==([^\s\\;]+)", _read(ROOT / "requirements.lock"), re.MULTILINE):
        pinned.setdefault(name, []).append(version)
    rows = [f"| {name} | {', '.join(versions)} | {_licence(name)} |\n" for name, versions in pinned.items()]
    page, documentation = map(_bundled, _runtime()), map(_built_in, BUILDERS)
    font = _entry("Inter", "4.1, a Latin subset (OFL-1.1)", _read(WEB / "src/style/inter.LICENSE.txt"))
    return "".join((_HEAD, *rows, _WEB, *page, font, _DOCUMENTATION, *documentation))


def _licence(name: str) -> str:
    if name in ELSEWHERE:
        return ELSEWHERE[name]
    try:
        told = cast(Message, metadata(name))
    except PackageNotFoundError:
        raise FileNotFoundError(f"{name} is locked and not installed: run 'make setup'") from None
    expression = told.get("License-Expression")
    if expression:
        return expression
    classes = [one.rpartition(" :: ")[2] for one in told.get_all("Classifier") or () if one.startswith("License ::")]
    written = str(told.get("License") or "").strip()
    given = written if written and "\n" not in written and written not in ("BSD",) else "; ".join(classes) or written
    if not given:
        raise Unknown(f"{name} does not tell its licence: look it up and enter it in ELSEWHERE")
    return SPDX.get(given, given)


def _runtime() -> list[str]:
    """What the page needs when it runs, whole: its dependencies and theirs, by the lock."""
    packages: dict[str, dict[str, Any]] = json.loads(_read(WEB / "package-lock.json"))["packages"]
    found: set[str] = set()
    wanted = list(packages[""]["dependencies"])
    while wanted:
        name = wanted.pop()
        if name not in found:
            found.add(name)
            wanted += packages[f"node_modules/{name}"].get("dependencies", {})
    return sorted(found)


def _bundled(name: str) -> str:
    folder = WEB / "node_modules" / name
    about = json.loads(_read(folder / "package.json"))
    (text,) = (file for file in folder.iterdir() if file.name.upper().startswith("LICENSE"))
    return _entry(name, f"{about['version']} ({about['license']})", _read(text))


def _built_in(name: str) -> str:
    installed = distribution(name)
    (text,) = (file for file in installed.files or () if file.name.startswith("LICENSE"))
    return _entry(name, f"{installed.version} ({_licence(name)})", text.read_text(encoding="utf-8"))


def _entry(name: str, about: str, text: str) -> str:
    return f"\n### {name} {about}\n\n```text\n{text.strip()}\n```\n"


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


if __name__ == "__main__":
    PAGE.write_text(document(), encoding="utf-8")
