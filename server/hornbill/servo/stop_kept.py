"""Owns KeptStop: the stop latch outlives the process, and keeping it never holds up what takes torque away."""

import asyncio
import logging
from collections.abc import Mapping
from typing import cast

from hornbill.servo.hub import Happened, Hub, StopChanged
from hornbill.servo.quenching import MODES
from hornbill.servo.stop import Latch, Stop
from hornbill.servo.timebase import TimeBase
from hornbill.store.settings import Settings

log = logging.getLogger(__name__)

KEY = "stop"
WAITS_S = 0.25
"""The latch is kept once every servo has confirmed, or after this long: a server killed sooner forgets the stop."""


class KeptStop:
    """Keeps the latch under one name of the settings, and sets it again at the next start."""

    def __init__(self, settings: Settings, stop: Stop, base: TimeBase, hub: Hub) -> None:
        self._settings = settings
        self._stop = stop
        self._base = base
        self._hub = hub
        self._task: asyncio.Task[None] | None = None
        self._kept: Latch | None = None
        """The latch that is kept now. One that was restored is kept as it was pressed."""
        hub.listen(self._on_change, StopChanged)

    def restore(self) -> None:
        """Be stopped if the server before this one was. Call it before a bus is joined. Raises StoreFailed."""
        kept = self._settings.get(KEY)
        if not isinstance(kept, dict):
            return
        told = cast("Mapping[str, object]", kept)
        mode, at = told.get("mode"), told.get("at")
        self._stop.restore(
            mode if isinstance(mode, str) and mode in MODES else "off",
            str(told.get("by") or "somebody"),
            str(told.get("reason") or ""),
            (at if isinstance(at, int | float) else self._base.utc_now()) - self._base.utc_offset,
        )
        self._kept = self._stop.latch

    async def close(self) -> None:
        """Keep now what still waits. Call it when everything has been stopped."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        self._keep()

    def _on_change(self, _change: StopChanged) -> None:
        """The latch may have been set, set anew or cleared: keep it soon."""
        if self._stop.latch is not self._kept and (self._task is None or self._task.done()):
            self._task = asyncio.get_running_loop().create_task(self._keep_soon())

    async def _keep_soon(self) -> None:
        await self._stop.confirmed(WAITS_S)
        self._keep()

    def _keep(self) -> None:
        """A store that fails keeps nobody from stopping; it is said, because the next start would not be stopped."""
        latch = self._stop.latch
        if latch is self._kept:
            return
        try:
            if latch is None:
                self._settings.drop(KEY)
            else:
                at = self._base.utc(latch.at)
                self._settings.put(KEY, {"mode": latch.mode, "by": latch.by, "reason": latch.reason, "at": at})
            self._kept = latch
        except Exception:
            log.exception("the stop could not be kept")
            text = "The stop cannot be kept. It holds now, and a server started anew would not know of it: check the "
            self._hub.tell(Happened("warning", "store_failed", text + "data folder and its disk."))
