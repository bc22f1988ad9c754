"""The site: the benches that share the database, and this one among them."""

import asyncio
import contextlib
import logging
import socket
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

from hornbill import __version__
from hornbill.domain.bench import BenchStatus, SiteBench
from hornbill.errors import StoreFailed
from hornbill.servo.runtime.hub import Hub, LogEvent
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.benches import CONTACT_S
from hornbill.store.store import Store

log = logging.getLogger(__name__)

REFRESH_S = 1.0
"""Interval at which changes by other benches are looked for, s."""


class Site:
    """Benches of the database: reports this one to the others, and takes over what the others changed."""

    def __init__(
        self, url: str | None, store: Store, hub: Hub, base: TimeBase, status: Callable[[], BenchStatus]
    ) -> None:
        """`url`: address of the page of this bench. `status` returns its present condition."""
        self._url = url
        self._store = store
        self._hub = hub
        self._base = base
        self._since = base.utc_now()
        self._status = status
        self._taken = False

    def this(self) -> SiteBench:
        """This bench."""
        return _bench(
            asdict(self._status()), name=self._store.bench, host=socket.gethostname(), url=self._url,
            version=__version__, since=self._since, last_contact=self._base.utc_now(), state="online", is_this=True,
        )  # fmt: skip

    async def benches(self) -> list[SiteBench]:
        """All benches, this one first, then by name. Raises StoreFailed."""
        found = await self._store.run(self._store.benches.all)
        others = [
            _bench(
                one.status, name=one.name, host=one.host, url=one.url, version=one.version, since=one.since,
                last_contact=one.contact, state=one.state, is_this=False,
            )
            for one in found
            if one.name != self._store.bench
        ]  # fmt: skip
        return [self.this(), *others]

    async def run(self) -> None:
        """Report this bench every `CONTACT_S`, and look for changes every `REFRESH_S`, until cancelled.

        Both in time of the event loop, as the instants that are stored.
        """
        due = self._base.now()
        while True:
            with contextlib.suppress(StoreFailed):  # reported by the writes that wait
                if self._base.now() >= due:
                    due = self._base.now() + CONTACT_S
                    await self._contact()
                await self._store.refresh()
            await asyncio.sleep(REFRESH_S)

    async def _contact(self) -> None:
        kept = await self._store.run(self._store.benches.contact, self._url, asdict(self._status()))
        if not kept and not self._taken:
            text = f"Another server now uses bench {self._store.bench}. Stop one of the two servers."
            log.error(text)
            self._hub.publish(LogEvent("failure", "bench_taken", text, params={"bench": self._store.bench}))
        self._taken = not kept


def _bench(status: Mapping[str, Any], **facts: Any) -> SiteBench:
    return SiteBench(**{**asdict(UNKNOWN), **{k: v for k, v in status.items() if k in _FIELDS}, **facts})


UNKNOWN = BenchStatus(
    bus=None, bus_state="disconnected", role=None, servos_online=0, servos_total=0, faults=0, bus_load_pct=None,
    holder=None, torque_stopped=False,
)  # fmt: skip
"""Condition of a bench that has not reported one."""

_FIELDS = asdict(UNKNOWN).keys()
