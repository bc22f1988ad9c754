"""The activity of a servo, from samples alone: also of oscillations that alias with Status, without flapping."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import cast

import pytest

from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import DUMMY
from hornbill.servo.device.servo import Servo
from hornbill.servo.monitoring.activity import MAX_FAST_POLLED, RATE_POLL_HZ, Activities, torque_limit_pct
from hornbill.servo.monitoring.polling import Polling
from hornbill.servo.runtime.hub import Hub, LogEvent, Sampled
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Uid
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus

CATALOG = Catalog.load()
Signal = Callable[[float], float]
START = 100.0


@dataclass
class Rig:
    """One online servo: its torque is polled, and its angle as often as it is subscribed."""

    model: str = "BLA21-06U-A0"
    now: float = START
    reads: list[tuple[str, float]] = field(default_factory=list[tuple[str, float]])
    events: list[LogEvent] = field(default_factory=list[LogEvent])
    states: list[str] = field(default_factory=list[str])

    def __post_init__(self) -> None:
        hub = self.hub = Hub()
        self.servo = ready(1, self.model)
        self._until, self._read_key, self._polled, self._torque = -math.inf, "", -math.inf, START
        base = TimeBase(lambda: self.now, lambda: self.now)
        self.activities = Activities(hub, base, cast(Polling, self), lambda _uid: self.servo, lambda _uid: True)
        hub.subscribe(self.events.append, LogEvent)

    def subscribe(self, _servo: Servo, channels: list[str], rate_hz: float, *, owner: str, ttl_s: float) -> None:
        """As Polling does."""
        assert owner == "activity"
        self.reads.append((channels[0], rate_hz))
        self._until, self._read_key = self.now + ttl_s, channels[0]

    def run(self, seconds: float, angle: Signal, torque: Signal = lambda _at: 0.0, watched_hz: float = 0.0) -> None:
        """Publish samples as from a bus: Status every 0.1 s, unless 0x08 was just read, and polled rows."""
        end, status = self.now + seconds, self.now
        while self.now < end:
            self.now = round(self.now + 0.005, 3)
            read = self.now < self._until
            hz = max(watched_hz, self.reads[-1][1] if read and self._read_key == "current_angle" else 0.0)
            if hz and self.now - self._polled >= 1 / hz:
                self._polled = self.now
                self._sample("current_angle", angle)
            if self.now - status >= 0.1:
                status = self.now
                if self.now - self._polled > 0.15:
                    self._sample("current_angle", angle)
            fast = read and self._read_key == "current_torque"
            if self.now - self._torque >= (1 / self.reads[-1][1] if fast else CATALOG.polled["current_torque"]):
                self._torque = self.now
                self._sample("current_torque", torque)
            self.activities.tick()
            if self.states[-1:] != [self.doing]:
                self.states.append(self.doing)

    def _sample(self, key: str, of: Signal) -> None:
        value = round(of(self.now), 1)
        self.servo.note(key, round(value * self.servo.registers[key].parameter.per_unit), self.now)
        self.hub.publish(Sampled(self.servo.uid, key, self.now, value))

    @property
    def doing(self) -> str:
        return self.activities.of(self.servo).doing

    def codes(self) -> list[str]:
        return [one.code for one in self.events]


def ready(number: int, model: str = "BLA21-06U-A0") -> Servo:
    """A servo that holds 0°, commanded once, with the defaults of its model."""
    servo = Servo(Uid(f"{number:032x}"), CATALOG)
    servo.identify_as(CATALOG.models[model], 1300)
    servo.online = servo.identified = True
    servo.status = NodeStatus(100, NodeHealth.OK, Mode.OPERATIONAL)
    for key, one in servo.registers.items():
        servo.note(key, one.parameter.default or 0, START)
    servo.note("current_voltage", round(CATALOG.models[model].nominal_v * 10), START)
    for key in ("command_speed", "command_torque"):
        servo.note(key, DUMMY, START)
    return servo


def swing(hz: float, peak: float) -> Signal:
    return lambda at: peak * math.sin(2 * math.pi * hz * at + 0.4)


@pytest.mark.parametrize("hz", [2.0, 5.0, 9.9, 10.0, 20.0, 23.7])
def test_hunting_is_found_at_every_frequency_and_reported_once(hz: float) -> None:
    rig = Rig()
    rig.run(30.0, swing(hz, 1.0), swing(hz, 90.0))
    assert rig.doing == "hunting"
    assert rig.codes() == ["hunting"]
    assert rig.states.count("hunting") == 1, rig.states
    (event,) = rig.events
    assert event.params["peak_to_peak_deg"] == pytest.approx(2.0, abs=0.7)
    rig.run(10.0, lambda _at: 0.2)
    assert rig.doing == "holding"
    assert rig.codes() == ["hunting", "hunting_ended"]
    assert rig.states.count("hunting") == 1, rig.states


def test_what_status_shows_needs_no_additional_reads() -> None:
    rig = Rig()
    rig.run(30.0, swing(16.0, 1.0))
    assert rig.doing == "hunting"
    assert len([rate for _, rate in rig.reads if rate != RATE_POLL_HZ]) <= 1
    assert len(rig.reads) <= 2, "and those that measure its frequency"
    quiet = Rig()
    quiet.run(60.0, lambda _at: 12.3, lambda _at: 20.0)
    assert quiet.reads == []


def test_only_a_few_servos_are_polled_fast_at_a_time() -> None:
    rig = Rig()
    others = [ready(number) for number in range(2, 12)]
    servos = {one.uid: one for one in (rig.servo, *others)}
    read: list[str] = []

    class Reads:
        def subscribe(self, servo: Servo, *_: object, **__: object) -> None:
            read.append(servo.uid)

    base = TimeBase(lambda: rig.now, lambda: rig.now)
    activities = Activities(rig.hub, base, cast(Polling, Reads()), servos.get, lambda _uid: True)
    for tick in range(40):
        rig.now = START + 2 + tick / 10
        for servo in others:
            rig.hub.publish(Sampled(servo.uid, "current_angle", rig.now, 0.0))
            rig.hub.publish(Sampled(servo.uid, "current_torque", rig.now, 80.0 * (tick // 5 % 2)))
        if tick == 19:
            assert len(set(read)) == MAX_FAST_POLLED
    assert all(activities.of(servo).doing == "holding" for servo in others)


@pytest.mark.parametrize("watched_hz", [0.0, 20.0])
def test_a_changing_load_on_a_horn_at_rest_is_no_hunting(watched_hz: float) -> None:
    rig = Rig()
    rig.run(60.0, lambda at: 0.1 * math.sin(at), lambda at: 60.0 * math.sin(at * 1.3), watched_hz)
    assert rig.codes() == []
    assert set(rig.states) <= {"unknown", "holding"}


def test_torque_during_a_move_is_no_saturation() -> None:
    rig = Rig()
    for turn in range(20):
        begun, to = rig.now, 60.0 * (turn % 2)
        rig.servo.note("command_angle", round(to * 10), rig.now)

        def where(at: float, begun: float = begun, to: float = to) -> float:
            share = min(1.0, (at - begun) / 1.5)
            return to * share + (60.0 - to) * (1 - share)

        rig.run(4.0, where, lambda at, begun=begun: 100.0 if at - begun < 1.5 else 5.0)
    assert rig.codes() == []
    assert "saturated" not in rig.states


@pytest.mark.parametrize(
    ("raws", "pct", "limit"),
    [
        ({}, 50.0, 100.0),
        ({"torque_limit_cw": 40}, 50.0, 100.0),
        ({"torque_limit_cw": 40, "speed_torque_control": 1}, 39.0, 40.0),
        ({"torque_limit_cw": 40, "speed_torque_control": 1}, -39.0, 100.0),
        ({"torque_limit_ccw": -25, "speed_torque_control": 1}, -20.0, 25.0),
        ({"overcurrent_limit": 60}, 50.0, 50.0),
        ({"current_voltage": 60}, 50.0, 81.1),
    ],
)
def test_the_torque_limit_is_the_lowest_of_its_direction(raws: dict[str, int], pct: float, limit: float) -> None:
    servo = ready(1)
    for key, raw in raws.items():
        servo.note(key, raw, START)
    assert torque_limit_pct(servo, pct) == limit


def test_a_command_restarts_the_detection_of_hunting() -> None:
    rig = Rig()
    rig.run(10.0, swing(16.0, 1.0))
    assert rig.doing == "hunting"
    for turn in range(20):
        rig.servo.note("command_angle", 100 + turn, rig.now)
        rig.run(0.4, swing(16.0, 1.0))
        assert rig.doing != "hunting" or turn == 0
    assert rig.codes() == ["hunting"], "it neither ended nor started again"
    rig.run(5.0, swing(16.0, 1.0))
    assert rig.doing == "hunting"
    assert rig.codes() == ["hunting"]


def test_an_offline_servo_is_unknown_and_its_hunting_has_not_ended() -> None:
    rig = Rig()
    rig.run(10.0, swing(16.0, 1.0))
    rig.now += 1.5
    rig.activities.tick()
    assert rig.doing == "unknown"
    assert rig.activities.of(rig.servo).peak_to_peak_deg is None
    rig.run(10.0, swing(16.0, 1.0))
    assert rig.codes() == ["hunting"]
    assert rig.doing == "hunting"
