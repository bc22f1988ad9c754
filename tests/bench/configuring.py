"""Applying a profile with snapshot and read-back: bus time on the virtual clock, and the host's CPU alone."""

import asyncio
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import jumping_clock as clock
from behaviour.rig import CATALOG, Rig, play
from bench.crowd import ALL_ROWS, FIRMWARE, HOST, Crowd, CrowdPort
from bench.line import line
from bench.reading import STREAM_SHARE, compared, ready, requests_alone, with_host
from hornbill.schema.scale import to_value, unit_of
from hornbill.servo.device.output import KEY as TORQUE
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.servo.profiles.profiles import Draft
from hornbill.servo.runs.apply import ApplyOptions
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Raw
from hornbill.wire.bittime import frame_bits
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, ValueKind, integer
from hornbill.wire.transfer import END, START, Transfer, split

GET_SET = GetSetRequest.TYPE
IS_REQUEST, SERVICE, TYPE_AND_SERVICE = 1 << 15, 1 << 7, 0xFF_0080
"""Bits of an identifier (DroneCAN's CAN bus transport layer)."""

IS_GET_SET = GET_SET.id << 16 | SERVICE

MANY = 16
ROUNDS = 3
HALF_TURN = 1800
"""180° in steps of the registers of angles, 0.1°."""
TORQUE_OFF = {TORQUE: 1}
"""As delivered, but with torque off: a direction is not reversed under torque."""

ROWS = [
    row
    for row in CATALOG.models[ALL_ROWS].rows().values()
    if row.writable and row.rom and not row.identity and row.key != TORQUE
]
"""The 30 rows of a model with PWM input that a profile taken from a servo has."""


def figures() -> Iterator[dict[str, Any]]:
    """Thirty rows to one servo and to sixteen at once, each row changed, while they stream."""
    yield bus_time(1, must=1.3, aim=1.1)
    yield bus_time(MANY, must=1.3, aim=1.1)
    yield cpu_time(must=3.5)


def bus_time(count: int, *, must: float, aim: float) -> dict[str, Any]:
    """Simulated servos that respond immediately, on the embedded bus; the limit is the bits of the frames.

    Those are: every row read once before (it is what a roll-back and the snapshot need), written once, and read back
    once, with the responses, as they were on the bus in this run.
    """

    async def scene(rig: Rig) -> dict[str, Any]:
        servos = await rig.ready(count)
        rig.bus.history.clear()
        took = await _apply(rig.host, servos, _other(0))
        exchanges = list(_exchanges([frame for _, frame in rig.bus.history]))
        limit = _needed_bits(exchanges, count) / rig.bus.bitrate / (1 - count * STREAM_SHARE)
        figures = {
            "rows": len(ROWS), "requests_each": round(len(exchanges) / count, 1), "bus_s": round(took, 4),
            "limit_s": round(limit, 4), "ratio": round(took / limit, 3),
        }  # fmt: skip
        return line(
            f"apply a profile to {count}, with snapshot and read-back: bus time",
            figures,
            must=must,
            aim=aim,
            limit="the bits of the frames",
        )

    return play(
        scene, *(Recipe(ALL_ROWS, FIRMWARE, servo_id=n, node_id=n, rom=TORQUE_OFF) for n in range(1, count + 1))
    )


def cpu_time(*, must: float) -> dict[str, Any]:
    """The host with prepared responses, with the job, the snapshots and the audit in a database in memory.

    Compared with as many requests alone: a read, a write and a read back of each row. Both include the prepared bus.
    """

    async def scene(host: Host) -> dict[str, Any]:
        servos = await ready(host, MANY)
        pairs: list[tuple[float, float]] = []
        for number in range(2):  # what is made at the first use is not what is measured
            await _apply(host, servos, _other(number))
        for number in range(ROUNDS):
            began = time.process_time()
            await _apply(host, servos, _other(number))
            between = time.process_time()
            await requests_alone(host, servos, times=3, rows=[row.key for row in ROWS])
            pairs.append((between - began, time.process_time() - between))
        figures = {"rows": len(ROWS), **compared(pairs)}
        return line(
            f"apply a profile to {MANY}: CPU of the host, of that of its requests",
            figures,
            must=must,
            limit="its requests alone",
        )

    crowd = WritableCrowd(MANY)
    return clock.run(with_host(scene, lambda: CrowdPort(crowd)))


