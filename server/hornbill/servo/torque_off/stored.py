"""Stores what must be off after a restart of the server: the stop latch, and outputs switched on for a save."""

import asyncio
import logging
from collections.abc import Mapping
from typing import NamedTuple, cast

from hornbill.servo.device.output import MODES, OutputState, Reason, off_mode
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Hub, LogEvent, StopChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.servo.torque_off.retries import TorqueOffRetries
from hornbill.servo.torque_off.stop import Latch, StopControl
from hornbill.store.store import Store
from hornbill.store.tables import Json
from hornbill.units import Raw

log = logging.getLogger(__name__)

STOP_KEY = "stop"
SAVES_KEY = "energised_for_save"

WAITS_S = 0.25
"""The latch is stored once every servo has acknowledged, or after this time. A server killed earlier loses the stop."""

STARTED_S = 2.0
"""Maximum delay of a start as derived from an uptime in whole seconds."""


class StoredMode(NamedTuple):
    """Stored form of an order: torque mode (off or brake), reason, author, start (seconds since 1970 UTC), everyone."""

    mode: str
    reason: str
    by: str | None
    at: float | None
    everyone: bool = False

    @classmethod
    def of(cls, stored: object) -> "StoredMode | None":
        """Parse a stored value; None if its format is unknown."""
        if not isinstance(stored, dict):
            return None
        found = cast("Mapping[str, object]", stored)
        mode, by, at = found.get("mode"), found.get("by"), found.get("at")
        return cls(
            mode if isinstance(mode, str) and mode in MODES else "off",
            str(found.get("reason") or ""),
            None if by is None else str(by),
            at if isinstance(at, int | float) else None,
            found.get("everyone") is True,
        )

    def to_json(self) -> Json:
        """As stored."""
        return dict(self._asdict())


class StoredTorqueOff:
    """Stores the latch and the outputs as settings, in the form of `StoredMode`. A store failure delays nothing."""

    def __init__(self, store: Store, stop: StopControl, retries: TorqueOffRetries, base: TimeBase, hub: Hub) -> None:
        self._store = store
        self._stop = stop
        self._retries = retries
        self._base = base
        self._hub = hub
        self._task: asyncio.Task[None] | None = None
        self._latch: Latch | None = None
        """The latch as currently stored. A restored latch is stored as originally pressed."""
        self._found = self._saves()
        hub.subscribe(self._on_stop, StopChanged)

    def restore_stop(self) -> None:
        """Restore the stop of the previous server, if any. Call before joining a bus. Raises StoreFailed."""
        note = StoredMode.of(self._store.settings.get(STOP_KEY))
        if note is not None:
            at = self._base.utc_now() if note.at is None else note.at
            self._stop.restore(
                note.mode, note.by or "another client", note.reason, at - self._base.utc_offset, everyone=note.everyone
            )
            self._latch = self._stop.latch

    async def energising(self, servo: Servo, raw: Raw | None, before: OutputState) -> None:
        """Store that the output of a servo is about to be switched on for a save.

        `raw`: the 0x20 to return to. `before`: its reason. The entry is in the database when this returns.
        """
        note = StoredMode(off_mode(raw), before.reason, before.by, self._base.utc_now())
        self._put_saves({**self._saves(), servo.uid: note.to_json()})
        await self._store.settled()

    def over(self, servo: Servo) -> None:
        """Remove the entry: ROM was written, or the output was switched back."""
        saves = self._saves()
        if saves.pop(servo.uid, None) is not None:
            self._put_saves(saves)

    def on_arrival(self, servo: Servo) -> None:
        """Switch back an output that an earlier server left on, unless the servo has restarted since.

        Call as soon as the servo is identified.
        """
        note = StoredMode.of(self._found.pop(servo.uid, None))
        if note is None or servo.status is None:
            return
        self.over(servo)
        if servo.status.uptime_sec + STARTED_S >= self._base.utc_now() - (note.at or 0.0):
            self._retries.require(servo, cast("Reason", note.reason), note.by, note.mode)

    async def close(self) -> None:
        """Store the latch now if pending. Call after everything has been stopped."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        await self._store_latch()

    def _on_stop(self, _change: StopChanged) -> None:
        if self._stop.latch is not self._latch and (self._task is None or self._task.done()):
            self._task = asyncio.get_running_loop().create_task(self._store_soon())

    async def _store_soon(self) -> None:
        await self._retries.acknowledged(WAITS_S)
        await self._store_latch()

    async def _store_latch(self) -> None:
        """Store the latch. A failure is reported, because the next start would not be stopped."""
        settings = self._store.settings
        try:
            while (latch := self._stop.latch) is not self._latch:  # it may change while the store is awaited
                if latch is None:
                    await self._store.run(settings.drop, STOP_KEY)
                else:
                    note = StoredMode(latch.mode, latch.reason, latch.by, self._base.utc(latch.at), latch.everyone)
                    await self._store.run(settings.put, STOP_KEY, note.to_json())
                self._latch = latch
        except Exception:
            log.exception("the stop could not be stored")
            text = "The stop cannot be stored. It is in effect, but a restart of the server would lose it. Check the "
            self._hub.publish(
                LogEvent("warning", "store_failed", text + "data folder and its disk.", params={"what": "stop"})
            )

    def _saves(self) -> dict[str, Json]:
        try:
            stored = self._store.settings.get(SAVES_KEY)
        except Exception:
            log.exception("outputs switched on for a save could not be read")
            return {}
        return dict(stored) if isinstance(stored, dict) else {}

    def _put_saves(self, saves: dict[str, Json]) -> None:
        try:
            self._store.settings.put(SAVES_KEY, saves) if saves else self._store.settings.drop(SAVES_KEY)
        except Exception:
            log.exception("outputs switched on for a save could not be stored")
