"""The slcan protocol: frames and commands as ASCII lines ending with CR, refusals with BELL.

Besides frames an adapter may send: CR alone or z, Z (done), BELL (refused), Fxx (status flags, on request), and
unsolicited, as supported by the Linux driver, `s` (a new controller state) and `e` (bus errors).
"""

from binascii import unhexlify

from hornbill.bus.ports.errorframe import BUS_ERROR, NOW_ACTIVE, NOW_BUS_OFF, NOW_PASSIVE, OVERFLOW, UNACKNOWLEDGED
from hornbill.bus.ports.link import Received
from hornbill.units import Instant
from hornbill.wire.frame import Frame

BITRATES = {
    10_000: b"S0",
    20_000: b"S1",
    50_000: b"S2",
    100_000: b"S3",
    125_000: b"S4",
    250_000: b"S5",
    500_000: b"S6",
    800_000: b"S7",
    1_000_000: b"S8",
}
"""The command for each CAN bit rate (bit/s)."""

LONGEST = 27
"""Characters of a full frame, including CR."""

# Status flags, bits of Fxx. Full queues (0, 1), the warning level (2) and lost arbitration (6) are not errors.
_OVERRUN = 0x08
_PASSIVE_FLAG = 0x20
_BUS_ERROR_FLAG = 0x80

_STATES = {b"a": NOW_ACTIVE, b"w": NOW_ACTIVE, b"p": NOW_PASSIVE, b"b": NOW_BUS_OFF}

_LAST_IDENTIFIER = 0x1FFF_FFFF
_STAMPS = (0, 2, 4)  # bytes of time stamp after a frame: none, milliseconds, microseconds
_HEADS = {b"t": 5, b"r": 5, b"d": 5, b"b": 5, b"R": 10, b"D": 10, b"B": 10}  # type, identifier and length code
_ENDLESS = 512  # longer than any line, even of CAN FD
_REOPENING = 3  # responses to C, S and O


def line_of(frame: Frame) -> bytes:
    """The command that sends `frame`, which must be valid (29-bit identifier, at most 8 bytes)."""
    return b"T%08X%d%b\r" % (frame.id, len(frame.data), frame.data.hex().upper().encode())


class Lines:
    """Parser of received data, split anywhere. Never raises: invalid data is counted as garbled."""

    def __init__(self) -> None:
        self.accepted = 0
        """Number of commands accepted with CR."""
        self.refused = 0
        """Number of commands refused with BELL."""
        self.flags = 0
        """Number of responses to F."""
        self.refused_since: Instant | None = None
        """Time of the first of consecutive refused frames. None while frames are accepted."""
        self._reopening = 0  # pending responses to C, S and O
        self._rest = b""
        self._passive = False

    def feed(self, data: bytes, at: Instant) -> Received:
        """Parse `data` and the rest of the previous data. `at` is the time of reception."""
        got = Received()
        frames = got.frames
        lines = (self._rest + data.replace(b"\a", b"\a\r")).split(b"\r")
        self._rest = lines.pop()
        for line in lines:
            if line[:1] != b"T":
                self._other(line, got, at)
            elif (frame := _frame_of(line, at)) is not None:
                frames.append(frame)
            else:
                self._garbled(line, got, at)
        if len(self._rest) > _ENDLESS:
            self._rest = b""
            got.garbled += 1
        return got

    def reopening(self) -> None:
        """Do not count the responses to C, S and O, which follow those to the frames written before."""
        self._reopening = _REOPENING

    def reset(self) -> None:
        """Reset the counters. An incomplete line is retained."""
        self.accepted = self.refused = self.flags = self._reopening = 0
        self.refused_since = None
        self._passive = False

    def _other(self, line: bytes, got: Received, at: Instant) -> None:
        line = line.lstrip(b"\n")
        kind, rest = line[:1], line[1:]
        if line in (b"", b"#"):
            self.accepted += 1
            self._match_response(None)
        elif line in (b"z", b"Z") or (kind in b"zZ" and _is_frame(rest)):
            self.refused_since = None  # one of our frames was accepted or sent
        elif line.endswith(b"\a") or kind == b"#":
            self.refused += 1
            got.refused += self._match_response(at)
        elif kind == b"F" and len(rest) == 2 and _is_hex(rest):
            self.flags += 1
            self._take_flags(int(rest, 16), got)
        elif kind == b"s" and rest[:1] in _STATES and rest[1:].isdigit():
            got.errors.append(_STATES[rest[:1]])
        elif kind == b"e" and rest[:1].isdigit() and rest[1:].isalpha():
            got.errors.append(UNACKNOWLEDGED if b"a" in rest else BUS_ERROR)
            if b"o" in rest:
                got.errors.append(OVERFLOW)
        elif _is_frame(line):
            got.ignored += 1
        else:
            self._garbled(line, got, at)

    def _garbled(self, line: bytes, got: Received, at: Instant) -> None:
        """Count an invalid line. After noise it may end with a complete frame."""
        got.garbled += 1
        start = line.rfind(b"T", 1)
        noisy = start > 0 and any(not 0x20 <= byte <= 0x7E for byte in line[:start])
        frame = _frame_of(line[start:], at) if noisy else None
        if frame is not None:
            got.frames.append(frame)

    def _match_response(self, refused_at: Instant | None) -> bool:
        """Match an unspecific response. Returns whether it was to a frame."""
        # An open channel does not refuse C, so refusals before its response are those of earlier frames.
        earlier = self._reopening == _REOPENING and refused_at is not None
        if self._reopening and not earlier:
            self._reopening -= 1
            return False
        if refused_at is None or self.refused_since is None:
            self.refused_since = refused_at
        return True

    def _take_flags(self, flags: int, got: Received) -> None:
        """Report each event since the previous request of the flags once."""
        if flags & _OVERRUN:
            got.errors.append(OVERFLOW)
        if flags & _BUS_ERROR_FLAG:
            got.errors.append(BUS_ERROR)
        passive = bool(flags & _PASSIVE_FLAG)
        if passive != self._passive:
            self._passive = passive
            got.errors.append(NOW_PASSIVE if passive else NOW_ACTIVE)


def _frame_of(line: bytes, at: Instant) -> Frame | None:
    """Parse an extended data frame from a line starting with T. None if it is incomplete."""
    try:
        # 8 digits of identifier and 1 of length: with a 0 for the T they make five bytes
        raw = unhexlify(b"0" + line[1:])
    except ValueError:
        return None
    head = int.from_bytes(raw[:5], "big")
    end = 5 + (head & 15)
    if end <= 13 and len(raw) - end in _STAMPS and head >> 4 <= _LAST_IDENTIFIER:
        return Frame(head >> 4, raw[5:end], at)
    return None


def _is_frame(line: bytes) -> bool:
    """Whether a line looks like a frame other than an extended data frame of classic CAN."""
    head = 10 if line[:1] == b"T" else _HEADS.get(line[:1], _ENDLESS)
    return len(line) >= head and _is_hex(line[1:])


def _is_hex(digits: bytes) -> bool:
    return not digits.strip(b"0123456789ABCDEFabcdef")
