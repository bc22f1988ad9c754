"""Sphinx extension: the address of each page, the menu, links into the source tree and pictures in two themes."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import furo
from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.project import Project
from sphinx.transforms import SphinxTransform

MANUAL = "schemas/generated/parameters.md"
ICONS = Path(furo.__file__).parent / "theme" / "furo" / "partials" / "icons.html"


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension with Sphinx."""
    app.connect("builder-inited", _use_addresses)
    app.connect("build-finished", _write_icons)
    for one in (Menu, NamesOfSources, BothThemes):
        app.add_transform(one)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class Addresses(Project):
    """Addresses: docs/ at the root of the site, READMEs of the source tree below inside/."""

    def path2doc(self, filename: Any) -> str | None:
        """Address of a source file without its ending; None if it is no page."""
        file = Path(filename)
        name = (file.relative_to(self.srcdir) if file.is_absolute() else file).as_posix()
        if not name.endswith(".md"):
            return None
        if name == MANUAL:
            return "reference/parameters"
        name = name.removesuffix(".md")
        if name.startswith("docs/") and not name.startswith("docs/site/"):
            return re.sub(r"(^|/)README$", r"\1index", name.removeprefix("docs/"))
        return "inside/" + name.replace("/README", "").replace("/", "-").lower()


def _use_addresses(app: Sphinx) -> None:
    app.project = app.env.project = Addresses(app.srcdir, app.project.source_suffix)


def _write_icons(app: Sphinx, exception: Exception | None) -> None:
    """Write Furo's icons once, without styles: in each page, as Furo has them, they take a fifth of all text."""
    if exception is None:
        symbols = re.sub(r"{#.*?#}", "", ICONS.read_text(encoding="utf-8"), flags=re.DOTALL)
        symbols = symbols.replace('style="opacity: 50%"', 'opacity="0.5"').replace('style="display: none;"', "")
        (Path(app.outdir) / "_static" / "icons.svg").write_text(symbols.strip(), encoding="utf-8")


class Menu(SphinxTransform):
    """Menu from the links of each index page in docs/, one part per section."""

    default_priority = 200

    def apply(self, **kwargs: Any) -> None:
        """Append a hidden toctree for each section with links."""
        here = self.env.docname
        if here.rpartition("/")[2] != "index":
            return
        (top,) = (one for one in self.document.children if isinstance(one, nodes.section))
        seen = {here}
        for section in [one for one in top.children if isinstance(one, nodes.section)] or [top]:
            pages = {page: text for page, text in self._links(section) if page not in seen}
            seen |= pages.keys()
            if pages:
                caption = "" if section is top else section[0].astext()
                top += self._toctree(caption, [(text, page) for page, text in pages.items()])

    def _links(self, section: nodes.section) -> Iterator[tuple[str, str]]:
        for link in section.findall(addnodes.pending_xref):
            if link["reftarget"] in self.env.found_docs:
                yield link["reftarget"], link.astext()

    def _toctree(self, caption: str, entries: list[tuple[str, str]]) -> nodes.Node:
        return addnodes.toctree(
            parent=self.env.docname, entries=entries, includefiles=[page for _, page in entries], caption=caption,
            rawcaption=caption, hidden=True, titlesonly=True, maxdepth=-1, numbered=0, glob=False, includehidden=False,
        )  # fmt: skip


class NamesOfSources(SphinxTransform):
    """Links to source files shown as names, because source files are not part of the site."""

    default_priority = 200

    def apply(self, **kwargs: Any) -> None:
        """Replace these links by their text."""
        for link in list(self.document.findall(addnodes.download_reference)):
            link.replace_self(link.children)


class BothThemes(SphinxTransform):
    """NAME-light.svg in the light theme, NAME-dark.svg in the dark theme."""

    default_priority = 200

    def apply(self, **kwargs: Any) -> None:
        """Add the dark picture after the light one."""
        for light in list(self.document.findall(nodes.image)):
            if light["uri"].endswith("-light.svg"):
                dark = light.deepcopy()
                dark["uri"] = light["uri"].replace("-light.svg", "-dark.svg")
                light["classes"].append("only-light")
                dark["classes"].append("only-dark")
                light.parent.insert(light.parent.index(light) + 1, dark)
