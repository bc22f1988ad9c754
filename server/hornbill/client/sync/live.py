"""Live events and samples over the server's event stream, which resumes after a lost connection."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

import json
import time
import uuid
from contextlib import closing
from typing import TYPE_CHECKING, Any

from hornbill.client.live import Gap, Sample
from hornbill.client.problems import ServerUnreachable
from hornbill.errors import HornbillError

if TYPE_CHECKING:
    from collections.abc import Collection, Generator, Sequence

    from hornbill.client import responses
    from hornbill.client.sync.connection import Connection

SILENCE_S = 25.0
"""A stream without any line for this time is lost: the server sends one every 10 s."""
PAUSE_S = 1.0
"""Pause before reconnecting."""
TTL_S = 60.0
RENEW_S = 20.0
"""Lifetime of a telemetry subscription, and time between its renewals."""


class Live:
    """The event stream of one server. Reconnects, and resumes after the last message, for up to `reconnect_s`."""

    def __init__(self, connection: Connection, reconnect_s: float | None) -> None:
        """`reconnect_s`: then ServerUnreachable is raised; None: never. The first connection is not retried."""
        self._connection = connection
        self._reconnect_s = reconnect_s

    def events(self, uids: Collection[str] | None, *, past: bool) -> Generator[responses.EventMessage | Gap]:
        """Entries of the event log of these servos (None: all) and of no servo."""
        began: float | None = None
        with closing(self._messages("events", None)) as messages:
            for message in messages:
                match message["type"]:
                    case "hello" if began is None:
                        began = 0.0 if past else message["now"] + message["utc_offset"]
                    case "event" if message["at"] >= (began or 0.0):
                        if uids is None or message["uid"] is None or message["uid"] in uids:
                            yield message
                    case "dropped" if not message["telemetry"]:
                        yield _gap(message)
                    case _:
                        pass

    def samples(self, uids: Collection[str], channels: Sequence[str], rate_hz: float | None) -> Generator[Sample | Gap]:
        """Samples in the order of their times within each servo. With `rate_hz`, subscribes to them meanwhile."""
        owner = f"{self._connection.by} {uuid.uuid4().hex[:8]}"
        offset = newest = 0.0
        renewed: tuple[float, float] | None = None  # on our clock and on the server's, which may be faster
        try:
            with closing(self._messages("telemetry", uids)) as messages:
                for message in messages:
                    if message["type"] == "hello":
                        offset = message["utc_offset"]
                        newest, renewed = message["now"], None  # the server may have been restarted
                    elif message["type"] == "telemetry":
                        newest = max(newest, *(column["t"][-1] for column in message["channels"].values()))
                    now = time.monotonic(), newest
                    if rate_hz is not None and (
                        renewed is None or max(now[0] - renewed[0], now[1] - renewed[1]) > RENEW_S
                    ):
                        renewed = now
                        self._subscribe(uids, channels, rate_hz, owner)
                    if message["type"] == "telemetry":
                        for sample in _samples(message, channels, offset):
                            yield sample
                    elif message["type"] == "dropped" and message["telemetry"]:
                        yield _gap(message)
        finally:
            if rate_hz is not None and renewed is not None and not self._connection.closed:
                try:
                    self._subscribe(uids, [], rate_hz, owner)
                except HornbillError:
                    pass  # it expires

    def _subscribe(self, uids: Collection[str], channels: Sequence[str], rate_hz: float, owner: str) -> None:
        body = {"channels": list(channels), "rate_hz": rate_hz, "ttl_s": TTL_S, "owner": owner[-64:]}
        for uid in uids:
            self._connection.request("PUT", f"/servos/{uid}/telemetry", body)

    def _messages(self, topics: str, uids: Collection[str] | None) -> Generator[Any]:
        """Messages of the stream; a heartbeat is one, too."""
        last: str | None = None
        lost_at: float | None = None
        connected = False
        query = {"topics": topics, "uids": None if uids is None else ",".join(uids)}
        while True:
            why = "It ended."
            headers = {} if last is None else {"Last-Event-ID": last}
            try:
                with self._connection.lines("/events/stream", silence_s=SILENCE_S, headers=headers, **query) as lines:
                    name, data = last, ""
                    for line in lines:
                        if line.startswith("data: "):
                            data = line[6:]
                        elif line.startswith("id: "):
                            name = line[4:]
                        elif line.startswith(":"):
                            yield {"type": "heartbeat"}
                        elif not line and data:
                            connected, last, lost_at = True, name, None
                            yield json.loads(data)
                            data = ""
            except ServerUnreachable as error:
                if not connected:
                    raise
                why = error.detail
            lost_at = lost_at or time.monotonic()
            if self._reconnect_s is not None and time.monotonic() - lost_at >= self._reconnect_s:
                text = f"The event stream was lost and did not return within {self._reconnect_s:g} s. {why}"
                raise ServerUnreachable(text, cause=None, sent=False)
            time.sleep(PAUSE_S)


def _samples(message: Any, channels: Collection[str], offset: float) -> list[Sample | Gap]:
    uid = message["uid"]
    found = [
        Gap("no_value", t + offset, uid=uid, key=key) if value is None else Sample(uid, key, t + offset, value)
        for key, column in message["channels"].items()
        if key in channels
        for t, value in zip(column["t"], column["v"], strict=True)
    ]
    return sorted(found, key=lambda one: one.t)


def _gap(message: Any) -> Gap:
    return Gap("lost", time.time(), message["count"])
