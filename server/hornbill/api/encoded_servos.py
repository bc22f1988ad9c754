"""JSON of servos for REST, encoded once per change."""

import math
from collections.abc import Iterable
from typing import Any, Final

from hornbill.api import present
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.servo.runtime.hub import Change
from hornbill.units import Instant, Uid

KEPT_S: Final = 0.25
"""Longest use of one encoding. Changes end it earlier; activities also change with time alone."""

_AGE: Final = b'"age_s":'
"""The first in a servo is the age of its angle. In a text its quotes would be escaped."""
_NOT_ENCODED: Final = (-math.inf, None, b"", b"")


class EncodedServos:
    """JSON of each servo up to its next change; the age of its angle is inserted for each request."""

    def __init__(self, host: Host) -> None:
        self.host = host
        self._parts: dict[Uid, tuple[Instant, Instant | None, bytes, bytes]] = {}
        """Time of encoding, time of the angle, and the JSON before and after the age."""
        host.hub.subscribe(self._on_change)

    def array(self, servos: Iterable[Servo]) -> bytes:
        """JSON array of these servos as they are now."""
        now = self.host.base.now()
        return b"[%b]" % b",".join([self._servo(one, now) for one in servos])

    def _servo(self, one: Servo, now: Instant) -> bytes:
        encoded_at, angle_at, before, after = self._parts.get(one.uid, _NOT_ENCODED)
        if now - encoded_at < KEPT_S and angle_at == one.angle_at:
            age = b"null" if angle_at is None else repr(round(now - angle_at, 3)).encode()
            return b"%b%b%b" % (before, age, after)
        made = present.servo(self.host, one)
        whole = made.model_dump_json().encode()
        if not made.commanded_by:  # commands of other nodes have ages, too
            before, _, after = whole.partition(_AGE)
            self._parts[one.uid] = now, one.angle_at, before + _AGE, after[after.index(b",") :]
        return whole

    def _on_change(self, change: Change) -> None:
        uid: Uid | None = getattr(change, "uid", None)
        if uid is None:  # of the bus, a job, a lease, or Stop
            self._parts.clear()
        else:
            self._parts.pop(uid, None)


def encoded_servos(state: Any, host: Host) -> EncodedServos:
    """Those of an application; created for its first request, and again when the host is replaced."""
    found: EncodedServos | None = getattr(state, "encoded_servos", None)
    if found is None or found.host is not host:
        found = state.encoded_servos = EncodedServos(host)
    return found
