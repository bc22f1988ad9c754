"""CPU time of the server for one request, compared with a bare FastAPI route of the same size; and the document."""

import socket
import statistics
import time
from collections.abc import Iterator, Sequence
from importlib.metadata import version
from typing import Any

import httpx

from bench.line import line
from bench.processes import cpu_s, server, wait_until_ready
from bench.rest_server import SERVOS

BARE = f"FastAPI {version('fastapi')}, a bare route"
REQUESTS, ROUNDS = 300, 5
IDLE_S = 2.0

Server = tuple[str, int]
"""Address and process ID."""


def figures() -> Iterator[dict[str, Any]]:
    """A validated write of an angle to a servo, the list of six servos, and the OpenAPI document."""
    with server(("-m", "bench.rest_server")) as ours:
        wait_until_ready(ours[0], SERVOS)
        api = ours[0] + "api/v1"
        servos = httpx.get(f"{api}/servos")
        with server(("-m", "bench.rest_server"), str(len(servos.content))) as bare:
            uid = servos.json()[0]["uid"]
            lease = httpx.post(f"{api}/leases", json={"holder": "bench", "ttl_s": 60}).json()["id"]
            head = {"Lease": lease}
            httpx.post(f"{api}/servos/{uid}/torque", json={"mode": "on"}, headers=head).raise_for_status()
            path = f"/api/v1/servos/{uid}/parameters/command_angle"
            puts = [_request("PUT", path, f"Lease: {lease}", body=b'{"value":%.1f}' % angle) for angle in (1.5, -1.5)]
            compared = _compare(ours, bare, puts)
            without = [_request("PUT", f"/without-exchange/{uid}/parameters/command_angle", body=b'{"value":1.5}')]
            compared["bare_ms_without_exchange"] = round(_cpu_s(bare, without, _idle(bare)) / REQUESTS * 1000, 3)
            yield line(
                "validated PUT of an angle, CPU", compared, of="times", must=1.6,
                peer=f"{BARE} that carries the same frames on the same simulated bus",
            )  # fmt: skip
            listing = [_request("GET", "/api/v1/servos")]
            compared = _compare(ours, bare, listing)
            yield line(f"list of {SERVOS} servos, CPU", compared, of="times", must=1.5, peer=BARE)
        document = [_request("GET", "/api/v1/openapi.json", "Accept-Encoding: gzip")]
        _cpu_s(ours, document, 0.0)  # the first compresses it
        figures = {"ms_each": round(_cpu_s(ours, document, 0.0) / REQUESTS * 1000, 3)}
        yield line(
            "OpenAPI document, compressed, CPU",
            figures,
            of="ms_each",
            must=20,
            limit="what a person takes for immediate",
        )


def _compare(ours: Server, bare: Server, requests: Sequence[bytes]) -> dict[str, float]:
    """Milliseconds a request of both, alternately; what they do without requests does not count."""
    idle, bare_idle = _idle(ours), _idle(bare)
    pairs = [(_cpu_s(ours, requests, idle), _cpu_s(bare, requests, bare_idle)) for _ in range(ROUNDS)]
    return {
        "ms_each": round(statistics.median(mine for mine, _ in pairs) / REQUESTS * 1000, 3),
        "bare_ms_each": round(statistics.median(theirs for _, theirs in pairs) / REQUESTS * 1000, 3),
        "idle_pct": round(idle * 100, 1),
        "times": round(statistics.median(mine / theirs for mine, theirs in pairs), 2),
    }


def _idle(of: Server) -> float:
    """Share of a core without requests."""
    began, idle = time.perf_counter(), cpu_s(of[1])
    time.sleep(IDLE_S)
    return (cpu_s(of[1]) - idle) / (time.perf_counter() - began)


def _cpu_s(of: Server, requests: Sequence[bytes], idle: float) -> float:
    """CPU seconds of the server for all requests, one after the other on one connection."""
    with socket.create_connection(("127.0.0.1", int(of[0].rstrip("/").rpartition(":")[2]))) as line_:
        began, before = time.perf_counter(), cpu_s(of[1])
        for number in range(REQUESTS):
            line_.sendall(requests[number % len(requests)])
            _receive(line_)
        return cpu_s(of[1]) - before - idle * (time.perf_counter() - began)


def _request(verb: str, path: str, *headers: str, body: bytes = b"") -> bytes:
    head = [f"{verb} {path} HTTP/1.1", "Host: 127.0.0.1", *headers]
    if body:
        head += ["Content-Type: application/json", f"Content-Length: {len(body)}"]
    return "\r\n".join((*head, "", "")).encode() + body


def _receive(line_: socket.socket) -> None:
    """One response."""
    data = line_.recv(65536)
    assert data.startswith(b"HTTP/1.1 200"), data
    head, _, body = data.partition(b"\r\n\r\n")
    low = head.lower()
    left = int(low[low.index(b"content-length:") + 15 :].split(b"\r", 1)[0]) - len(body)
    while left > 0:
        left -= len(line_.recv(65536))
