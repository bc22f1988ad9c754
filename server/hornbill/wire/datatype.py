"""DroneCAN data types and the interface of their structures."""

from binascii import crc_hqx
from dataclasses import dataclass, field
from enum import IntEnum
from typing import ClassVar, Protocol, Self


class Kind(IntEnum):
    """The three kinds of transfer. Messages and services have separate ID spaces: ID 1 exists in both."""

    MESSAGE = 0
    REQUEST = 1
    RESPONSE = 2


@dataclass(frozen=True, slots=True)
class DataType:
    """One data type: full DSDL name, default ID (messages 0..65535, services 0..255), 64-bit signature.

    `crc_seed` is the transfer CRC after the eight signature bytes, low byte first: the start value for
    the payload of every multi-frame transfer of this type.
    """

    name: str
    id: int
    signature: int
    service: bool
    crc_seed: int = field(init=False)

    def __post_init__(self) -> None:
        """Raises ValueError if the ID or the signature is out of range."""
        limit = 0xFF if self.service else 0xFFFF
        if not 0 <= self.id <= limit:
            raise ValueError(f"Data type ID {self.id} of {self.name} is outside 0 to {limit}.")
        if not 0 <= self.signature < 1 << 64:
            raise ValueError(f"Signature {self.signature:#x} of {self.name} does not fit 64 bits.")
        # CRC-16 with polynomial 0x1021, not reflected, no final xor: the same as crc_hqx.
        object.__setattr__(self, "crc_seed", crc_hqx(self.signature.to_bytes(8, "little"), 0xFFFF))


class Structure(Protocol):
    """One structure of a data type: a message, or the request or the response of a service."""

    TYPE: ClassVar[DataType]
    KIND: ClassVar[Kind]

    def encode(self) -> bytes:
        """The payload without transfer CRC and tail byte. Raises ValueError for values out of range."""
        ...

    @classmethod
    def decode(cls, payload: bytes) -> Self | None:
        """Decode a received payload. None if it is malformed. Never raises."""
        ...
