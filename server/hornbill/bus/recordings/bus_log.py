"""BusLog: log of a running bus, written without delaying it."""

import asyncio
import errno
import logging
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import StrEnum
from math import inf
from typing import Final

from hornbill.bus.recordings.folder import FileFolder
from hornbill.bus.recordings.writer import ENDINGS, LogFormat, LogWriter
from hornbill.bus.threads import OwnThread
from hornbill.domain.event import EventCode
from hornbill.domain.fields import Param, known
from hornbill.domain.note import Note
from hornbill.errors import Busy, HornbillError
from hornbill.units import Instant
from hornbill.wire.frame import Frame, LoggedFrame
from hornbill.wire.port import channel_name

log = logging.getLogger(__name__)

QUEUE_LIMIT: Final = 50_000
"""Frames buffered for a slow disk: seven seconds of a saturated bus. Further frames are counted as dropped."""

BATCH_S: Final = 0.1
"""How long frames are collected before they are written together."""

LATE_S: Final = 0.05
"""Maximum delivery delay of received frames. Sent frames are recorded at once and wait for earlier received ones."""

CLOSE_S: Final = 5.0
"""Timeout for completing a log on a slow disk. Then it is abandoned."""


class LogPhase(StrEnum):
    """State of a log."""

    IDLE = "idle"
    RUNNING = "running"
    STOPPED = "stopped"
    FULL = "full"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class LogStatus:
    """Status of the current or last log. `started_at` in seconds since 1970 UTC, sizes in bytes.

    `frames` is the number written, `dropped` the number lost because the disk was too slow, `reason` why the log ended
    automatically.
    """

    phase: LogPhase = LogPhase.IDLE
    name: str | None = None
    form: LogFormat | None = None
    started_at: float | None = None
    frames: int = 0
    dropped: int = 0
    size: int = 0
    limit: int = 0
    reason: Note | None = None


