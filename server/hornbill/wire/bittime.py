"""Length of an extended data frame in bit times, including stuffing.

CRC and stuffing are computed bytewise from tables. Bit by bit would cost more than all other work of the embedded
bus on a frame.
"""

from functools import lru_cache

from hornbill.wire.frame import Frame

INTERFRAME_BITS = 3
"""Recessive bits between two frames. frame_bits counts them with the frame before."""

ERROR_FRAME_BITS = 20
"""An error flag (6), the other nodes' flags after it (up to 6) and the delimiter (8)."""

NOISE_BITS = 6 + ERROR_FRAME_BITS + INTERFRAME_BITS
"""Bits from one error frame to the next while the bus carries only noise: six equal bits violate the stuffing rule."""

# After the CRC, never stuffed: CRC delimiter, acknowledge slot and its delimiter, end of frame (7).
_TAIL_BITS = 1 + 1 + 1 + 7 + INTERFRAME_BITS
# Stuffed: 39 bits up to the length code, and the 15 of the CRC.
_FIXED_BITS = 39 + 15 + _TAIL_BITS

_POLYNOMIAL = 0x4599


def _crc_table() -> list[int]:
    table: list[int] = []
    for byte in range(256):
        crc = byte << 7
        for _ in range(8):
            crc = (crc << 1) ^ (_POLYNOMIAL if crc & 0x4000 else 0)
        table.append(crc & 0x7FFF)
    return table


def _stuffing_table(width: int) -> list[tuple[int, int]]:
    """For every state of the stuffing rule and every `width` bits: number of stuff bits added, and the next state.

    A state is the level of the last bit and its run length (1..4), in the high bits of the index, so that it can be
    or-ed with the next bits.
    """
    table: list[tuple[int, int]] = [(0, 0)] * (8 << 8)
    for state in range(8):
        for bits in range(1 << width):
            level, run, added = state >> 2, (state & 3) + 1, 0
            for shift in range(width - 1, -1, -1):
                bit = bits >> shift & 1
                run = run + 1 if bit == level else 1
                level = bit
                if run == 5:
                    added, level, run = added + 1, level ^ 1, 1
            table[state << 8 | bits] = (added, (level << 2 | run - 1) << 8)
    return table


_CRC = _crc_table()
_STUFFED_8 = _stuffing_table(8)
_STUFFED_7 = _stuffing_table(7)
_AFTER_DOMINANT = 0


@lru_cache(maxsize=4096)
def _header(identifier: int, length: int) -> tuple[int, int, int]:
    """(CRC, stuffing state, stuff bits) after the 39 bits from start of frame to the length code."""
    # start 0 | 11 high bits | SRR 1, IDE 1 | 18 low bits | RTR 0, r1 0, r0 0 | 4 of length
    bits = identifier >> 18 << 27 | 0b11 << 25 | (identifier & 0x3FFFF) << 7 | length
    crc = 0
    for byte in bits.to_bytes(5, "big"):  # a zero before the start of frame does not change a CRC of zero
        crc = _CRC[crc >> 7 ^ byte] ^ (crc << 8 & 0x7FFF)
    state, count = _AFTER_DOMINANT, 0
    for byte in (bits | 1 << 39).to_bytes(5, "big"):  # a one there ends any run: the start of frame begins a new one
        added, state = _STUFFED_8[state | byte]
        count += added
    return crc, state, count


@lru_cache(maxsize=4096)
def _until_tail(identifier: int, length: int, payload: bytes) -> tuple[int, int, int]:
    """The same after the bytes before the last one. A message that repeats differs only in that: its transfer ID."""
    crc, state, count = _header(identifier, length)
    for byte in payload:
        crc = _CRC[crc >> 7 ^ byte] ^ (crc << 8 & 0x7FFF)
        added, state = _STUFFED_8[state | byte]
        count += added
    return crc, state, count


def _bits(identifier: int, data: bytes) -> int:
    crc, state, count = _until_tail(identifier, len(data), data[:-1])
    for byte in data[-1:]:
        crc = _CRC[crc >> 7 ^ byte] ^ (crc << 8 & 0x7FFF)
        added, state = _STUFFED_8[state | byte]
        count += added
    added, state = _STUFFED_8[state | crc >> 7]
    return _FIXED_BITS + 8 * len(data) + count + added + _STUFFED_7[state | crc & 0x7F][0]


def frame_bits(frame: Frame) -> int:
    """Bits of an extended data frame, from start of frame to the third interframe bit.

    67 + 8n for n data bytes, plus the stuff bits between start of frame and CRC. The frame must be valid (29-bit
    identifier, at most 8 bytes), as `transmit.check` ensures.
    """
    return _bits(frame.id, frame.data)
