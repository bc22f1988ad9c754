"""`make docs`: the pages of docs/ as a static site, which the program serves at /docs/ and anybody may copy.

The contents are those of docs/README.md. Nothing is inline and nothing comes from elsewhere, so that it lives under the
content security policy of the page; colours and the choice of light or dark are the page's own files. A link that
leads nowhere ends the build.
"""

import json
import os
import re
import shutil
import sys
from collections.abc import Iterable, Iterator
from copy import copy
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from string import Template
from urllib.parse import quote, unquote, urlsplit

from markdown_it import MarkdownIt
from markdown_it.token import Token

HERE = Path(__file__).resolve().parent
DOCS = HERE.parent
ROOT = DOCS.parent
OUT = DOCS / "dist"
WORKSHOP = (
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "SECURITY.md",
    "THIRD_PARTY.md",
    "schemas/generated/parameters.md",
)
FOLDERS = ("server", "web", "schemas", "tests", "examples", "docs/site")
COPIED = {"schemas/generated/openapi.json": "reference/openapi.json"}
ASSETS = {
    HERE / "site.css": "site.css",
    HERE / "site.js": "site.js",
    ROOT / "web" / "src" / "style" / "tokens.css": "tokens.css",
    ROOT / "web" / "public" / "theme.js": "theme.js",
    ROOT / "web" / "public" / "mark.svg": "icon.svg",
}
MARKDOWN = MarkdownIt("commonmark", {"html": True}).enable("table")


@dataclass
class Page:
    """One source, where it goes, and what is in it."""

    source: Path
    place: str
    tokens: list[Token]
    title: str = ""
    headings: list[tuple[int, str, str]] = field(default_factory=list[tuple[int, str, str]])
    """level, text, id"""


def main(out: Path) -> int:
    """Build everything into `out`; 1 when a link leads nowhere."""
    pages = {page.source: page for page in map(_read, _sources())}
    wrong = [f"{page.source.relative_to(ROOT)}: {text}" for page in pages.values() for text in _link(page, pages)]
    sections = _contents(pages)
    listed = {source for _, entries in sections for source in _listed(entries)}
    wrong += [
        f"docs/README.md does not list {one.relative_to(ROOT)}"
        for one in pages
        if one not in listed and one != DOCS / "README.md"
    ]
    if wrong:
        sys.stderr.write("\n".join(wrong) + "\n")
        return 1
    if out.exists():
        shutil.rmtree(out)
    template = Template((HERE / "page.html").read_text(encoding="utf-8"))
    for page in pages.values():
        _write(out / page.place, _html(page, sections, pages, template))
    for source, name in ASSETS.items():
        shutil.copy(source, out / name)
    for source, name in COPIED.items():
        shutil.copy(ROOT / source, out / name)
    shutil.copytree(DOCS / "pictures", out / "pictures")
    index = [_entry(page) for page in pages.values()]
    _write(out / "search.js", f"self.searchIndex = {json.dumps(index, ensure_ascii=False)};\n")
    sys.stdout.write(f"{len(pages)} pages in {out}\n")
    return 0


def _sources() -> Iterator[Path]:
    for file in sorted(DOCS.rglob("*.md")):
        if OUT not in file.parents and HERE not in file.parents:
            yield file
    for name in (*WORKSHOP, *(f"{folder}/README.md" for folder in FOLDERS)):
        if (ROOT / name).is_file():
            yield ROOT / name


def _place(source: Path) -> str:
    """Where a source is in the site."""
    name = source.relative_to(ROOT).as_posix()
    if name == "schemas/generated/parameters.md":
        return "reference/parameters.html"
    if name.startswith("docs/") and not name.startswith("docs/site/"):
        return re.sub(r"(^|/)README\.md$", r"\1index.md", name.removeprefix("docs/")).removesuffix(".md") + ".html"
    return "inside/" + name.removesuffix(".md").replace("/README", "").replace("/", "-").lower() + ".html"


def _read(source: Path) -> Page:
    page = Page(source, _place(source), MARKDOWN.parse(source.read_text(encoding="utf-8")))
    seen: dict[str, int] = {}
    for place, token in enumerate(page.tokens):
        if token.type != "heading_open":
            continue
        inline = page.tokens[place + 1]
        text = "".join(one.content for one in inline.children or () if one.type in ("text", "code_inline"))
        anchor = _anchor(text)
        number = seen.get(anchor, -1) + 1
        seen[anchor] = number
        token.attrSet("id", anchor if not number else f"{anchor}-{number}")
        page.headings.append((int(token.tag[1]), text, str(token.attrGet("id"))))
    page.title = page.headings[0][1] if page.headings else source.stem
    return page


def _anchor(text: str) -> str:
    """As code hosts make it, so that a link works in both."""
    return re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")


def _link(page: Page, pages: dict[Path, Page]) -> Iterator[str]:
    """Turn links between sources into links between pages; what leads nowhere is told."""
    for token in page.tokens:
        opened: list[bool] = []
        for child in tuple(token.children or ()):
            if child.type == "image":
                target = (page.source.parent / str(child.attrGet("src"))).resolve()
                if not target.is_file() or DOCS not in target.parents:
                    yield f"there is no picture {child.attrGet('src')}"
                    continue
                child.attrSet("src", _relative(page.place, target.relative_to(DOCS).as_posix()))
                child.attrSet("loading", "lazy")
                _in_both_themes(token, child, target)
            elif child.type == "link_open":
                keep, problem = _linked(page, pages, child)
                opened.append(keep)
                if problem:
                    yield problem
                if not keep:
                    child.tag, child.attrs = "span", {}
            elif child.type == "link_close" and not opened.pop():
                child.tag = "span"