class BusLog:
    """At most one log at a time. All methods are called on the event loop; a thread writes.

    The bus never waits for the disk: frames that cannot be written in time are dropped and counted. A log continues
    when the bus is lost and reconnected, and ends automatically when it is full or the disk fails.
    """

    def __init__(
        self,
        folder: FileFolder,
        *,
        listen: Callable[[Callable[[Sequence[Frame], bool], None]], Callable[[], None]],
        address: Callable[[], str],
        utc: Callable[[Instant], float],
        publish: Callable[[str, EventCode, str, Mapping[str, Param]], None],
    ) -> None:
        """`listen` subscribes to all frames and returns a function that unsubscribes. `address` is that of the bus.

        `utc` converts the time of a frame to seconds since 1970. `publish` receives level, code, sentence and values of
        an event.
        """
        self.folder = folder
        self._listen = listen
        self._address = address
        self._utc = utc
        self._publish = publish
        self._status = LogStatus()
        self._thread: Executor = OwnThread("log")  # never joined, so that a hanging disk cannot block the exit
        self._waiting: deque[LoggedFrame] = deque()
        self._wake = asyncio.Event()
        self._ending = False
        self._unsubscribe: Callable[[], None] = lambda: None
        self._opening: asyncio.Future[LogWriter] | None = None
        self._writing: asyncio.Task[None] | None = None

    @property
    def status(self) -> LogStatus:
        """Status of the log."""
        return self._status

    async def start(self, form: LogFormat, name: str | None, limit: int) -> LogStatus:
        """Start a log of at most `limit` bytes. `name` is without extension and defaults to the current time.

        Raises Busy while another log is running, InvalidValue for an invalid or existing name, and LogFailed.
        """
        if self._status.phase is LogPhase.RUNNING:
            raise Busy(
                f"The log {self._status.name} is already running. Stop it first.",
                cause="log_running",
                name=self._status.name or "",
            )
        path = self.folder.new(log_name(form, name))
        # before the file is created, so that no other log starts while the disk is slow
        self._status = LogStatus(LogPhase.RUNNING, path.name, form, datetime.now(UTC).timestamp(), limit=limit)
        loop = asyncio.get_running_loop()
        try:
            self._opening = loop.run_in_executor(self._thread, LogWriter, path, form, limit)
            file = await self._opening
        except BaseException as error:
            self._status = replace(self._status, phase=LogPhase.FAILED, reason=_why(error))
            raise
        self._waiting.clear()
        self._wake.clear()
        self._ending = False
        self._unsubscribe = self._listen(self._receive)
        self._writing = loop.create_task(self._write(file))
        self._publish("info", "log_started", f"Logging to {path.name}.", {"name": path.name})
        return self._status

    async def stop(self) -> LogStatus:
        """End the log, including all frames received so far. No effect without a log."""
        if self._opening is not None and not self._opening.done():
            await asyncio.wait({self._opening}, timeout=CLOSE_S)  # starting: it ends at once
        task = self._writing
        if task is not None and not task.done():
            self._unsubscribe()
            self._ending = True
            self._wake.set()
            await asyncio.wait({task}, timeout=CLOSE_S)
            if not task.done():
                task.cancel()
                text = f"The disk did not complete it within {CLOSE_S:g} s."
                self._end(LogPhase.FAILED, Note(text, "disk_slow", {"within_s": CLOSE_S}))
        return self._status

    async def delete(self, name: str) -> None:
        """Remove a log. Raises Unknown(unknown_log), Busy for the running log, LogFailed."""
        if self._status.phase is LogPhase.RUNNING and self._status.name == name:
            raise Busy(
                f"The log {name} is running. Stop it first.",
                cause="log_running",
                name=name,
            )
        await asyncio.get_running_loop().run_in_executor(self._thread, self.folder.delete, name)

    def _receive(self, frames: Sequence[Frame], sent: bool) -> None:
        """Queue frames. Called for every batch before its other receivers, so it must be fast."""
        channel = channel_name(self._address())
        taken = frames[: QUEUE_LIMIT - len(self._waiting)]
        self._waiting.extend([LoggedFrame(frame, channel, sent) for frame in taken])
        if len(taken) < len(frames):
            self._status = replace(self._status, dropped=self._status.dropped + len(frames) - len(taken))
        self._wake.set()

    async def _write(self, file: LogWriter) -> None:
        loop = asyncio.get_running_loop()
        phase, reason = LogPhase.STOPPED, None
        try:
            while True:
                await self._wake.wait()
                if not self._ending:
                    await asyncio.sleep(BATCH_S)
                ending = self._ending  # no more frames are added then
                self._wake.clear()
                batch = self._take(inf if ending else loop.time())
                room = await loop.run_in_executor(self._thread, self._write_batch, file, batch)
                self._status = replace(self._status, frames=file.frames, size=file.size)
                if not room:
                    limit_mb = self._status.limit / 1e6
                    text = f"It reached its limit of {limit_mb:g} MB."
                    phase, reason = LogPhase.FULL, Note(text, "log_limit", {"limit_mb": limit_mb})
                if ending or not room:
                    break
            await loop.run_in_executor(self._thread, file.close)
        except asyncio.CancelledError:
            self._thread.submit(_close_failed, file)  # it waits there for the disk
            raise
        except Exception as error:
            phase, reason = LogPhase.FAILED, _why(error)
            await loop.run_in_executor(self._thread, _close_failed, file)
        self._status = replace(self._status, frames=file.frames, size=file.size)
        self._end(phase, reason)

    def _take(self, now: Instant) -> list[LoggedFrame]:
        """All frames except the last few, in chronological order, as readers of logs expect."""
        waiting = sorted(self._waiting, key=_instant)
        self._waiting = deque(each for each in waiting if 0 <= now - _instant(each) < LATE_S)
        if self._waiting:
            self._wake.set()
        return [each for each in waiting if not 0 <= now - _instant(each) < LATE_S]

    def _write_batch(self, file: LogWriter, batch: Sequence[LoggedFrame]) -> bool:
        """Write a batch. Runs in the thread."""
        utc = self._utc
        return file.write(
            logged._replace(frame=logged.frame._replace(at=round(utc(logged.frame.at), 6))) for logged in batch
        )

    def _end(self, phase: LogPhase, reason: Note | None) -> None:
        if self._status.phase is not LogPhase.RUNNING:
            return
        self._unsubscribe()
        self._waiting.clear()
        self._status = replace(self._status, phase=phase, reason=reason)
        name, dropped = self._status.name, self._status.dropped
        why = "" if reason is None else reason.text
        lost = f" The disk was too slow for {dropped} frames." if dropped else ""
        params = known(name=name, dropped=dropped or None)
        match phase:
            case LogPhase.FULL:
                params["limit_mb"] = self._status.limit / 1e6
                text = f"The log {name} ended. {why}{lost} Start a new one to continue."
                self._publish("notice", "log_full", text, params)
            case LogPhase.FAILED:
                if reason is not None:
                    params |= {**reason.params, "why": reason.code}
                text = f"The log {name} ended. {why}{lost} Everything else continues."
                self._publish("warning", "log_failed", text, params)
            case _:
                params["frames"] = self._status.frames
                self._publish(
                    "info", "log_stopped", f"The log {name} ended after {self._status.frames} frames.{lost}", params
                )


def log_name(form: LogFormat, name: str | None) -> str:
    """File name of a log. `name` may include its extension and defaults to the current time (UTC)."""
    stem = f"{datetime.now(UTC):%Y-%m-%dT%H-%M-%SZ}" if name is None else name.strip().removesuffix(ENDINGS[form])
    return f"{stem}{ENDINGS[form]}"


def _instant(logged: LoggedFrame) -> Instant:
    return logged.frame.at


def _why(error: BaseException) -> Note:
    if isinstance(error, HornbillError):
        return Note(error.detail, "problem", error.note_params)
    if not isinstance(error, OSError):
        log.error("log could not be written", exc_info=error)
        return Note(f"It could not be written: {error}.", "write_failed", {"error": str(error)})
    text = error.strerror or str(error)
    if error.errno == errno.ENOSPC:
        return Note(f"{text}: free space on the disk of the data folder.", "disk_full")
    return Note(f"{text}.", "write_failed", {"error": text})


def _close_failed(file: LogWriter) -> None:
    try:
        file.close()
    except Exception as error:
        log.debug("failed log could not be closed: %s", error)
