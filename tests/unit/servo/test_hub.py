"""The hub: who hears what."""

import pytest

from hornbill.servo.runtime.hub import BusChanged, Change, Happened, Hub, Sampled, ServoChanged
from hornbill.units import Uid

SAMPLE = Sampled(Uid("a"), "current_angle", 1.0, 2.0)
CHANGES: list[Change] = [SAMPLE, BusChanged(), ServoChanged(Uid("a")), Happened("info", "ready", "Something."), SAMPLE]


def test_a_listener_without_kinds_hears_all_and_one_with_kinds_those() -> None:
    hub = Hub()
    everything: list[Change] = []
    samples: list[Change] = []
    some: list[Change] = []
    hub.listen(everything.append)
    hub.listen(samples.append, Sampled)
    hub.listen(some.append, BusChanged, Happened)
    for change in CHANGES:
        hub.tell(change)
    assert everything == CHANGES
    assert samples == [SAMPLE, SAMPLE]
    assert some == [CHANGES[1], CHANGES[3]]


def test_a_listener_taken_off_hears_no_more_even_if_taken_off_twice() -> None:
    hub = Hub()
    first: list[Change] = []
    second: list[Change] = []
    forget = hub.listen(first.append, Sampled)
    hub.listen(second.append, Sampled)
    hub.tell(SAMPLE)
    forget()
    forget()
    hub.tell(SAMPLE)
    assert (len(first), len(second)) == (1, 2)


def test_a_listener_that_fails_costs_the_others_nothing(caplog: pytest.LogCaptureFixture) -> None:
    hub = Hub()
    heard: list[Change] = []

    def fail(_change: Change) -> None:
        raise RuntimeError("no")

    hub.listen(fail)
    hub.listen(heard.append)
    hub.tell(SAMPLE)
    assert heard == [SAMPLE]
    assert "a listener failed" in caplog.text
