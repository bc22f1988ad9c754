"""Every command of every guide is run, and the built site holds together, with and without a browser."""

import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import httpx
import pytest
from playwright.sync_api import Page

from e2e.conftest import Demo, as_in_rom
from e2e.guides import ENDLESS, NEEDS, ROOT, WRITTEN, Block, Rig, blocks, guides
from e2e.looks import complaints
from e2e.servers import Server, running

PAGES = [file for file in guides() if any(not one.marks for one in blocks(file))]
MARKED = [one for file in guides() for one in blocks(file) if one.marks]
NO_HARDWARE = "needs hardware"


@pytest.fixture(scope="module")
def shared() -> Iterator[Server]:
    """One demo for all guides: what is in ROM is as their last reader left it, as a reader's is."""
    with running("demo", "--servos", "3", "--seed", "3") as server:
        server.ready(3)
        yield server


@pytest.fixture
def bench(shared: Server) -> Iterator[Server]:
    """The demo, without a stop, a lease or values in RAM alone of the guide before."""
    shared.ready(3)
    for one in shared.servos():
        as_in_rom(shared.api, str(one["uid"]))
    yield shared
    shared.api.delete("/stop")
    for lease in shared.api.get("/leases").json():
        shared.api.delete(f"/leases/{lease['id']}")


@pytest.mark.parametrize("guide", PAGES, ids=lambda file: str(file.relative_to(ROOT)))
def test_a_guides_commands_run_from_top_to_bottom(bench: Server, tmp_path: Path, guide: Path) -> None:
    serial = str(bench.servos()[0]["serial"])
    run = [one for one in blocks(guide) if not one.marks]
    script = "\n".join(f"echo '== {one}' >&2\n{one.script}" for one in run)
    (tmp_path / "bench.toml").touch()
    Rig(bench.url.rstrip("/"), serial).bash(script, tmp_path)


@pytest.mark.parametrize("block", MARKED, ids=str)
def test_a_marked_command_says_what_it_needs_or_starts_and_ends(tmp_path: Path, block: Block) -> None:
    assert set(block.marks) <= {*NEEDS, ENDLESS}, f"{block}: say one of {NEEDS} or {ENDLESS}"
    if block.needs:
        pytest.skip(f"{block}: {block.needs}: {block.script.strip().splitlines()[-1]}")
    command = block.script.replace(f"# {ENDLESS}\n", "exec ").strip()
    (tmp_path / "morning.log").write_text("(1700000000.000000) can0 1001550B#0000000000000000\n")
    environment = {**Rig("", "").environment, "HORNBILL_PORT": "0", "HORNBILL_DATA_DIR": str(tmp_path / "data")}
    del environment["HORNBILL_URL"]
    with subprocess.Popen(
        ["bash", "-c", command], stdout=subprocess.PIPE, text=True, env=environment, cwd=tmp_path
    ) as process:
        assert process.stdout is not None
        try:
            assert "http://" in process.stdout.readline(), command
        finally:
            process.send_signal(signal.SIGINT)
        assert process.wait(timeout=15) == 0


def test_the_readmes_flow_by_curl_does_what_its_comments_say(bench: Server, tmp_path: Path) -> None:
    (block,) = [one for one in blocks(ROOT / "README.md") if "API=" in one.script]
    rig = Rig(bench.url.rstrip("/"), str(bench.servos()[0]["serial"]))
    out = rig.bash(block.script, tmp_path).replace(": ", ":").replace(", ", ",")
    for said in (
        '"code":"out_of_range"', '"outcome":"applied"', '"state":"succeeded"', '"settled":true', '"latched":true',
        '"code":"stopped"', '"latched":false',
    ):  # fmt: skip
        assert said in out, said
    uid = bench.servos()[0]["uid"]
    rows = bench.api.get(f"/servos/{uid}/parameters").json()["parameters"]
    assert rows["angle_limit_cw"]["rom"] == 75.0


def test_every_command_is_in_a_block_that_is_looked_at_and_no_other_shell() -> None:
    for guide in guides():
        found = re.findall(
            r"^ *```(?:sh|shell|console|zsh)\b.*|^ +```bash", guide.read_text(encoding="utf-8"), re.MULTILINE
        )
        assert found == [], f"{guide}: write ```bash at the beginning of a line"


