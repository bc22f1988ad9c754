"""Owns the form of a bundle: what its members say, as text and back; nothing that is read in one is trusted."""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any, Final, Literal, TypeAlias

import orjson
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from hornbill.errors import LogFailed
from hornbill.schema.catalog import Catalog
from hornbill.servo.frame_ring import Kept
from hornbill.units import Instant
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ArrayCommand, CommandType
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import ExecuteOpcodeRequest, GetSetRequest, RestartNodeRequest, ValueKind
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import decode

SAMPLES_MOST: Final = 500_000
LINES_MOST: Final = 100_000
"""What is read of a bundle at most: samples of telemetry, and lines of events or of writes."""

README: Final = (
    "This is a flight recording of hornbill, which configures and drives BLA15 and BLA21 servos over DroneCAN: what "
    "was on the bus, and what was known, around the moment that about.json names.\n"
    "Open it in hornbill's page (Recorder, Open a bundle), or with `hornbill serve --bus bundle:FILE.zip`; no adapter "
    "is needed, and nothing can be sent.\n"
    "frames.log is in the form of `candump -l`; telemetry.csv, events.jsonl and writes.csv count time in seconds since "
    "1970 UTC, as it does.\n"
)  # fmt: skip
TELEMETRY_HEAD: Final = "time,uid,channel,value\n"
WRITES_HEAD: Final = "time,node_id,uid,kind,key,name,raw,value\n"

Reason: TypeAlias = Literal["failure", "stop", "lost", "bus_lost", "by_hand"]
Word: TypeAlias = Annotated[str, Field(max_length=120)]
Sentence: TypeAlias = Annotated[str, Field(max_length=2000)]
Uid32: TypeAlias = Annotated[str, Field(pattern="^[0-9a-f]{32}$")]
Int64: TypeAlias = Annotated[int, Field(ge=-(2**63), lt=2**63)]


class _Form(BaseModel):
    """A field that a newer hornbill writes is passed over; NaN and the infinite are refused."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class Mark(_Form):
    """A moment for which the bundle was written; `at` in seconds since 1970 UTC."""

    at: float
    reason: Reason
    text: Sentence
    uid: Uid32 | None = None


class BundleBus(_Form):
    """The bus that was connected: address as `PUT /bus` takes it, bit/s, our own node id."""

    address: Annotated[str, Field(max_length=1000)]
    bitrate: Annotated[int, Field(gt=0, le=10_000_000)]
    node_id: Annotated[int, Field(ge=1, le=127)]


class BundleReading(_Form):
    """One register as last read before the first mark; `at` in seconds since 1970 UTC."""

    raw: Int64
    value: bool | int | float | Word | None
    unit: Word
    at: float | None


class BundleServo(_Form):
    """One servo as it was known at the first mark."""

    uid: Uid32
    node_id: Annotated[int, Field(ge=1, le=127)] | None
    name: Word
    label: Word
    title: Word
    model_number: Int64 | None
    hardware_version: Int64 | None
    firmware: Int64 | None
    serial_number: Int64 | None
    production_date: Word | None
    state: Word
    readings: Annotated[dict[Word, BundleReading], Field(max_length=200)]
    rom: Annotated[dict[Word, Int64], Field(max_length=200)] = {}


class About(_Form):
    """What a bundle is of. Times in seconds since 1970 UTC; `utc_offset` turns the writer's own clock into them."""

    format: Literal[1]
    version: Word
    reason: Reason
    text: Sentence
    marks: Annotated[list[Mark], Field(min_length=1, max_length=1000)]
    started_at: float
    ended_at: float
    utc_offset: float
    bus: BundleBus | None
    servos: Annotated[list[BundleServo], Field(max_length=500)]
    schema_revision: Word
    frames: Annotated[int, Field(ge=0)]
    incomplete: Annotated[list[Word], Field(max_length=10)] = []
    """Members that were cut because they would have become too large."""


class Columns(BaseModel):
    """The samples of one channel: `t` in seconds since 1970 UTC, `v` in its unit, null for a gap."""

    uid: str
    channel: str
    t: list[float]
    v: list[float | None]


def read_about(data: bytes, name: str) -> About:
    """What about.json of the bundle `name` says. Raises LogFailed."""
    try:
        return About.model_validate(orjson.loads(data))
    except (orjson.JSONDecodeError, RecursionError) as error:
        raise LogFailed(f"{name} is no bundle of hornbill: its about.json is no JSON.") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "about.json"
        raise LogFailed(f"{name} is no bundle that this hornbill can read: {where[:120]}: {first['msg']}.") from error


def candump(frames: Iterable[Kept], utc_offset: float) -> bytes:
    """Frames as lines of `candump -l`, the last word T for those we sent."""
    lines = [
        f"({at + utc_offset:.6f}) {channel} {number:08X}#{data.hex().upper()} {'T' if sent else 'R'}\n"
        for at, number, data, sent, channel in frames
    ]
    return "".join(lines).encode()


