"""Values for several servos at a steady rate, for the length of a block."""

from collections.abc import Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self

from hornbill.client import answers
from hornbill.errors import Conflict, HornbillError

if TYPE_CHECKING:
    from hornbill.client.aio.connection import AsyncConnection
    from hornbill.client.aio.servo import AsyncServo


class AsyncStream:
    """Repeats the newest values at `rate_hz` from the start of the block to its end, under a lease.

    It begins where the horns stand. One ArrayCommand carries up to 15 servos.
    """

    def __init__(
        self,
        connection: "AsyncConnection",
        servos: "list[AsyncServo]",
        kind: Literal["angle", "speed", "torque"],
        rate_hz: float,
    ) -> None:
        self._ask = connection.ask
        self._wanted = {"uids": [one.uid for one in servos], "type": kind, "rate_hz": rate_hz}
        self.id: str | None = None

    async def __aenter__(self) -> Self:
        """Begin. Raises LeaseRequired, Stopped, Busy."""
        begun: answers.Stream = await self._ask("POST", "/streams", self._wanted, once=True)
        self.id = begun["id"]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End it; the horns stay where they are as long as the lease lasts."""
        try:
            await self._ask("DELETE", f"/streams/{self.id}")
        except HornbillError:
            if error is None:
                raise

    async def put(self, values: "Mapping[AsyncServo, float]", *, speed_deg_s: float | None = None) -> answers.Stream:
        """New values (°, rpm or %), all or nothing; they leave with the next burst, or at a limited speed.

        Raises Conflict when the stream has ended by itself, with why.
        """
        body: dict[str, Any] = {"values": {servo.uid: value for servo, value in values.items()}}
        if speed_deg_s is not None:
            body["profile"] = {"speed_deg_s": speed_deg_s, "accel_deg_s2": 4 * speed_deg_s}
        return _running(await self._ask("PUT", f"/streams/{self.id}", body))

    async def state(self) -> answers.Stream:
        """How well it keeps time; `ended` says why it ended, null while it runs."""
        return await self._ask("GET", f"/streams/{self.id}")


def _running(state: answers.Stream) -> answers.Stream:
    if state["ended"] is not None:
        raise Conflict(f"The stream has ended: {state['ended']}", cause=None)
    return state
