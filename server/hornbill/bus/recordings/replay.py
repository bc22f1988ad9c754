"""ReplayPort: replays a log or recording as a receive-only bus, with its original timing."""

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
"""Limits of `speed`. Slower, nothing seems to move; faster, the event loop is saturated."""

OPEN_S: Final = 8.0
"""Timeout for reading the first frame, and CLOSE_S for completing a read. Then the file is abandoned."""
CLOSE_S: Final = 3.0

_BATCH: Final = 512
_TURN_S: Final = 0.001  # the resolution of event loop timers
_SPEED: Final = "?speed="


def parse(address: str) -> tuple[Path, float]:
    """Path and speed factor of `file:PATH[?speed=S]` or `recording:PATH[?speed=S]`. S is 0.01 to 1000.

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
            f"{factor!r} is not a valid speed. Enter {SLOWEST:g} to {FASTEST:g}.",
            address=address,
            cause="playback_speed_invalid",
            requested=factor,
        )
    if not name.strip():
        raise PortOpenFailed(
            f"{address!r} has no file name. Enter file:PATH, for example file:can0.log.",
            address=address,
            cause="file_name_missing",
        )
    return Path(name.strip()), speed


async def open_replay(address: str, *, bitrate: int = 1_000_000, folder: Path | None = None) -> "ReplayPort":
    """Open the log `file:PATH[?speed=S]` as a port. Replay starts with the first call of `listen`.

    With `recording:PATH[?speed=S]`, the port also has the contents of the recording in `about`. A name without a folder
    is searched in the working directory, then in `folder`. `bitrate` is used only to compute the bus load. Raises
    PortOpenFailed; facts: address.
    """
    path, speed = parse(address)
    if bitrate <= 0:
        raise PortOpenFailed(
            f"{bitrate} bit/s is not a valid bit rate. The factory setting of the servos is 1000000.",
            address=address,
            cause="bit_rate_unsupported",
            bitrate=bitrate,
        )
    reading = asyncio.get_running_loop().run_in_executor(
        OwnThread("replay"), _open, path, folder, address.startswith(RECORDING_SCHEME)
    )
    try:
        async with asyncio.timeout(OPEN_S):
            recording, frames, first = await asyncio.shield(reading)
    except LogFailed as error:
        raise PortOpenFailed(
            f"{address} cannot be replayed: {error.detail}", address=address, cause="not_playable", why=error.detail
        ) from error
    except (TimeoutError, asyncio.CancelledError) as error:
        reading.add_done_callback(_close)
        if isinstance(error, asyncio.CancelledError):
            raise
        raise PortOpenFailed(
            f"{address} cannot be replayed: no frame was found within {OPEN_S:g} s. Check the file and its disk.",
            address=address,
            cause="frames_timeout",
            within_s=OPEN_S,
        ) from error
    if not first:
        recording.close()
        raise PortOpenFailed(
            f"{recording.name} contains no CAN frames with 29-bit identifiers.",
            address=address,
            cause="frames_missing",
            name=recording.name,
        )
    return ReplayPort(recording, frames, first, address=address, bitrate=bitrate, speed=speed)


class ReplayPort:
    """A CanPort that delivers the frames of a log or recording on the event loop's clock. It stays open afterwards.

    Sending is refused: otherwise a recorded response could be matched to a new request.
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
        """`first` was taken from `frames` already. Created by `open_replay`."""
        self.address = address
        self.bitrate = bitrate
        self.statistics = PortStatistics()
        self.refused = 0
        """Number of frames that were refused."""
        self.sample_point: float | None = None
        self.trouble: PortError | None = None
        self.retry_in_s: float | None = None
        self.details = PLAIN
        self.about = recording.about
        """Contents of a recording. None for a plain log."""
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
        """ACTIVE until closed, LOST if reading the file fails."""
        return self._state

    @property
    def ended(self) -> bool:
        """Whether all frames were replayed."""
        return self._playing is not None and self._playing.done()

    def listen(self, sink: FrameSink) -> None:
        """Deliver frames to `sink`. The first call starts the replay."""
        self._sink = sink
        if self._playing is None:
            self._playing = asyncio.get_running_loop().create_task(self._play())

    def send(self, frames: Sequence[Frame]) -> None:
        """Raises BusReadOnly, BusDisconnected once closed, and ValueError for an invalid frame."""
        if self._state is not PortState.ACTIVE:
            raise BusDisconnected(
                f"The replay of {self.address} has stopped. Connect a bus again.",
                cause="playback_stopped",
                address=self.address,
            )
        check(frames)
        self.refused += len(frames)
        raise BusReadOnly(
            f"{self.address} is a recording and read-only: no requests, writes or motion. Connect an adapter for that.",
            cause="address_is_recording",
            address=self.address,
        )

    async def close(self) -> None:
        """Stop the replay and close the file."""
        self._state = PortState.DISCONNECTED
        self._sink = None
        if self._playing is not None:
            self._playing.cancel()
            await asyncio.gather(self._playing, return_exceptions=True)
        if self._reading is not None:
            await asyncio.wait({self._reading}, timeout=CLOSE_S)  # the file must not be closed while being read
            if not self._reading.done():
                log.warning("%s is still being read and is abandoned", self.address)
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
                    # times of a combined log may step back: then there is no pause
                    latest = max(latest, start + (logged.frame.at - origin) / self._speed)
                    if latest - loop.time() > _TURN_S:
                        self._deliver(burst)
                        burst = []
                        await asyncio.sleep(latest - loop.time())
                    burst.append(logged.frame._replace(at=latest))
                self._deliver(burst)
                self._reading = loop.run_in_executor(OwnThread("replay"), _take, self._frames)
                self._batch = await asyncio.shield(self._reading)
            text = "The replay has ended. Replay it again, or connect a bus."
            self.trouble = PortError(text, cause="playback_ended", address=self.address)
        except LogFailed as error:
            self._state, self.trouble = PortState.LOST, PortError(error.detail, **{"cause": None, **error.facts})
        except Exception:
            log.exception("replay of %s failed", self.address)
            text = f"The replay of {self.address} failed. Connect it again."
            self._state, self.trouble = PortState.LOST, PortError(text, cause="replay_failed", address=self.address)
        self._count()

    def _deliver(self, frames: list[Frame]) -> None:
        self._count()
        if not frames:
            return
        self.statistics.rx_frames += len(frames)
        self.statistics.busy_s += sum(map(frame_bits, frames)) / self.bitrate / self._speed  # the original load
        if self._sink is not None:
            self._sink(frames)

    def _count(self) -> None:
        """Update the counters from the log, which is read slightly ahead."""
        read, seen = self._recording.counters, self.statistics
        seen.ignored = read.ignored
        seen.error_frames = read.error_frames
        seen.errors = read.error_frames + read.unreadable


_Opened: TypeAlias = tuple[LogReader, Iterator[LoggedFrame], list[LoggedFrame]]


def _open(path: Path, folder: Path | None, recorded: bool) -> _Opened:
    """Open the log and read its first frames. Runs in a thread. Raises LogFailed."""
    try:
        if folder is not None and path.name == str(path) and not path.exists():
            path = folder / path
        # opening a pipe would wait for its writer, and a device may be endless
        odd = path.exists() and not (path.is_file() or path.is_dir())
    except OSError as error:
        raise LogFailed(
            f"{str(path)[:90]!r} is not a valid file name.", cause="file_name_invalid", name=str(path)[:90]
        ) from error
    if odd:
        raise LogFailed(f"{path} is not a regular file. Use a log file.", cause="file_unreadable", name=str(path))
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


def _close(done: "asyncio.Future[_Opened]") -> None:
    """Close a log opened after the timeout."""
    if not done.cancelled() and done.exception() is None:
        done.result()[0].close()


def _take(frames: Iterator[LoggedFrame]) -> list[LoggedFrame]:
    """The next frames. Runs in a thread. Raises LogFailed."""
    return list(itertools.islice(frames, _BATCH))
