"""Detection of the baud rate of a serial adapter: listen and send commands at each rate until valid data arrives."""

import errno
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

from hornbill.bus.ports.mavlink import system_of
from hornbill.bus.ports.serial_line import SerialStream
from hornbill.errors import PortOpenFailed

RATES: Final = (1_000_000, 115_200, 2_000_000, 3_000_000, 921_600, 460_800, 57_600)
"""Baud rates in the order of trial. The first is that of the servos' starter kit."""

SEARCH_S: Final = 3.2
"""How long all rates are tried in turn: an adapter that restarts on opening receives nothing for 2 s."""

ONE_RATE_S: Final = 2.2
"""The same for a single rate."""

MAX_SEARCH_S: Final = 3.7
"""Maximum time until a device that is not an adapter is refused."""

# At each rate. An FTDI chip may delay a response by 16 ms.
_LISTEN_S = 0.02
_RESPONSE_S = 0.07
_OPEN_S = 0.11
_QUIET_S = 0.025
_WRITE_S = 0.25

_WAKE = b"\r\rC\rV\r"
"""Completes an incomplete command of another program, closes the channel, requests the version."""

_NOISE_BYTES = 16
"""Number of invalid bytes above the interference of opening a line."""

_MAVLINK_RATES: Final = (57_600, 115_200)

_FRAME = re.compile(rb"(?:T[01][0-9A-Fa-f]{7}|t[0-7][0-9A-Fa-f]{2})([0-8])((?:[0-9A-Fa-f]{2})*)\r")
_VERSION = re.compile(rb"[VvN][0-9A-Fa-f]{4}\r")
_STAMPS = (0, 2, 4)
_ECHOED: Final = frozenset((b"V", b"O", b"L"))
"""Lines sent only by an adapter that echoes."""
_UNREADABLE = re.compile(rb"[^\x20-\x7e\r\n\a]")
_PLAIN = re.compile(rb"[\x20-\x7e\r\n\a]*[\r\a]")


class Sense(IntEnum):
    """How well bytes match slcan, from nothing to certain."""

    NOTHING = 0
    NOISE = 1
    ECHO = 2
    RESPONSE = 3
    """CR, BELL or plain text: proof only if it is repeated for a second request."""
    SLCAN = 4
    """A complete frame or a version."""


