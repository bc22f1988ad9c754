"""The built documentation: links, search, themes, accessibility, and links from the page into it."""

import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import httpx
import pytest
from playwright.sync_api import Page

from commands.guides import ROOT
from e2e.looks import complaints
from e2e.servers import Demo
from e2e.sphinx_site import sphinx
from e2e.state import WAIT_S

pytestmark = pytest.mark.release


class Links(HTMLParser):
    """Targets of links of a page, and anchors in it."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.pointers: set[str] = set()
        """Links that are followed on click, not fetched."""
        self.anchors: set[str] = set()
        self.inline: list[str] = []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.links += [value for name in ("href", "src") if (value := given.get(name))]
        if tag == "a" and given.get("href"):
            self.pointers.add(str(given["href"]))
        if given.get("id"):
            self.anchors.add(str(given["id"]))
        element = tag == "style" or (tag == "script" and "src" not in given)
        if element or "style" in given or any(name.startswith("on") for name in given):
            self.inline.append(f"<{tag} {attrs}>")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, where the server looks for it in a checkout."""
    out = ROOT / "docs" / "dist"
    shutil.rmtree(out, ignore_errors=True)
    made = sphinx(ROOT, out, tmp_path_factory.mktemp("doctrees"))
    assert made.returncode == 0, made.stderr[-2000:]
    return out


def test_links_of_the_built_site_resolve_and_nothing_is_inline(built: Path) -> None:
    pages = {file: Links(file) for file in built.rglob("*.html")}
    assert len(pages) > 40
    for file, page in pages.items():
        assert page.inline == [], file
        for link in page.links:
            parts = urlsplit(link)
            if link in page.pointers and parts.scheme in ("http", "https"):
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            assert target.is_file(), f"{file.name}: {link}"
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].anchors, f"{file.name}: {link}"


@pytest.mark.usefixtures("built")
def test_the_server_serves_the_site_under_the_pages_policy(demo: Demo) -> None:
    index = httpx.get(demo.url + "docs", follow_redirects=True, timeout=WAIT_S)
    assert index.url.path == "/docs/"
    assert "<title>hornbill documentation" in index.text
    assert "script-src 'self'; style-src 'self';" in index.headers["content-security-policy"]
    assert httpx.get(demo.url + "docs/reference/parameters.html", timeout=WAIT_S).status_code == 200
    script = httpx.get(demo.url + "docs/searchindex.js", timeout=WAIT_S).headers["content-type"]
    assert script.startswith(("text/javascript", "application/javascript"))
    assert httpx.get(demo.url + "docs/no-such-page.html", timeout=WAIT_S).status_code == 404
    assert httpx.get(demo.url + "docs/..%2f..%2fREADME.md", timeout=WAIT_S).status_code == 404


@pytest.mark.usefixtures("built")
def test_a_page_is_found_read_in_dark_mode_and_passes_axe(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "docs/")
    page.keyboard.press("/")
    page.keyboard.type("position unit\n")
    page.locator(".search a").first.wait_for()
    assert complaints(page) == []
    page.locator(".search a", has_text="The position unit").click()
    page.get_by_role("heading", level=1, name="The position unit").wait_for()
    for theme in ("light", "dark"):
        page.evaluate("theme => localStorage.setItem('hornbill.theme', theme)", theme)
        for path in ("docs/index.html", "docs/tutorial.html", "docs/reference/api/servos.html"):
            page.goto(demo.url + path)
            assert page.locator("html").get_attribute("data-theme") == theme
            assert complaints(page) == [], path
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.usefixtures("built")
def test_documentation_and_page_share_the_theme(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "docs/")
    icons = "[...document.querySelectorAll('button use')].filter(one => one.getBoundingClientRect().width > 10)"
    page.wait_for_function(f"{icons}.length > 0")  # from their file
    page.get_by_role("button", name="color theme").first.click()
    chosen = page.locator("html").get_attribute("data-theme")
    assert page.evaluate("localStorage.getItem('hornbill.theme')") == chosen
    page.goto(demo.url + "docs/tutorial.html")
    assert page.locator("html").get_attribute("data-theme") == chosen
    page.get_by_role("button", name="Copy").first.wait_for(state="attached")


GUIDES = re.findall(
    r'^  (\w+): "([\w/-]*)",$', (ROOT / "web" / "src" / "kit" / "guide.tsx").read_text("utf-8"), re.MULTILINE
)


@pytest.mark.usefixtures("built")
def test_links_from_the_page_into_the_documentation_resolve(page: Page, demo: Demo) -> None:
    assert len(GUIDES) > 10
    for name, place in GUIDES:
        response = httpx.get(f"{demo.url}docs/{place and place + '.html'}", timeout=WAIT_S)
        assert response.status_code == 200, name
    page.goto(demo.url + "api-page")
    page.get_by_test_id("guide-rigs").wait_for()
    page.get_by_test_id("keys").click()
    page.get_by_test_id("guide-tutorial").wait_for()
    links = page.locator('a[href*="/docs/"]').evaluate_all("all => all.map(one => [one.href, one.target])")
    assert {httpx.get(href, timeout=WAIT_S).status_code for href, _ in links} == {200}
    assert {target for _, target in links} == {"_blank"}, "what is staged or moving stays in its own tab"
    assert {href.removeprefix(demo.url) for href, _ in links} >= {"docs/", "docs/tutorial.html", "docs/rigs.html"}
