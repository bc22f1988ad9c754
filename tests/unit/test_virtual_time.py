"""VirtualLoop: speed, standing still during calls in threads, and lateness that never shows."""

import asyncio
import math
import time

import pytest

from hornbill.virtual_time import BEHIND_S, START, VirtualLoop, VirtualSelector, utc_of


class Real:
    """Real time, set by the test."""

    def __init__(self) -> None:
        self.now = 50.0

    def __call__(self) -> float:
        return self.now


@pytest.mark.parametrize("speed", [0.5, 1.0, 100.0])
def test_the_clock_shows_the_next_timer_when_its_real_time_has_come(speed: float) -> None:
    real = Real()
    selector = VirtualSelector(speed, real)
    real.now += 2.0 / speed
    assert (selector.select(2.0), selector.now) == ([], START + 2.0)
    assert selector.actual_speed == pytest.approx(speed)


def test_a_loop_that_is_late_stands_still_meanwhile_and_does_not_catch_up_for_long() -> None:
    real = Real()
    selector = VirtualSelector(10.0, real)
    real.now += 60.0  # a busy computer
    assert selector.now == START
    selector.select(0.5)
    assert selector.now == START + 0.5
    began = time.monotonic()
    real.now += BEHIND_S / 2
    selector.select(BEHIND_S / 2 * 10.0)
    assert selector.now == START + 0.5 + BEHIND_S / 2 * 10.0
    assert time.monotonic() - began < 1.0


def test_a_loop_that_is_a_second_late_catches_up() -> None:
    real = Real()
    selector = VirtualSelector(1.0, real)
    real.now += 1.0
    began = time.monotonic()
    for _ in range(4):
        selector.select(0.25)
    assert selector.now == START + 1.0
    assert time.monotonic() - began < 0.2, "it waits although it is late"


def test_a_call_in_a_thread_takes_no_virtual_time() -> None:
    async def main() -> tuple[float, float]:
        loop = asyncio.get_running_loop()
        ticks = asyncio.create_task(_tick())
        began = loop.time()
        await loop.run_in_executor(None, time.sleep, 0.05)
        took = loop.time() - began
        await asyncio.sleep(3600)
        ticks.cancel()
        return took, loop.time() - began

    with asyncio.Runner(loop_factory=lambda: VirtualLoop(math.inf)) as runner:
        began = time.monotonic()
        took, whole = runner.run(main())
    assert took < 1.0, "at most the timer that was due when the call began"
    assert whole == pytest.approx(3600 + took)
    assert time.monotonic() - began < 30


async def _tick() -> None:
    while True:
        await asyncio.sleep(0.5)


def test_utc_follows_virtual_time_and_is_real_on_other_loops() -> None:
    async def main() -> float:
        utc = utc_of(asyncio.get_running_loop())
        before = utc()
        await asyncio.sleep(1000)
        return utc() - before

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        assert runner.run(main()) == pytest.approx(1000)
    loop = asyncio.new_event_loop()
    assert utc_of(loop) is time.time
    loop.close()
