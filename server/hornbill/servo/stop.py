"""Owns Stop: torque off (or brake) written to every known servo at once, repeated until answered, and latched."""

import asyncio
import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from hornbill.errors import HornbillError, Stopped
from hornbill.schema.catalog import Catalog
from hornbill.servo.asking import STOP, Asker
from hornbill.servo.hub import Change, Happened, Hub, ReadingChanged, StopChanged
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.units import Instant, Raw, Uid

log = logging.getLogger(__name__)

MODES: dict[str, Raw] = {"off": 1, "brake": 2}
"""Values of 0x20 that take the output away (section 4.13): 0 is ON and is not here."""

AGAIN_S = 0.02
AGAIN_LATER_S = 0.25
SAME_S = 1.0
"""The page sends one press over its socket and over REST; within this time both are one stop."""

SOON = 25
"""Tries at the short interval; a servo that is silent for half a second is asked four times a second from then on."""


@dataclass(slots=True)
class Confirmation:
    """How stop went on one servo; `ms` from the request to the servo's answer."""

    uid: Uid
    label: str
    ms: float | None = None

    @property
    def confirmed(self) -> bool:
        """Whether the servo said that its torque is off."""
        return self.ms is not None


@dataclass(slots=True)
class Latch:
    """One stop, from its request until somebody clears it."""

    mode: str
    at: Instant
    by: str
    reason: str
    servos: dict[Uid, Confirmation] = field(default_factory=dict[Uid, Confirmation])


class Stop:
    """The latch and the tasks that carry it out. Needs no lease and waits for nothing.

    `known` gives every servo that may still be on the bus; `quiet` is called first and must cancel, before it
    returns, everything of ours that could still energise a servo.
    """

    def __init__(
        self,
        asker: Asker,
        hub: Hub,
        base: TimeBase,
        catalog: Catalog,
        known: Callable[[], Iterable[Servo]],
        quiet: Callable[[], None],
    ) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._row = catalog.by_key["torque_mode"]
        self._known = known
        self._quiet = quiet
        self._tasks: dict[Uid, asyncio.Task[None]] = {}
        self.latch: Latch | None = None
        hub.listen(self._on_change)

    @property
    def latched(self) -> bool:
        """Whether motion waits for somebody to clear the stop."""
        return self.latch is not None

    def check(self) -> None:
        """Raises Stopped while the latch is set."""
        if self.latch is not None:
            raise Stopped(
                f"Stopped by {self.latch.by}. Nothing moves until the stop is cleared: DELETE /api/v1/stop.",
                mode=self.latch.mode,
            )

    def now(self, mode: str, by: str, reason: str) -> Latch:
        """Stop. The first frames leave on the next turn of the event loop; pressing again sends again.

        `mode` is "off" or "brake".
        """
        latch = self.latch
        self._quiet()
        if latch is not None and (latch.mode, latch.by) == (mode, by) and self._base.now() - latch.at < SAME_S:
            self._go_on(latch)
            return latch
        self.latch = Latch(mode, self._base.now(), by, reason)
        self._end_tasks()
        servos = [servo for servo in self._known() if servo.node_id is not None]
        for servo in servos:
            self._begin(servo, self.latch)
        self._hub.tell(StopChanged())
        self._hub.tell(Happened("failure", "stopped", f"Stopped by {by}. Torque goes {mode} on every servo."))
        return self.latch

    def _go_on(self, latch: Latch) -> None:
        """The same press, by its other road: send again at once, and keep the times of the first."""
        for servo in self._known():
            if servo.node_id is not None:
                self._begin(servo, latch, anew=False)

    def on_arrival(self, servo: Servo) -> None:
        """A servo that comes back while the latch is set is stopped too: it may have started with torque on."""
        if self.latch is not None:
            self._begin(servo, self.latch)
            self._hub.tell(StopChanged())

    def _on_change(self, change: Change) -> None:
        """Somebody else turned torque on, or a restart too quick to be noticed did: not while the latch is set."""
        if self.latch is None or not isinstance(change, ReadingChanged) or change.key != self._row.key:
            return
        task = self._tasks.get(change.uid)
        servo = next((one for one in self._known() if one.uid == change.uid), None)
        if servo is not None and servo.raw(self._row.key) == 0 and (task is None or task.done()):
            self._begin(servo, self.latch)
            self._hub.tell(StopChanged())

    def clear(self, by: str) -> None:
        """Unlatch. Moves and turns on nothing; a servo that has not answered yet is written to until it does."""
        if self.latch is None:
            return
        open_ones = ", ".join(one.label for one in self.latch.servos.values() if not one.confirmed)
        self.latch = None
        self._hub.tell(StopChanged())
        text = f"Stop cleared by {by}. Torque stays off until turned on."
        if open_ones:
            text += f" Not confirmed: {open_ones}. Torque may still be on there; it is turned off when it answers."
        self._hub.tell(Happened("warning" if open_ones else "notice", "stop_cleared", text))

    async def confirmed(self, within_s: float) -> None:
        """Answer when every servo has confirmed, or after that time."""
        tasks = [task for task in self._tasks.values() if not task.done()]
        if tasks:
            await asyncio.wait(tasks, timeout=within_s)

    async def close(self) -> None:
        """End the repetitions; the latch stays as it is."""
        tasks = list(self._tasks.values())
        self._end_tasks()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _end_tasks(self) -> None:
        for task in self._tasks.values():
            task.cancel()
        self._tasks.clear()

    def _begin(self, servo: Servo, latch: Latch, *, anew: bool = True) -> None:
        if anew or servo.uid not in latch.servos:
            latch.servos[servo.uid] = Confirmation(servo.uid, servo.title)
        old = self._tasks.pop(servo.uid, None)
        if old is not None:
            old.cancel()
        self._tasks[servo.uid] = asyncio.get_running_loop().create_task(
            self.quench(servo, latch.mode, lambda: self._confirm(latch, servo.uid))
        )

    def _confirm(self, latch: Latch, uid: Uid) -> None:
        one = latch.servos[uid]
        if one.ms is None:
            one.ms = round((self._base.now() - latch.at) * 1000, 2)
        if latch is self.latch:
            self._hub.tell(StopChanged())

    async def quench(self, servo: Servo, mode: str, confirm: Callable[[], None] | None = None) -> None:
        """Write `mode` into 0x20 of one servo, again and again until it answers that it holds it."""
        wanted, tries = MODES[mode], 0
        while True:
            try:
                if await self._asker.write(servo, self._row, wanted, STOP) == wanted:
                    break
            except HornbillError as error:
                log.debug("%s: torque %s: %s", servo.title, mode, error.detail)
            except Exception:  # whatever it is, the servo still has to be stopped
                log.exception("%s: torque %s", servo.title, mode)
            tries += 1
            await asyncio.sleep(AGAIN_S if tries <= SOON else AGAIN_LATER_S)
        if confirm is not None:
            confirm()
