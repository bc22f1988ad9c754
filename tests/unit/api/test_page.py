"""The page is served with a strict policy, and never a file from outside its folder."""

from pathlib import Path

import httpx
import pytest

from hornbill.api.http import create_api
from hornbill.schema.catalog import Catalog
from unit.api.asgi import send

CATALOG = Catalog.load()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "secret").write_text("not for you")
    page = tmp_path / "page"
    (page / "assets").mkdir(parents=True)
    (page / "index.html").write_text("<!doctype html><title>hornbill</title>")
    (page / "assets" / "a-1234.js").write_text("export {};")
    return page


def get(path: str, folder: Path | None) -> httpx.Response:
    return send(create_api(CATALOG, page_folder=lambda: folder), "GET", path)


@pytest.mark.parametrize("path", ["/", "/servos", "/servos/0123/parameters"])
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
