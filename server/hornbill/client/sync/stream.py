"""Stream of setpoints as a context manager."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self

from hornbill.errors import Conflict, HornbillError

if TYPE_CHECKING:
    from hornbill.client import responses
    from hornbill.client.sync.connection import Connection
    from hornbill.client.sync.servo import Servo


class Stream:
    """Sends the newest setpoints at `rate_hz` for the duration of a block. Requires a lease.

    It first holds the current angles. One ArrayCommand contains up to 15 servos.
    """

    def __init__(
        self,
        connection: Connection,
        servos: list[Servo],
        kind: Literal["angle", "speed", "torque"],
        rate_hz: float,
    ) -> None:
        self._request = connection.request
        self._wanted = {"uids": [one.uid for one in servos], "type": kind, "rate_hz": rate_hz}
        self.id: str | None = None

    def __enter__(self) -> Self:
        """Start the stream. Raises LeaseRequired, Stopped, Busy."""
        started: responses.Stream = self._request("POST", "/streams", self._wanted, once=True)
        self.id = started["id"]
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the stream. The servos keep their last setpoint until the lease ends."""
        try:
            self._request("DELETE", f"/streams/{self.id}")
        except HornbillError:
            if error is None:
                raise

    def put(self, values: Mapping[Servo, float], *, speed_deg_s: float | None = None) -> responses.Stream:
        """Set new setpoints (°, rpm or %), all or nothing, sent with the next burst. `speed_deg_s` limits the speed.

        Raises Conflict, with the reason, if the stream has ended.
        """
        body: dict[str, Any] = {"values": {servo.uid: value for servo, value in values.items()}}
        if speed_deg_s is not None:
            body["profile"] = {"speed_deg_s": speed_deg_s, "accel_deg_s2": 4 * speed_deg_s}
        return _running(self._request("PUT", f"/streams/{self.id}", body))

    def state(self) -> responses.Stream:
        """State and timing. `ended`: reason why it ended, None while it runs."""
        return self._request("GET", f"/streams/{self.id}")


def _running(state: responses.Stream) -> responses.Stream:
    if state["ended"] is not None:
        raise Conflict(f"The stream has ended: {state['ended']}", cause=None)
    return state