def _in_both_themes(token: Token, image: Token, target: Path) -> None:
    """A drawing NAME-light.svg is shown in the light theme, and NAME-dark.svg beside it in the dark one."""
    dark = target.with_name(target.name.replace("-light.svg", "-dark.svg"))
    if dark == target or not dark.is_file() or token.children is None:
        return
    other = copy(image)
    other.attrs = {**image.attrs, "src": str(image.attrGet("src")).replace("-light.svg", "-dark.svg"), "class": "dark"}
    image.attrSet("class", "light")
    token.children.insert(token.children.index(image) + 1, other)


def _linked(page: Page, pages: dict[Path, Page], link: Token) -> tuple[bool, str]:
    href = str(link.attrGet("href"))
    parts = urlsplit(href)
    if parts.scheme or parts.netloc:
        link.attrSet("rel", "noreferrer")
        return True, ""
    target = (page.source.parent / unquote(parts.path)).resolve() if parts.path else page.source
    if target.is_dir() and (target / "README.md") in pages:
        target = target / "README.md"
    if target in pages:
        found = pages[target]
        if parts.fragment and unquote(parts.fragment) not in [one for _, _, one in found.headings]:
            return True, f"{href}: there is no such heading"
        link.attrSet("href", _relative(page.place, found.place) + (f"#{parts.fragment}" if parts.fragment else ""))
        return True, ""
    if not target.exists():
        return True, f"{href}: there is no such file"
    copied = COPIED.get(target.relative_to(ROOT).as_posix())
    if copied:
        link.attrSet("href", _relative(page.place, copied))
    return bool(copied), ""  # a file of the sources is named, and not linked


@dataclass(frozen=True)
class Entry:
    """A line of the contents, and those that stand beside it in the same item of docs/README.md."""

    source: Path
    text: str
    within: tuple["Entry", ...] = ()


Sections = list[tuple[str, list[Entry]]]


def _contents(pages: dict[Path, Page]) -> Sections:
    """The sections of docs/README.md: a heading, and the pages that are linked below it."""
    found: Sections = []
    by_place = {page.place: source for source, page in pages.items()}
    index = pages[DOCS / "README.md"]
    seen: set[Path] = set()
    for place, token in enumerate(index.tokens):
        if token.type == "heading_open" and token.tag == "h2":
            found.append((index.tokens[place + 1].content, []))
        children = token.children or []
        item = [
            Entry(target, children[at + 1].content)
            for at, child in enumerate(children)
            if child.type == "link_open" and (target := by_place.get(str(child.attrGet("href")).split("#")[0]))
        ]
        item = [one for one in item if found and one.source not in seen]
        seen |= {one.source for one in item}
        if item:
            below = item[0].source.name == "README.md" and item[0].source.parent == item[-1].source.parent
            found[-1][1].extend([Entry(item[0].source, item[0].text, tuple(item[1:]))] if below else item)
    return found


def _listed(entries: Iterable[Entry]) -> Iterator[Path]:
    for entry in entries:
        yield entry.source
        yield from _listed(entry.within)


def _menu(page: Page, entries: Iterable[Entry], pages: dict[Path, Page]) -> str:
    """A list of links; what belongs to one of them is shown while somebody reads there."""
    links: list[str] = []
    for entry in entries:
        here = ' aria-current="page"' if entry.source == page.source else ""
        text = f'<a href="{_relative(page.place, pages[entry.source].place)}"{here}>{escape(entry.text)}</a>'
        opened = entry.within and page.source in _listed([entry])
        links.append(f"<li>{text}{_menu(page, entry.within, pages) if opened else ''}</li>")
    return f"<ul>{''.join(links)}</ul>"


def _html(page: Page, sections: Sections, pages: dict[Path, Page], template: Template) -> str:
    links = [f"<h2>{escape(section)}</h2>{_menu(page, entries, pages)}" for section, entries in sections]
    within = [f'<li><a href="#{anchor}">{escape(text)}</a></li>' for level, text, anchor in page.headings if level == 2]
    body = MARKDOWN.renderer.render(page.tokens, MARKDOWN.options, {})
    body = body.replace("<table>", '<div class="table" tabindex="0" role="group" aria-label="Table"><table>')
    body = body.replace("</table>", "</table></div>").replace("<pre>", '<pre tabindex="0">')
    return template.substitute(
        title=escape(page.title),
        up=_relative(page.place, ""),
        contents="".join(links),
        within=f"<h2>On this page</h2><ul>{''.join(within)}</ul>" if len(within) > 1 else "",
        body=body,
    )


def _entry(page: Page) -> dict[str, object]:
    text = " ".join(token.content for token in page.tokens if token.type in ("inline", "fence"))
    headings = [[text, anchor] for level, text, anchor in page.headings if level > 1]
    return {
        "title": page.title,
        "place": page.place,
        "headings": headings,
        "text": re.sub(r"[\s|`*\[\]()#]+", " ", text)[:20_000],
    }


def _relative(place: str, target: str) -> str:
    """From one page to a file of the site."""
    found = os.path.relpath(target or ".", Path(place).parent).replace(os.sep, "/")
    return quote(found) if target else f"{found}/"


def _write(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else OUT))
