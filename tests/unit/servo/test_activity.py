"""What a servo does, told from samples alone: also of swings that Status meets at one phase only, without flapping."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import cast

import pytest

from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import DUMMY
from hornbill.servo.device.servo import Servo
from hornbill.servo.monitoring.activity import MAX_FAST_POLLED, Activities, torque_limit_pct
from hornbill.servo.monitoring.polling import Polling
from hornbill.servo.runtime.hub import Hub, LogEvent, Sampled
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Uid
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus

CATALOG = Catalog.load()
Where = Callable[[float], float]
START = 100.0


@dataclass
class Desk:
    """One servo that is heard, its torque polled, and its angle as often as it is asked for."""

    model: str = "BLA21-06U-A0"
    now: float = START
    looks: list[tuple[str, float]] = field(default_factory=list[tuple[str, float]])
    said: list[LogEvent] = field(default_factory=list[LogEvent])
    states: list[str] = field(default_factory=list[str])

    def __post_init__(self) -> None:
        hub = self.hub = Hub()
        self.servo = ready(1, self.model)
        self._until, self._looked, self._polled, self._torque = -math.inf, "", -math.inf, START
        base = TimeBase(lambda: self.now, lambda: self.now)
        self.activities = Activities(hub, base, cast(Polling, self), lambda _uid: self.servo, lambda _uid: True)
        hub.subscribe(self.said.append, LogEvent)

    def subscribe(self, _servo: Servo, channels: list[str], rate_hz: float, *, owner: str, ttl_s: float) -> None:
        """Stands for Polling."""
        assert owner == "activity"
        self.looks.append((channels[0], rate_hz))
        self._until, self._looked = self.now + ttl_s, channels[0]

    def run(self, seconds: float, angle: Where, torque: Where = lambda _at: 0.0, watched_hz: float = 0.0) -> None:
        """Samples as the bus brings them: Status every 0.1 s, unless 0x08 was read just before, and what is polled."""
        end, status = self.now + seconds, self.now
        while self.now < end:
            self.now = round(self.now + 0.001, 3)
            looked = self.now < self._until
            hz = max(watched_hz, self.looks[-1][1] if looked and self._looked == "current_angle" else 0.0)
            if hz and self.now - self._polled >= 1 / hz:
                self._polled = self.now
                self._sample("current_angle", angle)
            if self.now - status >= 0.1:
                status = self.now
                if self.now - self._polled > 0.15:
                    self._sample("current_angle", angle)
            every = (
                1 / self.looks[-1][1]
                if looked and self._looked == "current_torque"
                else CATALOG.polled["current_torque"]
            )
            if self.now - self._torque >= every:
                self._torque = self.now
                self._sample("current_torque", torque)
            self.activities.tick()
            doing = self.doing
            if not self.states or self.states[-1] != doing:
                self.states.append(doing)

    def _sample(self, key: str, of: Where) -> None:
        value = round(of(self.now), 1)
        self.servo.note(key, round(value * self.servo.registers[key].parameter.per_unit), self.now)
        self.hub.publish(Sampled(self.servo.uid, key, self.now, value))

    @property
    def doing(self) -> str:
        return self.activities.of(self.servo).doing

    def codes(self) -> list[str]:
        return [one.code for one in self.said]


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


def swing(hz: float, peak: float) -> Where:
    return lambda at: peak * math.sin(2 * math.pi * hz * at + 0.4)


@pytest.mark.parametrize("hz", [2.0, 3.1, 5.0, 7.7, 9.4, 9.9, 10.0, 10.1, 16.0, 20.0, 23.7, 30.0])
def test_hunting_is_found_at_every_frequency_told_once_and_ends_once(hz: float) -> None:
    desk = Desk()
    desk.run(60.0, swing(hz, 1.0), swing(hz, 90.0))
    assert desk.doing == "hunting"
    assert desk.codes() == ["hunting"]
    assert desk.states[-1:] == ["hunting"]
    assert desk.states.count("hunting") == 1, desk.states
    (told,) = desk.said
    assert told.params["peak_to_peak_deg"] == pytest.approx(2.0, abs=0.7)
    desk.run(20.0, lambda _at: 0.2)
    assert desk.doing == "holding"
    assert desk.codes() == ["hunting", "hunting_ended"]
    assert desk.states.count("hunting") == 1, desk.states


def test_what_status_shows_needs_no_other_reads() -> None:
    desk = Desk()
    desk.run(30.0, swing(16.0, 1.0))
    assert desk.doing == "hunting"
    assert len(desk.looks) <= 1
    quiet = Desk()
    quiet.run(60.0, lambda _at: 12.3, lambda _at: 20.0)
    assert quiet.looks == []


def test_few_servos_are_looked_at_closely_at_a_time() -> None:
    desk = Desk()
    others = [ready(number) for number in range(2, 12)]
    servos = {one.uid: one for one in (desk.servo, *others)}
    looked: list[str] = []

    class Reads:
        def subscribe(self, servo: Servo, *_: object, **__: object) -> None:
            looked.append(servo.uid)

    base = TimeBase(lambda: desk.now, lambda: desk.now)
    activities = Activities(desk.hub, base, cast(Polling, Reads()), servos.get, lambda _uid: True)
    for tick in range(40):
        desk.now = START + 2 + tick / 10
        for servo in others:
            desk.hub.publish(Sampled(servo.uid, "current_angle", desk.now, 0.0))
            desk.hub.publish(Sampled(servo.uid, "current_torque", desk.now, 80.0 * (tick // 5 % 2)))
        if tick == 19:
            assert len(set(looked)) == MAX_FAST_POLLED
    assert all(activities.of(servo).doing == "holding" for servo in others)


@pytest.mark.parametrize("watched_hz", [0.0, 20.0])
def test_loads_that_change_under_a_horn_at_rest_are_no_hunting(watched_hz: float) -> None:
    desk = Desk()
    desk.run(120.0, lambda at: 0.1 * math.sin(at), lambda at: 60.0 * math.sin(at * 1.3), watched_hz)
    assert desk.codes() == []
    assert set(desk.states) <= {"unknown", "holding"}


def test_a_motor_at_its_limit_at_rest_is_saturated_told_once_and_ends_once() -> None:
    desk = Desk()
    desk.run(10.0, lambda _at: 5.0, lambda _at: 40.0)
    desk.run(30.0, lambda _at: 5.0, lambda at: 95.0 if math.sin(at * 7) > -0.9 else 85.0)
    assert desk.doing == "saturated"
    (told,) = desk.said
    assert (told.code, told.params["torque_limit_pct"]) == ("saturated", 100.0)
    desk.run(30.0, lambda _at: 5.0, lambda _at: 30.0)
    assert desk.codes() == ["saturated", "saturated_ended"]
    assert desk.states == ["unknown", "holding", "saturated", "holding"]


def test_torque_of_a_move_is_no_saturation() -> None:
    desk = Desk()
    for turn in range(20):
        begun, to = desk.now, 60.0 * (turn % 2)
        desk.servo.note("command_angle", round(to * 10), desk.now)

        def where(at: float, begun: float = begun, to: float = to) -> float:
            share = min(1.0, (at - begun) / 1.5)
            return to * share + (60.0 - to) * (1 - share)

        desk.run(4.0, where, lambda at, begun=begun: 100.0 if at - begun < 1.5 else 5.0)
    assert desk.codes() == []
    assert "saturated" not in desk.states


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
def test_the_limit_is_the_lowest_of_what_holds_on_that_side(raws: dict[str, int], pct: float, limit: float) -> None:
    servo = ready(1)
    for key, raw in raws.items():
        servo.note(key, raw, START)
    assert torque_limit_pct(servo, pct) == limit


def test_a_command_ends_rest_and_a_swing_counts_only_after_it() -> None:
    desk = Desk()
    desk.run(10.0, swing(16.0, 1.0))
    assert desk.doing == "hunting"
    for turn in range(20):
        desk.servo.note("command_angle", 100 + turn, desk.now)
        desk.run(0.4, swing(16.0, 1.0))
        assert desk.doing != "hunting" or turn == 0
    assert desk.codes() == ["hunting"], "it neither ended nor began anew"
    desk.run(5.0, swing(16.0, 1.0))
    assert desk.doing == "hunting"
    assert desk.codes() == ["hunting"]


def test_silence_is_unknown_and_clears_nothing_but_a_restart_does() -> None:
    desk = Desk()
    desk.run(10.0, swing(16.0, 1.0))
    desk.now += 1.5
    desk.activities.tick()
    assert desk.doing == "unknown"
    assert desk.activities.of(desk.servo).peak_to_peak_deg is None
    desk.run(10.0, swing(16.0, 1.0))
    assert desk.codes() == ["hunting"]
    assert desk.doing == "hunting"
