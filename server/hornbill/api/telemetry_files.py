"""Telemetry as CSV and Parquet files, generated in pieces so that the event loop is not blocked."""

import asyncio
import heapq
import importlib
import importlib.util
import math
from collections.abc import AsyncIterator, Iterable, Iterator, Mapping
from datetime import UTC, datetime, timedelta
from itertools import islice
from operator import itemgetter
from typing import Any, Final

from hornbill.csv_text import Formatted, csv_text
from hornbill.errors import NotAvailable
from hornbill.servo.monitoring.sample_ring import SampleColumns
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant

ROWS_A_PIECE = 500
"""CSV lines generated per iteration of the event loop: a few milliseconds."""

ROWS_A_GROUP = 65_536
"""Samples per Parquet row group; compressed in a thread."""

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC).replace(tzinfo=None)

_Sample = tuple[Instant, int, float]


async def csv(columns: Mapping[str, SampleColumns], base: TimeBase) -> AsyncIterator[bytes]:
    """One line per sample time: `t_utc`, `t_s` on the server's clock, and one cell per channel, empty if no sample."""
    yield csv_text([["t_utc", "t_s", *columns]], end="\n").encode()
    rows = _rows(columns)
    while True:
        piece = list(islice(rows, ROWS_A_PIECE))
        if not piece:
            return
        lines = ([Formatted(_instant(base.utc(t))), Formatted(f"{t:.6f}"), *cells] for t, cells in piece)
        yield csv_text(lines, end="\n").encode()
        await asyncio.sleep(0)


def _instant(utc: float) -> str:
    return (_EPOCH + timedelta(microseconds=round(utc * 1e6))).isoformat(timespec="microseconds") + "Z"


def _rows(columns: Mapping[str, SampleColumns]) -> Iterator[tuple[Instant, list[float | None]]]:
    """Sample times in ascending order, each with its cells."""
    empty: list[float | None] = [None] * len(columns)
    at, cells = -math.inf, list(empty)
    for t, place, value in heapq.merge(*_samples(columns), key=itemgetter(0)):
        if t != at:
            if at > -math.inf:
                yield at, cells
            at, cells = t, list(empty)
        if value == value:
            cells[place] = value
    if at > -math.inf:
        yield at, cells


def _samples(columns: Mapping[str, SampleColumns]) -> list[Iterable[_Sample]]:
    def of(place: int, one: SampleColumns) -> Iterator[_Sample]:
        for times, values in one.pieces:
            for t, value in zip(times.tolist(), values.tolist(), strict=True):
                yield t, place, value

    return [of(place, one) for place, one in enumerate(columns.values())]


def need_parquet() -> None:
    """Raises NotAvailable if pyarrow is not installed."""
    if importlib.util.find_spec("pyarrow") is None:
        raise NotAvailable(
            "Parquet export requires pyarrow, which is not installed. Install it with "
            "pip install 'hornbill[parquet]', or use telemetry.csv.",
            cause="pyarrow_missing",
        )


async def parquet(columns: Mapping[str, SampleColumns], utc_offset: float) -> AsyncIterator[bytes]:
    """Rows of `channel`, `t` (seconds on the server's clock) and `value` (null is a gap), sorted by channel.

    The file's metadata contains `utc_offset`: add it to `t` for seconds since 1970 UTC.
    """
    sink = _Pieces()
    writer = await asyncio.to_thread(_Writer, sink, utc_offset)
    for key, one in columns.items():
        for times, values in _groups(one):
            await asyncio.to_thread(writer.write, key, times, values)
            yield sink.taken()
    await asyncio.to_thread(writer.close)
    yield sink.taken()


def _groups(one: SampleColumns) -> Iterator[tuple[Any, Any]]:
    """Pieces joined into groups of about ROWS_A_GROUP samples."""
    waiting, rows = list[tuple[Any, Any]](), 0
    for piece in one.pieces:
        waiting.append(piece)
        rows += len(piece[0])
        if rows >= ROWS_A_GROUP:
            yield SampleColumns(tuple(waiting)).joined()
            waiting, rows = [], 0
    if waiting:
        yield SampleColumns(tuple(waiting)).joined()


class _Writer:
    """pyarrow's Parquet writer. Imported for the first file only, because the import takes half a second."""

    def __init__(self, sink: "_Pieces", utc_offset: float) -> None:
        self._arrow: Any = importlib.import_module("pyarrow")
        self._numpy: Any = importlib.import_module("numpy")
        made: Any = importlib.import_module("pyarrow.parquet")
        arrow = self._arrow
        self._schema = arrow.schema(
            [("channel", arrow.dictionary(arrow.int32(), arrow.string())), ("t", arrow.float64()),
             ("value", arrow.float64())],
            metadata={"utc_offset": repr(utc_offset)},
        )  # fmt: skip
        self._writer = made.ParquetWriter(sink, self._schema, compression="zstd")

    def write(self, key: str, times: Any, values: Any) -> None:
        """One row group."""
        arrow, numpy = self._arrow, self._numpy
        places = arrow.array(numpy.zeros(len(times), dtype=numpy.int32))
        channel = arrow.DictionaryArray.from_arrays(places, arrow.array([key]))
        rows = [
            channel,
            arrow.array(numpy.frombuffer(times)),
            arrow.array(numpy.frombuffer(values), from_pandas=True),
        ]  # NaN becomes null
        self._writer.write_table(arrow.Table.from_arrays(rows, schema=self._schema))

    def close(self) -> None:
        """Write the footer of the file."""
        self._writer.close()


class _Pieces:
    """Writable file object whose content is taken piece by piece."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0
        self.closed = False

    def write(self, data: bytes) -> int:
        """Append a copy: buffers of pyarrow are valid only during the call."""
        part = bytes(data)
        self._parts.append(part)
        self._size += len(part)
        return len(part)

    def tell(self) -> int:
        """Position: bytes written so far, including those already taken."""
        return self._size

    def flush(self) -> None:
        """Nothing to do: data is not buffered."""

    def close(self) -> None:
        """Mark the file as closed."""
        self.closed = True

    def writable(self) -> bool:
        """True."""
        return True

    def readable(self) -> bool:
        """False."""
        return False

    def seekable(self) -> bool:
        """False."""
        return False

    def taken(self) -> bytes:
        """Data written since the last call."""
        parts, self._parts = self._parts, []
        return b"".join(parts)
