"""The event stream over real connections, direct and through nginx: a client that reconnects resumes."""

import json
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from e2e.servers import running
from e2e.state import WAIT_S
from e2e.test_reverse_proxy import TOKEN, nginx

BEARER = {"Authorization": f"Bearer {TOKEN}"}
STREAM = "api/v1/events/stream?topics=events"


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    flags = ("--servos", "1", "--token", TOKEN, "--behind-proxy", "--root-path", "/hornbill")
    with running("demo", *flags) as one:
        yield one.url


@pytest.fixture(params=["uvicorn", "nginx"])
def url(server: str, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """The server itself, and through the proxy."""
    if request.param == "uvicorn":
        yield server
        return
    with nginx(tmp_path, server, strips=False) as (address, _):
        yield address


class Reader:
    """Events of one connection."""

    def __init__(self, response: httpx.Response) -> None:
        self.response = response
        self._lines = response.iter_lines()
        self.last = ""

    def next(self) -> dict[str, Any]:
        """The next event; comments are skipped."""
        fields: dict[str, str] = {}
        until = time.monotonic() + WAIT_S
        for line in self._lines:
            assert time.monotonic() < until, "nothing but comments"
            if line:
                name, _, value = line.partition(": ")
                fields[name] = value
            elif "event" in fields:
                self.last = fields.get("id", self.last)
                return json.loads(fields["data"])
            else:
                fields = {}
        raise AssertionError("the stream ended")

    def receive(self, kind: str) -> dict[str, Any]:
        while (found := self.next())["type"] != kind:
            pass
        return found


@contextmanager
def reading(client: httpx.Client, last: str | None = None) -> Generator[Reader]:
    headers = {} if last is None else {"Last-Event-ID": last}
    with client.stream("GET", STREAM, headers=headers) as response:
        assert response.status_code == 200
        assert response.headers["content-type"].startswith("text/event-stream")
        yield Reader(response)


def test_the_last_id_resumes_the_stream_without_repeats(url: str) -> None:
    with httpx.Client(base_url=url, headers=BEARER, timeout=WAIT_S) as client:

        def stop(reason: str) -> None:
            client.post("api/v1/stop", json={"mode": "off", "reason": reason}).raise_for_status()

        def until(reader: Reader, reason: str) -> list[dict[str, Any]]:
            """All messages up to the present stop and its event, which arrive in any order."""
            received: list[dict[str, Any]] = []
            at: float | None = None
            while at is None or not any(one.get("code") == "stopped" and one["at"] >= at for one in received):
                received.append(reader.next())
                if received[-1]["type"] == "stop" and received[-1]["stop"]["reason"] == reason:
                    at = received[-1]["stop"]["at"]
            return received

        with reading(client) as before:
            assert before.next()["type"] == "hello"
            stop(f"at {url}")  # received while streaming: no proxy buffers it
            seen = max(one["at"] for one in until(before, f"at {url}") if one["type"] == "event")
            last = before.last
        assert last
        client.delete("api/v1/stop").raise_for_status()
        stop(f"away from {url}")
        with reading(client, last) as after:
            received = until(after, f"away from {url}")
        client.delete("api/v1/stop").raise_for_status()
        assert received[0]["type"] == "hello", "every connection begins with it"
        assert not {"hello", "dropped"} & {one["type"] for one in received[1:]}
        news = [one for one in received if one["type"] == "event"]
        assert {"stop_cleared", "stopped"} <= {one["code"] for one in news}
        assert all(one["at"] > seen for one in news), "an event was sent twice"


def test_an_unknown_id_reports_a_gap_and_sends_the_state(url: str) -> None:
    with (
        httpx.Client(base_url=url, headers=BEARER, timeout=WAIT_S) as client,
        reading(client, "of-another-life-7") as after,
    ):
        kinds = [after.next()["type"] for _ in range(2)]
        assert sorted(kinds) == ["dropped", "hello"]
        assert after.receive("stop")["stop"] is not None


def test_the_stream_needs_a_token(url: str) -> None:
    assert httpx.get(url + STREAM, timeout=WAIT_S).status_code == 401
