"""The files of a telemetry window: CSV and Parquet, made piece by piece so that the loop is never held up."""

import asyncio
import heapq
import importlib
import importlib.util
import math
from collections.abc import AsyncIterator, Iterable, Iterator, Mapping
from itertools import islice
from operator import itemgetter
from typing import Any

import numpy as np

from hornbill.csv_text import Formatted, csv_text
from hornbill.errors import NotAvailable
from hornbill.servo.monitoring.sample_ring import SampleColumns
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant

ROWS_A_PIECE = 500
"""Lines of CSV made in one turn of the loop: a few milliseconds."""

ROWS_A_GROUP = 65_536
"""Samples in one row group of Parquet; they are packed in another thread."""

_Sample = tuple[Instant, int, float]


async def csv(columns: Mapping[str, SampleColumns], base: TimeBase) -> AsyncIterator[bytes]:
    """One line a sample time: `t_utc`, `t_s` on the server's clock, and a cell a channel, empty where it has none."""
    yield csv_text([["t_utc", "t_s", *columns]], end="\n").encode()
    rows = _rows(columns)
    while True:
        piece = list(islice(rows, ROWS_A_PIECE))
        if not piece:
            return
        utc = np.array([base.utc(t) * 1e6 for t, _ in piece]).round().astype("datetime64[us]")
        told = np.datetime_as_string(utc, unit="us").tolist()
        lines = (
            [Formatted(f"{at}Z"), Formatted(f"{t:.6f}"), *cells] for at, (t, cells) in zip(told, piece, strict=True)
        )
        yield csv_text(lines, end="\n").encode()
        await asyncio.sleep(0)


def _rows(columns: Mapping[str, SampleColumns]) -> Iterator[tuple[Instant, list[float | None]]]:
    """Sample times in order, each with its cells."""
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
    """Raises NotAvailable where what writes Parquet is not installed."""
    if importlib.util.find_spec("pyarrow") is None:
        raise NotAvailable(
            "Parquet cannot be written: pyarrow is not installed. Install it with pip install 'hornbill[parquet]', "
            "or take telemetry.csv.",
            cause="pyarrow_missing",
        )


async def parquet(columns: Mapping[str, SampleColumns], utc_offset: float) -> AsyncIterator[bytes]:
    """Rows of `channel`, `t` (seconds on the server's clock) and `value` (null is a gap), channel by channel.

    The file's metadata has `utc_offset`: add it to `t` for seconds since 1970 UTC.
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
    """Pieces put together to at most ROWS_A_GROUP samples and one piece."""
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
    """pyarrow's writer of one table; loaded when the first file is made, for that takes half a second."""

    def __init__(self, sink: "_Pieces", utc_offset: float) -> None:
        self._arrow: Any = importlib.import_module("pyarrow")
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
        arrow = self._arrow
        places = arrow.array(np.zeros(len(times), dtype=np.int32))
        channel = arrow.DictionaryArray.from_arrays(places, arrow.array([key]))
        rows = [channel, arrow.array(times), arrow.array(values, from_pandas=True)]  # NaN becomes null
        self._writer.write_table(arrow.Table.from_arrays(rows, schema=self._schema))

    def close(self) -> None:
        """The end of the file, which says where everything is."""
        self._writer.close()


class _Pieces:
    """A file to write to, from which what was written is taken away again and again."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0
        self.closed = False

    def write(self, data: bytes) -> int:
        """Append; pyarrow's buffers are copied, for they do not outlive the call."""
        part = bytes(data)
        self._parts.append(part)
        self._size += len(part)
        return len(part)

    def tell(self) -> int:
        """Bytes written so far, taken ones included."""
        return self._size

    def flush(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        """Nothing more comes."""
        self.closed = True

    def writable(self) -> bool:
        """It is."""
        return True

    def readable(self) -> bool:
        """It is not."""
        return False

    def seekable(self) -> bool:
        """It is not."""
        return False

    def taken(self) -> bytes:
        """What was written since the last time."""
        parts, self._parts = self._parts, []
        return b"".join(parts)
