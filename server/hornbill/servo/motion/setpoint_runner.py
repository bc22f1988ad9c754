"""Setpoint runner: sends setpoints when they are due, and ends and reports every run in the same way."""

import asyncio
import logging
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import Final

from hornbill.domain.fields import Param
from hornbill.domain.note import Note
from hornbill.errors import HornbillError
from hornbill.servo.runtime.hub import Hub, LogEvent
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant

log = logging.getLogger(__name__)


class SetpointSource(ABC):
    """Setpoints of one or more servos over time, each sent under the lease the run was started with."""

    @abstractmethod
    async def send(self, due: Instant, now: Instant) -> Instant | None:
        """Send the setpoint due at `due`. Returns when the next one is due, None after the last.

        Raises HornbillError when motion has ended (Stopped, LeaseRequired, BusDisconnected, …); that ends the run.
        """

    def interrupt(self, why: Note) -> LogEvent | None:
        """Note that the run ended early, and why. Returns the event to log, or None."""
        return None


@dataclass(slots=True, eq=False)
class PeriodicSource(SetpointSource):
    """Setpoints at a steady rate. A missed slot is not sent later, because its setpoint is out of date.

    `misses`: number of missed slots. `worst_late_s`: maximum lateness of a setpoint.
    """

    period_s: float
    misses: int = field(default=0, init=False)
    worst_late_s: float = field(default=0.0, init=False)

    @abstractmethod
    async def send_next(self) -> bool:
        """Send the setpoint of the next slot. True after the last. Raises as `send`."""

    async def send(self, due: Instant, now: Instant) -> Instant | None:
        """Send the setpoint of one slot and skip missed slots."""
        late = now - due
        self.worst_late_s = max(self.worst_late_s, late)
        missed = int(late / self.period_s)
        if missed > 0:
            self.miss(missed)
        if await self.send_next():
            return None
        return due + (max(missed, 0) + 1) * self.period_s

    def miss(self, slots: int) -> None:
        """Count slots in which nothing was sent."""
        self.misses += slots


INTERNAL: Final[dict[str, Param]] = {"problem": "internal"}


class SetpointRunner:
    """Runs each source in a separate task until its last setpoint, until motion is refused, or until `end`.

    It does not switch torque off: Motion does, when a lease ends, on Stop, and before the bus is left. A source notices
    each of these when Motion refuses its next setpoint.
    """

    def __init__(self, hub: Hub, base: TimeBase) -> None:
        self._hub = hub
        self._base = base
        self._tasks: dict[SetpointSource, asyncio.Task[None]] = {}

    def start(self, source: SetpointSource) -> asyncio.Task[None]:
        """Run a source in a task. The task never raises."""
        task = self._tasks[source] = asyncio.get_running_loop().create_task(self._run(source))
        return task

    def runs(self, source: SetpointSource) -> bool:
        """Whether a source is running."""
        return source in self._tasks

    def end(self, source: SetpointSource) -> None:
        """End a run immediately, even during a setpoint, without an event. Idempotent."""
        task = self._tasks.pop(source, None)
        if task is not None:
            task.cancel()

    async def follow(self, source: SetpointSource) -> None:
        """Run a source in the caller's task. Raises what ends it."""
        due: Instant | None = self._base.now()
        while True:
            due = await source.send(due, self._base.now())
            if due is None:
                return
            await asyncio.sleep(max(0.0, due - self._base.now()))

    async def close(self) -> None:
        """End every run."""
        tasks = dict(self._tasks)
        for source in tasks:
            source.interrupt(Note("The server is shutting down.", "server_shutdown"))
            self.end(source)
        await asyncio.gather(*tasks.values(), return_exceptions=True)

    async def _run(self, source: SetpointSource) -> None:
        try:
            await self.follow(source)
        except HornbillError as error:
            self._report(source, Note.of(error), "notice")
        except Exception as error:  # after a bug, the run must not appear to continue
            log.exception("setpoints failed")
            self._report(
                source, Note(f"Internal error in hornbill: {error!r}. Report it.", "problem", INTERNAL), "failure"
            )
        finally:
            self._tasks.pop(source, None)

    def _report(self, source: SetpointSource, why: Note, level: str) -> None:
        event = source.interrupt(why)
        if event is not None:
            self._hub.publish(replace(event, level=level, params={**why.params, **event.params}))
