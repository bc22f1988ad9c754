"""The hub: subscriptions by kind of change."""

import pytest

from hornbill.servo.runtime.hub import BusChanged, Change, Hub, LogEvent, Sampled, ServoChanged
from hornbill.units import Uid

SAMPLE = Sampled(Uid("a"), "current_angle", 1.0, 2.0)
CHANGES: list[Change] = [SAMPLE, BusChanged(), ServoChanged(Uid("a")), LogEvent("info", "ready", "Something."), SAMPLE]


def test_a_subscriber_receives_all_changes_or_those_of_its_kinds() -> None:
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


def test_an_unsubscribed_subscriber_receives_nothing_more() -> None:
    hub = Hub()
    first: list[Change] = []
    second: list[Change] = []
    unsubscribe = hub.subscribe(first.append, Sampled)
    hub.subscribe(second.append, Sampled)
    hub.publish(SAMPLE)
    unsubscribe()
    unsubscribe()
    hub.publish(SAMPLE)
    assert (len(first), len(second)) == (1, 2)


def test_a_failing_subscriber_does_not_affect_others(caplog: pytest.LogCaptureFixture) -> None:
    hub = Hub()
    received: list[Change] = []

    def fail(_change: Change) -> None:
        raise RuntimeError("no")

    hub.subscribe(fail)
    hub.subscribe(received.append)
    hub.publish(SAMPLE)
    assert received == [SAMPLE]
    assert "a subscriber failed" in caplog.text