class WritableCrowd(Crowd):
    """A crowd that stores written values. Its responses are created once per value."""

    def __init__(self, count: int) -> None:
        super().__init__(CATALOG, count, rom=TORQUE_OFF)
        self._held: dict[tuple[int, str], Raw] = {}
        self._parts: dict[int, list[bytes]] = {}
        self._requests: dict[bytes, tuple[str, Raw | None]] = {}
        self._said: dict[tuple[int, str, Raw], list[Frame]] = {}

    def respond(self, request: Frame) -> list[Frame]:
        """As any crowd, but with written values."""
        if request.id & TYPE_AND_SERVICE != IS_GET_SET:
            return super().respond(request)
        node = request.id >> 8 & 0x7F
        parts = self._parts.setdefault(node, [])
        if request.data[-1] & START:
            parts.clear()
        parts.append(request.data[:-1])
        if not request.data[-1] & END:
            return []
        name, raw = self._decoded(b"".join(parts), whole=len(parts) == 1)
        if raw is not None:
            self._held[node, name] = raw
        elif (node, name) not in self._held:
            return super().respond(request)
        number, priority = request.data[-1] & 31, request.id & 0x1F00_0000
        return [
            Frame(one.id | priority, one.data[:-1] + bytes((one.data[-1] | number,)))
            for one in self._frames(node, name, self._held[node, name])
        ]

    def _decoded(self, stream: bytes, *, whole: bool) -> tuple[str, Raw | None]:
        if stream not in self._requests:
            request_ = GetSetRequest.decode(stream if whole else stream[2:])  # several frames begin with a CRC
            assert request_ is not None
            value = request_.value.value
            self._requests[stream] = request_.name, None if value is None else int(value)
        return self._requests[stream]

    def _frames(self, node: int, name: str, raw: Raw) -> list[Frame]:
        key = node, name, raw
        if key not in self._said:
            (read,) = split(
                Transfer(Kind.REQUEST, 11, HOST, node, 0, 0, GetSetRequest(0, EMPTY, name).encode()), GET_SET
            )
            (canned,) = Reassembler(HOST).feed(super().respond(read))
            before = GetSetResponse.decode(canned.payload)
            assert before is not None
            payload = replace(before, value=integer(raw)).encode()
            self._said[key] = split(Transfer(Kind.RESPONSE, 11, node, HOST, 0, 0, payload), GET_SET)
        return self._said[key]


def _other(turn: int) -> dict[str, Raw]:
    """A value for every row that differs from the default, and between odd and even turns."""
    found: dict[str, Raw] = {}
    for row in ROWS:
        assert row.default is not None
        assert row.minimum is not None
        assert row.maximum is not None
        legal = [row.default + away for away in (-1, 1, -2, 2) if row.minimum <= row.default + away <= row.maximum]
        if row.unit == "°":
            legal = [raw for raw in legal if abs(raw) <= HALF_TURN]  # beyond it a change has to be confirmed
        # a row of two values is back at its default on every odd turn
        found[row.key] = (legal if len(legal) > 1 else [*legal, row.default])[turn % 2]
    return found


async def _apply(host: Host, servos: Sequence[Servo], raws: Mapping[str, Raw]) -> float:
    """Seconds on the loop's clock for one job over all servos; every row must have been written on every one."""
    values = {row.key: to_value(row, raws[row.key], raws) for row in ROWS}
    units = {row.key: unit for row in ROWS if row.kind == "number" and (unit := unit_of(row, raws)[0])}
    await host.profiles.put("bench", Draft(values, model=ALL_ROWS, firmware=FIRMWARE, units=units), by="bench")
    loop = asyncio.get_running_loop()
    began = loop.time()
    options = ApplyOptions(on_anomaly="continue", confirm=("supply", "temperature"))
    job = await host.jobs.wait(host.profile_jobs.start("bench", [servo.uid for servo in servos], None, options))
    took = loop.time() - began
    assert job.state == "succeeded", job.error
    assert all(servo.raw(key) == raw for servo in servos for key, raw in raws.items())
    evidence = {step.evidence for step in job.steps if step.name.startswith("write")}
    assert evidence == {f"{len(ROWS)} rows written and read back, 0 unchanged"}, evidence
    return took


def _exchanges(frames: Sequence[Frame]) -> Iterator[tuple[tuple[int, str, bool], int]]:
    """(node, name of the row, whether it is a write) and bits of every GetSet request of the host with its response."""
    going: dict[int, list[Frame]] = {}
    ended: list[list[Frame]] = []
    for frame in frames:
        if frame.id & TYPE_AND_SERVICE != IS_GET_SET:
            continue
        request_ = bool(frame.id & IS_REQUEST)
        node = frame.id >> 8 & 0x7F if request_ else frame.id & 0x7F
        if request_ and frame.data[-1] & START:
            ended.append(going.get(node, []))
            going[node] = []
        going.setdefault(node, []).append(frame)
    for one in (*ended, *going.values()):
        transfers = Reassembler().feed(one)
        if len(transfers) < 2:
            continue
        request = GetSetRequest.decode(transfers[0].payload)
        assert request is not None
        key = transfers[0].destination, request.name, request.value.kind is not ValueKind.EMPTY
        yield key, sum(frame_bits(frame) for frame in one)


def _needed_bits(exchanges: Sequence[tuple[tuple[int, str, bool], int]], count: int) -> int:
    bits: dict[tuple[int, str, bool], list[int]] = {}
    for key, size in exchanges:
        bits.setdefault(key, []).append(size)
    return sum(
        bits[node, row.name, False][0] + bits[node, row.name, True][0] + bits[node, row.name, False][-1]
        for node in range(1, count + 1)
        for row in ROWS
    )
