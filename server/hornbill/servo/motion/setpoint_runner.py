"""The runner of setpoints over time: it sends each one when it is due, and ends and reports every run in one way."""

import asyncio
import logging
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from hornbill.errors import HornbillError
from hornbill.servo.runtime.hub import Hub, LogEvent
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant

log = logging.getLogger(__name__)


class SetpointSource(ABC):
    """Setpoints of one or more servos as a function of time, each sent under the lease the run was started with."""

    @abstractmethod
    async def send(self, due: Instant, now: Instant) -> Instant | None:
        """Send what was due at `due`. When the next one is due; None after the last.

        Raises HornbillError when motion has ended (Stopped, LeaseRequired, BusDisconnected, …); that ends the run.
        """

    def interrupt(self, why: str) -> LogEvent | None:
        """Note that the run ended before its last setpoint, and why. The event for the log, None without one."""
        return None


@dataclass(slots=True, eq=False)
class PeriodicSource(SetpointSource):
    """Setpoints at a steady rate. A slot that passed is not sent later: its setpoint is old, and two at once help
    nobody. `misses`: the slots that passed so; `worst_late_s`: how long after its time a setpoint left at worst.
    """

    period_s: float
    misses: int = field(default=0, init=False)
    worst_late_s: float = field(default=0.0, init=False)

    @abstractmethod
    async def send_next(self) -> bool:
        """Send the setpoint of the next slot. True after the last. Raises as `send`."""

    async def send(self, due: Instant, now: Instant) -> Instant | None:
        """Send the setpoint of one slot, and skip those that passed."""
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


INTERNAL: Final = {"problem": "internal"}


class SetpointRunner:
    """Runs sources, each in a task of its own, until its last setpoint, until motion may not go on, or until `end`.

    It takes no torque: Motion does that, when a lease ends, at a stop, and before the bus is left. A source notices
    each of them by its next setpoint, which Motion refuses.
    """

    def __init__(self, hub: Hub, base: TimeBase) -> None:
        self._hub = hub
        self._base = base
        self._tasks: dict[SetpointSource, asyncio.Task[None]] = {}

    def start(self, source: SetpointSource) -> asyncio.Task[None]:
        """Run a source in a task, which ends with it and never raises."""
        task = self._tasks[source] = asyncio.get_running_loop().create_task(self._run(source))
        return task

    def runs(self, source: SetpointSource) -> bool:
        """Whether a source was started and has not ended."""
        return source in self._tasks

    def end(self, source: SetpointSource) -> None:
        """End a run where it is, also in the middle of a setpoint, without an event. Idempotent."""
        task = self._tasks.pop(source, None)
        if task is not None:
            task.cancel()

    async def follow(self, source: SetpointSource) -> None:
        """Run a source as a part of the caller's task. Raises what ends it."""
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
            source.interrupt("The server ends.")
            self.end(source)
        await asyncio.gather(*tasks.values(), return_exceptions=True)

    async def _run(self, source: SetpointSource) -> None:
        try:
            await self.follow(source)
        except HornbillError as error:
            self._report(source, error.detail, "notice", error.note_params)
        except Exception as error:  # a defect of ours must not look like a run that goes on
            log.exception("setpoints failed")
            self._report(source, f"hornbill itself failed: {error!r}. Report this.", "failure", INTERNAL)
        finally:
            self._tasks.pop(source, None)

    def _report(self, source: SetpointSource, why: str, level: str, told: Mapping[str, object]) -> None:
        event = source.interrupt(why)
        if event is not None:
            self._hub.publish(replace(event, level=level, params={**told, **event.params}))
