"""The page and the documentation are served with a strict policy, and never a file from outside their folders.

Without the documentation, or for a missing page of it, an error page names the remedy.
"""

import re
from pathlib import Path

import httpx
import pytest

from hornbill import resources
from hornbill.api.http import create_api
from hornbill.api.pages.page import PAGES
from hornbill.schema.catalog import Catalog
from unit.api.asgi import send

CATALOG = Catalog.load()
INDEX = """<!doctype html>
<html lang="en" data-theme="dark"><head><title>hornbill</title><script src="./theme.js"></script>
<script type="module" crossorigin src="./assets/index-1.js"></script><link rel="stylesheet" href="./assets/index-1.css">
<link rel="modulepreload" href="./assets/start-1.js"></head>
<body>
<div id="app"></div></body></html>"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The built page, beside a file that is not part of it."""
    (tmp_path / "secret").write_text("not for you")
    page = tmp_path / "page"
    (page / "assets").mkdir(parents=True)
    (page / "index.html").write_text(INDEX)
    (page / "assets" / "a-1234.js").write_text("export {};")
    return page


@pytest.fixture
def docs(tmp_path: Path) -> Path:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.html").write_text("<title>Documentation</title>")
    return tmp_path / "docs"


def get(
    path: str,
    folder: Path | None,
    docs: Path | None = None,
    *,
    language: str = "en-GB",
    root: str = "",
    accept: str = "*/*",
) -> httpx.Response:
    api = create_api(CATALOG, page_folder=lambda: folder, docs_folder=lambda: docs)
    return send(api, "GET", path, headers={"Accept-Language": language, "Accept": accept}, root=root)


def test_the_paths_of_the_page_are_those_of_its_router() -> None:
    router = (Path(__file__).parents[3] / "web/src/bench/route.ts").read_text(encoding="utf-8")
    alone = re.search(r"const ALONE = /\^\\/\((.*?)\)", router)
    of_a_servo = re.search(r"const SERVO = .*\(\?:\\/\((.*?)\)\)\?", router)
    assert alone is not None
    assert of_a_servo is not None
    paths = [*alone[1].split("|"), "api-page", "servos/matrix"]
    paths += [f"servos/{'0' * 32}/{tab}" for tab in of_a_servo[1].split("|")]
    assert len(paths) > 10
    assert [path for path in paths if not PAGES.fullmatch(path)] == []


UNKNOWN = ["/healthz", "/redoc", "/nothing", "/servos/0123/parameters", "/api", "/servos/x/y"]


@pytest.mark.parametrize("path", UNKNOWN)
def test_other_paths_are_not_the_page(path: str, folder: Path) -> None:
    response = get(path, folder)
    assert response.status_code == 404
    assert "<title>" not in response.text
    assert len(response.text) < 100


@pytest.mark.parametrize("path", UNKNOWN)
def test_a_browser_gets_the_page_with_status_404_for_other_paths(path: str, folder: Path) -> None:
    response = get(path, folder, accept="text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8")
    assert response.status_code == 404
    assert "<title>hornbill</title>" in response.text
    assert "default-src 'none'" in response.headers["content-security-policy"]
    assert response.headers["vary"] == "Accept"


@pytest.mark.parametrize("path", ["/", "/servos", f"/servos/{'01' * 16}/parameters", "/bus/"])
def test_every_path_of_the_page_opens_it(path: str, folder: Path) -> None:
    response = get(path, folder)
    assert response.status_code == 200
    assert "<title>hornbill</title>" in response.text
    policy = response.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert response.headers["x-content-type-options"] == "nosniff"
    assert response.headers["cache-control"] == "no-cache"


def test_files_with_a_hash_in_their_name_are_immutable(folder: Path) -> None:
    assert "immutable" in get("/assets/a-1234.js", folder).headers["cache-control"]


@pytest.mark.parametrize("path", ["/../secret", "/%2e%2e/secret", "/assets/../../secret", "/..%2fsecret"])
def test_nothing_outside_the_folder_is_served(path: str, folder: Path) -> None:
    assert "not for you" not in get(path, folder).text


@pytest.mark.parametrize(
    "path",
    ["/nothing.js", "/api/v1/nothing", "/api/nothing", "/" + "a" * 5000 + ".js", "/assets/%00.js", "/%00/a.js"],
)
def test_a_missing_file_is_a_problem(path: str, folder: Path) -> None:
    response = get(path, folder)
    assert response.status_code == 404
    assert response.json()["code"] == "not_found"


def test_without_a_built_page_the_error_names_the_remedy(folder: Path) -> None:
    response = get("/", None)
    assert response.status_code == 503
    assert "make build" in response.text


def test_the_built_documentation_is_served(folder: Path, docs: Path) -> None:
    response = get("/docs/", folder, docs)
    assert (response.status_code, "Documentation" in response.text) == (200, True)
    assert "default-src 'none'" in response.headers["content-security-policy"]


@pytest.mark.parametrize(("language", "back"), [("en-GB,en", "Back to hornbill"), ("ja-JP,ja;q=0.9", "hornbillに戻る")])
@pytest.mark.parametrize("checkout", [True, False])
def test_without_documentation_an_error_page_names_the_remedy(
    folder: Path, monkeypatch: pytest.MonkeyPatch, language: str, back: str, checkout: bool
) -> None:
    monkeypatch.setattr(resources, "checkout", lambda: folder if checkout else None)
    response = get("/docs/how-to/move.html", folder, language=language, root="/hornbill")
    assert response.status_code == 503
    assert response.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in response.headers["content-security-policy"]
    assert ("make docs" in response.text) is checkout
    for part in (back, 'href="/hornbill/"', 'href="/hornbill/assets/index-1.css"'):
        assert part in response.text
    assert "module" not in response.text, "the scripts of the page do not run"


def test_a_missing_page_of_the_documentation_links_to_the_contents(folder: Path, docs: Path) -> None:
    response = get("/docs/nothing.html", folder, docs)
    assert response.status_code == 404
    assert 'href="/docs/"' in response.text
    assert get("/docs/../page/index.html", folder, docs).text != INDEX


def test_without_page_and_documentation_the_error_is_plain_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resources, "checkout", lambda: Path())
    response = get("/docs/", None)
    assert (response.status_code, "make docs" in response.text, "<" in response.text) == (503, True, False)
