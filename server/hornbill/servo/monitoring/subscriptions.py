"""Subscriptions: which rows of one servo to poll for whom, how often, and until when."""

from dataclasses import dataclass

from hornbill.units import Instant

DEFAULT_OWNER = "rest"
"""Owner of a subscription without a given owner."""


@dataclass(frozen=True, slots=True)
class Subscription:
    """Rows and their requested rate (Hz). Expires at `until`, never if None."""

    channels: tuple[str, ...]
    rate_hz: float
    until: Instant | None


class Subscriptions:
    """Subscriptions to one servo, one per owner. Each row is polled at the highest rate requested for it."""

    def __init__(self) -> None:
        self.by_owner: dict[str, Subscription] = {}
        self.rates: dict[str, float] = {}
        """Requested rate of each row, Hz."""

    @property
    def total_hz(self) -> float:
        """Reads per second if everything were granted."""
        return sum(self.rates.values())

    @property
    def next_end(self) -> Instant | None:
        """When the next subscription expires."""
        return min((one.until for one in self.by_owner.values() if one.until is not None), default=None)

    def put(self, owner: str, subscription: Subscription) -> None:
        """Replace the owner's subscription; one without rows ends it."""
        if subscription.channels:
            self.by_owner[owner] = subscription
        else:
            self.by_owner.pop(owner, None)
        self._combine()

    def expire(self, now: Instant) -> None:
        """Drop expired subscriptions."""
        ended = [owner for owner, one in self.by_owner.items() if one.until is not None and one.until <= now]
        for owner in ended:
            del self.by_owner[owner]
        if ended:
            self._combine()

    def _combine(self) -> None:
        self.rates = {}
        for one in self.by_owner.values():
            for key in one.channels:
                self.rates[key] = max(self.rates.get(key, 0.0), one.rate_hz)