def sense_of(data: bytes) -> Sense:
    """How well `data`, received at one baud rate, matches slcan."""
    if not data:
        return Sense.NOTHING
    frames = (len(found[2]) // 2 - int(found[1]) for found in _FRAME.finditer(data))
    if _VERSION.search(data) or any(stamp in _STAMPS for stamp in frames):
        return Sense.SLCAN
    if not _PLAIN.fullmatch(data):
        return Sense.NOISE
    lines = data.replace(b"\n", b"").replace(b"\a", b"\a\r").split(b"\r")
    return Sense.RESPONSE if _ECHOED.isdisjoint(lines) else Sense.ECHO


@dataclass(slots=True)
class FoundBaud:
    """Result of the search. `confirmed`: valid data was received at `baud`; otherwise it is a guess."""

    baud: int
    confirmed: bool
    responds: bool
    """Whether the adapter responds to commands."""
    silent: bool = False
    """Whether it did not respond to a command."""
    echoes: bool = False
    """Whether it echoes what it receives."""
    noise: int = 0
    """Number of invalid bytes at this rate."""


@dataclass(slots=True)
class _AtRate:
    """Data received at one rate, over all tries."""

    data: bytes = b""
    noise: int = 0
    senses: set[Sense] = field(default_factory=set[Sense])


class Abandoned(Exception):
    """The adapter is no longer wanted."""


class Search:
    """One search on an open line. Afterwards the line is at the detected rate."""

    def __init__(
        self, line: SerialStream, address: str, wanted: Callable[[], bool] = lambda: True, *, opens: bytes = b"O"
    ) -> None:
        """`address` is for messages; `wanted` is polled for whether to continue. `opens`: command to open, O or L."""
        self._line = line
        self._address = address
        self._wanted = wanted
        self._opens = opens + b"\r"
        self._received: dict[int, _AtRate] = {}
        self._began = time.monotonic()

    def run(self, rates: Sequence[int]) -> FoundBaud:
        """Detect the rate of the adapter. The first of `rates` if it sends nothing at any of them.

        Takes up to SEARCH_S, ONE_RATE_S for a single rate, and MAX_SEARCH_S for a device that is not an adapter. Raises
        PortOpenFailed for a device that uses MAVLink or sends invalid data at every rate, OSError if it was unplugged,
        and Abandoned.
        """
        until = self._began + (SEARCH_S if len(rates) > 1 else ONE_RATE_S)
        usable = list(rates)
        while time.monotonic() < until:
            for rate in tuple(usable):
                if not self._line.set_baud(rate):
                    usable.remove(rate)
                    continue
                found = self._try(rate)
                if found is not None:
                    return found
                if time.monotonic() >= until:
                    break
            if not usable:
                raise PortOpenFailed(
                    f"{self._address} cannot be set to {' or '.join(map(str, rates))} baud: its driver does not "
                    "support it. Choose another rate.",
                    address=self._address,
                    cause="baud_unsupported",
                    bauds=list(rates),
                )
            self._check_mavlink()
            echo = next((rate for rate, received in self._received.items() if Sense.ECHO in received.senses), None)
            if echo is not None:
                self._line.set_baud(echo)
                return FoundBaud(echo, confirmed=True, responds=False, silent=True, echoes=True)
            if self._is_noise():
                break
        if self._is_noise():
            self._refuse_noise(usable)
        self._line.set_baud(usable[0])
        return FoundBaud(usable[0], confirmed=False, responds=False, silent=True)

    def _try(self, rate: int) -> FoundBaud | None:
        received = self._received.setdefault(rate, _AtRate())
        before = len(received.data)
        first = self._receive(received, _LISTEN_S)
        if first is Sense.SLCAN:
            return FoundBaud(rate, confirmed=True, responds=False)
        senses = [first]
        for command, wait_s in ((_WAKE, _RESPONSE_S), (self._opens, _OPEN_S)):
            sense = self._request(received, command, wait_s)
            senses.append(sense)
            if sense is Sense.RESPONSE and first is Sense.NOTHING:
                sense = self._request(received, command, wait_s)  # noise does not respond twice
            if sense is Sense.SLCAN or (sense is Sense.RESPONSE and first is Sense.NOTHING):
                data = received.data[before:]
                responds = sense is Sense.RESPONSE or _VERSION.search(data) is not None
                return FoundBaud(
                    rate, confirmed=True, responds=responds, silent=not responds and command != _WAKE,
                    echoes=not _ECHOED.isdisjoint(data.split(b"\r")), noise=len(_UNREADABLE.findall(data)),
                )  # fmt: skip
        if Sense.NOISE in senses:
            received.noise += len(received.data) - before
        return None

    def _request(self, received: _AtRate, command: bytes, wait_s: float) -> Sense:
        if not self._line.write(command, _WRITE_S):
            raise OSError(errno.ETIMEDOUT, "it does not accept any data")
        return self._receive(received, wait_s)

    def _receive(self, received: _AtRate, wait_s: float) -> Sense:
        """Receive until the data is certainly slcan, or for `wait_s`. A pause ends a response."""
        if not self._wanted():
            raise Abandoned
        data = b""
        sense = sense_of(data)
        until = time.monotonic() + wait_s
        while sense is not Sense.SLCAN and (left := until - time.monotonic()) > 0:
            more = self._line.read(min(left, _QUIET_S) if sense is Sense.RESPONSE else left)
            if not more and sense is Sense.RESPONSE:
                break
            data += more
            sense = sense_of(data)
        received.data += data
        received.senses.add(sense)
        return sense

    def _is_noise(self) -> bool:
        """Whether the device sends much data, all of it invalid at every rate."""
        senses = set[Sense]().union(*(received.senses for received in self._received.values()))
        if Sense.RESPONSE in senses or Sense.ECHO in senses:
            return False
        return sum(received.noise for received in self._received.values()) >= _NOISE_BYTES

    def _check_mavlink(self) -> None:
        """Check for an autopilot, which sends once a second: on USB at any rate, otherwise usually at one of two."""
        candidates = [
            *(received.data for received in self._received.values()),
            b"".join(one.data for one in self._received.values()),
        ]
        system = next((found for data in candidates if (found := system_of(data)) is not None), None)
        if system is not None:
            self._refuse_mavlink(system)

    def _refuse_noise(self, rates: Sequence[int]) -> None:
        each_s = (self._began + MAX_SEARCH_S - time.monotonic()) / len(_MAVLINK_RATES)
        for rate in _MAVLINK_RATES:
            if not self._line.set_baud(rate):
                continue
            until, data = time.monotonic() + each_s, b""
            while (left := until - time.monotonic()) > 0:
                if not self._wanted():
                    raise Abandoned
                data += self._line.read(left)
                system = system_of(data)
                if system is not None:
                    self._refuse_mavlink(system)
        noise = sum(received.noise for received in self._received.values())
        if len(rates) == 1:
            tried = f"{rates[0]} baud"
            remedy = f"Remove @{rates[0]} to let hornbill detect the baud rate of an slcan adapter."
        else:
            tried = f"any of {len(rates)} baud rates"
            remedy = (
                "Check that an slcan adapter is on this port. If it uses another baud rate, add it: "
                f"{self._address}@BAUD."
            )
        raise PortOpenFailed(
            f"{self._address} sends {noise} bytes that are not slcan at {tried}. {remedy}",
            address=self._address, remedy=remedy, cause="not_slcan",
        )  # fmt: skip

    def _refuse_mavlink(self, system: int) -> None:
        device = self._address.removeprefix("slcan:").partition("@")[0]
        remedy = f"To reach servos through it, use mavcan:{device}@BAUD with the baud rate of its port."
        raise PortOpenFailed(
            f"{self._address} sends MAVLink (system {system}): an autopilot is on this port, not an slcan adapter. "
            f"{remedy}",
            address=self._address, remedy=remedy, cause="mavlink", device=device,
        )  # fmt: skip
