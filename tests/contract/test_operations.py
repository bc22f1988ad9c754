"""What clients rely on in the OpenAPI document: unique names, problems, idempotency keys, descriptions."""

import asyncio
from collections.abc import Iterator
from typing import Any

import httpx

from contract.document_server import document
from hornbill.api.http import create_api
from hornbill.api.openapi.sharing import parameters_of
from hornbill.api.routing import WITHOUT_KEY
from hornbill.api.security.access import Access
from hornbill.api.security.sessions import TRIES
from hornbill.schema.catalog import Catalog

CATALOG = Catalog.load()


def operations() -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, verbs in document()["paths"].items():
        for verb, operation in verbs.items():
            yield verb, path, operation


def problem(response: dict[str, Any]) -> dict[str, Any]:
    """The shared response that an operation refers to."""
    return document()["components"]["responses"][response["$ref"].rpartition("/")[2]]


def test_every_operation_has_a_unique_name_and_every_row_its_routes() -> None:
    """test_reach.py lists the names of all operations."""
    found = [operation["operationId"] for _, _, operation in operations()]
    assert len(found) == len(set(found))
    for key, row in CATALOG.readable.items():
        verbs = document()["paths"][f"/api/v1/servos/{{uid}}/parameters/{key}"]
        assert {verb: one["operationId"] for verb, one in verbs.items()} == {
            verb: f"{word}_{key}" for verb, word in (("get", "get"), ("put", "set")) if verb == "get" or row.writable
        }
        assert verbs["get"]["summary"] == row.label


def test_every_operation_describes_its_responses_and_problems_have_one_schema() -> None:
    for verb, path, operation in operations():
        place = f"{verb} {path}"
        assert operation.get("summary"), place
        assert operation.get("description"), place
        assert any(status.startswith("2") for status in operation["responses"]), place
        for status, response in operation["responses"].items():
            if not status.startswith("2"):
                shape = problem(response)["content"]["application/problem+json"]["schema"]
                assert shape["$ref"].endswith("/Problem"), place
            if status.startswith(("4", "5")):
                text = response.get("description", problem(response)["description"])
                assert "`" in text, f"{place} {status} names no code"


def test_every_operation_declares_its_problems_and_all_but_stop_the_limit_of_wrong_tokens() -> None:
    unlimited: list[str] = []
    for verb, path, operation in operations():
        common = problem(operation["responses"]["default"])
        assert "`forbidden_origin` (403)" in common["description"], f"{verb} {path}"
        if "`too_many_attempts` (429)" not in common["description"]:
            unlimited.append(operation["operationId"])
            continue
        assert common["headers"]["Retry-After"]["schema"]["type"] == "integer"
    assert unlimited == ["stop"]


def test_wrong_tokens_are_limited_as_declared() -> None:
    async def main() -> None:
        app = create_api(CATALOG, access=Access(given="the-one-that-is-right"))
        transport = httpx.ASGITransport(app, raise_app_exceptions=False, client=("192.0.2.9", 5000))
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as http:
            for at in range(TRIES):
                await http.get("/api/v1/servos", headers={"Authorization": f"Bearer wrong-{at}"})
            for verb, path, operation in operations():
                response = await http.request(verb.upper(), path, headers={"Authorization": "Bearer wrong"})
                limited = operation["operationId"] != "stop"
                assert response.status_code == (429 if limited else 401), f"{verb} {path}"
                assert ("retry-after" in response.headers) == limited

    asyncio.run(main())


def test_every_post_but_the_listed_ones_takes_an_idempotency_key() -> None:
    without: set[str] = set()
    for verb, path, operation in operations():
        named = {one["name"] for one in parameters_of(document(), operation)}
        assert verb == "post" or "Idempotency-Key" not in named
        if verb == "post" and "Idempotency-Key" not in named:
            without.add(path)
    assert without == set(WITHOUT_KEY)


def test_every_operation_with_202_has_wait() -> None:
    slow = [(path, operation) for _, path, operation in operations() if "202" in operation["responses"]]
    assert len(slow) > 8
    for path, operation in slow:
        named = {one["name"] for one in parameters_of(document(), operation)}
        # A person decides when a request for motion control ends.
        assert "wait" in named or path == "/api/v1/leases/requests", path


def test_titles_of_schemas_are_unique() -> None:
    titles = [one["title"] for one in document()["components"]["schemas"].values() if "title" in one]
    assert sorted(titles) == sorted(set(titles))
    assert not [name for name in document()["components"]["schemas"] if "__" in name]


def test_it_is_openapi_3_1_and_every_reference_exists() -> None:
    assert document()["openapi"].startswith("3.1")
    text = str(document())
    for part in text.split("#/components/schemas/")[1:]:
        name = part.split("'", 1)[0]
        assert name in document()["components"]["schemas"], name


def test_every_parameter_and_field_is_described() -> None:
    parameters = [(path, each) for _, path, one in operations() for each in parameters_of(document(), one)]
    assert [(path, one["name"]) for path, one in parameters if not is_described(one)] == []
    schemas = document()["components"]["schemas"]
    fields = [(shape, name, one) for shape, each in schemas.items() for name, one in each.get("properties", {}).items()]
    assert [
        f"{shape}.{name}"
        for shape, name, one in fields
        if not is_described(one) and "const" not in one and not shape.endswith("Value")
    ] == []


def is_described(declared: dict[str, Any]) -> bool:
    """With its own description, or that of the schema it refers to."""
    shape = document()["components"]["schemas"].get(declared.get("$ref", "").rpartition("/")[2], {})
    return any("description" in one for one in (declared, declared.get("schema", {}), shape))
