"""What the live iterators of a client yield: samples and gaps."""

from typing import Literal, NamedTuple


class Sample(NamedTuple):
    """One sample of one channel."""

    uid: str
    """Unique ID of the servo."""
    key: str
    """Key of the parameter."""
    t: float
    """Time of the sample, seconds since 1970 UTC on the server's clock."""
    value: float
    """Value in the unit of the row."""


class Gap(NamedTuple):
    """Something is missing at this place of the series. Never silently skipped."""

    cause: Literal["lost", "no_value"]
    """lost: the server was restarted, or the program was away or too slow for longer than the server stores; no_value:
    the servo did not respond, or reported the channel as inactive."""
    t: float
    """Time of the missing sample, or at which the loss was noticed, seconds since 1970 UTC."""
    lost: int | None = None
    """Upper bound of the lost messages, of all topics and servos. None if unknown."""
    uid: str | None = None
    """Unique ID of the servo. None for all."""
    key: str | None = None
    """Key of the parameter. None for all."""
