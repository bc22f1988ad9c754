"""Line budget: capacity left for polling on an adapter's serial line, if it is slower than the CAN bus."""

import math
from collections.abc import Callable
from typing import Final

from hornbill.units import Instant
from hornbill.wire.port import CanPort, SerialLineInfo

READ_BYTES: Final = 77
"""slcan lines received per read by name: three response frames (27, 27 and 21) and an acknowledgement."""

BROADCAST_BYTES_PER_S: Final = 487
"""Broadcasts of one servo: Status, two frames (27 and 19) ten times a second, and NodeStatus (table 2-2)."""

FULL: Final = 0.85
"""Maximum share of the line in use. An adapter drops data that does not fit its buffer."""

LEAST: Final = 0.05
"""Share of the line always available to polling, so that no reading stops on a busy line."""

_MEASURED_S: Final = 1.0


class LineBudget:
    """Divides the receiving direction of the line between broadcasts of servos and polling."""

    def __init__(self, port: Callable[[], CanPort | None]) -> None:
        """`port` returns the port of the connected bus."""
        self._port = port
        self._others = 0.0
        self._last: tuple[CanPort, Instant, int, int] | None = None

    @property
    def line(self) -> SerialLineInfo | None:
        """The limiting serial line, or None."""
        port = self._port()
        line = None if port is None else port.details.serial_line
        return None if line is None or line.bytes_per_s is None else line

    def reads_per_s(self, share: float, servos: int, reads: int, now: Instant) -> float:
        """Maximum reads per second of polling within `share` (0..1) of the line; infinite without a limit.

        `servos`: number online. `reads`: reads that polling has made so far.
        """
        line = self.line
        rate = None if line is None else line.slcan_bytes_per_s
        if line is None or rate is None:
            return math.inf
        self._measure(reads, now, line.frame_bytes / line.FRAME_BYTES)
        others = max(self._others, servos * BROADCAST_BYTES_PER_S)
        return max(LEAST * rate, min(share * rate, FULL * rate - others)) / READ_BYTES

    def _measure(self, reads: int, now: Instant, factor: float) -> None:
        """Measure other traffic on the line, bytes/s of slcan, over the last second or more.

        `factor`: how much longer frames are than in slcan.
        """
        port = self._port()
        assert port is not None
        count = int(port.statistics.line_bytes / factor)
        if self._last is None or self._last[0] is not port:
            self._last, self._others = (port, now, count, reads), 0.0
            return
        _, since, bytes_before, reads_before = self._last
        if now - since >= _MEASURED_S:
            polled = (reads - reads_before) * READ_BYTES
            self._others = max(0.0, (count - bytes_before - polled) / (now - since))
            self._last = (port, now, count, reads)
