"""Owns Ring and Reader: the newest entries of an event stream by number, and who has read how far."""

import asyncio
import secrets
from collections import deque
from itertools import islice
from typing import Final, NamedTuple

ENTRIES_KEPT: Final = 10_000
BYTES_KEPT: Final = 8 << 20
"""Of a ring, whichever is less. Telemetry has one of its own, so that it drives out nothing else."""

TELEMETRY: Final = "telemetry"
ALWAYS: Final = "always"
"""Of these topics one hears whatever one has asked for: the stop latch, and who has motion control."""


class Entry(NamedTuple):
    """One message: its topic, its type, the servo it is about, and its members as JSON (without type and seq)."""

    topic: str
    type: str
    uid: str | None
    members: str


class Ring:
    """The newest entries, by number. `name` is another one in every process and for every ring."""

    def __init__(self, entries: int = ENTRIES_KEPT, size: int = BYTES_KEPT) -> None:
        self.name = secrets.token_hex(4)
        self._entries, self._size = entries, size
        self._kept: deque[Entry] = deque()
        self._bytes = 0
        self._first = 0

    @property
    def next(self) -> int:
        """The number of the entry that comes next."""
        return self._first + len(self._kept)

    def put(self, entry: Entry) -> None:
        """Add one; the oldest make room."""
        self._kept.append(entry)
        self._bytes += len(entry.members)
        while len(self._kept) > self._entries or self._bytes > self._size:
            self._bytes -= len(self._kept.popleft().members)
            self._first += 1

    def since(self, place: int) -> tuple[int, list[tuple[int, Entry]]]:
        """How many from `place` on are gone, and those that are there, with their numbers."""
        begin = max(place, self._first)
        newest = islice(reversed(self._kept), max(0, self.next - begin))
        numbers = range(self.next - 1, begin - 1, -1)
        found = list(zip(numbers, newest, strict=True))
        return begin - place, found[::-1]


class Reader:
    """One stream: what it wants, and its place in each ring. `waiting` is set when there is something for it."""

    def __init__(self, topics: frozenset[str], uids: frozenset[str] | None, last: str | None) -> None:
        """`last`: the id of the last event it had before it was interrupted."""
        self.topics = topics
        self.uids = uids
        self.back = last is not None
        self.known = _places(last or "")
        self.places: dict[str, int | None] = {}
        self.seq = 0
        self.over = False
        self.waiting = asyncio.Event()
        self.waiting.set()

    def wants(self, entry: Entry) -> bool:
        """Whether it is told of this."""
        named = entry.topic == ALWAYS or entry.topic in self.topics
        return named and (entry.uid is None or self.uids is None or entry.uid in self.uids)

    def end(self) -> None:
        """Tell it no more."""
        self.over = True
        self.waiting.set()

    def message(self, entry: Entry, place: str | None) -> str:
        """An event of the stream; without `place` whoever comes back is told it again."""
        self.seq += 1
        data = f'{{"type":"{entry.type}","seq":{self.seq},{entry.members}}}'
        named = "" if place is None else f"id: {place}\n"
        return f"event: {entry.type}\n{named}data: {data}\n\n"


def _places(last: str) -> dict[str, int]:
    """Places by the names of rings, of an id; of one that is none of ours, nothing."""
    found: dict[str, int] = {}
    for part in last[:200].split("~"):
        name, _, number = part.partition(".")
        if number.isascii() and number.isdecimal():
            found[name] = int(number)
    return found