def test_no_guide_shows_another_serial() -> None:
    for guide in guides():
        assert set(re.findall(r"\b6[12]-\d{6}\b", guide.read_text(encoding="utf-8"))) <= {WRITTEN}, guide


class Links(HTMLParser):
    """What a page points at, and what in it can be pointed at."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.pointers: set[str] = set()
        """Those that are followed when somebody clicks, and not fetched."""
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


def sphinx(sources: Path, out: Path, scratch: Path) -> subprocess.CompletedProcess[str]:
    """As `make docs` calls it."""
    options = ["-q", "-W", "-E", "-c", sources / "docs" / "site", "-d", scratch]
    return subprocess.run(
        [sys.executable, "-m", "sphinx", *options, sources, out], capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, where the program looks for it in a checkout."""
    out = ROOT / "docs" / "dist"
    shutil.rmtree(out, ignore_errors=True)
    made = sphinx(ROOT, out, tmp_path_factory.mktemp("doctrees"))
    assert made.returncode == 0, made.stderr[-2000:]
    return out


def test_every_link_of_the_built_site_leads_somewhere_inside_it_and_nothing_is_inline(built: Path) -> None:
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


def test_a_link_that_leads_nowhere_ends_the_build(tmp_path: Path) -> None:
    copy = tmp_path / "checkout"
    for name in ("docs", "schemas", "web/src/style", "web/public", "server/README.md", "tests/README.md",
                 "web/README.md", "examples/README.md", "README.md", "CONTRIBUTING.md", "CHANGELOG.md"):  # fmt: skip
        source, target = ROOT / name, copy / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("dist"))
        else:
            shutil.copy(source, target)
    (copy / "docs" / "tutorial.md").write_text("# Broken\n\n[here](nowhere.md) and [there](rigs.md#no-such-heading)\n")
    (copy / "docs" / "unlisted.md").write_text("# In no menu\n")
    built = sphinx(copy, tmp_path / "out", tmp_path / "doctrees")
    assert built.returncode == 1
    assert re.search(r"tutorial\.md:3: WARNING: .*'nowhere\.md'", built.stderr)
    assert re.search(r"tutorial\.md:3: WARNING: .*'no-such-heading'", built.stderr)
    assert re.search(r"unlisted\.md: WARNING: document isn't included in any toctree", built.stderr)


@pytest.mark.usefixtures("built")
def test_the_program_serves_the_site_below_docs_under_the_pages_policy(demo: Demo) -> None:
    index = httpx.get(demo.url + "docs", follow_redirects=True)
    assert index.url.path == "/docs/"
    assert "<title>hornbill documentation" in index.text
    assert "script-src 'self'; style-src 'self';" in index.headers["content-security-policy"]
    assert httpx.get(demo.url + "docs/reference/parameters.html").status_code == 200
    script = httpx.get(demo.url + "docs/searchindex.js").headers["content-type"]
    assert script.startswith(("text/javascript", "application/javascript"))
    assert httpx.get(demo.url + "docs/no-such-page.html").status_code == 404
    assert httpx.get(demo.url + "docs/..%2f..%2fREADME.md").status_code == 404


@pytest.mark.usefixtures("built")
def test_somebody_finds_a_page_reads_it_dark_and_axe_finds_nothing(page: Page, demo: Demo) -> None:
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
def test_the_theme_chosen_in_the_documentation_is_the_pages(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "docs/")
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
def test_every_link_of_the_page_into_the_documentation_is_answered(page: Page, demo: Demo) -> None:
    assert len(GUIDES) > 10
    for name, place in GUIDES:
        answer = httpx.get(f"{demo.url}docs/{place and place + '.html'}")
        assert answer.status_code == 200, name
    page.goto(demo.url + "api-page")
    page.get_by_test_id("guide-rigs").wait_for()
    page.get_by_test_id("keys").click()
    page.get_by_test_id("guide-tutorial").wait_for()
    links = page.locator('a[href*="/docs/"]').evaluate_all("all => all.map(one => [one.href, one.target])")
    assert {httpx.get(href).status_code for href, _ in links} == {200}
    assert {target for _, target in links} == {"_blank"}, "what is staged or moving stays in its own tab"
    assert {href.removeprefix(demo.url) for href, _ in links} >= {"docs/", "docs/tutorial.html", "docs/rigs.html"}
