"""Bus monitor: raw and decoded traffic, decoded once for all clients."""

import asyncio
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import Any, Final, TypeAlias

from hornbill.node.hooks import Hooks
from hornbill.node.tap import FrameTap
from hornbill.servo.monitoring.transfer_text import MatchedRequest, TransferText
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.wire.datatype import Kind
from hornbill.wire.describe import KINDS, PROBLEMS, as_object, frame_count
from hornbill.wire.frame import Frame
from hornbill.wire.identifier import parse
from hornbill.wire.reassembly import DropReason, Reassembler
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import BY_KEY, AnyStructure, decode

BATCH_S: Final = 1 / 30
"""Interval of batches to watchers."""

MAX_PENDING: Final = 4096
"""Pending frames above which a batch is decoded early: half a second of a full bus."""

_SETTLE_S: Final = 0.1
"""A transfer in progress when watching starts has no visible beginning, which is not a bus error."""


@lru_cache(maxsize=1024)
def _about(can_id: int) -> tuple[str, str | None, int, int | None]:
    """Kind, full type name, source and destination (None: broadcast) of an identifier."""
    kind, type_id, source, destination, _, _ = parse(can_id)
    data_type = BY_KEY.get((kind is not Kind.MESSAGE, type_id))
    name = None if data_type is None else data_type.name
    return KINDS[kind], name, source, None if kind is Kind.MESSAGE else destination


class SeenFrame:
    """A frame on the bus. `timestamp`: seconds since 1970 UTC. `problem`: why it could not be decoded, else None."""

    __slots__ = ("can_id", "data", "problem", "sent", "timestamp")

    def __init__(self, timestamp: float, sent: bool, can_id: int, data: bytes, problem: str | None) -> None:
        self.timestamp = timestamp
        self.sent = sent
        self.can_id = can_id
        self.data = data
        self.problem = problem

    @property
    def about(self) -> tuple[str, str | None, int, int | None]:
        """Kind, full type name, source and destination (None: broadcast)."""
        return _about(self.can_id)

    @property
    def text(self) -> str:
        """Searchable text."""
        return f"{self.problem or ''} {self.can_id:08x} {self.data.hex()}"

    @property
    def shown(self) -> dict[str, Any]:
        """As RawFrame."""
        return {
            "timestamp": self.timestamp,
            "sent": self.sent,
            "can_id": f"{self.can_id:08x}",
            "data": self.data.hex(),
            "problem": self.problem,
        }


class SeenTransfer:
    """A complete transfer, decoded on first access."""

    def __init__(
        self,
        text: TransferText,
        transfer: Transfer,
        timestamp: float,
        sent: bool,
        can_id: int,
        request: MatchedRequest | None,
    ) -> None:
        self.transfer = transfer
        self.timestamp = timestamp
        self.sent = sent
        self.can_id = can_id
        self._text = text
        self._request = request

    @property
    def about(self) -> tuple[str, str | None, int, int | None]:
        """Kind, full type name, source and destination (None: broadcast)."""
        return _about(self.can_id)

    @property
    def problem(self) -> str | None:
        """Why its payload could not be decoded although its type is known. None otherwise."""
        return "payload does not fit" if self._structure is None and self.about[1] is not None else None

    @cached_property
    def summary(self) -> str:
        """Description in one sentence."""
        return self._text.describe(self.transfer, self._structure, self._request)

    @property
    def text(self) -> str:
        """Searchable text."""
        return f"{self.summary} {self.can_id:08x} {self.transfer.payload.hex()}"

    @cached_property
    def shown(self) -> dict[str, Any]:
        """As DecodedTransfer."""
        return {
            **as_object(self.transfer, self._structure, self.timestamp),
            "summary": self.summary,
            "sent": self.sent,
            "can_id": f"{self.can_id:08x}",
            "frames": frame_count(self.transfer),
        }

    @cached_property
    def _structure(self) -> AnyStructure | None:
        return decode(self.transfer)


