"""Audit entries of the servo layer. A failing store never blocks the action that is audited."""

import asyncio
import logging
from collections.abc import Callable, Coroutine

from hornbill.servo.runtime.hub import Hub, LogEvent
from hornbill.store.audit import AuditLog, NewAuditEntry

log = logging.getLogger(__name__)

AUDITED_S = 0.25
"""A stop and the end of a lease are audited once torque is off, or after this time."""


class Audit:
    """Stores audit entries. A store failure is reported once until the store works again, and blocks nothing."""

    def __init__(self, rows: AuditLog, hub: Hub) -> None:
        self.rows = rows
        self._hub = hub
        self._failed = False
        self._waiting: dict[asyncio.Task[None], Callable[[], NewAuditEntry]] = {}

    def note(self, *entries: NewAuditEntry) -> None:
        """Store the entries of one action together. Never raises."""
        try:
            self.rows.add(entries)
            self._failed = False
        except Exception:  # a full disk must not block changing or stopping a servo
            log.exception("audit entries could not be stored: %r", entries)
            if not self._failed:
                self._failed = True
                text = "The audit cannot be stored: actions are not recorded. Check the data folder and its disk."
                self._hub.publish(LogEvent("warning", "store_failed", text, params={"what": "audit"}))

    def later(self, after: Coroutine[object, object, None], entry: Callable[[], NewAuditEntry]) -> None:
        """Store an entry once `after` has ended, so that a commit delays nothing urgent. Returns at once."""
        task = asyncio.get_running_loop().create_task(after)
        self._waiting[task] = entry
        task.add_done_callback(lambda done: self.note(self._waiting.pop(done)()))

    async def close(self) -> None:
        """Store pending entries now. Call after everything has been stopped and released."""
        tasks = list(self._waiting)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
