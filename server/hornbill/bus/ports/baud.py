"""The search for the baud rate of a serial adapter: listen at each rate, then ask, until something is well-formed."""

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
"""Baud rates in the order they are tried; the first is that of the servos' starter kit."""

SEARCH_S: Final = 3.2
"""How long all of them are tried, again and again: an adapter that restarts when it is opened is deaf for 2 s."""

ONE_RATE_S: Final = 2.2
"""The same where there is one rate only."""

MOST_S: Final = 3.7
"""How long it may take until a device that is no adapter is refused."""

# At each rate. An FTDI chip may keep an answer for 16 ms.
_LISTEN_S = 0.02
_ANSWER_S = 0.07
_OPEN_S = 0.11
_QUIET_S = 0.025
_WRITE_S = 0.25

_WAKE = b"\r\rC\rV\r"
"""Ends what another program may have left half said, closes the channel, asks for the version."""

_NOISE_BYTES = 16
"""So many bytes that make no sense are more than what a line picks up while it is opened."""

_MAVLINK_RATES: Final = (57_600, 115_200)

_FRAME = re.compile(rb"(?:T[01][0-9A-Fa-f]{7}|t[0-7][0-9A-Fa-f]{2})([0-8])((?:[0-9A-Fa-f]{2})*)\r")
_VERSION = re.compile(rb"[VvN][0-9A-Fa-f]{4}\r")
_STAMPS = (0, 2, 4)
_ECHOED: Final = frozenset((b"V", b"O"))
"""Lines that no adapter sends but one that returns what it is sent."""
_UNREADABLE = re.compile(rb"[^\x20-\x7e\r\n\a]")
_PLAIN = re.compile(rb"[\x20-\x7e\r\n\a]*[\r\a]")


class Sense(IntEnum):
    """How much sense bytes make as slcan, from none to beyond doubt."""

    NOTHING = 0
    NOISE = 1
    ECHO = 2
    ANSWER = 3
    """CR, BELL or plain text: proof only where it comes again when asked again."""
    SLCAN = 4
    """A whole frame or a version."""


