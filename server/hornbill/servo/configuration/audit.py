"""Owns Audit: the servo layer's way into the audit, which never stands in the way of what is being done."""

import logging

from hornbill.servo.hub import Happened, Hub
from hornbill.store.audit import AuditLog, Entry

log = logging.getLogger(__name__)


class Audit:
    """Keeps entries. A store that fails is said once until it works again; the deed itself goes on."""

    def __init__(self, rows: AuditLog, hub: Hub) -> None:
        self.rows = rows
        self._hub = hub
        self._failed = False

    def note(self, *entries: Entry) -> None:
        """Keep the entries of one deed together. Never raises."""
        try:
            self.rows.add(entries)
            self._failed = False
        except Exception:  # a full disk must not keep anybody from changing or stopping a servo
            log.exception("the audit could not be kept: %r", entries)
            if not self._failed:
                self._failed = True
                text = "The audit cannot be kept. Check the data folder and its disk; what is done now is not recorded."
                self._hub.tell(Happened("warning", "store_failed", text))
