"""Recognition of MAVLink: whether data from a serial port is the telemetry of an autopilot."""

from binascii import crc_hqx
from typing import Final

_V1, _V2 = 0xFE, 0xFD
_REVERSED: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_SEEDS: Final = {0: 50, 1: 124, 2: 137, 30: 39, 109: 185, 111: 34, 147: 154, 253: 83}
"""Message IDs sent without request (HEARTBEAT, SYS_STATUS, SYSTEM_TIME, ATTITUDE, RADIO_STATUS, TIMESYNC,
BATTERY_STATUS, STATUSTEXT), with the CRC_EXTRA byte of their checksum."""


def system_of(data: bytes) -> int | None:
    """System ID of the first complete MAVLink message in `data` with a valid checksum. None without one."""
    for at, byte in enumerate(data):
        if byte in (_V1, _V2) and (found := _message_at(data, at)) is not None:
            return found
    return None


def _message_at(data: bytes, at: int) -> int | None:
    head = 6 if data[at] == _V1 else 10
    if len(data) < at + head:
        return None
    size = data[at + 1]
    if data[at] == _V1:
        system, kind = data[at + 3], data[at + 5]
    else:
        system, kind = data[at + 5], int.from_bytes(data[at + 7 : at + 10], "little")
    end = at + head + size
    seed = _SEEDS.get(kind)
    if seed is None or len(data) < end + 2:
        return None
    expected = checksum(data[at + 1 : end] + bytes((seed,)))
    return system if expected == int.from_bytes(data[end : end + 2], "little") else None


def checksum(data: bytes) -> int:
    """CRC-16/MCRF4XX: as crc_hqx, with the bits of each byte and of the result reversed."""
    crc = crc_hqx(data.translate(_REVERSED), 0xFFFF)
    return _REVERSED[crc & 0xFF] << 8 | _REVERSED[crc >> 8]
