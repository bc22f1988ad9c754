"""Owns Fragments: servos, readings, bus, lease and stop as JSON, made once for all sockets that send them now."""

from collections.abc import Callable
from typing import Any

from pydantic import BaseModel

from hornbill.api import present
from hornbill.servo.host import Host
from hornbill.servo.hub import BusChanged, LeaseChanged, ReadingChanged, ServoChanged, StopChanged
from hornbill.servo.reading import reading
from hornbill.units import Instant, Uid

FRESH_S = 0.05
"""So long a fragment stands for the thing itself, unless that changes: sockets send within so much of each other.
Ages in it are at most so much too young."""

_Key = tuple[str, ...]


class Fragments:
    """JSON of what many sockets send at about the same time."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._made: dict[_Key, tuple[Instant, str]] = {}
        self._stops = [
            host.hub.listen(self._on_servo, ServoChanged),
            host.hub.listen(self._on_reading, ReadingChanged),
            host.hub.listen(lambda _change: self._drop("bus"), BusChanged),
            host.hub.listen(lambda _change: self._drop("lease"), LeaseChanged),
            host.hub.listen(lambda _change: self._drop("stop"), StopChanged),
        ]

    def close(self) -> None:
        """Listen no more."""
        for stop in self._stops:
            stop()

    def servo(self, uid: Uid) -> str | None:
        """A servo; None when there is none any more."""
        fleet = self._host.fleet
        if not fleet.knows(uid):
            return None
        return self._fragment(("servo", uid), lambda: present.servo(self._host, fleet.get(uid)))

    def reading(self, uid: Uid, key: str) -> str | None:
        """A reading; None when the servo, or the row, is not there any more."""
        fleet = self._host.fleet
        if not fleet.knows(uid) or key not in (servo := fleet.get(uid)).registers:
            return None
        return self._fragment(("reading", uid, key), lambda: present.reading(reading(servo, key, self._host.base)))

    def bus(self) -> str:
        """The bus."""
        return self._fragment(("bus",), lambda: present.bus(self._host))

    def stop(self) -> str:
        """The stop latch."""
        return self._fragment(("stop",), lambda: present.stop(self._host))

    def lease(self) -> str:
        """Who holds motion control; null when nobody does."""
        lease = self._host.leases.current(self._host.base.now())
        return "null" if lease is None else self._fragment(("lease",), lambda: present.lease_view(self._host, lease))

    def _fragment(self, key: _Key, make: Callable[[], BaseModel]) -> str:
        now = self._host.base.now()
        found = self._made.get(key)
        if found is None or now - found[0] > FRESH_S:
            found = self._made[key] = (now, make().model_dump_json())
        return found[1]

    def _drop(self, *key: str) -> None:
        self._made.pop(key, None)

    def _on_servo(self, change: Any) -> None:
        self._drop("servo", change.uid)

    def _on_reading(self, change: Any) -> None:
        self._drop("servo", change.uid)
        self._drop("reading", change.uid, change.key)
