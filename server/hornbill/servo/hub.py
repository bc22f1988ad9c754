"""Owns Hub: how the servo layer tells whoever listens that something changed."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias, TypeVar

from hornbill.servo.jobs import Job
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

    job: Job


@dataclass(frozen=True, slots=True)
class Happened:
    """A sentence for the event log. `level`: info, notice, warning or failure."""

    level: str
    code: str
    text: str
    uid: Uid | None = None


@dataclass(frozen=True, slots=True)
class LeaseChanged:
    """Somebody took, renewed for the first time, lost or gave back the lease."""


@dataclass(frozen=True, slots=True)
class StopChanged:
    """The stop latch changed, or another servo confirmed."""


@dataclass(frozen=True, slots=True)
class BusChanged:
    """The bus was connected, disconnected, or changed its state."""


Change: TypeAlias = (
    ServoChanged | ReadingChanged | Sampled | JobChanged | Happened | LeaseChanged | StopChanged | BusChanged
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