def sense_of(data: bytes) -> Sense:
    """What `data`, received at one baud rate, says about that rate."""
    if not data:
        return Sense.NOTHING
    frames = (len(found[2]) // 2 - int(found[1]) for found in _FRAME.finditer(data))
    if _VERSION.search(data) or any(stamp in _STAMPS for stamp in frames):
        return Sense.SLCAN
    if not _PLAIN.fullmatch(data):
        return Sense.NOISE
    lines = data.replace(b"\n", b"").replace(b"\a", b"\a\r").split(b"\r")
    return Sense.ANSWER if _ECHOED.isdisjoint(lines) else Sense.ECHO


@dataclass(slots=True)
class FoundBaud:
    """Result of the search. `confirmed`: something well-formed was received at `baud`; else it is a guess."""

    baud: int
    confirmed: bool
    answers: bool
    """Whether the adapter answers commands."""
    silent: bool = False
    """Whether it was asked, and did not answer."""
    echoes: bool = False
    """Whether it sends back what it is sent."""
    noise: int = 0
    """Bytes that made no sense at this rate."""


@dataclass(slots=True)
class _AtRate:
    """What was received at one rate, over all tries."""

    data: bytes = b""
    noise: int = 0
    senses: set[Sense] = field(default_factory=set[Sense])


class Abandoned(Exception):
    """The adapter is no longer wanted."""


class Search:
    """One search on an open line. It leaves the line at the rate it found."""

    def __init__(self, line: SerialStream, address: str, wanted: Callable[[], bool] = lambda: True) -> None:
        """`address` is for messages; `wanted` is asked again and again whether to go on."""
        self._line = line
        self._address = address
        self._wanted = wanted
        self._heard: dict[int, _AtRate] = {}
        self._began = time.monotonic()

    def run(self, rates: Sequence[int]) -> FoundBaud:
        """The rate at which the adapter speaks; the first of `rates` if it says nothing at any of them.

        Takes up to SEARCH_S, ONE_RATE_S for one rate, and MOST_S for a device that is no adapter. Raises PortOpenFailed
        for a device that speaks MAVLink, or sends what makes no sense at any rate; OSError when it is gone; Abandoned.
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
                    f"{self._address} cannot be set to {' or '.join(map(str, rates))} baud: its driver has no such "
                    "rate. Choose another rate.",
                    address=self._address,
                    cause="no_such_baud",
                    bauds=list(rates),
                )
            self._check_mavlink()
            echo = next((rate for rate, heard in self._heard.items() if Sense.ECHO in heard.senses), None)
            if echo is not None:
                self._line.set_baud(echo)
                return FoundBaud(echo, confirmed=True, answers=False, silent=True, echoes=True)
            if self._is_noise():
                break
        if self._is_noise():
            self._refuse_noise(usable)
        self._line.set_baud(usable[0])
        return FoundBaud(usable[0], confirmed=False, answers=False, silent=True)

    def _try(self, rate: int) -> FoundBaud | None:
        heard = self._heard.setdefault(rate, _AtRate())
        before = len(heard.data)
        first = self._hear(heard, _LISTEN_S)
        if first is Sense.SLCAN:
            return FoundBaud(rate, confirmed=True, answers=False)
        senses = [first]
        for words, wait_s in ((_WAKE, _ANSWER_S), (b"O\r", _OPEN_S)):
            said = self._ask(heard, words, wait_s)
            senses.append(said)
            if said is Sense.ANSWER and first is Sense.NOTHING:
                said = self._ask(heard, words, wait_s)  # noise does not answer twice
            if said is Sense.SLCAN or (said is Sense.ANSWER and first is Sense.NOTHING):
                came = heard.data[before:]
                answers = said is Sense.ANSWER or _VERSION.search(came) is not None
                return FoundBaud(
                    rate, confirmed=True, answers=answers, silent=not answers and words != _WAKE,
                    echoes=not _ECHOED.isdisjoint(came.split(b"\r")), noise=len(_UNREADABLE.findall(came)),
                )  # fmt: skip
        if Sense.NOISE in senses:
            heard.noise += len(heard.data) - before
        return None

    def _ask(self, heard: _AtRate, words: bytes, wait_s: float) -> Sense:
        if not self._line.write(words, _WRITE_S):
            raise OSError(errno.ETIMEDOUT, "it takes nothing, not one byte")
        return self._hear(heard, wait_s)

    def _hear(self, heard: _AtRate, wait_s: float) -> Sense:
        """Receive until it makes sense beyond doubt, or `wait_s` is over; an answer is over when it is quiet."""
        if not self._wanted():
            raise Abandoned
        data = b""
        sense = sense_of(data)
        until = time.monotonic() + wait_s
        while sense is not Sense.SLCAN and (left := until - time.monotonic()) > 0:
            more = self._line.read(min(left, _QUIET_S) if sense is Sense.ANSWER else left)
            if not more and sense is Sense.ANSWER:
                break
            data += more
            sense = sense_of(data)
        heard.data += data
        heard.senses.add(sense)
        return sense

    def _is_noise(self) -> bool:
        """Whether the device sends a lot, and nothing of it makes sense at any rate."""
        senses = set[Sense]().union(*(heard.senses for heard in self._heard.values()))
        if Sense.ANSWER in senses or Sense.ECHO in senses:
            return False
        return sum(heard.noise for heard in self._heard.values()) >= _NOISE_BYTES

    def _check_mavlink(self) -> None:
        """An autopilot says who it is once a second: on USB at whatever rate, else at one of two as a rule."""
        spoken = [*(heard.data for heard in self._heard.values()), b"".join(one.data for one in self._heard.values())]
        system = next((found for data in spoken if (found := system_of(data)) is not None), None)
        if system is not None:
            self._refuse_mavlink(system)

    def _refuse_noise(self, rates: Sequence[int]) -> None:
        each_s = (self._began + MOST_S - time.monotonic()) / len(_MAVLINK_RATES)
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
        noise = sum(heard.noise for heard in self._heard.values())
        if len(rates) == 1:
            tried = f"{rates[0]} baud"
            remedy = f"Leave out @{rates[0]}: then hornbill finds the rate of an slcan adapter."
        else:
            tried = f"any of {len(rates)} baud rates"
            remedy = (
                "Check that an slcan adapter is on this port. If it runs at another baud rate, add that: "
                f"{self._address}@BAUD."
            )
        raise PortOpenFailed(
            f"{self._address} sends {noise} bytes that are not slcan at {tried}. {remedy}",
            address=self._address, remedy=remedy, cause="noise",
        )  # fmt: skip

    def _refuse_mavlink(self, system: int) -> None:
        remedy = "Connect the servos through a CAN adapter, or choose the autopilot's slcan port if it has one."
        raise PortOpenFailed(
            f"{self._address} speaks MAVLink (system {system}): an autopilot is on this port, not an slcan adapter. "
            f"{remedy}",
            address=self._address, remedy=remedy, cause="mavlink",
        )  # fmt: skip
