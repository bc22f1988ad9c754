"""The ring of one channel beside a plain list, and telemetry's marks, gaps and memory."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.schema.catalog import Catalog
from hornbill.servo.device.servo import Servo
from hornbill.servo.monitoring.sample_ring import FIRST_CHUNK, LARGEST_CHUNK, SampleRing
from hornbill.servo.monitoring.telemetry import MAX_BYTES, TelemetryCollector
from hornbill.servo.runtime.hub import Hub, LogEvent, Sampled, ServoChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Uid

CATALOG = Catalog.load()
UID = Uid("01" * 16)


def in_order(steps: list[float]) -> list[tuple[float, float]]:
    """Samples whose times go on by these steps."""
    t, found = 1000.0, list[tuple[float, float]]()
    for place, step in enumerate(steps):
        t += step
        found.append((t, float(place)))
    return found


def filled(samples: list[tuple[float, float]]) -> SampleRing:
    ring = SampleRing()
    for t, v in samples:
        ring.append(t, v)
    return ring


def samples_of(ring: SampleRing, since: float, until: float | None = None) -> list[tuple[float, float]]:
    times, values = ring.window(since, until).joined()
    return list(zip(times.tolist(), values.tolist(), strict=True))


STEPS = st.lists(st.sampled_from([0.0, 0.001, 0.02, 0.1, 3.0]), max_size=400)


@given(STEPS, st.floats(0, 60), st.floats(0, 60) | st.none())
@settings(deadline=None)
def test_a_window_has_the_samples_of_a_list(steps: list[float], after: float, length: float | None) -> None:
    samples = in_order(steps)
    since = 1000.0 + after
    until = None if length is None else since + length
    expected = [(t, v) for t, v in samples if t >= since and (until is None or t <= until)]
    assert samples_of(filled(samples), since, until) == expected


@given(st.lists(st.tuples(st.sampled_from([0.0, 0.001, 0.02, 0.1, 3.0]), st.floats(-0.5, 0.0)), max_size=200))
@settings(deadline=None)
def test_late_samples_are_stored_in_order_of_time(given_samples: list[tuple[float, float]]) -> None:
    samples = in_order([step for step, _ in given_samples])
    found = samples_of(filled([(t + back, v) for (t, v), (_, back) in zip(samples, given_samples, strict=True)]), 0.0)
    assert sorted(v for _, v in found) == [v for _, v in samples]
    assert [t for t, _ in found] == sorted(t for t, _ in found)


@given(STEPS, st.integers(0, 5))
@settings(deadline=None)
def test_the_oldest_samples_are_dropped_and_their_size_returned(steps: list[float], times: int) -> None:
    samples = in_order(steps)
    ring = SampleRing()
    size = sum(ring.append(t, v) for t, v in samples)
    for _ in range(times):
        size -= ring.drop_oldest()
    found = samples_of(ring, 0.0)
    assert found == samples[len(samples) - len(found) :]
    assert size >= 16 * len(found)


def test_a_window_does_not_change_when_the_ring_does() -> None:
    ring = filled(in_order([0.01] * 3000))
    window = ring.window(0.0)
    before = window.joined()[0].tolist()
    for t, v in [(t + 30, v) for t, v in in_order([0.01] * 3000)]:
        ring.append(t, v)
    ring.append(1030.5, 1.0)
    ring.drop_oldest()
    assert window.joined()[0].tolist() == before


def test_the_memory_of_a_long_and_of_a_short_channel() -> None:
    ring = SampleRing()
    assert sum(ring.append(t, v) for t, v in in_order([0.02] * 30_000)) < 17 * 30_000 + 16 * LARGEST_CHUNK
    assert SampleRing().append(1.0, 1.0) == 16 * FIRST_CHUNK == 1024


class Desk:
    """A hub, a servo and its telemetry, on a clock that tests set."""

    def __init__(self, **settings: Any) -> None:
        self.now = 1000.0
        self.hub = Hub()
        self.servo = Servo(UID, CATALOG)
        self.servo.identify_as(CATALOG.models["BLA21-06U-A0"], 1300)
        self.servo.online = True
        self.published: list[Sampled] = []
        base = TimeBase(lambda: self.now)
        self.telemetry = TelemetryCollector(self.hub, base, lambda uid: self.servo if uid == UID else None, **settings)
        self.hub.subscribe(self.published.append, Sampled)
        self.hub.publish(ServoChanged(UID))

    def sample(self, value: float | None, key: str = "current_angle", after: float = 0.1) -> None:
        self.now += after
        self.hub.publish(Sampled(UID, key, self.now, value))

    def values(self, key: str = "current_angle") -> list[float | None]:
        return self.telemetry.window(UID, key, 0.0)[1]

    def marks(self, key: str = "current_angle") -> list[str]:
        return [kind for _, kind in self.telemetry.marks(UID, key, 0.0)]


def test_an_offline_servo_leaves_a_gap_in_every_channel_and_publishes_it() -> None:
    desk = Desk()
    desk.sample(1.0)
    desk.sample(7.4, "current_voltage")
    desk.now += 3
    desk.servo.online = False
    desk.hub.publish(ServoChanged(UID))
    desk.hub.publish(ServoChanged(UID))
    assert desk.values() == [1.0, None]
    assert desk.values("current_voltage") == [7.4, None]
    assert desk.marks() == desk.marks("current_voltage") == ["gap"]
    assert [one.value for one in desk.published] == [1.0, 7.4, None, None]


def test_a_lost_bus_leaves_a_gap_at_once_and_a_restart_is_marked() -> None:
    desk = Desk()
    desk.sample(-36_000_000.0)
    desk.hub.publish(LogEvent("failure", "bus_lost", "gone"))
    desk.sample(35_999_999.9, after=0.5)
    desk.servo.restarted(float("inf"))
    desk.hub.publish(ServoChanged(UID))
    assert desk.values() == [-36_000_000.0, None, 35_999_999.9, None], "values are exact in the whole range"
    assert desk.marks() == ["gap", "restart"]


def test_a_pause_of_polling_is_a_gap() -> None:
    desk = Desk()
    for after in (0.05, 0.05, 60.0):
        desk.sample(1.0, "current_speed", after)
    times, values = desk.telemetry.window(UID, "current_speed", 0.0)
    assert values == [1.0, 1.0, None, 1.0]
    assert times == sorted(times)


def test_a_slow_channel_has_no_gaps() -> None:
    desk = Desk()
    for _ in range(10):
        desk.sample(1.0, "current_speed", 10.0)
    assert desk.values("current_speed").count(None) == 1  # the first interval may have been a gap


@pytest.mark.parametrize(("extended_angle", "marks"), [(0, ["wrap"]), (1, [])])
def test_a_wrap_is_marked_unless_turns_are_counted(extended_angle: int, marks: list[str]) -> None:
    desk = Desk()
    desk.servo.note("extended_angle", extended_angle, 0.0)
    for value in (170.0, 179.0, -172.0, -160.0):
        desk.sample(value)
    assert desk.marks() == marks
    assert desk.values() == [170.0, 179.0, -172.0, -160.0]


def test_the_measured_rate_and_age_ignore_gaps() -> None:
    desk = Desk()
    for _ in range(100):
        desk.sample(1.0, "current_speed", 0.05)
    desk.now += 2
    desk.servo.online = False
    desk.hub.publish(ServoChanged(UID))
    hz, age_s = desk.telemetry.measured(UID, "current_speed")
    assert 11 < hz < 13
    assert age_s is not None
    assert math.isclose(age_s, 2.0)
    assert desk.telemetry.measured(UID, "current_torque") == (0.0, None)


def test_only_the_last_minutes_are_stored() -> None:
    desk = Desk(minutes=1)
    for _ in range(10_000):
        desk.sample(1.0, after=0.01)
    times, _ = desk.telemetry.window(UID, "current_angle", 0.0)
    assert 60 <= times[-1] - times[0] <= 60 + 0.01 * LARGEST_CHUNK
    assert desk.telemetry.bytes < 20 * len(times) + 16 * LARGEST_CHUNK


def test_a_crowd_stays_within_the_memory_and_the_oldest_samples_are_dropped() -> None:
    desk = Desk(max_bytes=1_000_000)
    uids = [Uid(f"{number:032x}") for number in range(125)]
    for turn in range(1000):
        for uid in uids:
            desk.hub.publish(Sampled(uid, "current_angle", 1000 + turn / 10, 1.0))
    assert desk.telemetry.bytes <= 1_000_000
    times = [desk.telemetry.window(uid, "current_angle", 0.0)[0] for uid in uids]
    assert {one[-1] for one in times} == {1000 + 999 / 10}
    first = [one[0] for one in times]
    assert max(first) - min(first) < 0.1 * LARGEST_CHUNK


def test_ten_minutes_of_a_full_bus_need_a_fifth_of_the_memory() -> None:
    desk, slow = Desk(), ("command_angle", "command_speed", "command_torque", "current_voltage", "current_speed")
    for turn in range(6000):  # Status at 10 Hz, and six rows a second of each of 125 servos
        for key in ("current_angle", *(slow if turn % 10 == 0 else ())):
            desk.hub.publish(Sampled(UID, key, 1000 + turn / 10, 1.0))
    assert desk.telemetry.bytes * 125 < MAX_BYTES / 5


def test_a_gap_is_published_once_however_its_time_is_rounded() -> None:
    awkward = next(t for t in (n * 0.1 + 0.03 for n in range(20_000)) if (t + 5.0) - t > 5.0)
    desk = Desk()
    for t in (awkward, awkward + 60):
        desk.hub.publish(Sampled(UID, "current_voltage", t, 7.4))
    assert [sample.value for sample in desk.published] == [7.4, None, 7.4]
