"""`hornbill decode`: the transfers of a recording or of a live pipe, as JSON lines or as lines for people."""

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
"""Buses in one recording that are told apart; `candump any` mixes them."""

_DATES_FROM: Final = 1e8  # times below count from the start of the recording


def decode_log(log: str, as_json: bool, standard_input: BinaryIO, out: BinaryIO, tell: Callable[[str], None]) -> None:
    """Decode the file `log`, or for "-" what `standard_input` brings, line by line, to `out`; counts go to `tell`.

    Ends when nothing more comes, nobody reads on, or it is interrupted. Raises LogFailed when it cannot be read.
    """
    live = log == STANDARD_INPUT
    if live:
        # as it is: another buffer around it would wait until it is full
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
        # nobody reads on: what is still in `out` must not be tried again when the process ends
        os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())
    except KeyboardInterrupt:
        pass  # how one ends a live pipe
    finally:
        recording.close()
        for line in decoding.counts():
            tell(line)


class Decoding:
    """Takes a recording apart, one frame after the other; nothing but half-received transfers is kept."""

    def __init__(self, recording: LogReader) -> None:
        self._recording = recording
        self._reassemblers: dict[str, Reassembler] = {}
        self._text = TransferText(Catalog.load())
        self._transfers = 0
        self._misfits = 0

    def json_lines(self) -> Iterator[str]:
        """One JSON object a transfer, in the form of the conformance vectors. Raises LogFailed."""
        for transfer, structure, _ in self._walk():
            yield orjson.dumps(as_object(transfer, structure, transfer.at)).decode()

    def text_lines(self) -> Iterator[str]:
        """One line a transfer: time in UTC, who to whom, what, identifier, frames. Raises LogFailed."""
        for transfer, structure, can_id in self._walk():
            told = self._text.describe(transfer, structure, self._text.follow(transfer))
            ends = f"{transfer.source or '–'} → {transfer.destination or 'all'}"
            frames = frame_count(transfer)
            size = f"{len(transfer.payload)} bytes" if frames == 1 else f"{frames} frames"
            yield f"{_time(transfer.at)}  {ends:<10} {told:<64} {can_id:08X}  {size}"

    def counts(self) -> list[str]:
        """What was read and what was not, a line each; reasons that did not occur are left out."""
        read = self._recording.counters
        lines = [f"{read.frames} frames, {self._transfers} transfers"]
        for reason, words in PROBLEMS.items():
            dropped = sum(getattr(one.counters, reason) for one in self._reassemblers.values())
            if dropped:
                lines.append(f"{reason}: {dropped} ({words})")
        open_ones = sum(one.sessions for one in self._reassemblers.values())
        for name, count, words in (
            ("unfinished", open_ones, "transfers under way when the recording ended"),
            ("bad_payload", self._misfits, "transfers whose payload does not fit their type"),
            ("unreadable", read.unreadable, "lines that are no frame"),
            ("ignored", read.ignored, "standard, remote and FD frames"),
            ("error_frames", read.error_frames, "errors seen on the bus"),
        ):
            if count:
                lines.append(f"{name}: {count} ({words})")
        return lines

    def _walk(self) -> Iterator[tuple[Transfer, AnyStructure | None, int]]:
        """Every transfer, services between any two nodes among them; what it carries; the identifier of its frames."""
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
    """Time of day with the microseconds that part frames, or seconds since the recording began."""
    if at < _DATES_FROM:
        return f"{at:15.6f}"
    return f"{datetime.fromtimestamp(at, UTC):%H:%M:%S.%f}"
