"""ReplayPort: a recording as a bus, played with its own time spacing; nothing can be sent on it."""

import asyncio
import itertools
import logging
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, TypeAlias

from hornbill.bus.recordings.reader import LogReader
from hornbill.bus.recordings.recording import RecordingReader
from hornbill.bus.threads import OwnThread
from hornbill.bus.transmit import check
from hornbill.errors import BusDisconnected, BusReadOnly, LogFailed, PortError, PortOpenFailed
from hornbill.wire.bittime import frame_bits
from hornbill.wire.frame import Frame, LoggedFrame
from hornbill.wire.port import LOG_SCHEME, PLAIN, RECORDING_SCHEME, FrameSink, PortState, PortStatistics

log = logging.getLogger(__name__)

SLOWEST: Final = 0.01
FASTEST: Final = 1000.0
"""Bounds of `speed`: beyond them nobody sees anything move, or the event loop does nothing else."""

OPEN_S: Final = 8.0
"""How long a file may take to show its first frame, and CLOSE_S to end a reading; then it is left to itself."""
CLOSE_S: Final = 3.0

_BATCH: Final = 512
_TURN_S: Final = 0.001  # no event loop's timer is finer
_SPEED: Final = "?speed="


def parse(address: str) -> tuple[Path, float]:
    """File and speed of `file:PATH[?speed=S]`, or of `recording:`; S is 0.01 to 1000 times as fast.

    Raises PortOpenFailed.
    """
    name, given, factor = address.removeprefix(LOG_SCHEME).removeprefix(RECORDING_SCHEME).rpartition(_SPEED)
    if not given:
        name, factor = factor, "1"
    try:
        speed = float(factor)
    except ValueError:
        speed = math.nan
    if not SLOWEST <= speed <= FASTEST:
        raise PortOpenFailed(
            f"{factor!r} is no speed. Give {SLOWEST:g} to {FASTEST:g}.",
            address=address,
            cause="playback_speed_invalid",
            requested=factor,
        )
    if not name.strip():
        raise PortOpenFailed(
            f"{address!r} names no file. Write file:PATH, for example file:can0.log.",
            address=address,
            cause="file_name_missing",
        )
    return Path(name.strip()), speed


async def open_replay(address: str, *, bitrate: int = 1_000_000, folder: Path | None = None) -> "ReplayPort":
    """The recording `file:PATH[?speed=S]` as a port, which begins to play when it is first listened to.

    Of `recording:PATH[?speed=S]` the frames are played, and the port says what the recording is `about`.
    A name without a folder that is not in the working directory is looked for in `folder` too. `bitrate` only says
    how much of the bus each frame took. Raises PortOpenFailed; facts: address.
    """
    path, speed = parse(address)
    if bitrate <= 0:
        raise PortOpenFailed(
            f"{bitrate} bit/s is no bit rate. The servos are delivered with 1000000.",
            address=address,
            cause="bit_rate_unsupported",
            bitrate=bitrate,
        )
    reading = asyncio.get_running_loop().run_in_executor(
        OwnThread("replay"), _begin, path, folder, address.startswith(RECORDING_SCHEME)
    )
    try:
        async with asyncio.timeout(OPEN_S):
            recording, frames, first = await asyncio.shield(reading)
    except LogFailed as error:
        raise PortOpenFailed(
            f"{address} cannot be played: {error.detail}", address=address, cause="not_playable", why=error.detail
        ) from error
    except (TimeoutError, asyncio.CancelledError) as error:
        reading.add_done_callback(_close)
        if isinstance(error, asyncio.CancelledError):
            raise
        raise PortOpenFailed(
            f"{address} cannot be played: no frame was found in it within {OPEN_S:g} s. Check the file and its disk.",
            address=address,
            cause="frames_timeout",
            within_s=OPEN_S,
        ) from error
    if not first:
        recording.close()
        raise PortOpenFailed(
            f"There is no frame of a CAN bus with 29-bit identifiers in {recording.name}.",
            address=address,
            cause="frames_missing",
            name=recording.name,
        )
    return ReplayPort(recording, frames, first, address=address, bitrate=bitrate, speed=speed)


