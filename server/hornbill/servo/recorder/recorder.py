"""Flight recorder: the last ten minutes in memory, written to a file after a failure, a stop or a loss."""

import asyncio
import logging
import re
from collections import deque
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final, cast

import orjson

from hornbill.domain.event import EventCode
from hornbill.domain.fields import Param, known
from hornbill.domain.recording import MARKS_MOST, Mark, MarkReason
from hornbill.errors import Busy, HornbillError, InvalidValue, LogFailed
from hornbill.node.tap import FrameTap
from hornbill.schema.fault import bits_of
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.services import HostServices
from hornbill.servo.monitoring.commanders import Commanders
from hornbill.servo.recorder.building import BeginDraft, RecordingBuilder, RecordingInProgress
from hornbill.servo.recorder.frame_ring import RETAIN_S, FrameRing
from hornbill.servo.recorder.snapshot import KnownState
from hornbill.servo.runtime.hub import BusChanged, LeaseChanged, LogEvent, ReadingChanged, StopChanged
from hornbill.servo.torque_off.stop import Latch, StopControl, reason_text
from hornbill.units import Instant, Uid
from hornbill.wire.port import REPLAYS, CanPort, channel_name

log = logging.getLogger(__name__)

BEFORE_S: Final = 60.0
LEAST_BEFORE_S: Final = 30.0
AFTER_S: Final = 10.0
LONGEST_S: Final = 60.0
"""Maximum time after the first trigger. A later trigger begins a new recording."""

QUIET_S: Final = 60.0
"""The same trigger of the same servo begins a new recording only after this long without it. Otherwise a loose plug
would fill the folder and displace the first recording of the problem."""

MAX_EVENTS: Final = 20_000
CLOSE_S: Final = 5.0