Row: TypeAlias = SeenFrame | SeenTransfer


class Batch:
    """Traffic since the last batch. `rows`: transfers, and frames that could not be decoded, in bus order."""

    def __init__(self, frames: Sequence[tuple[float, bool, Frame, str | None]], rows: Sequence[Row]) -> None:
        self._frames = frames
        self.rows = rows

    @cached_property
    def frames(self) -> Sequence[Row]:
        """All frames."""
        return [SeenFrame(at, sent, frame.id, frame.data, problem) for at, sent, frame, problem in self._frames]


class BusMonitor:
    """Decodes all bus traffic, including services between other nodes, while there are watchers."""

    def __init__(self, tap: FrameTap, base: TimeBase, make_text: Callable[[], TransferText]) -> None:
        self._tap = tap
        self._base = base
        self._make_text = make_text
        self._watchers: Hooks[Batch] = Hooks()
        self._pending: list[tuple[Frame, bool]] = []
        self._timer: asyncio.TimerHandle | None = None
        self._untap: Callable[[], None] | None = None
        self._begin()

    @property
    def watched(self) -> bool:
        """Whether there are watchers."""
        return bool(self._watchers)

    def watch(self, watcher: Callable[[Batch], None]) -> Callable[[], None]:
        """Call `watcher` with a batch about 30 times a second. Returns a function that stops it."""
        if self._untap is None:
            self._begin()
            self._untap = self._tap.listen(self._on_frames)
        self._watchers.append(watcher)

        def stop() -> None:
            if watcher in self._watchers:
                self._watchers.remove(watcher)
            if not self._watchers:
                self._end()

        return stop

    def _begin(self) -> None:
        self._text = self._make_text()
        self._reassembler = Reassembler(on_drop=self._note_drop)
        self._drops: list[tuple[DropReason, int, bytes]] = []
        self._since = self._base.now()

    def _end(self) -> None:
        if self._untap is not None:
            self._untap()
            self._untap = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._pending.clear()

    def _on_frames(self, frames: Sequence[Frame], sent: bool) -> None:
        """Queue frames for decoding. Runs in the receive path of every frame, so it must be fast."""
        self._pending.extend([(frame, sent) for frame in frames])
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(BATCH_S, self._deliver)
        if len(self._pending) >= MAX_PENDING:
            self._timer.cancel()
            self._deliver()

    def _deliver(self) -> None:
        self._timer = None
        pending, self._pending = self._pending, []
        self._watchers.notify(self._decoded(pending))

    def _decoded(self, pending: Sequence[tuple[Frame, bool]]) -> Batch:
        """Decode frame by frame, to know which frame completed or broke a transfer."""
        now, utc_offset = self._base.now(), self._base.utc_offset
        text, feed, drops = self._text, self._reassembler.feed, self._drops
        frames: list[tuple[float, bool, Frame, str | None]] = []
        rows: list[Row] = []
        for frame, sent in pending:
            completed = feed((frame,), now)
            at = round((frame.at or now) + utc_offset, 6)
            problem: str | None = None
            if drops:
                for reason, can_id, data in drops:
                    if reason == "unexpected" and (frame.at or now) - self._since < _SETTLE_S:
                        continue
                    is_this = (can_id, data) == (frame.id, frame.data)  # else an earlier frame whose transfer timed out
                    rows.append(SeenFrame(at, sent and is_this, can_id, data, PROBLEMS[reason]))
                    if is_this:
                        problem = PROBLEMS[reason]
                drops.clear()
            frames.append((at, sent, frame, problem))
            rows += [SeenTransfer(text, one, at, sent, frame.id, text.follow(one)) for one in completed]
        return Batch(frames, rows)

    def _note_drop(self, reason: DropReason, can_id: int, data: bytes) -> None:
        self._drops.append((reason, can_id, data))
