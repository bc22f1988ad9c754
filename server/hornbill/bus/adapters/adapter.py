"""Adapter: what people are told of something a bus can be opened on."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from hornbill.errors import Cause


@dataclass(frozen=True, slots=True)
class FoundAdapter:
    """Something a bus can be opened on; the words of `state` are those of `GET /bus/adapters`.

    `reason` says why it cannot be used, or what is odd about it; `remedy` what to do about that. `bitrate` is in
    bit/s, `sample_point` 0..1; both None where nobody tells. `serial_number` is that of USB; `baud` the rate (bit/s) at
    which a serial adapter was last used. `cause` and `params` say `reason` and `remedy` for programs.
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
        """The word before the colon of its address."""
        return self.address.partition(":")[0]

    @property
    def channel(self) -> str:
        """What follows the colon."""
        return self.address.partition(":")[2]

    @property
    def usable(self) -> bool:
        """Whether it can be opened, or is."""
        return self.state in ("ready", "connected")