class Recorder:
    """Records from `begin` on. A replay is not recorded again."""

    def __init__(
        self,
        services: HostServices,
        *,
        tap: FrameTap,
        fleet: Fleet,
        commanders: Commanders,
        stop: StopControl,
        port: Callable[[], CanPort | None],
        builder: RecordingBuilder,
    ) -> None:
        """`port` returns the port of the connected bus."""
        self._base, self._hub, self._leases = services.base, services.hub, services.leases
        self._tap, self._fleet, self._stop, self._port, self._builder = tap, fleet, stop, port, builder
        self._commanders = commanders
        self._draft: BeginDraft | None = None
        self.before_s = BEFORE_S
        """Time that a recording covers before its first trigger, s."""
        self.ring = FrameRing()
        self._events: deque[tuple[Instant, bytes]] = deque(maxlen=MAX_EVENTS)
        self._failures: dict[Uid, int] = {}
        self._latch: Latch | None = None
        self._held: list[dict[str, object]] = []
        self._address: str | None = None
        self._unlisten: Callable[[], None] = lambda: None
        self._since: Instant = services.base.now()
        self._last: dict[tuple[object, ...], Instant] = {}
        self._pending: RecordingInProgress | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._closing = asyncio.Event()

    def begin(self, draft: BeginDraft, *, before_s: float = BEFORE_S) -> None:
        """Start recording. `draft` begins each file, which covers `before_s` (30 to 600) before its first trigger."""
        if not LEAST_BEFORE_S <= before_s <= RETAIN_S:
            raise InvalidValue(
                f"{before_s:g} s is outside the range of {LEAST_BEFORE_S:g} to {RETAIN_S:g} s.",
                requested=before_s,
                cause="before_out_of_range",
                minimum_s=LEAST_BEFORE_S,
                maximum_s=RETAIN_S,
            )
        assert self._draft is None
        self._draft, self.before_s, self._since = draft, before_s, self._base.now()
        hub = self._hub
        hub.subscribe(self._on_event, LogEvent)
        hub.subscribe(self._on_reading, ReadingChanged)
        hub.subscribe(self._on_stop, StopChanged)
        hub.subscribe(self._on_lease, LeaseChanged)
        hub.subscribe(self._on_bus, BusChanged)
        self._unlisten = self._tap.listen(self.ring.add)
        self._on_bus(BusChanged())

    @property
    def recording(self) -> bool:
        """Whether the bus is being recorded: not before `begin`, not during a replay."""
        return self._draft is not None and not self._recorded

    @property
    def reach_s(self) -> float:
        """Time span in memory, s: since the start, at most 600, less if memory is full."""
        now = self._base.now()
        self.ring.forget_old(now)
        since = self._since if not self.ring.full else max(self._since, self.ring.since or self._since)
        return max(0.0, min(RETAIN_S, now - since))

    @property
    def pending(self) -> RecordingInProgress | None:
        """Recording that still collects data. None if none."""
        return self._pending

    def trigger(self, text: str, before_s: float | None = None) -> "asyncio.Future[str]":
        """Write a recording of this moment. The future returns its file name or raises LogFailed.

        `before_s`: 1 to 600, default: as configured. Raises LogFailed without a folder, Busy during a replay.
        """
        if self._draft is None:
            raise LogFailed(
                "Nothing is recorded because the server has no data folder.", cause="recordings_folder_missing"
            )
        if self._recorded:
            raise Busy(
                "A recording is being played, so nothing is recorded. Connect a bus first.",
                cause="playback_in_progress",
            )
        self._mark("manual", text, slug=_slug(text), before_s=before_s)
        assert self._pending is not None
        return self._pending.done

    async def close(self) -> None:
        """Write pending recordings immediately. Idempotent."""
        self._unlisten()
        self._closing.set()
        self._builder.hurry = True
        if self._tasks:
            _, late = await asyncio.wait(self._tasks, timeout=CLOSE_S)
            for task in late:
                task.cancel()
            await asyncio.gather(*late, return_exceptions=True)

    @property
    def _recorded(self) -> bool:
        return self._address is not None and self._address.startswith(REPLAYS)

    def _on_bus(self, _change: BusChanged) -> None:
        port = self._port()
        address = None if port is None else port.address
        if address == self._address:
            return
        before, self._address = self._recorded, address
        if self._recorded and not before:
            self._unlisten()
        elif before and not self._recorded:
            self._unlisten = self._tap.listen(self.ring.add)
            self._since = self._base.now()  # earlier samples belong to the replay
        if address is not None:
            self.ring.switch_channel(channel_name(address))

    def _on_event(self, event: LogEvent) -> None:
        self._note({
            "type": "event", "level": event.level, "code": event.code, "text": event.text, "uid": event.uid,
            "params": event.params,
        })  # fmt: skip
        if event.code == "offline":
            self._mark("lost", event.text, event.uid, params=event.params)
        elif event.code == "bus_lost" and event.level == "failure":
            self._mark("bus_lost", event.text, params=event.params)

    def _on_reading(self, change: ReadingChanged) -> None:
        if change.key != "fault_failure" or self._recorded:
            return
        servo = self._fleet.find(change.uid)
        word = 0 if servo is None else servo.raw(change.key) or 0
        new = word & ~self._failures.get(change.uid, 0)
        self._failures[change.uid] = word
        if servo is not None and new:
            labels = {bit.bit: bit for bit in self._fleet.catalog.faults if bit.parameter == change.key}
            bits = sorted(bits_of(new))
            names = ", ".join(labels[bit].label if bit in labels else f"bit {bit}" for bit in bits)
            text = f"{servo.title} reports a failure: {names}."
            faults = [labels[bit].key if bit in labels else f"bit {bit}" for bit in bits]
            self._mark("failure", text, change.uid, which=new, params={"servo": servo.title, "faults": faults})

    def _on_stop(self, _change: StopChanged) -> None:
        latch, before = self._stop.latch, self._latch
        if latch is before:
            return
        self._latch = latch
        if latch is None:
            self._note({"type": "stop", "latched": False})
            return
        why = f": {reason_text(latch.reason)}" if latch.reason else ""
        self._note({"type": "stop", "latched": True, "mode": latch.mode, "by": latch.by, "reason": latch.reason})
        params: dict[str, object] = {**known(by=latch.by, why=latch.reason or None)}
        self._mark("stop", f"Stop by {latch.by}{why}.", which=id(latch), params=params)

    def _on_lease(self, _change: LeaseChanged) -> None:
        valid = self._leases.valid(self._base.now())
        held: list[dict[str, object]] = [
            {"holder": one.holder, "uids": None if one.uids is None else sorted(one.uids)} for one in valid
        ]
        if held != self._held:
            self._held = held
            self._note({"type": "lease", "leases": held})

    def _known(self) -> KnownState:
        port = self._port()
        bus = None if port is None else (port.address, port.bitrate)
        return KnownState.of(self._fleet.seen(), self._commanders, bus)

    def _note(self, what: dict[str, object]) -> None:
        if not self._recorded:
            now = self._base.now()
            self._events.append((now, orjson.dumps({"time": round(self._base.utc(now), 6), **what})))

    def _mark(
        self,
        reason: MarkReason,
        text: str,
        uid: Uid | None = None,
        *,
        which: object = None,
        slug: str = "",
        before_s: float | None = None,
        params: Mapping[str, object] = MappingProxyType({}),
    ) -> None:
        """Add a trigger to the pending recording, or begin a new one."""
        if self._draft is None or self._recorded or self._closing.is_set():
            return
        now, same = self._base.now(), (reason, uid, which)
        last = self._last.get(same)
        self._last[same] = now
        mark = Mark(
            at=self._base.utc(now), reason=reason, text=text[:2000], uid=uid, params=cast("dict[str, Param]", params)
        )
        pending = self._pending
        if pending is not None:
            if len(pending.marks) < MARKS_MOST:
                pending.marks.append(mark)
            pending.until = max(pending.until, min(now + AFTER_S, pending.at + LONGEST_S))
            if before_s is not None:
                pending.since = min(pending.since, now - before_s)
            return
        if reason != "manual" and last is not None and now - last < QUIET_S:
            return
        self._last = {one: at for one, at in self._last.items() if now - at < QUIET_S}
        pending = self._pending = RecordingInProgress(
            reason, text[:2000], now, max(self._since, now - (before_s or self.before_s)), now + AFTER_S,
            self._known(), slug or reason.replace("_", "-"), asyncio.get_running_loop().create_future(), [mark],
        )  # fmt: skip
        task = asyncio.get_running_loop().create_task(self._finish(pending, self._draft))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _finish(self, pending: RecordingInProgress, draft: BeginDraft) -> None:
        """Wait for the end of the recording and write it. A failure is published and raised from `pending.done`."""
        try:
            while (left := pending.until - self._base.now()) > 0 and not self._closing.is_set():
                try:
                    async with asyncio.timeout(left):
                        await self._closing.wait()
                except TimeoutError:
                    pass
            pending.until = min(pending.until, self._base.now())
            pending.snapshot = pending.snapshot.joined(self._known())
            if self._pending is pending:
                self._pending = None
            name, size, dropped = await self._builder.write(pending, draft, self.ring, list(self._events))
        except asyncio.CancelledError:
            pending.done.cancel()
            raise
        except Exception as error:
            if not isinstance(error, HornbillError):
                log.exception("Recording not written")
            detail = error.detail if isinstance(error, HornbillError) else f"The recording was not written: {error}."
            failed = error if isinstance(error, LogFailed) else LogFailed(detail, cause="recording_not_written")
            pending.done.set_exception(failed)
            pending.done.exception()  # mark as retrieved: there may be no waiter
            self._publish("warning", "recording_failed", f"{detail} Everything else continues.", failed.note_params)
            return
        pending.done.set_result(name)
        text = f"{pending.text.rstrip('.')}. Recorded in {name} ({size / 1e6:.1f} MB)."
        params = {**pending.marks[0].params, "mark": pending.reason, "text": pending.text, "name": name}
        self._publish("notice", "recording_written", text, {**params, "size_mb": round(size / 1e6, 1)})
        if dropped:
            text = f"Deleted to make room: {', '.join(dropped)}."
            self._publish("notice", "recordings_deleted", text, {"names": dropped})

    def _publish(self, level: str, code: EventCode, text: str, params: Mapping[str, object]) -> None:
        self._hub.publish(LogEvent(level, code, text, params={**params}))


def _slug(text: str) -> str:
    """A file name part from a user's text: ASCII letters, digits and hyphens, at most 30 characters."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower())[:30].strip("-") or "manual"