def samples(uid: str, channel: str, times: Sequence[Instant], values: Sequence[float | None], offset: float) -> bytes:
    """Lines of telemetry.csv; a gap has no value."""
    lines = [
        f"{at + offset:.6f},{uid},{channel},{'' if value is None else repr(value)}\n"
        for at, value in zip(times, values, strict=True)
    ]
    return "".join(lines).encode()


class Writes:
    """Finds in the frames of ours what could change a servo: writes, commands, opcodes, restarts (table 2-3)."""

    _TYPES: Final = frozenset((GetSetRequest.TYPE.id, ExecuteOpcodeRequest.TYPE.id, RestartNodeRequest.TYPE.id))

    def __init__(self, catalog: Catalog, uid_of: dict[int, str], utc_offset: float) -> None:
        """`uid_of` says who was on which node id."""
        self._rows = {row.name: row for row in catalog.parameters.values()}
        self._uid_of = uid_of
        self._offset = utc_offset
        self._reassembler = Reassembler()

    def lines(self, frames: Iterable[Kept]) -> bytes:
        """Lines of writes.csv for these frames, which follow those of the call before."""
        ours = [Frame(number, data, at) for at, number, data, sent, _ in frames if sent and self._may_write(number)]
        if not ours:
            return b""
        out = io.StringIO()
        write = csv.writer(out, lineterminator="\n").writerow
        for transfer in self._reassembler.feed(ours):
            for row in self._rows_of(transfer):
                write((f"{transfer.at + self._offset:.6f}", transfer.destination or "", *row))
        return out.getvalue().encode()

    def _may_write(self, number: int) -> bool:
        if number & 0x80:
            return bool(number & 0x8000) and (number >> 16 & 0xFF) in self._TYPES
        return (number >> 8 & 0xFFFF) == ArrayCommand.TYPE.id

    def _rows_of(self, transfer: Transfer) -> Iterator[tuple[object, ...]]:
        """Uid, kind, key, name, raw, value."""
        uid = self._uid_of.get(transfer.destination, "")
        match decode(transfer):
            case GetSetRequest(_, value, name) if value.kind is not ValueKind.EMPTY:
                row = self._rows.get(name.upper().replace("0X", "0x"))
                raw = value.value
                shown = raw / row.per_unit if row is not None and row.kind == "number" and isinstance(raw, int) else raw
                yield uid, "parameter", "" if row is None else row.key, name[:16], raw, shown
            case ExecuteOpcodeRequest(opcode, argument):
                yield uid, "opcode", "", int(opcode), argument, ""
            case RestartNodeRequest():
                yield uid, "restart", "", "", "", ""
            case ArrayCommand(commands):
                for one in commands:
                    kind = one.command_type
                    what = CommandType(kind).name.lower() if kind in CommandType else f"type {int(kind)}"
                    yield "", "array_command", what, f"actuator {one.actuator_id}", "", f"{one.command_value:.6g}"
            case _:
                return


def columns(data: bytes) -> tuple[list[Columns], bool]:
    """Telemetry by servo and channel, in the order of first sight, and whether that is all of it. Never raises."""
    found: dict[tuple[str, str], Columns] = {}
    for place, row in enumerate(_rows(data)):
        if place >= SAMPLES_MOST:
            return list(found.values()), False
        if len(row) != 4 or (at := _number(row[0])) is None:
            continue
        uid, channel = row[1][:32], row[2][:120]
        column = found.get((uid, channel))
        if column is None:
            column = found[uid, channel] = Columns(uid=uid, channel=channel, t=[], v=[])
        column.t.append(at)
        column.v.append(_number(row[3]))
    return list(found.values()), True


def writes(data: bytes) -> list[dict[str, str]]:
    """The lines of writes.csv by the names of its head. Never raises."""
    head = WRITES_HEAD.strip().split(",")
    rows = (row for place, row in enumerate(_rows(data)) if place < LINES_MOST)
    return [dict(zip(head, row, strict=True)) for row in rows if len(row) == len(head)]


def events(data: bytes) -> list[dict[str, Any]]:
    """The lines of events.jsonl that are JSON objects. Never raises."""
    found: list[dict[str, Any]] = []
    for line in data.split(b"\n", LINES_MOST)[:LINES_MOST]:
        try:
            one = orjson.loads(line) if line else None
        except (orjson.JSONDecodeError, RecursionError):
            continue
        if isinstance(one, dict):
            found.append(one)  # pyright: ignore[reportUnknownArgumentType] - JSON objects have text for keys
    return found


def _rows(data: bytes) -> Iterator[list[str]]:
    """The lines below the head; where the form breaks, it ends."""
    reader = csv.reader(io.StringIO(data.decode("utf-8", "replace")))
    try:
        next(reader, None)
        yield from reader
    except csv.Error:
        return


def _number(text: str) -> float | None:
    try:
        found = float(text)
    except ValueError:
        return None
    return found if math.isfinite(found) else None
