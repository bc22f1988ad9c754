"""What names a DroneCAN data type, and what its structures can do."""

from binascii import crc_hqx
from dataclasses import dataclass, field
from enum import IntEnum
from typing import ClassVar, Protocol, Self


class Kind(IntEnum):
    """The three kinds of transfer. Messages and services have separate number spaces: id 1 exists in both."""

    MESSAGE = 0
    REQUEST = 1
    RESPONSE = 2


@dataclass(frozen=True, slots=True)
class DataType:
    """One data type: full DSDL name, default id (messages 0..65535, services 0..255), 64-bit signature.

    `crc_seed` is the transfer CRC after the eight signature bytes, low byte first: the start value for
    the payload of every multi-frame transfer of this type.
    """

    name: str
    id: int
    signature: int
    service: bool
    crc_seed: int = field(init=False)

    def __post_init__(self) -> None:
        """Raises ValueError for an id or a signature that does not fit its bits."""
        limit = 0xFF if self.service else 0xFFFF
        if not 0 <= self.id <= limit:
            raise ValueError(f"Data type id {self.id} of {self.name} is outside 0 to {limit}.")
        if not 0 <= self.signature < 1 << 64:
            raise ValueError(f"Signature {self.signature:#x} of {self.name} does not fit 64 bits.")
        # CRC-16 with polynomial 0x1021, not reflected, no final xor: exactly what crc_hqx computes.
        object.__setattr__(self, "crc_seed", crc_hqx(self.signature.to_bytes(8, "little"), 0xFFFF))


class Structure(Protocol):
    """One structure of a data type: a message, or the request or the response of a service."""

    TYPE: ClassVar[DataType]
    KIND: ClassVar[Kind]

    def encode(self) -> bytes:
        """The payload, without transfer CRC and tail byte. Raises ValueError when a value does not fit."""
        ...

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """The structure in a payload from the bus, or None when it is malformed. Never raises."""
        ...
