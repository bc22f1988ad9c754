"""A foreign page in the same browser can neither read nor change anything."""

import pytest
from starlette.requests import HTTPConnection

from hornbill.api.http import create_api
from hornbill.api.security.origin import local_policy
from hornbill.schema.catalog import Catalog
from unit.api.asgi import send

POLICY = local_policy(frozenset(("127.0.0.1", "localhost", "::1")))


def connection(kind: str = "http", method: str = "POST", path: str = "/", **headers: str) -> HTTPConnection:
    pairs = [(name.encode(), value.encode()) for name, value in headers.items()]
    return HTTPConnection({"type": kind, "method": method, "path": path, "headers": pairs})


@pytest.mark.parametrize("host", ["127.0.0.1:8000", "localhost:8000", "[::1]:8000", "127.0.0.1"])
def test_the_page_and_programs_are_allowed(host: str) -> None:
    assert POLICY(connection(host=host, origin=f"http://{host}")) is None
    assert POLICY(connection(host=host)) is None


@pytest.mark.parametrize(
    "headers",
    [
        {"host": "127.0.0.1:8000", "origin": "http://evil.example"},
        {"host": "127.0.0.1:8000", "origin": "http://127.0.0.1:9000"},
        {"host": "127.0.0.1:8000", "origin": "null"},
        {"host": "evil.example", "origin": "http://evil.example"},
        {"host": "evil.example"},
        {"host": "127.0.0.1.evil.example"},
        {},
        *({"host": host} for host in ("[", "[::1", "", "a b", "127.0.0.1@evil.example")),
    ],
)
def test_foreign_hosts_and_origins_are_rejected(headers: dict[str, str]) -> None:
    assert POLICY(connection(**headers)) is not None
    assert POLICY(connection(method="GET", **headers)) is not None, "not even for reading"
    assert POLICY(connection(kind="websocket", **headers)) is not None


def test_the_rejection_is_a_problem_and_reaches_no_route() -> None:
    api = create_api(Catalog.load(), policy=POLICY)
    response = send(api, "POST", "/api/v1/stop", headers={"Origin": "http://evil.example"})
    assert response.status_code == 403
    assert response.headers["content-type"] == "application/problem+json"
    assert response.json()["code"] == "forbidden_origin"


def test_another_site_can_only_link_to_the_page() -> None:
    """Images, frames and fetches have no Origin, but the browser sends Sec-Fetch-Site."""
    own = {"host": "127.0.0.1:8000"}
    for site in ("cross-site", "same-site"):
        for path in ("/api/v1/servos", "/viser/", "/metrics"):
            for mode, dest in (("no-cors", "image"), ("navigate", "iframe"), ("navigate", "document")):
                headers = {"sec-fetch-site": site, "sec-fetch-mode": mode, "sec-fetch-dest": dest}
                assert POLICY(connection("http", "GET", path, **own, **headers)) is not None, (path, mode, dest)
        link = {"sec-fetch-site": site, "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
        assert POLICY(connection("http", "GET", "/servos", **own, **link)) is None
        assert POLICY(connection("http", "POST", "/servos", **own, **link)) is not None
    for site in ("same-origin", "none"):
        assert POLICY(connection("http", "GET", "/api/v1/servos", **own, **{"sec-fetch-site": site})) is None


def test_any_ip_address_is_a_host_where_allowed() -> None:
    numbers = local_policy(frozenset(("localhost",)), addresses=True)
    assert numbers(connection(host="192.0.2.7:8000")) is None
    assert numbers(connection(host="[2001:db8::1]:8000")) is None
    assert numbers(connection(host="evil.example")) is not None
    assert POLICY(connection(host="192.0.2.7:8000")) is not None
