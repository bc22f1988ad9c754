"""How the servo layer tells whoever listens that something changed."""

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
    """Something about a servo other than its angle changed."""

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
    """A job moved on."""

    job: RunningJob


@dataclass(frozen=True, slots=True)
class Happened:
    """A sentence for the event log. `level`: info, notice, warning or failure.

    `params` are the values in the text, JSON by name, from which a page makes the sentence in its own language.
    """

    level: str
    code: EventCode
    text: str
    uid: Uid | None = None
    params: dict[str, object] = field(default_factory=dict[str, object], hash=False)


@dataclass(frozen=True, slots=True)
class LeaseChanged:
    """Somebody took, renewed for the first time, lost or gave back the lease."""


@dataclass(frozen=True, slots=True)
class ServoSeen:
    """It is known which servo is on a node ID, and nothing of it has been read yet."""

    uid: Uid


@dataclass(frozen=True, slots=True)
class ServoRead:
    """The rows of a servo that has arrived have been read."""

    uid: Uid


@dataclass(frozen=True, slots=True)
class NodeSuspected:
    """A node that may be a servo broadcasts, and has not been identified. Repeated while that is so."""

    node_id: int


@dataclass(frozen=True, slots=True)
class StopPressed:
    """Stop is about to write torque off. Listeners cancel all that could still energise a servo before they return."""


@dataclass(frozen=True, slots=True)
class StopChanged:
    """The stop latch changed, or another servo confirmed."""


@dataclass(frozen=True, slots=True)
class BusChanged:
    """The bus was connected, disconnected, or changed its state."""


@dataclass(frozen=True, slots=True)
class BusUsable:
    """The connected bus was lost (`usable` False), or is back, or there is none any more (True)."""

    usable: bool


Change: TypeAlias = (
    ServoChanged
    | ReadingChanged
    | Sampled
    | JobChanged
    | Happened
    | LeaseChanged
    | ServoSeen
    | ServoRead
    | NodeSuspected
    | StopPressed
    | StopChanged
    | BusChanged
    | BusUsable
)

C = TypeVar("C", bound=Change)


class Hub:
    """Delivers changes to listeners, in order, on the event loop. A listener must return at once."""

    def __init__(self) -> None:
        self._listeners: list[tuple[Callable[[Any], None], tuple[type, ...]]] = []
        self._by_kind: dict[type, tuple[Callable[[Any], None], ...]] = {}

    def listen(self, listener: Callable[[C], None], *kinds: type[C]) -> Callable[[], None]:
        """Call `listener` with every change from now on, or with those of `kinds`; the answer takes it off again."""
        entry = listener, kinds
        self._listeners.append(entry)
        self._by_kind.clear()

        def forget() -> None:
            if entry in self._listeners:
                self._listeners.remove(entry)
                self._by_kind.clear()

        return forget

    def tell(self, change: Change) -> None:
        """Deliver one change to every listener."""
        kind = type(change)
        listeners = self._by_kind.get(kind)
        if listeners is None:
            found = [listener for listener, kinds in self._listeners if not kinds or kind in kinds]
            listeners = self._by_kind[kind] = tuple(found)
        for listener in listeners:
            try:
                listener(change)
            except Exception:  # whoever listens must not be able to break what it listens to
                log.exception("a listener failed on %r", change)
