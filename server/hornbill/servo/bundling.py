"""Owns Bundler: a bundle put together from what is remembered, in slices between which the loop is everybody else's."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Final, Protocol

import orjson

from hornbill import __version__
from hornbill.schema.catalog import Catalog
from hornbill.servo import bundle
from hornbill.servo.bundle import About, BundleBus, BundleServo, Mark, Reason
from hornbill.servo.frame_ring import FrameRing
from hornbill.servo.snapshot import Snapshot
from hornbill.servo.telemetry import Telemetry
from hornbill.servo.timebase import TimeBase
from hornbill.units import Instant

REST_S: Final = 0.002
"""Between two slices of packing the loop is everybody else's for this long."""

PIECE: Final = 1 << 17
"""Bytes given to the disk in one go."""


class Draft(Protocol):
    """A bundle on its way to the disk. Every method raises LogFailed, but `discard`."""

    name: str
    cut: list[str]

    async def put(self, member: str, data: bytes) -> bool:
        """More of a member; false when there is no room for it in a bundle."""
        ...

    async def finish(self) -> tuple[int, list[str]]:
        """Make it complete: its bytes, and the names of older bundles dropped for it."""
        ...

    async def discard(self) -> None:
        """Leave nothing behind."""
        ...


class Shelf(Protocol):
    """Where bundles go."""

    async def begin(self, name: str) -> Draft:
        """A new bundle of about this name. Raises LogFailed."""
        ...


@dataclass(slots=True)
class Pending:
    """A bundle whose time is not over yet, or that is being written. Instants are on the event loop's clock."""

    reason: Reason
    text: str
    at: Instant
    since: Instant
    until: Instant
    snapshot: Snapshot
    slug: str
    done: "asyncio.Future[str]"
    marks: list[Mark] = field(default_factory=list[Mark])


class Bundler:
    """Writes one bundle at a time. In a hurry it rests no more between its slices."""

    def __init__(self, base: TimeBase, catalog: Catalog, telemetry: Telemetry, node_id: int) -> None:
        """`node_id` is our own."""
        self._base, self._catalog, self._telemetry, self._node_id = base, catalog, telemetry, node_id
        self.hurry = False
        self._one = asyncio.Lock()

    async def write(
        self, pending: Pending, shelf: Shelf, ring: FrameRing, events: Sequence[tuple[Instant, bytes]]
    ) -> tuple[str, int, list[str]]:
        """The name of the bundle, its bytes, and the names of older ones dropped for it. Raises LogFailed.

        `events` are lines of JSON with their instants.
        """
        lines = [line + b"\n" for at, line in events if pending.since <= at <= pending.until]
        async with self._one:
            return await self._write(pending, shelf, ring, lines)

    async def _write(
        self, pending: Pending, shelf: Shelf, ring: FrameRing, events: list[bytes]
    ) -> tuple[str, int, list[str]]:
        at = datetime.fromtimestamp(self._base.utc(pending.at), UTC)
        draft = await shelf.begin(f"hornbill-{at:%Y%m%d-%H%M%S}-{pending.slug}.zip")
        try:
            await draft.put("README.txt", bundle.README.encode())
            frames, writes = await self._put_frames(draft, pending, ring)
            await self._put_telemetry(draft, pending)
            await self._put_all(draft, "events.jsonl", events)
            await self._put_all(draft, "writes.csv", [bundle.WRITES_HEAD.encode(), *writes])
            about = self._about(pending, frames, draft.cut, [servo async for servo in self._servos(pending)])
            await draft.put("about.json", orjson.dumps(about.model_dump(), option=orjson.OPT_INDENT_2))
            size, dropped = await draft.finish()
        except BaseException:
            await draft.discard()
            raise
        return draft.name, size, dropped

    async def _put_frames(self, draft: Draft, pending: Pending, ring: FrameRing) -> tuple[int, list[bytes]]:
        """How many frames there are, and the lines of what in them was written."""
        offset = self._base.utc_offset
        finder = bundle.Writes(self._catalog, pending.snapshot.uids(), offset)
        count, held, found = 0, bytearray(), list[bytes]()
        for part in ring.slices(pending.since, pending.until):
            held += bundle.candump(part, offset)
            count += len(part)
            found.append(finder.lines(part))
            if len(held) >= PIECE:
                await draft.put("frames.log", bytes(held))
                held.clear()
            await self._rest()
        await draft.put("frames.log", bytes(held))
        return count, found

    async def _put_telemetry(self, draft: Draft, pending: Pending) -> None:
        await draft.put("telemetry.csv", bundle.TELEMETRY_HEAD.encode())
        for servo in pending.snapshot.servos:
            for key in list(self._telemetry.channels(servo.uid)):
                times, values = self._telemetry.window(servo.uid, key, pending.since)
                for start in range(0, len(times), 1000):
                    await self._rest()
                    part = [
                        (at, value)
                        for at, value in zip(times[start : start + 1000], values[start : start + 1000], strict=True)
                        if at <= pending.until
                    ]
                    ats, taken = [at for at, _ in part], [value for _, value in part]
                    await draft.put("telemetry.csv", bundle.samples(servo.uid, key, ats, taken, self._base.utc_offset))

    async def _put_all(self, draft: Draft, member: str, lines: Sequence[bytes]) -> None:
        for start in range(0, max(1, len(lines)), 500):
            await draft.put(member, b"".join(lines[start : start + 500]))
            await self._rest()

    async def _servos(self, pending: Pending) -> AsyncIterator[BundleServo]:
        for servo in pending.snapshot.servos:
            yield servo.shown(self._base)
            await self._rest()

    def _about(self, pending: Pending, frames: int, cut: list[str], servos: list[BundleServo]) -> About:
        utc, snapshot = self._base.utc, pending.snapshot
        address, bitrate = snapshot.bus or (None, 0)
        return About(
            format=1, version=__version__, reason=pending.reason, text=pending.text, marks=pending.marks,
            started_at=utc(pending.since), ended_at=utc(pending.until), utc_offset=self._base.utc_offset,
            bus=None if address is None else BundleBus(address=address, bitrate=bitrate, node_id=self._node_id),
            servos=servos, schema_revision=self._catalog.revision, frames=frames, incomplete=list(cut),
        )  # fmt: skip

    async def _rest(self) -> None:
        await asyncio.sleep(0 if self.hurry else REST_S)
