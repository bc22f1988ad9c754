"""The runner of setpoints: slots keep their time, none is caught up, and every end is reported in one way."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

import jumping_clock
from hornbill.domain.note import Note
from hornbill.errors import Stopped
from hornbill.servo.motion.setpoint_runner import PeriodicSource, SetpointRunner
from hornbill.servo.runtime.hub import Hub, LogEvent
from hornbill.servo.runtime.timebase import TimeBase

PERIOD_S = 0.02


@dataclass(slots=True, eq=False)
class Counted(PeriodicSource):
    """It notes when each of its slots was sent; `before` may take its time or raise."""

    now: Callable[[], float]
    slots: int
    before: Callable[[int], float] = lambda _slot: 0.0
    at: list[float] = field(default_factory=list[float])
    why: str | None = None

    async def send_next(self) -> bool:
        await asyncio.sleep(self.before(len(self.at)))
        self.at.append(round(self.now(), 6))
        return len(self.at) == self.slots

    def interrupt(self, why: Note) -> LogEvent:
        self.why = why.text
        return LogEvent("notice", "move_ended", why.text)


def run(slots: int, before: Callable[[int], float], end_after_s: float | None = None) -> tuple[Counted, list[LogEvent]]:
    events: list[LogEvent] = []

    async def scene() -> Counted:
        base, hub = TimeBase(asyncio.get_running_loop().time), Hub()
        hub.subscribe(events.append, LogEvent)
        runner, began = SetpointRunner(hub, base), base.now()
        source = Counted(PERIOD_S, lambda: base.now() - began, slots, before)
        task = runner.start(source)
        assert runner.runs(source)
        if end_after_s is not None:
            await asyncio.sleep(end_after_s)
            runner.end(source)
            runner.end(source)
        await asyncio.wait([task])
        assert not runner.runs(source)
        await runner.close()
        return source

    return jumping_clock.run(scene()), events


def test_slots_are_sent_on_time() -> None:
    source, events = run(5, lambda _slot: 0.005)
    assert source.at == pytest.approx([0.005, 0.025, 0.045, 0.065, 0.085], abs=0.001)
    assert (source.misses, source.why, events) == (0, None, [])


def test_missed_slots_are_counted_and_not_caught_up() -> None:
    source, _events = run(4, lambda slot: 0.07 if slot == 1 else 0.0)
    assert source.at == pytest.approx([0.0, 0.09, 0.09, 0.1], abs=0.001)
    assert source.misses == 2
    assert source.worst_late_s == pytest.approx(0.05, abs=0.001)


def test_a_refusal_ends_a_run_with_one_notice() -> None:
    def refuse(slot: int) -> float:
        if slot == 2:
            raise Stopped("Stopped.", cause=None)
        return 0.0

    source, events = run(9, refuse)
    assert (len(source.at), source.why) == (2, "Stopped.")
    assert [(one.level, one.text) for one in events] == [("notice", "Stopped.")]


def test_an_internal_error_ends_a_run_as_a_failure() -> None:
    source, events = run(9, lambda slot: 1 / (1 - slot))
    assert len(source.at) == 1
    assert source.why is not None
    assert [one.level for one in events] == ["failure"]


def test_an_ended_run_sends_and_reports_nothing_more() -> None:
    source, events = run(100, lambda _slot: 0.0, end_after_s=0.03)
    assert len(source.at) == 2
    assert events == []