class ReplayPort:
    """A CanPort that delivers the frames of a recording on the event loop's clock, then stays, and is silent.

    Sending is refused, so that nobody waits for an answer: one in the recording, to a question of then, would
    otherwise be taken for it.
    """

    def __init__(
        self,
        recording: LogReader,
        frames: Iterator[LoggedFrame],
        first: list[LoggedFrame],
        *,
        address: str,
        bitrate: int,
        speed: float,
    ) -> None:
        """`first` was taken from `frames` already. Made by `open_replay`."""
        self.address = address
        self.bitrate = bitrate
        self.statistics = PortStatistics()
        self.refused = 0
        """Frames somebody wanted to send."""
        self.sample_point: float | None = None
        self.trouble: PortError | None = None
        self.retry_in_s: float | None = None
        self.details = PLAIN
        self.about = recording.about
        """What a recording is of; None for a plain log."""
        self._recording = recording
        self._frames = frames
        self._batch = first
        self._speed = speed
        self._sink: FrameSink | None = None
        self._state = PortState.ACTIVE
        self._playing: asyncio.Task[None] | None = None
        self._reading: asyncio.Future[list[LoggedFrame]] | None = None

    @property
    def state(self) -> PortState:
        """Active until it is closed; lost when the file can no longer be read."""
        return self._state

    @property
    def ended(self) -> bool:
        """Whether every frame was played."""
        return self._playing is not None and self._playing.done()

    def listen(self, sink: FrameSink) -> None:
        """Deliver frames to `sink`; the first call starts the recording."""
        self._sink = sink
        if self._playing is None:
            self._playing = asyncio.get_running_loop().create_task(self._play())

    def send(self, frames: Sequence[Frame]) -> None:
        """Raises BusReadOnly, and BusDisconnected once it is closed; ValueError for an impossible frame."""
        if self._state is not PortState.ACTIVE:
            raise BusDisconnected(
                f"{self.address} is not played any more. Connect a bus again.",
                cause="playback_stopped",
                address=self.address,
            )
        check(frames)
        self.refused += len(frames)
        raise BusReadOnly(
            f"{self.address} is a recording: nothing can be read from it or written to it, and nothing moves. "
            "Connect an adapter for that.",
            cause="address_is_recording",
            address=self.address,
        )

    async def close(self) -> None:
        """Stop playing and close the file."""
        self._state = PortState.DISCONNECTED
        self._sink = None
        if self._playing is not None:
            self._playing.cancel()
            await asyncio.gather(self._playing, return_exceptions=True)
        if self._reading is not None:
            await asyncio.wait({self._reading}, timeout=CLOSE_S)  # the file must not be closed under it
            if not self._reading.done():
                log.warning("%s is still being read, and left to itself", self.address)
                self._reading.add_done_callback(lambda _done: self._recording.close())
                return
        self._recording.close()

    async def _play(self) -> None:
        loop = asyncio.get_running_loop()
        start, origin = loop.time(), self._batch[0].frame.at
        latest = start
        try:
            while self._batch:
                burst: list[Frame] = []
                for logged in self._batch:
                    # a recording put together of two may step back: then there is no pause
                    latest = max(latest, start + (logged.frame.at - origin) / self._speed)
                    if latest - loop.time() > _TURN_S:
                        self._deliver(burst)
                        burst = []
                        await asyncio.sleep(latest - loop.time())
                    burst.append(logged.frame._replace(at=latest))
                self._deliver(burst)
                self._reading = loop.run_in_executor(OwnThread("replay"), _take, self._frames)
                self._batch = await asyncio.shield(self._reading)
            text = "The recording is over: nothing comes any more. Play it again, or connect a bus."
            self.trouble = PortError(text, cause="playback_ended", address=self.address)
        except LogFailed as error:
            self._state, self.trouble = PortState.LOST, PortError(error.detail, **{"cause": None, **error.facts})
        except Exception:
            log.exception("%s cannot be played on", self.address)
            text = f"{self.address} cannot be played on. Connect it again."
            self._state, self.trouble = PortState.LOST, PortError(text, cause="replay_failed", address=self.address)
        self._count()

    def _deliver(self, frames: list[Frame]) -> None:
        self._count()
        if not frames:
            return
        self.statistics.rx_frames += len(frames)
        self.statistics.busy_s += sum(map(frame_bits, frames)) / self.bitrate / self._speed  # the load of then
        if self._sink is not None:
            self._sink(frames)

    def _count(self) -> None:
        """What the recording holds besides frames; it is read a little ahead."""
        read, seen = self._recording.counters, self.statistics
        seen.ignored = read.ignored
        seen.error_frames = read.error_frames
        seen.errors = read.error_frames + read.unreadable


_Begun: TypeAlias = tuple[LogReader, Iterator[LoggedFrame], list[LoggedFrame]]


def _begin(path: Path, folder: Path | None, recorded: bool) -> _Begun:
    """The recording and its first frames, in a thread. Raises LogFailed."""
    try:
        if folder is not None and path.name == str(path) and not path.exists():
            path = folder / path
        # opening a pipe would wait for whoever writes to it, and a device may have no end
        odd = path.exists() and not (path.is_file() or path.is_dir())
    except OSError as error:
        raise LogFailed(
            f"{str(path)[:90]!r} is no name of a file.", cause="file_name_invalid", name=str(path)[:90]
        ) from error
    if odd:
        raise LogFailed(
            f"{path} is no file. Give one that a log was written to.", cause="file_unreadable", name=str(path)
        )
    recording = _recording(path) if recorded else LogReader.open(path)
    try:
        frames = iter(recording)
        return recording, frames, _take(frames)
    except BaseException:
        recording.close()
        raise


def _recording(path: Path) -> LogReader:
    with RecordingReader(path) as recording:
        return recording.frames()


def _close(done: "asyncio.Future[_Begun]") -> None:
    """Close what was opened too late."""
    if not done.cancelled() and done.exception() is None:
        done.result()[0].close()


def _take(frames: Iterator[LoggedFrame]) -> list[LoggedFrame]:
    """The next few, in a thread. Raises LogFailed."""
    return list(itertools.islice(frames, _BATCH))
