"""Polling: rates, an even distribution over time, the budget, and subscriptions."""

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable
from functools import cache
from typing import TypeVar, cast

import pytest

import jumping_clock as clock
from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter
from hornbill.servo.device.reading import LIVE_PERIOD_S
from hornbill.servo.device.requests import RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.monitoring.polling import BACKGROUND, BUDGET, READ_S, Polling
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Raw, Uid
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus

CATALOG = Catalog.load()
T = TypeVar("T")
MODEL = CATALOG.models["BLA21-06U-A0"]


class Reads:
    """ServoRequests whose reads take READ_S and are logged."""

    silent = False
    read_interval_s = 0.0

    def __init__(self, overview: Raw = 0) -> None:
        self.overview = overview
        self.done: list[tuple[float, Uid, str]] = []

    async def read(self, servo: Servo, parameter: Parameter, policy: RetryPolicy) -> Raw:
        loop = asyncio.get_running_loop()
        self.done.append((loop.time(), servo.uid, parameter.key))
        await asyncio.sleep(READ_S)
        raw = self.overview if parameter.key == "fault_overview" else 0
        servo.note(parameter.key, raw, loop.time())
        return raw


def ready(number: int) -> Servo:
    servo = Servo(Uid(f"{number:032x}"), CATALOG)
    servo.identify_as(MODEL, 1300)
    servo.online = servo.identified = True
    servo.status = NodeStatus(100, NodeHealth.OK, Mode.OPERATIONAL)
    assert servo.state is State.READY
    return servo


def play(
    act: Callable[[Polling, Reads], Awaitable[T]], overview: Raw = 0, budget: float = BUDGET, *, watched: bool = True
) -> T:
    """The result of `act` with a Polling on a jumping clock."""

    async def scene() -> T:
        reads = Reads(overview)
        base = TimeBase(asyncio.get_running_loop().time)
        polling = Polling(cast(ServoRequests, reads), base, budget, watched=lambda: watched)
        found = await act(polling, reads)
        await polling.close()
        return found

    return clock.run(scene())


@cache
def polled(count: int, seconds: float, overview: Raw = 0, *, watched: bool = True) -> list[tuple[float, Uid, str]]:
    """The reads of that many servos after they have settled."""

    async def act(polling: Polling, reads: Reads) -> list[tuple[float, Uid, str]]:
        for number in range(count):
            polling.begin(ready(number))
            await asyncio.sleep(0.003)
        await asyncio.sleep(5.0)
        reads.done.clear()
        await asyncio.sleep(seconds)
        return reads.done

    return play(act, overview, watched=watched)


def test_few_servos_are_polled_at_the_configured_rates() -> None:
    counts = Counter((uid, key) for _, uid, key in polled(16, 20.0))
    assert len(counts) == 16 * len(CATALOG.polled)
    for (_, key), count in counts.items():
        assert count == pytest.approx(20.0 / CATALOG.polled[key], abs=1)


def test_polling_of_a_crowd_stays_within_the_background_budget() -> None:
    done = polled(125, 80.0)  # long enough that the first rows matter little
    assert len(done) * READ_S / 80.0 <= BACKGROUND * BUDGET * 1.05


def test_servos_that_nobody_watches_are_polled_half_as_often() -> None:
    assert len(polled(6, 20.0, watched=False)) == pytest.approx(len(polled(6, 20.0)) / 2, rel=0.1)


@pytest.mark.parametrize(("count", "overview", "watched"), [(16, 0, True), (125, 1 << 16, True), (6, 1 << 16, False)])
def test_every_row_is_polled_before_its_reading_is_stale(count: int, overview: Raw, watched: bool) -> None:
    last: dict[tuple[Uid, str], float] = {}
    for at, uid, key in polled(count, 20.0, overview, watched=watched):
        limit = LIVE_PERIOD_S.get(CATALOG.by_key[key].group, 2.5)
        assert at - last.get((uid, key), at) < limit - 0.1, key
        last[uid, key] = at
    assert len(last) == count * (len(CATALOG.polled) + (3 if overview else 0))


