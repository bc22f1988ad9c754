"""Owns Witness: keeps in the audit who stopped everything and who had motion control, without being in the way."""

import asyncio
from collections.abc import Callable, Coroutine

from hornbill.servo.configuration.audit import Audit
from hornbill.servo.leases import Lease
from hornbill.servo.stop import Latch, Stop
from hornbill.servo.timebase import TimeBase
from hornbill.store.audit import Entry

WAITS_S = 0.25
"""A stop is kept once every servo has confirmed, or after this long. A commit holds up the loop for a moment, and
until then torque is being taken away."""


class Witness:
    """Told of a deed when it is done, and keeps it a little later. Its methods return at once and never raise."""

    def __init__(self, audit: Audit, base: TimeBase, stop: Stop) -> None:
        self._audit = audit
        self._base = base
        self._stop = stop
        self._waiting: dict[asyncio.Task[None], Callable[[], Entry]] = {}

    def pressed(self, latch: Latch) -> None:
        """Somebody pressed stop; the entry says who, why, and how many servos had confirmed by then."""
        self._later(self._stop.confirmed(WAITS_S), lambda: _of_stop(latch))

    def cleared(self, latch: Latch, by: str) -> None:
        """Somebody cleared a stop. A servo that has not confirmed it may still be written to."""
        detail = f"Stop of {latch.by} cleared. {_confirmed(latch)}"
        self._later(self._stop.confirmed(WAITS_S), lambda: Entry(by, "stop", "cleared", detail=detail))

    def lease_taken(self, lease: Lease) -> None:
        """Somebody got motion control."""
        detail = f"Motion control for {lease.ttl_s:g} s from each sign of life."
        self._audit.note(Entry(lease.holder, "lease", "taken", detail=detail))

    def lease_passed(self, lease: Lease, old: Lease | None, how: str, reason: str) -> None:
        """Somebody got motion control from whoever had it; `how`: passed, when it was asked for, or forced."""
        before = None if old is None else old.holder
        entry = Entry(lease.holder, "lease", how, before=before, after=lease.holder, detail=reason)
        self._later(asyncio.sleep(WAITS_S), lambda: entry)

    def lease_ended(self, lease: Lease, why: str) -> None:
        """Somebody gave motion control back or lost it; torque is on its way off where it was used."""
        outcome = "lapsed" if lease.expires_at <= self._base.now() else "released"
        self._later(asyncio.sleep(WAITS_S), lambda: Entry(lease.holder, "lease", outcome, detail=why))

    async def close(self) -> None:
        """Keep now what still waits. Call it when everything has been stopped and let go."""
        tasks = list(self._waiting)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _later(self, before: Coroutine[object, object, None], entry: Callable[[], Entry]) -> None:
        task = asyncio.get_running_loop().create_task(before)
        self._waiting[task] = entry
        task.add_done_callback(self._keep)

    def _keep(self, task: asyncio.Task[None]) -> None:
        self._audit.note(self._waiting.pop(task)())


def _of_stop(latch: Latch) -> Entry:
    reason = f"{latch.reason.rstrip('.')}. " if latch.reason else ""
    return Entry(latch.by, "stop", "pressed", requested=latch.mode, detail=reason + _confirmed(latch))


def _confirmed(latch: Latch) -> str:
    every = [*latch.servos.values(), *latch.nodes.values()]
    took = max((one.ms for one in every if one.ms is not None), default=None)
    count = sum(one.confirmed for one in every)
    within = "" if took is None else f" within {took:.0f} ms"
    return f"{count} of {len(every)} confirmed{within}."
