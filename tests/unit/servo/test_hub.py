"""The hub: who hears what."""

import pytest

from hornbill.servo.runtime.hub import BusChanged, Change, Hub, LogEvent, Sampled, ServoChanged
from hornbill.units import Uid

SAMPLE = Sampled(Uid("a"), "current_angle", 1.0, 2.0)
CHANGES: list[Change] = [SAMPLE, BusChanged(), ServoChanged(Uid("a")), LogEvent("info", "ready", "Something."), SAMPLE]


def test_a_listener_without_kinds_hears_all_and_one_with_kinds_those() -> None:
    hub = Hub()
    everything: list[Change] = []
    samples: list[Change] = []
    some: list[Change] = []
    hub.subscribe(everything.append)
    hub.subscribe(samples.append, Sampled)
    hub.subscribe(some.append, BusChanged, LogEvent)
    for change in CHANGES:
        hub.publish(change)
    assert everything == CHANGES
    assert samples == [SAMPLE, SAMPLE]
    assert some == [CHANGES[1], CHANGES[3]]


def test_a_listener_taken_off_hears_no_more_even_if_taken_off_twice() -> None:
    hub = Hub()
    first: list[Change] = []
    second: list[Change] = []
    forget = hub.subscribe(first.append, Sampled)
    hub.subscribe(second.append, Sampled)
    hub.publish(SAMPLE)
    forget()
    forget()
    hub.publish(SAMPLE)
    assert (len(first), len(second)) == (1, 2)


def test_a_listener_that_fails_costs_the_others_nothing(caplog: pytest.LogCaptureFixture) -> None:
    hub = Hub()
    heard: list[Change] = []

    def fail(_change: Change) -> None:
        raise RuntimeError("no")

    hub.subscribe(fail)
    hub.subscribe(heard.append)
    hub.publish(SAMPLE)
    assert heard == [SAMPLE]
    assert "a subscriber failed" in caplog.text
