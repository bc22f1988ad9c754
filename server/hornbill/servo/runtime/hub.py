"""Publish/subscribe hub for changes in the servo layer."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias, TypeVar

from hornbill.domain.event import EventCode
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.units import Uid

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ServoChanged:
    """Anything about a servo except its angle changed."""

    uid: Uid


@dataclass(frozen=True, slots=True)
class ReadingChanged:
    """A parameter was read or written, or its effect or ROM knowledge changed."""

    uid: Uid
    key: str


class Sampled(NamedTuple):
    """A sample of a channel: `t` seconds on the event loop's clock, `value` in the row's unit or None for a gap."""

    uid: Uid
    key: str
    t: float
    value: float | None


@dataclass(frozen=True, slots=True)
class JobChanged:
    """The state or a step of a job changed."""

    job: RunningJob


@dataclass(frozen=True, slots=True)
class LogEvent:
    """An entry for the event log. `level`: info, notice, warning or failure.

    `params`: values of the text by name, as JSON; the page words the entry in its own language from them.
    """

    level: str
    code: EventCode
    text: str
    uid: Uid | None = None
    params: dict[str, object] = field(default_factory=dict[str, object], hash=False)


@dataclass(frozen=True, slots=True)
class LeaseChanged:
    """The lease was taken, renewed for the first time, released, or has ended."""


@dataclass(frozen=True, slots=True)
class ServoSeen:
    """A servo was identified on a node ID. Nothing has been read from it yet."""

    uid: Uid


@dataclass(frozen=True, slots=True)
class CommandsBegan:
    """Another node began to command a servo by ArrayCommand."""

    uid: Uid
    node_id: int


@dataclass(frozen=True, slots=True)
class ServoRead:
    """All rows of a newly arrived servo have been read."""

    uid: Uid


@dataclass(frozen=True, slots=True)
class NodeSuspected:
    """An unidentified node that may be a servo is broadcasting. Repeated until it is identified."""

    node_id: int


@dataclass(frozen=True, slots=True)
class StopPressed:
    """Stop is about to write torque off. Before returning, subscribers cancel anything that could energise a servo."""


@dataclass(frozen=True, slots=True)
class StopChanged:
    """The stop latch changed, or another servo acknowledged."""


@dataclass(frozen=True, slots=True)
class BusChanged:
    """The bus was connected, disconnected, or changed state."""


@dataclass(frozen=True, slots=True)
class BusUsable:
    """The connected bus was lost (`usable` False), or it is back or was disconnected (True)."""

    usable: bool


Change: TypeAlias = (
    ServoChanged
    | ReadingChanged
    | Sampled
    | JobChanged
    | LogEvent
    | LeaseChanged
    | ServoSeen
    | CommandsBegan
    | ServoRead
    | NodeSuspected
    | StopPressed
    | StopChanged
    | BusChanged
    | BusUsable
)

C = TypeVar("C", bound=Change)


class Hub:
    """Delivers changes to subscribers, in order, on the event loop. A subscriber must return at once."""

    def __init__(self) -> None:
        self._subscribers: list[tuple[Callable[[Any], None], tuple[type, ...]]] = []
        self._by_kind: dict[type, tuple[Callable[[Any], None], ...]] = {}

    def subscribe(self, subscriber: Callable[[C], None], *kinds: type[C]) -> Callable[[], None]:
        """Call `subscriber` with every later change, or with those of `kinds`. Returns a function that unsubscribes."""
        entry = subscriber, kinds
        self._subscribers.append(entry)
        self._by_kind.clear()

        def unsubscribe() -> None:
            if entry in self._subscribers:
                self._subscribers.remove(entry)
                self._by_kind.clear()

        return unsubscribe

    def publish(self, change: Change) -> None:
        """Deliver one change to every subscriber. A subscriber that raises is logged and does not affect the others."""
        kind = type(change)
        subscribers = self._by_kind.get(kind)
        if subscribers is None:
            found = [subscriber for subscriber, kinds in self._subscribers if not kinds or kind in kinds]
            subscribers = self._by_kind[kind] = tuple(found)
        for subscriber in subscribers:
            try:
                subscriber(change)
            except Exception:  # a subscriber must not be able to break the publisher
                log.exception("a subscriber failed on %r", change)
