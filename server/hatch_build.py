"""Build hook: adds parameter tables, page and documentation to the wheel, except for editable installs."""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CustomBuildHook(BuildHookInterface):
    """Force-include schemas/, web/dist and, if built, docs/dist under hornbill/_data/."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        root = Path(self.root)
        page = root / "web" / "dist"
        if not (page / "index.html").is_file():
            raise RuntimeError(f"The page is not built: {page} has no index.html. Run 'make build'.")
        build_data["force_include"][str(root / "schemas")] = "hornbill/_data/schemas"
        build_data["force_include"][str(page)] = "hornbill/_data/web"
        docs = root / "docs" / "dist"
        if (docs / "index.html").is_file():
            build_data["force_include"][str(docs)] = "hornbill/_data/docs"
