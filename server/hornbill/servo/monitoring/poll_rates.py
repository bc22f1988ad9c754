"""Who wants which rows of one servo polled, how often, and until when."""

from dataclasses import dataclass

from hornbill.units import Instant

DEFAULT_OWNER = "rest"
"""Whose request it is when nobody says."""


@dataclass(frozen=True, slots=True)
class PollRate:
    """Rows and the rate (Hz) somebody wants each of them at; it ends by itself at `until`."""

    channels: tuple[str, ...]
    rate_hz: float
    until: Instant | None


class PollRates:
    """One request an owner; together they ask for the union of the rows, each at the highest rate wished for it."""

    def __init__(self) -> None:
        self.by_owner: dict[str, PollRate] = {}
        self.rates: dict[str, float] = {}
        """Hz of every row somebody wants."""

    @property
    def total_hz(self) -> float:
        """Reads a second, were everything granted."""
        return sum(self.rates.values())

    @property
    def next_end(self) -> Instant | None:
        """When the next of them ends by itself."""
        return min((one.until for one in self.by_owner.values() if one.until is not None), default=None)

    def put(self, owner: str, request: PollRate) -> None:
        """Replace what this owner wants; a request for no rows ends it."""
        if request.channels:
            self.by_owner[owner] = request
        else:
            self.by_owner.pop(owner, None)
        self._unite()

    def expire(self, now: Instant) -> None:
        """Drop what has ended."""
        ended = [owner for owner, one in self.by_owner.items() if one.until is not None and one.until <= now]
        for owner in ended:
            del self.by_owner[owner]
        if ended:
            self._unite()

    def _unite(self) -> None:
        self.rates = {}
        for one in self.by_owner.values():
            for key in one.channels:
                self.rates[key] = max(self.rates.get(key, 0.0), one.rate_hz)