def test_polling_of_many_servos_is_spread_over_time() -> None:
    done = polled(50, 20.0)
    slots = Counter(int(at * 20) for at, _, _ in done)
    mean = len(done) / (20 * 20)
    assert max(slots.values()) < 3 * mean


def test_a_new_subscription_is_polled_at_once() -> None:
    async def act(polling: Polling, reads: Reads) -> None:
        servo = ready(1)
        polling.begin(servo)
        await asyncio.sleep(5.05)
        reads.done.clear()
        polling.subscribe(servo, ["current_speed"], 20.0)
        await asyncio.sleep(0.01)
        assert any(key == "current_speed" for _, _, key in reads.done)
        await asyncio.sleep(1.0)
        assert sum(key == "current_speed" for _, _, key in reads.done) == pytest.approx(20, abs=2)

    play(act)


def poll_counts(
    subscribed: dict[int, dict[str, float]], count: int = 4, budget: float = BUDGET, seconds: float = 10.0
) -> Counter[tuple[int, str]]:
    """The number of reads of each row in that many seconds, with these subscriptions."""

    async def act(polling: Polling, reads: Reads) -> Counter[tuple[int, str]]:
        servos = [ready(number) for number in range(count)]
        for servo in servos:
            polling.begin(servo)
        for number, rates in subscribed.items():
            for key, rate in rates.items():
                polling.subscribe(servos[number], [key], rate, owner=key)
        await asyncio.sleep(5.0)
        reads.done.clear()
        await asyncio.sleep(seconds)
        return Counter((int(uid, 16), key) for _, uid, key in reads.done)

    return play(act, budget=budget)


FAST = {"current_angle": 200.0, "current_speed": 200.0, "current_torque": 200.0}


def test_fast_channels_leave_the_background_rates_of_all_servos() -> None:
    seen = poll_counts({0: FAST, 1: FAST})
    for number in range(4):
        for key, period in CATALOG.polled.items():
            if number > 1 or key not in FAST:
                assert seen[number, key] == pytest.approx(10 / period, abs=1)


def test_the_remaining_budget_is_shared_in_proportion_to_the_requested_rates() -> None:
    seen = poll_counts({0: FAST, 1: {"current_speed": 100.0}, 2: {"current_speed": 50.0}, 3: FAST})
    assert seen[0, "current_speed"] == pytest.approx(seen[3, "current_speed"], rel=0.03)
    assert seen[0, "current_speed"] == pytest.approx(2 * seen[1, "current_speed"], rel=0.03)
    assert seen[1, "current_speed"] == pytest.approx(2 * seen[2, "current_speed"], rel=0.03)


@pytest.mark.parametrize(("count", "budget"), [(2, 0.4), (60, 0.05)])
def test_the_budget_is_observed_for_any_subscriptions(budget: float, count: int) -> None:
    seen = poll_counts(dict.fromkeys(range(min(count, 20)), FAST), count, budget, 20.0)
    assert sum(seen.values()) * READ_S / 20 <= budget * 1.02


def test_an_offline_servo_uses_no_budget() -> None:
    async def act(polling: Polling, _reads: Reads) -> None:
        here, gone = ready(1), ready(2)
        for servo in (here, gone):
            polling.begin(servo)
            polling.subscribe(servo, list(FAST), 200.0)
        shared = polling.rates(here)["current_speed"]
        gone.online = False
        await asyncio.sleep(1.5)
        assert polling.rates(here)["current_speed"] == pytest.approx(2 * shared, rel=0.05)

    play(act, budget=0.2)


def test_a_subscription_expires_unless_it_is_renewed() -> None:
    async def act(polling: Polling, reads: Reads) -> list[int]:
        servo = ready(1)
        polling.begin(servo)
        found: list[int] = []
        for renew in (True, True, False, False):
            if renew:
                polling.subscribe(servo, ["current_speed"], 20.0, owner="page", ttl_s=5.0)
            reads.done.clear()
            await asyncio.sleep(4.0)
            found.append(sum(key == "current_speed" for _, _, key in reads.done))
        assert polling.grants(servo) == []
        return found

    assert play(act) == [pytest.approx(80, abs=2), pytest.approx(80, abs=2), pytest.approx(20, abs=2), 0]
