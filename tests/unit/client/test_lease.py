"""The lease of the synchronous client: a thread renews it, and it is always released."""

import threading
from typing import Any

import httpx
import pytest

from hornbill.client import Hornbill
from hornbill.errors import LeaseHeld, LeaseRequired


class Server:
    """Grants a lease and counts its renewals; after `lost_after` renewals they fail, usually as it is unknown."""

    def __init__(self, lost_after: int | None = None, status: int = 404) -> None:
        self.seen: list[tuple[str, str, str | None]] = []
        self.renewed = threading.Event()
        self._lost_after = lost_after
        self._renewals = 0
        self._failure = {404: "unknown_lease", 503: "store_failed"}[status], status

    def __call__(self, request: httpx.Request) -> httpx.Response:
        path = request.url.path.removeprefix("/api/v1")
        self.seen.append((request.method, path, request.headers.get("Lease")))
        if request.method == "PUT":
            self._renewals += 1
            self.renewed.set()
            if self._lost_after is not None and self._renewals > self._lost_after:
                code, status = self._failure
                return httpx.Response(status, json={"code": code, "detail": "The lease has ended."})
        return httpx.Response(200, json={"id": "L1", "holder": "rig"})

    def client(self) -> Hornbill:
        return Hornbill("http://rig:1", transport=httpx.MockTransport(self))


def threads() -> int:
    return sum(one.name == "hornbill lease" for one in threading.enumerate())


def test_a_thread_renews_it() -> None:
    server = Server()
    with server.client() as hornbill, hornbill.lease("rig", ttl_s=0.03):
        assert server.renewed.wait(5)
        assert threads() == 1
    assert threads() == 0
    assert server.seen[-1][:2] == ("DELETE", "/leases/L1")


def test_requests_inside_the_block_carry_the_lease() -> None:
    server = Server()
    with server.client() as hornbill:
        with hornbill.lease("rig"):
            hornbill.request("POST", "/commands", once=True)
        hornbill.request("POST", "/commands", once=True)
    assert [lease for _, path, lease in server.seen if path == "/commands"] == ["L1", None]


def test_it_is_released_when_the_block_fails() -> None:
    server = Server()
    with server.client() as hornbill:
        with pytest.raises(ZeroDivisionError), hornbill.lease("rig"):
            _ = 1 / 0
        assert hornbill.lease_id is None
    assert server.seen[-1][:2] == ("DELETE", "/leases/L1")
    assert threads() == 0


def test_a_lost_lease_fails_the_block() -> None:
    server = Server(lost_after=0)

    def block(hornbill: Hornbill) -> None:
        with hornbill.lease("rig", ttl_s=0.03) as lease:
            for thread in threading.enumerate():
                if thread.name == "hornbill lease":
                    thread.join(5)
            assert lease.lost == "The lease has ended."

    with server.client() as hornbill, pytest.raises(LeaseRequired, match="lost before the end"):
        block(hornbill)
    assert ("DELETE", "/leases/L1", None) not in server.seen


def test_a_failed_renewal_does_not_end_the_lease() -> None:
    server = Server(lost_after=0, status=503)
    with server.client() as hornbill:
        with hornbill.lease("rig", ttl_s=0.03) as lease:
            for _ in range(3):
                assert server.renewed.wait(5)
                server.renewed.clear()
        assert lease.lost is None
    assert server.seen[-1][0] == "DELETE"


def test_without_heartbeat_the_program_renews_it() -> None:
    server = Server()
    with server.client() as hornbill, hornbill.lease("rig", heartbeat=False) as lease:
        assert threads() == 0
        lease.renew()
    assert [one[:2] for one in server.seen] == [("POST", "/leases"), ("PUT", "/leases/L1"), ("DELETE", "/leases/L1")]


def test_a_held_lease_names_its_holder() -> None:
    def held(_request: httpx.Request) -> httpx.Response:
        facts: dict[str, Any] = {"holder": "bench 2", "expires_in_s": 1.5}
        return httpx.Response(409, json={"code": "lease_held", "detail": "bench 2 has it.", **facts})

    with Hornbill("http://rig:1", transport=httpx.MockTransport(held)) as hornbill:
        with pytest.raises(LeaseHeld) as caught, hornbill.lease("rig"):
            pytest.fail("it was not given")
        assert caught.value.facts["holder"] == "bench 2"
        assert hornbill.lease_id is None
