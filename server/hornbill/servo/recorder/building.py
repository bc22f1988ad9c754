"""Writing a recording from the data in memory, in slices that leave the event loop free between them."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Final, Protocol, TypeAlias

from hornbill import __version__
from hornbill.domain.recording import About, Mark, MarkReason, RecordedBus, RecordedServo, RecordedWrite
from hornbill.schema.catalog import Catalog
from hornbill.servo.monitoring.telemetry import TelemetryCollector
from hornbill.servo.recorder.frame_ring import FrameRing
from hornbill.servo.recorder.snapshot import KnownState
from hornbill.servo.recorder.writes import WriteFinder
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant
from hornbill.wire.frame import LoggedFrame

REST_S: Final = 0.002
"""Pause between two slices, for other tasks on the event loop."""

SLICE: Final = 500
"""Samples, events or writes formatted at once, in about a millisecond."""


class RecordingDraft(Protocol):
    """A recording being written, one member after the other. Every coroutine but `discard` raises LogFailed.

    Times are seconds since 1970 UTC.
    """

    name: str
    cut: list[str]
    """Members truncated at their size limit."""

    async def add_frames(self, frames: Sequence[LoggedFrame], /) -> None:
        """Append frames."""
        ...

    async def add_samples(
        self, uid: str, channel: str, times: Sequence[float], values: Sequence[float | None], /
    ) -> None:
        """Append telemetry. None is a gap."""
        ...

    async def add_events(self, events: Sequence[bytes], /) -> None:
        """Append events, each a JSON object."""
        ...

    async def add_writes(self, writes: Sequence[RecordedWrite], /) -> None:
        """Append writes."""
        ...

    async def finish(self, about: About, /) -> tuple[int, list[str]]:
        """Complete the file. Returns its size in bytes and the names of older recordings deleted to make room."""
        ...

    async def discard(self) -> None:
        """Delete the unfinished file."""
        ...


BeginDraft: TypeAlias = Callable[[str], Awaitable[RecordingDraft]]
"""Begins a recording. A suffix is added to the name if it is in use. Raises LogFailed."""


@dataclass(slots=True)
class RecordingInProgress:
    """A recording that still collects data or is being written. Instants are on the event loop's clock."""

    reason: MarkReason
    text: str
    at: Instant
    since: Instant
    until: Instant
    snapshot: KnownState
    slug: str
    done: "asyncio.Future[str]"
    marks: list[Mark] = field(default_factory=list[Mark])


class RecordingBuilder:
    """Writes one recording at a time. `hurry` skips the pauses between slices."""

    def __init__(self, base: TimeBase, catalog: Catalog, telemetry: TelemetryCollector, node_id: int) -> None:
        """`node_id` is our own."""
        self._base, self._catalog, self._telemetry, self._node_id = base, catalog, telemetry, node_id
        self.hurry = False
        self._one = asyncio.Lock()

    async def write(
        self, pending: RecordingInProgress, begin: BeginDraft, ring: FrameRing, events: Sequence[tuple[Instant, bytes]]
    ) -> tuple[str, int, list[str]]:
        """Write a recording. Returns its name, its size in bytes and the names of deleted recordings. Raises LogFailed.

        `events` are JSON objects with their instants.
        """
        among = [event for at, event in events if pending.since <= at <= pending.until]
        async with self._one:
            return await self._write(pending, begin, ring, among)

    async def _write(
        self, pending: RecordingInProgress, begin: BeginDraft, ring: FrameRing, events: list[bytes]
    ) -> tuple[str, int, list[str]]:
        at = datetime.fromtimestamp(self._base.utc(pending.at), UTC)
        draft = await begin(f"hornbill-{at:%Y%m%d-%H%M%S}-{pending.slug}.zip")
        try:
            frames, writes = await self._add_frames(draft, pending, ring)
            await self._add_telemetry(draft, pending)
            for start in range(0, len(events), SLICE):
                await draft.add_events(events[start : start + SLICE])
                await self._rest()
            for start in range(0, len(writes), SLICE):
                await draft.add_writes(writes[start : start + SLICE])
                await self._rest()
            about = self._about(pending, frames, draft.cut, [servo async for servo in self._servos(pending)])
            size, dropped = await draft.finish(about)
        except BaseException:
            await draft.discard()
            raise
        return draft.name, size, dropped

    async def _add_frames(
        self, draft: RecordingDraft, pending: RecordingInProgress, ring: FrameRing
    ) -> tuple[int, list[RecordedWrite]]:
        """Add the frames. Returns their number and the writes found in them."""
        finder = WriteFinder(self._catalog, pending.snapshot.uids())
        count, found = 0, list[RecordedWrite]()
        for part in ring.slices(pending.since, pending.until, self._base.utc_offset):
            await draft.add_frames(part)
            count += len(part)
            found += finder.find(part)
            await self._rest()
        return count, found

    async def _add_telemetry(self, draft: RecordingDraft, pending: RecordingInProgress) -> None:
        utc = self._base.utc
        for servo in pending.snapshot.servos:
            for key in list(self._telemetry.channels(servo.uid)):
                times, values = self._telemetry.window(servo.uid, key, pending.since, pending.until)
                for start in range(0, len(times), SLICE):
                    await self._rest()
                    end = start + SLICE
                    await draft.add_samples(servo.uid, key, [utc(at) for at in times[start:end]], values[start:end])

    async def _servos(self, pending: RecordingInProgress) -> AsyncIterator[RecordedServo]:
        for servo in pending.snapshot.servos:
            yield servo.recorded(self._base)
            await self._rest()

    def _about(self, pending: RecordingInProgress, frames: int, cut: list[str], servos: list[RecordedServo]) -> About:
        utc, snapshot = self._base.utc, pending.snapshot
        address, bitrate = snapshot.bus or (None, 0)
        return About(
            format=1, version=__version__, reason=pending.reason, text=pending.text, marks=pending.marks,
            started_at=utc(pending.since), ended_at=utc(pending.until), utc_offset=self._base.utc_offset,
            bus=None if address is None else RecordedBus(address=address, bitrate=bitrate, node_id=self._node_id),
            servos=servos, schema_revision=self._catalog.revision, frames=frames, incomplete=list(cut),
        )  # fmt: skip

    async def _rest(self) -> None:
        await asyncio.sleep(0 if self.hurry else REST_S)
