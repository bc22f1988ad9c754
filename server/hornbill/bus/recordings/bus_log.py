"""BusLog: the log of a running bus, written without delaying it."""

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

WAITING_MOST: Final = 50_000
"""Frames kept for a slow disk: seven seconds of a full bus. What comes beyond is counted as dropped."""

BATCH_S: Final = 0.1
"""How long frames gather before they are written in one go."""

LATE_S: Final = 0.05
"""How long a frame received may be under way to us. What we send is here at once, and waits for those before it."""

CLOSE_S: Final = 5.0
"""How long a disk may take to end a log; then it is left to itself."""


class LogPhase(StrEnum):
    """How a log stands."""

    IDLE = "idle"
    RUNNING = "running"
    STOPPED = "stopped"
    FULL = "full"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class LogStatus:
    """The log that is written, or the last one. `started_at` in seconds since 1970 UTC, sizes in bytes.

    `frames` are those given to the disk, `dropped` those it was too slow for; `reason` says why it ended by itself.
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
    """At most one log at a time. All methods are called on the event loop; a thread does the writing.

    The bus never waits for the disk: what the disk cannot take in time is dropped and counted. A log goes on
    when the bus is lost and found again, and ends by itself when it is full or the disk fails.
    """

    def __init__(
        self,
        folder: FileFolder,
        *,
        listen: Callable[[Callable[[Sequence[Frame], bool], None]], Callable[[], None]],
        address: Callable[[], str],
        utc: Callable[[Instant], float],
        tell: Callable[[str, EventCode, str, Mapping[str, Param]], None],
    ) -> None:
        """`listen` makes a listener hear every frame until its answer is called; `address` is that of the bus now.

        `utc` turns the instant of a frame into seconds since 1970; `tell` gets level, code, sentence
        and values of an event.
        """
        self.folder = folder
        self._listen = listen
        self._address = address
        self._utc = utc
        self._tell = tell
        self._status = LogStatus()
        self._thread: Executor = OwnThread("log")  # not one that a disk which hangs could keep the process with
        self._waiting: deque[LoggedFrame] = deque()
        self._stirred = asyncio.Event()
        self._ending = False
        self._deaf: Callable[[], None] = lambda: None
        self._opening: asyncio.Future[LogWriter] | None = None
        self._writing: asyncio.Task[None] | None = None

    @property
    def status(self) -> LogStatus:
        """How the log stands now."""
        return self._status

    async def start(self, form: LogFormat, name: str | None, limit: int) -> LogStatus:
        """Begin a log of at most `limit` bytes; `name` is without ending, the time of now unless given.

        Raises Busy while another is written, InvalidValue for a name that is none or is taken, and LogFailed.
        """
        if self._status.phase is LogPhase.RUNNING:
            raise Busy(
                f"{self._status.name} is being written already. Stop it first.",
                cause="log_running",
                name=self._status.name or "",
            )
        path = self.folder.new(log_name(form, name))
        # before the file is made, so that nobody else begins one while the disk takes its time
        self._status = LogStatus(LogPhase.RUNNING, path.name, form, datetime.now(UTC).timestamp(), limit=limit)
        loop = asyncio.get_running_loop()
        try:
            self._opening = loop.run_in_executor(self._thread, LogWriter, path, form, limit)
            file = await self._opening
        except BaseException as error:
            self._status = replace(self._status, phase=LogPhase.FAILED, reason=_why(error))
            raise
        self._waiting.clear()
        self._stirred.clear()
        self._ending = False
        self._deaf = self._listen(self._hear)
        self._writing = loop.create_task(self._write(file))
        self._tell("info", "log_started", f"Logging to {path.name}.", {"name": path.name})
        return self._status

    async def stop(self) -> LogStatus:
        """End the log; what was heard until now is in it. Without one nothing happens."""
        if self._opening is not None and not self._opening.done():
            await asyncio.wait({self._opening}, timeout=CLOSE_S)  # it was to begin just now: then it ends at once
        task = self._writing
        if task is not None and not task.done():
            self._deaf()
            self._ending = True
            self._stirred.set()
            await asyncio.wait({task}, timeout=CLOSE_S)
            if not task.done():
                task.cancel()
                text = f"The disk did not take the end of it within {CLOSE_S:g} s."
                self._end(LogPhase.FAILED, Note(text, "disk_slow", {"within_s": CLOSE_S}))
        return self._status

    async def delete(self, name: str) -> None:
        """Remove a log. Raises Unknown(unknown_log), Busy for the one being written, LogFailed."""
        if self._status.phase is LogPhase.RUNNING and self._status.name == name:
            raise Busy(
                f"{name} is being written. Stop it first.",
                cause="log_running",
                name=name,
            )
        await asyncio.get_running_loop().run_in_executor(self._thread, self.folder.delete, name)

    def _hear(self, frames: Sequence[Frame], sent: bool) -> None:
        """On the way of every frame to whoever waits for it: keep it, and nothing else."""
        channel = channel_name(self._address())
        taken = frames[: WAITING_MOST - len(self._waiting)]
        self._waiting.extend([LoggedFrame(frame, channel, sent) for frame in taken])
        if len(taken) < len(frames):
            self._status = replace(self._status, dropped=self._status.dropped + len(frames) - len(taken))
        self._stirred.set()

    async def _write(self, file: LogWriter) -> None:
        loop = asyncio.get_running_loop()
        phase, reason = LogPhase.STOPPED, None
        try:
            while True:
                await self._stirred.wait()
                if not self._ending:
                    await asyncio.sleep(BATCH_S)
                ending = self._ending  # then nothing is added any more
                self._stirred.clear()
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
            self._thread.submit(_close_anyhow, file)  # it waits there until the disk lets go
            raise
        except Exception as error:
            phase, reason = LogPhase.FAILED, _why(error)
            await loop.run_in_executor(self._thread, _close_anyhow, file)
        self._status = replace(self._status, frames=file.frames, size=file.size)
        self._end(phase, reason)

    def _take(self, now: Instant) -> list[LoggedFrame]:
        """Every frame but the last few, in the order of their times, as readers of logs expect it."""
        waiting = sorted(self._waiting, key=_instant)
        self._waiting = deque(each for each in waiting if 0 <= now - _instant(each) < LATE_S)
        if self._waiting:
            self._stirred.set()
        return [each for each in waiting if not 0 <= now - _instant(each) < LATE_S]

    def _write_batch(self, file: LogWriter, batch: Sequence[LoggedFrame]) -> bool:
        """In the thread."""
        utc = self._utc
        return file.write(
            logged._replace(frame=logged.frame._replace(at=round(utc(logged.frame.at), 6))) for logged in batch
        )

    def _end(self, phase: LogPhase, reason: Note | None) -> None:
        if self._status.phase is not LogPhase.RUNNING:
            return
        self._deaf()
        self._waiting.clear()
        self._status = replace(self._status, phase=phase, reason=reason)
        name, dropped = self._status.name, self._status.dropped
        why = "" if reason is None else reason.text
        lost = f" The disk was too slow for {dropped} frames." if dropped else ""
        params = known(name=name, dropped=dropped or None)
        match phase:
            case LogPhase.FULL:
                params["limit_mb"] = self._status.limit / 1e6
                text = f"The log {name} ended. {why}{lost} Begin another to go on."
                self._tell("notice", "log_full", text, params)
            case LogPhase.FAILED:
                if reason is not None:
                    params |= {**reason.params, "why": reason.code}
                text = f"The log {name} ended. {why}{lost} Everything else goes on."
                self._tell("warning", "log_failed", text, params)
            case _:
                params["frames"] = self._status.frames
                self._tell(
                    "info", "log_stopped", f"The log {name} ended after {self._status.frames} frames.{lost}", params
                )


def log_name(form: LogFormat, name: str | None) -> str:
    """The file name of a log; `name` is with or without its ending, the time of now (UTC) unless given."""
    stem = f"{datetime.now(UTC):%Y-%m-%dT%H-%M-%SZ}" if name is None else name.strip().removesuffix(ENDINGS[form])
    return f"{stem}{ENDINGS[form]}"


def _instant(logged: LoggedFrame) -> Instant:
    return logged.frame.at


def _why(error: BaseException) -> Note:
    if isinstance(error, HornbillError):
        return Note(error.detail, "problem", error.note_params)
    if not isinstance(error, OSError):
        log.error("a log could not be written", exc_info=error)
        return Note(f"It could not be written: {error}.", "write_failed", {"error": str(error)})
    text = error.strerror or str(error)
    if error.errno == errno.ENOSPC:
        return Note(f"{text}: make room on the disk of the data folder.", "disk_full")
    return Note(f"{text}.", "write_failed", {"error": text})


def _close_anyhow(file: LogWriter) -> None:
    try:
        file.close()
    except Exception as error:
        log.debug("a log that failed did not close either: %s", error)
