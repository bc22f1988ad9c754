"""Values for several servos at a steady rate, for the length of a block."""

# Made from hornbill.client.aio by `make generate`: change it there.

from collections.abc import Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self

from hornbill.client import answers
from hornbill.errors import Conflict, HornbillError

if TYPE_CHECKING:
    from hornbill.client.sync.connection import Connection
    from hornbill.client.sync.servo import Servo


class Stream:
    """Repeats the newest values at `rate_hz` from the start of the block to its end, under a lease.

    It begins where the horns stand. One ArrayCommand carries up to 15 servos.
    """

    def __init__(
        self,
        connection: "Connection",
        servos: "list[Servo]",
        kind: Literal["angle", "speed", "torque"],
        rate_hz: float,
    ) -> None:
        self._ask = connection.ask
        self._wanted = {"uids": [one.uid for one in servos], "type": kind, "rate_hz": rate_hz}
        self.id: str | None = None

    def __enter__(self) -> Self:
        """Begin. Raises LeaseRequired, Stopped, Busy."""
        begun: answers.Stream = self._ask("POST", "/streams", self._wanted, once=True)
        self.id = begun["id"]
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End it; the horns stay where they are as long as the lease lasts."""
        try:
            self._ask("DELETE", f"/streams/{self.id}")
        except HornbillError:
            if error is None:
                raise

    def put(self, values: "Mapping[Servo, float]", *, speed_deg_s: float | None = None) -> answers.Stream:
        """New values (°, rpm or %), all or nothing; they leave with the next burst, or at a limited speed.

        Raises Conflict when the stream has ended by itself, with why.
        """
        body: dict[str, Any] = {"values": {servo.uid: value for servo, value in values.items()}}
        if speed_deg_s is not None:
            body["profile"] = {"speed_deg_s": speed_deg_s, "accel_deg_s2": 4 * speed_deg_s}
        return _running(self._ask("PUT", f"/streams/{self.id}", body))

    def state(self) -> answers.Stream:
        """How well it keeps time; `ended` says why it ended, null while it runs."""
        return self._ask("GET", f"/streams/{self.id}")


def _running(state: answers.Stream) -> answers.Stream:
    if state["ended"] is not None:
        raise Conflict(f"The stream has ended: {state['ended']}", cause=None)
    return state
