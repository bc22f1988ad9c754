"""Live samples in the synchronous client, from the lines of an event stream."""

import json
from typing import Any

import httpx
import pytest

from hornbill.client import Gap, Hornbill, Sample, ServerUnreachable, Servo
from hornbill.client.sync import live

UID = "0123456789abcdef" * 2
HELLO = {"type": "hello", "now": 100.0, "utc_offset": 1000.0}
COLUMNS = {"current_angle": {"t": [1.0, 3.0], "v": [5.0, None]}, "current_torque": {"t": [2.0], "v": [-3.0]}}
TELEMETRY = {"type": "telemetry", "uid": UID, "channels": {**COLUMNS, "position": {"t": [1.5], "v": [0.0]}}}
DROPPED = {"type": "dropped", "count": 7, "telemetry": True}


class Server:
    """Responds to each connection with one of the given texts, and refuses further ones."""

    def __init__(self, *connections: str) -> None:
        self._connections = list(connections)
        self.streams: list[httpx.Request] = []
        self.subscribed: list[dict[str, Any]] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        if request.method == "PUT":
            self.subscribed.append(json.loads(request.content))
            return httpx.Response(200, json={})
        self.streams.append(request)
        if not self._connections:
            raise httpx.ConnectError("refused", request=request)
        return httpx.Response(200, text=self._connections.pop(0), headers={"Content-Type": "text/event-stream"})


def lines(*messages: dict[str, Any], last: str = "") -> str:
    """An event stream of these messages; the ID of the last one is `last`."""
    blocks = [f"event: {one['type']}\ndata: {json.dumps(one)}\n" for one in messages]
    return "retry: 2000\n\n" + "\n".join(blocks) + (f"id: {last}\n" if last else "") + "\n: heartbeat\n\n"


def client(server: Server) -> tuple[Hornbill, Servo]:
    hornbill = Hornbill("http://rig:1", transport=httpx.MockTransport(server))
    known: Any = {"uid": UID}
    return hornbill, Servo(hornbill, known)


def test_samples_of_the_channels_come_in_order_with_gaps_and_the_stream_resumes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(live, "PAUSE_S", 0.0)
    server = Server(lines(HELLO, TELEMETRY, last="a.7"), lines(HELLO, DROPPED))
    hornbill, servo = client(server)
    found: list[Sample | Gap] = []
    for one in hornbill.telemetry([servo], list(COLUMNS)):
        found.append(one)
        if len(found) == 4:
            break
    assert found[:3] == [
        Sample(UID, "current_angle", 1001.0, 5.0),
        Sample(UID, "current_torque", 1002.0, -3.0),
        Gap("no_value", 1003.0, uid=UID, key="current_angle"),
    ]
    assert isinstance(found[3], Gap)
    assert (found[3].cause, found[3].lost, found[3].uid) == ("lost", 7, None)
    assert [one.headers.get("last-event-id") for one in server.streams] == [None, "a.7"]
    assert dict(server.streams[0].url.params) == {"topics": "telemetry", "uids": UID}
    hornbill.close()


def test_a_server_that_is_gone_raises_at_once_at_first_and_after_the_limit_later() -> None:
    hornbill, servo = client(Server(lines(HELLO)))
    with pytest.raises(ServerUnreachable, match="did not return within 0 s"):
        next(hornbill.telemetry([servo], ["current_angle"], reconnect_s=0.0))
    with pytest.raises(ServerUnreachable, match="No hornbill server responds"):
        next(hornbill.telemetry([servo], ["current_angle"]))
    hornbill.close()


def test_a_subscription_ends_with_the_loop_unless_the_client_is_closed() -> None:
    server = Server(lines(HELLO, TELEMETRY), lines(HELLO, TELEMETRY))
    hornbill, servo = client(server)
    for _ in hornbill.telemetry([servo], ["current_angle"], rate_hz=50):
        break
    assert [one["channels"] for one in server.subscribed] == [["current_angle"], []]
    samples = hornbill.telemetry([servo], ["current_angle"], rate_hz=50)
    next(samples)
    hornbill.close()
    samples.close()
    assert [one["channels"] for one in server.subscribed] == [["current_angle"], [], ["current_angle"]]
