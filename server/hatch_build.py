"""Build hook: adds commit, parameter tables, page and documentation to the wheel, except for editable installs.

The wheel has no pictures of the documentation: they are four fifths of its size, and are shown with it on the web.
"""

import os
import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PICTURES = frozenset({".png", ".webp", ".jpg", ".map"})


class CustomBuildHook(BuildHookInterface):
    """Force-include schemas/, web/dist and, if built, docs/dist under hornbill/_data/."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        root = Path(self.root)
        commit = self._commit(root)
        if self.target_name == "sdist":
            build_data["force_include"][str(commit)] = "commit"
            return
        build_data["force_include"][str(commit)] = "hornbill/_data/commit"
        page = root / "web" / "dist"
        if not (page / "index.html").is_file():
            raise RuntimeError(f"The page is not built: {page} has no index.html. Run 'make build'.")
        _include(build_data, root / "schemas", "schemas")
        build_data["force_include"][str(page)] = "hornbill/_data/web"
        docs = root / "docs" / "dist"
        if (docs / "index.html").is_file():
            _include(build_data, docs, "docs", but=PICTURES)

    def _commit(self, root: Path) -> Path:
        """File with the commit: that of an sdist, else of HORNBILL_COMMIT (without a repository), else of git."""
        if (root / "PKG-INFO").is_file() and (root / "commit").is_file():
            return root / "commit"
        found = os.environ.get("HORNBILL_COMMIT", "")
        if not found and (root / ".git").exists():
            described = ("git", "-C", str(root), "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*")
            found = subprocess.run(described, capture_output=True, text=True, check=False).stdout.strip()
        folder = root / "build"
        folder.mkdir(exist_ok=True)
        (folder / "commit").write_text(found, encoding="ascii")
        return folder / "commit"


def _include(build_data: dict[str, Any], folder: Path, name: str, but: frozenset[str] = frozenset()) -> None:
    """Force-include the files of a folder as hornbill/_data/`name`, without names and suffixes in `but`."""
    for file in folder.rglob("*"):
        if file.is_file() and not {file.name, file.suffix} & but:
            build_data["force_include"][str(file)] = f"hornbill/_data/{name}/{file.relative_to(folder).as_posix()}"
