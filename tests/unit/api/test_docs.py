"""The documentation is served as it was built; without it, and where a page is missing, people read what to do."""

import asyncio
from pathlib import Path

import httpx
import pytest

from hornbill import resources
from hornbill.api.http import create_api
from hornbill.schema.catalog import Catalog

CATALOG = Catalog.load()
INDEX = """<!doctype html>
<html lang="en" data-theme="dark"><head><title>hornbill</title><script src="./theme.js"></script>
<script type="module" crossorigin src="./assets/index-1.js"></script><link rel="stylesheet" href="./assets/index-1.css">
<link rel="modulepreload" href="./assets/start-1.js"></head>
<body>
<div id="app"></div></body></html>"""


def get(path: str, docs: Path | None, page: Path | None, language: str = "en-GB", root: str = "") -> httpx.Response:
    async def ask() -> httpx.Response:
        api = create_api(CATALOG, page_folder=lambda: page, docs_folder=lambda: docs)
        transport = httpx.ASGITransport(api, root_path=root)
        headers = {"Accept-Language": language}
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1", headers=headers) as client:
            return await client.get(root + path)

    return asyncio.run(ask())


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


def test_what_was_built_is_served(docs: Path, page: Path) -> None:
    answer = get("/docs/", docs, page)
    assert (answer.status_code, "Documentation" in answer.text) == (200, True)
    assert "default-src 'none'" in answer.headers["content-security-policy"]


@pytest.mark.parametrize(("language", "back"), [("en-GB,en", "Back to hornbill"), ("ja-JP,ja;q=0.9", "hornbillに戻る")])
@pytest.mark.parametrize(("checkout", "remedy"), [(True, "make docs"), (False, "")])
def test_without_it_a_page_in_our_look_names_a_remedy_that_is_possible_there(
    page: Path, monkeypatch: pytest.MonkeyPatch, language: str, back: str, checkout: bool, remedy: str
) -> None:
    monkeypatch.setattr(resources, "checkout", lambda: page if checkout else None)
    answer = get("/docs/how-to/move.html", None, page, language, root="/hornbill")
    assert answer.status_code == 503
    assert answer.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert ("make docs" in answer.text) == bool(remedy)
    assert back in answer.text
    assert 'href="/hornbill/"' in answer.text
    assert 'href="/hornbill/assets/index-1.css"' in answer.text
    assert "module" not in answer.text, "the page itself is not started"


def test_a_page_it_does_not_have_leads_to_its_contents(docs: Path, page: Path) -> None:
    answer = get("/docs/nothing.html", docs, page)
    assert answer.status_code == 404
    assert 'href="/docs/"' in answer.text
    assert get("/docs/../page/index.html", docs, page).text != INDEX


def test_without_a_built_page_either_it_is_plain_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resources, "checkout", lambda: Path())
    answer = get("/docs/", None, None)
    assert answer.status_code == 503
    assert "make docs" in answer.text
    assert "<" not in answer.text
