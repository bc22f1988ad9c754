"""Facts that the doctor collects about this server: database, disk, event loop and 3D view."""

import asyncio
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Final

from hornbill.servo.runtime.hub import Hub, LogEvent
from hornbill.servo.runtime.loop_lag import WINDOW_S, LoopLag
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.store import Store
from hornbill.units import Instant

DISK_INTERVAL_S: Final = 10.0


class ServerRecord:
    """What this computer and this process can do now. Publishes once when the database begins to fail."""

    def __init__(
        self,
        store: Store,
        hub: Hub,
        base: TimeBase,
        lag: LoopLag,
        folder: Path | None = None,
        view_error: Callable[[], str | None] | None = None,
    ) -> None:
        """`folder`: data folder, whose disk is watched. `view_error` returns why the 3D view does not run, None
        if it does; without it the view is disabled."""
        self.store = store
        self.lag = lag
        self.view_error = view_error
        self.failures = 0
        """Failed writes to the database."""
        self.error: str | None = None
        """Text of the last failed write. None if the last one succeeded."""
        self.disk: tuple[int, int] | None = None
        """Free and total bytes of the disk of the data folder. None if unknown."""
        self._hub = hub
        self._base = base
        self._folder = folder
        self._measured_at: Instant = float("-inf")
        self._measuring: asyncio.Future[tuple[int, int] | None] | None = None
        self.close = store.listen(self._on_written)

    @property
    def lag_s(self) -> float:
        """Longest lag of the event loop in the last WINDOW_S seconds, s; 0 if there was none of at least LAG_S."""
        return self.lag.worst_s(self._base.now() - WINDOW_S)

    @property
    def failing_s(self) -> float | None:
        """Time since writes to the database began to fail, s. None if they succeed."""
        since = self.store.failing_since
        return None if since is None else max(0.0, self._base.utc_now() - since)

    def tick(self, now: Instant) -> None:
        """Measure the disk at intervals, in a thread: a network drive may hang. Call it several times a second."""
        if self._folder is None or now - self._measured_at < DISK_INTERVAL_S or self._measuring is not None:
            return
        self._measured_at = now
        self._measuring = asyncio.get_running_loop().run_in_executor(None, _disk, self._folder)
        self._measuring.add_done_callback(self._on_measured)

    def _on_measured(self, measured: "asyncio.Future[tuple[int, int] | None]") -> None:
        self._measuring = None
        if not measured.cancelled() and measured.exception() is None:
            self.disk = measured.result()

    def _on_written(self, error: Exception | None) -> None:
        """Publish a failed write to the database, once until a write succeeds."""
        if error is not None and self.error is None:
            text = f"Changes are not being stored and will be lost at a restart of the server: {error}"
            self._hub.publish(LogEvent("failure", "store_failed", text, params={"what": "changes"}))
        self.failures += error is not None
        self.error = None if error is None else str(error)


def _disk(folder: Path) -> tuple[int, int] | None:
    """Free and total bytes of the disk of a folder. None if it cannot be read."""
    try:
        usage = shutil.disk_usage(folder)
    except OSError:
        return None
    return usage.free, usage.total
