"""Frames of the bus for one socket: filter, counts and a bounded queue."""

from collections import deque
from collections.abc import Callable
from typing import Any

from hornbill.api.live.messages import FrameFilter
from hornbill.servo.monitoring.bus_monitor import Batch, BusMonitor, Row, SeenFrame, SeenTransfer

ROWS_QUEUED = 600
"""Rows queued for a slow socket: twice what a fully loaded bus yields between two messages."""


class FrameWatch:
    """Subscription to topic `frames`. `wake` is called when rows are pending; `take` returns and clears them."""

    def __init__(self, monitor: BusMonitor, wanted: FrameFilter, wake: Callable[[], None]) -> None:
        self._wanted = wanted
        # Summaries contain true minus signs; users type hyphens.
        self._text = None if wanted.text is None else wanted.text.lower().replace("-", "−")
        self._type = None if wanted.type is None else wanted.type.lower()
        self._wake = wake
        self._rows: deque[Row] = deque()
        self._received = self._shown = self._dropped = 0
        self._reported = -1
        self.close = monitor.watch(self._on_batch)
        """Ends the subscription."""

    def take(self) -> dict[str, Any] | None:
        """Pending rows as a FramesMessage without `seq`; None if nothing was received since the last call."""
        if self._reported == self._received:
            return None
        self._reported = self._received
        rows, self._rows = self._rows, deque()
        self._shown += len(rows)
        return {
            "type": "frames",
            "received": self._received,
            "shown": self._shown,
            "dropped": self._dropped,
            "frames": [row.shown for row in rows if isinstance(row, SeenFrame)],
            "transfers": [row.shown for row in rows if isinstance(row, SeenTransfer)],
        }

    def _on_batch(self, batch: Batch) -> None:
        seen = batch.frames if self._wanted.view == "raw" else batch.rows
        self._received += len(seen)
        for row in seen:
            if self._wants(row):
                self._rows.append(row)
        while len(self._rows) > ROWS_QUEUED:
            self._rows.popleft()
            self._dropped += 1
        if self._rows:
            self._wake()

    def _wants(self, row: Row) -> bool:
        wanted = self._wanted
        kind, name, source, destination = row.about
        if wanted.node_id is not None and wanted.node_id not in (source, destination):
            return False
        if wanted.kind is not None and wanted.kind != kind:
            return False
        if self._type is not None and (name is None or self._type not in name.lower()):
            return False
        if wanted.problems_only and row.problem is None:
            return False
        return self._text is None or self._text in row.text.lower().replace("-", "−")
