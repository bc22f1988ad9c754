"""The documentation is served as built; without it, or for a missing page, an error page names the remedy."""

from pathlib import Path

import httpx
import pytest

from hornbill import resources
from hornbill.api.http import create_api
from hornbill.schema.catalog import Catalog
from unit.api.asgi import send

CATALOG = Catalog.load()
INDEX = """<!doctype html>
<html lang="en" data-theme="dark"><head><title>hornbill</title><script src="./theme.js"></script>
<script type="module" crossorigin src="./assets/index-1.js"></script><link rel="stylesheet" href="./assets/index-1.css">
<link rel="modulepreload" href="./assets/start-1.js"></head>
<body>
<div id="app"></div></body></html>"""


def get(path: str, docs: Path | None, page: Path | None, language: str = "en-GB", root: str = "") -> httpx.Response:
    api = create_api(CATALOG, page_folder=lambda: page, docs_folder=lambda: docs)
    return send(api, "GET", path, headers={"Accept-Language": language}, root=root)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    (tmp_path / "page").mkdir()
    (tmp_path / "page" / "index.html").write_text(INDEX)
    return tmp_path / "page"


@pytest.fixture
def docs(tmp_path: Path) -> Path:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.html").write_text("<title>Documentation</title>")
    return tmp_path / "docs"


def test_the_built_documentation_is_served(docs: Path, page: Path) -> None:
    response = get("/docs/", docs, page)
    assert (response.status_code, "Documentation" in response.text) == (200, True)
    assert "default-src 'none'" in response.headers["content-security-policy"]


@pytest.mark.parametrize(("language", "back"), [("en-GB,en", "Back to hornbill"), ("ja-JP,ja;q=0.9", "hornbillに戻る")])
@pytest.mark.parametrize(("checkout", "remedy"), [(True, "make docs"), (False, "")])
def test_without_it_an_error_page_names_the_remedy(
    page: Path, monkeypatch: pytest.MonkeyPatch, language: str, back: str, checkout: bool, remedy: str
) -> None:
    monkeypatch.setattr(resources, "checkout", lambda: page if checkout else None)
    response = get("/docs/how-to/move.html", None, page, language, root="/hornbill")
    assert response.status_code == 503
    assert response.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in response.headers["content-security-policy"]
    assert ("make docs" in response.text) == bool(remedy)
    assert back in response.text
    assert 'href="/hornbill/"' in response.text
    assert 'href="/hornbill/assets/index-1.css"' in response.text
    assert "module" not in response.text, "the scripts of the page do not run"


def test_a_missing_page_links_to_the_contents(docs: Path, page: Path) -> None:
    response = get("/docs/nothing.html", docs, page)
    assert response.status_code == 404
    assert 'href="/docs/"' in response.text
    assert get("/docs/../page/index.html", docs, page).text != INDEX


def test_without_a_built_page_the_error_is_plain_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resources, "checkout", lambda: Path())
    response = get("/docs/", None, None)
    assert response.status_code == 503
    assert "make docs" in response.text
    assert "<" not in response.text
