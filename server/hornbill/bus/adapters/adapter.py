"""FoundAdapter: description of a detected adapter."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from hornbill.errors import Cause


@dataclass(frozen=True, slots=True)
class FoundAdapter:
    """An adapter on which a bus can be opened. `state` is as in `GET /bus/adapters`.

    `reason` is why it cannot be used, or what is unusual about it; `remedy` what to do. `bitrate` is in bit/s,
    `sample_point` 0..1; both None if unknown. `serial_number` is the USB serial number, `baud` the rate (bit/s) at
    which a serial adapter was last used. `cause` and `params` are `reason` and `remedy` for programs.
    """

    address: str
    name: str
    state: str = "ready"
    reason: str | None = None
    remedy: str | None = None
    bitrate: int | None = None
    sample_point: float | None = None
    serial_number: str | None = None
    baud: int | None = None
    cause: Cause | None = None
    params: Mapping[str, str | int] = field(default_factory=dict[str, "str | int"])

    @property
    def interface(self) -> str:
        """The part of its address before the colon."""
        return self.address.partition(":")[0]

    @property
    def channel(self) -> str:
        """The part of its address after the colon."""
        return self.address.partition(":")[2]

    @property
    def usable(self) -> bool:
        """Whether it is open or can be opened."""
        return self.state in ("ready", "connected")
