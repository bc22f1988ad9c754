"""`hornbill decode`: transfers of a log or a live pipe, as JSON lines or text."""

import io
import os
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO, Final, cast

import orjson

from hornbill.bus.recordings.reader import LogReader
from hornbill.schema.catalog import Catalog
from hornbill.servo.monitoring.transfer_text import TransferText
from hornbill.wire.describe import PROBLEMS, as_object, frame_count, type_name
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import AnyStructure, decode

STANDARD_INPUT: Final = "-"

CHANNELS_MOST: Final = 64
"""Maximum number of buses distinguished in one log; `candump any` mixes them."""

_DATES_FROM: Final = 1e8  # smaller times are relative to the start of the log


def decode_log(log: str, as_json: bool, standard_input: BinaryIO, out: BinaryIO, report: Callable[[str], None]) -> None:
    """Decode the file `log`, or `standard_input` for "-", line by line, to `out`; counts go to `report`.

    Ends at the end of input, when the output is closed, or when interrupted. Raises LogFailed if it cannot be read.
    """
    live = log == STANDARD_INPUT
    if live:
        # unbuffered: another buffer would delay lines
        recording = LogReader(cast(io.BufferedReader, standard_input), "standard input")
    else:
        recording = LogReader.open(Path(log))
    decoding = Decoding(recording)
    try:
        for line in decoding.json_lines() if as_json else decoding.text_lines():
            out.write(line.encode() + b"\n")
            if live:
                out.flush()
        out.flush()
    except BrokenPipeError:
        # the reader closed the pipe: do not flush `out` again at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())
    except KeyboardInterrupt:
        pass  # ends a live pipe
    finally:
        recording.close()
        for line in decoding.counts():
            report(line)


class Decoding:
    """Decodes a log frame by frame. Only incomplete transfers are kept in memory."""

    def __init__(self, recording: LogReader) -> None:
        self._recording = recording
        self._reassemblers: dict[str, Reassembler] = {}
        self._text = TransferText(Catalog.load())
        self._transfers = 0
        self._misfits = 0

    def json_lines(self) -> Iterator[str]:
        """One JSON object per transfer, in the format of the conformance vectors. Raises LogFailed."""
        for transfer, structure, _ in self._walk():
            yield orjson.dumps(as_object(transfer, structure, transfer.at)).decode()

    def text_lines(self) -> Iterator[str]:
        """One line per transfer: time in UTC, source, destination, content, identifier, frames. Raises LogFailed."""
        for transfer, structure, can_id in self._walk():
            text = self._text.describe(transfer, structure, self._text.follow(transfer))
            ends = f"{transfer.source or '–'} → {transfer.destination or 'all'}"
            frames = frame_count(transfer)
            size = f"{len(transfer.payload)} bytes" if frames == 1 else f"{frames} frames"
            yield f"{_time(transfer.at)}  {ends:<10} {text:<64} {can_id:08X}  {size}"

    def counts(self) -> list[str]:
        """Counts of frames, transfers and problems, one line each; zero counts of problems are omitted."""
        read = self._recording.counters
        lines = [f"{read.frames} frames, {self._transfers} transfers"]
        for reason, meaning in PROBLEMS.items():
            dropped = sum(getattr(one.counters, reason) for one in self._reassemblers.values())
            if dropped:
                lines.append(f"{reason}: {dropped} ({meaning})")
        unfinished = sum(one.sessions for one in self._reassemblers.values())
        for name, count, meaning in (
            ("unfinished", unfinished, "transfers incomplete at the end of the log"),
            ("bad_payload", self._misfits, "transfers whose payload does not match their type"),
            ("unreadable", read.unreadable, "lines that are not frames"),
            ("ignored", read.ignored, "standard, remote and CAN FD frames"),
            ("error_frames", read.error_frames, "error frames on the bus"),
        ):
            if count:
                lines.append(f"{name}: {count} ({meaning})")
        return lines

    def _walk(self) -> Iterator[tuple[Transfer, AnyStructure | None, int]]:
        """Every transfer, including services between other nodes, with its content and the identifier of its frames."""
        for frame, channel, _ in self._recording:
            reassembler = self._reassemblers.get(channel) or self._begin(channel)
            for transfer in reassembler.feed((frame,)):
                structure = decode(transfer)
                self._transfers += 1
                self._misfits += structure is None and type_name(transfer) is not None
                yield transfer, structure, frame.id

    def _begin(self, channel: str) -> Reassembler:
        if len(self._reassemblers) >= CHANNELS_MOST:
            channel = next(iter(self._reassemblers))
        return self._reassemblers.setdefault(channel, Reassembler())


def _time(at: float) -> str:
    """Time of day with microseconds, or seconds since the start of the log."""
    if at < _DATES_FROM:
        return f"{at:15.6f}"
    return f"{datetime.fromtimestamp(at, UTC):%H:%M:%S.%f}"
