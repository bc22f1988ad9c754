"""The servo layer's way into the audit, which never stands in the way of what is being done."""

import asyncio
import logging
from collections.abc import Callable, Coroutine

from hornbill.servo.runtime.hub import Hub, LogEvent
from hornbill.store.audit import AuditLog, NewAuditEntry

log = logging.getLogger(__name__)

AUDITED_S = 0.25
"""A stop and the end of a lease are audited once torque is off, or after this long."""


class Audit:
    """Keeps entries. A store that fails is said once until it works again; the deed itself goes on."""

    def __init__(self, rows: AuditLog, hub: Hub) -> None:
        self.rows = rows
        self._hub = hub
        self._failed = False
        self._waiting: dict[asyncio.Task[None], Callable[[], NewAuditEntry]] = {}

    def note(self, *entries: NewAuditEntry) -> None:
        """Keep the entries of one deed together. Never raises."""
        try:
            self.rows.add(entries)
            self._failed = False
        except Exception:  # a full disk must not keep anybody from changing or stopping a servo
            log.exception("the audit could not be kept: %r", entries)
            if not self._failed:
                self._failed = True
                text = "The audit cannot be kept. Check the data folder and its disk; what is done now is not recorded."
                self._hub.publish(LogEvent("warning", "store_failed", text, params={"what": "audit"}))

    def later(self, after: Coroutine[object, object, None], entry: Callable[[], NewAuditEntry]) -> None:
        """Keep an entry once `after` has ended, so that a commit delays nothing urgent. Returns at once."""
        task = asyncio.get_running_loop().create_task(after)
        self._waiting[task] = entry
        task.add_done_callback(lambda done: self.note(self._waiting.pop(done)()))

    async def close(self) -> None:
        """Keep now what still waits. Call it when everything has been stopped and let go."""
        tasks = list(self._waiting)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
