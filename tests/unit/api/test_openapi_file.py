"""The OpenAPI document is served from its file: compressed, with an ETag, and below a sub-path with its server."""

import httpx

from hornbill import resources
from hornbill.api.http import create_api
from hornbill.schema.catalog import Catalog
from unit.api.asgi import send

PATH = "/api/v1/openapi.json"


def get(root: str = "", **headers: str) -> httpx.Response:
    sent = {"Accept-Encoding": "gzip"} | {name.replace("_", "-"): value for name, value in headers.items()}
    return send(create_api(Catalog.load(), root_path=root), "GET", PATH, headers=sent, root=root)


def test_the_document_is_compressed_and_sent_once() -> None:
    response = get()
    assert response.content == resources.openapi().read_bytes()
    assert int(response.headers["content-length"]) < 150_000
    assert get(Accept_Encoding="identity").content == response.content
    again = get(If_None_Match=response.headers["etag"])
    assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", response.headers["etag"])


def test_the_document_below_a_sub_path_has_its_server() -> None:
    made = get("/hornbill").json()
    assert made == {"servers": [{"url": "/hornbill"}], **get().json()}
