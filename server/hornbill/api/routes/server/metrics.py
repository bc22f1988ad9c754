"""GET /metrics: metrics in the Prometheus text format. `TABLE` lists them."""

import asyncio
import platform
from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from fastapi import Request, Response

from hornbill import __version__
from hornbill.api.dependencies import TheHost
from hornbill.api.live.event_log import EventLog
from hornbill.api.meter import Measures
from hornbill.api.routes.server.health import STATES, parts_of
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.node.role import ConnectionRole
from hornbill.schema.fault import LEVELS, OVERVIEW, REGISTERS
from hornbill.servo.device.reading import is_stale
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.host import Host
from hornbill.servo.runtime.histogram import Histogram
from hornbill.wire.port import NO_PORT, PortState

if TYPE_CHECKING:
    from prometheus_client.core import Metric  # imported late, because many servers are never scraped

routes = Routes("server", prefix="")

MEDIA_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"
ANGLE_FRESH_S: Final = 0.5
"""Maximum age of an exported angle: five broadcasts (table 2-2). Its age is always exported."""

Kind = Literal["gauge", "counter", "histogram"]
_WHO: Final = ("uid", "label")


class Shown(NamedTuple):
    """One metric; samples of counters are named `name`_total."""

    name: str
    kind: Kind
    help: str
    labels: tuple[str, ...] = ()


_ROWS: Final[tuple[tuple[str, Kind, str, tuple[str, ...]], ...]] = (
    ("build_info", "gauge", "Always 1; the version is in the labels.", ("version", "python")),
    ("uptime_seconds", "gauge", "Time since the server started.", ()),
    ("part_state", "gauge", "1 for the current state of each part of the server, 0 for the others.", ("part", "state")),
    ("store_failures", "counter", "Failed writes to the database.", ()),
    ("store_pending_writes", "gauge", "Changes that are not yet in the database.", ()),
    ("store_lost_changes", "counter", "Changes given up: the database rejected them, or too many waited.", ()),
    ("store_failing_seconds", "gauge", "Time since writes to the database began to fail. 0 while they succeed.", ()),
    ("disk_free_bytes", "gauge", "Free space on the disk of the data folder. Absent if unknown.", ()),
    ("disk_total_bytes", "gauge", "Size of the disk of the data folder. Absent if unknown.", ()),
    ("loop_lag_seconds", "histogram", "Lag of the event loop, measured 40 times a second.", ()),
    ("loop_lag_recent_seconds", "gauge", "Longest lag of at least 0.05 s in the last 10 s, otherwise 0.", ()),
    ("http_request_seconds", "histogram",
     "Duration of requests to the end of the response. 499: the client disconnected.", ("method", "route", "status")),
    ("http_requests_in_progress", "gauge", "Requests in progress.", ()),
    ("sockets_open", "gauge", "Open WebSockets.", ("route",)),
    ("telemetry_dropped_samples", "counter", "Samples dropped because a socket was too slow.", ()),
    ("events", "counter", "Entries of the event log.", ("level", "code")),
    ("jobs", "counter", "Ended jobs: succeeded, failed or cancelled.", ("kind", "outcome")),
    ("jobs_in_progress", "gauge", "Queued and running jobs.", ("kind",)),
    ("bus_state", "gauge", "1 for the current state of the bus, 0 for the others.", ("state",)),
    ("bus_role", "gauge", "1 for the connection role, 0 for the others. Absent without a bus.", ("role",)),
    ("bus_load_ratio", "gauge", "Bus load over the last second, 0 to 1.", ()),
    ("bus_frames", "counter", "Frames since the adapter was connected, rx or tx.", ("direction",)),
    ("bus_dropped_frames", "counter", "RX overruns: received frames that were dropped.", ()),
    ("bus_ignored_frames", "counter", "Standard, remote and CAN FD frames.", ()),
    ("bus_errors", "counter", "Error frames, and own frames that could not be sent.", ()),
    ("bus_error_frames", "counter", "Error frames on the bus. Few adapters report them.", ()),
    ("bus_unacknowledged", "counter", "Transmissions without acknowledgement. Few adapters report them.", ()),
    ("bus_offs", "counter", "Number of times the adapter went bus-off.", ()),
    ("bus_reopened", "counter", "Number of automatic reconnects of the adapter.", ()),
    ("bus_bad_frames", "counter", "Frames that belong to no complete transfer.", ("reason",)),
    ("bus_request_seconds", "histogram",
     "Duration of requests to servos, including queueing and retries.", ("kind",)),
    ("bus_requests", "counter",
     "Ended requests: responded, no_response, or failed (cancelled or never sent).", ("kind", "outcome")),
    ("bus_refusals", "counter", "Responses without the requested value.", ("kind",)),
    ("bus_request_repeats", "counter", "Retries of requests.", ()),
    ("bus_late_responses", "counter", "Responses received after the timeout.", ()),
    ("servos", "gauge", "Servos by state.", ("state",)),
    ("servo_info", "gauge", "Always 1; the identity is in the labels.", (*_WHO, "model", "firmware", "serial")),
    ("servo_online", "gauge", "1 while the servo is online.", _WHO),
    ("servo_health", "gauge", "Health from NodeStatus: 0 ok, 1 warning, 2 error, 3 critical.", _WHO),
    ("servo_uptime_seconds", "gauge", "Uptime reported by the servo.", _WHO),
    ("servo_angle_degrees", "gauge", "Horn angle (0x08). Absent if older than 0.5 s.", _WHO),
    ("servo_angle_age_seconds", "gauge", "Age of the horn angle.", _WHO),
    ("servo_temperature_celsius", "gauge", "Temperature (0x0B). Absent if older than 5 s.", _WHO),
    ("servo_voltage_volts", "gauge", "Supply voltage (0x0C). Absent if older than 5 s.", _WHO),
    ("servo_faults", "gauge", "Active fault bits by level.", (*_WHO, "level")),
    ("servo_fault", "gauge", "1 for every active fault bit.", (*_WHO, "level", "fault")),
    ("servo_unacknowledged_faults", "gauge", "Unacknowledged warnings and failures.", _WHO),
    ("servo_commanded", "gauge", "1 for every other node that commands the servo by ArrayCommand.", (*_WHO, "node_id")),
    ("servo_command_hertz", "gauge", "Rate of the commands of another node.", (*_WHO, "node_id")),
    ("servo_command_degrees", "gauge", "Last angle commanded by another node.", (*_WHO, "node_id")),
    ("servo_command_gaps", "counter",
     "Gaps in the commands of other nodes that were longer than the timeout of the servo (0x27).", _WHO),
    ("servo_unsaved_parameters", "gauge", "Parameters that a restart would lose.", _WHO),
    ("stop_latched", "gauge", "1 while a stop is latched.", ()),
    ("stop_unconfirmed_servos", "gauge", "Servos that have not confirmed the latched stop.", ()),
    ("stops", "counter", "Stop requests.", ()),
    ("stop_response_seconds", "histogram", "Time from a stop to the response of each servo.", ()),
    ("lease_held", "gauge", "1 while a client has motion control (a lease).", ()),
    ("leases", "counter", "Leases taken, released, revoked or expired.", ("event",)),
    ("streams_running", "gauge", "Running streams.", ()),
    ("stream_bursts", "counter", "Sent bursts of setpoints.", ()),
    ("stream_missed_slots", "counter", "Slots of streams without a burst in time.", ()),
)  # fmt: skip

TABLE: Final = tuple(Shown(f"hornbill_{name}", kind, text, labels) for name, kind, text, labels in _ROWS)
"""All metrics except those of the process, which the library defines."""

PROCESS: Final = "process_"
"""Prefix of process metrics: memory, CPU and open files of the server, on Linux."""

_BY_NAME: Final = {one.name: one for one in TABLE}
_BAD_FRAMES: Final = (
    "bad_identifier", "bad_tail", "bad_toggle", "bad_crc", "unexpected", "interrupted",
    "timed_out", "too_long", "evicted",
)  # fmt: skip
_READINGS: Final = {"servo_temperature_celsius": "current_temperature", "servo_voltage_volts": "current_voltage"}

_Samples = Iterable[tuple[Sequence[str], float]]


@routes.get("/metrics", Role.VIEW, include_in_schema=False)
async def get_metrics(host: TheHost, request: Request) -> Response:
    """All metrics. Yields to the event loop after each, so that a scrape does not delay a stop."""
    await asyncio.to_thread(import_module, "prometheus_client")
    from prometheus_client import generate_latest

    text = bytearray()
    for family in collect(host, request.app.state.measures, getattr(request.app.state, "event_log", None)):
        text += generate_latest(_One(family))
        await asyncio.sleep(0)
    return Response(bytes(text), media_type=MEDIA_TYPE)


class _One:
    """Adapter of one family to the library's writer."""

    def __init__(self, family: "Metric") -> None:
        self._family = family

    def collect(self) -> Iterator["Metric"]:
        yield self._family


def collect(host: Host, measures: Measures, log: EventLog | None) -> Iterator["Metric"]:
    """Current values of all metrics. `log`: event log, None without live clients."""
    from prometheus_client import ProcessCollector

    yield _family("build_info", [((__version__, platform.python_version()), 1)])
    yield _family("uptime_seconds", [((), host.base.now() - host.started_at)])
    yield from _server(host)
    yield _spreads(
        "http_request_seconds",
        [((method, route, str(status)), one) for (method, route, status), one in measures.requests.items()],
    )
    yield _family("http_requests_in_progress", [((), measures.in_progress)])
    yield _family("sockets_open", [((route,), count) for route, count in measures.sockets.items()])
    yield _family("telemetry_dropped_samples", [((), 0 if log is None else log.dropped)])
    yield _family("events", host.counts.events.items())
    yield _family("jobs", host.counts.jobs.items())
    running = [job.kind for job in host.jobs.all() if not job.ended]
    yield _family("jobs_in_progress", [((kind,), running.count(kind)) for kind in dict.fromkeys(running)])
    yield from _bus(host)
    yield from _servos(host)
    yield from _motion(host)
    yield from ProcessCollector(registry=None).collect()


def _server(host: Host) -> Iterator["Metric"]:
    server, parts = host.doctor.of_server, parts_of(host)
    states = [((name, state), part.state == state) for name, part in parts.items() for state in STATES]
    yield _family("part_state", states)
    yield _family("store_failures", [((), server.failures)])
    yield _family("store_pending_writes", [((), server.store.pending)])
    yield _family("store_lost_changes", [((), server.store.lost)])
    yield _family("store_failing_seconds", [((), server.failing_s or 0)])
    for name, place in (("disk_free_bytes", 0), ("disk_total_bytes", 1)):
        yield _family(name, [] if server.disk is None else [((), server.disk[place])])
    yield _spreads("loop_lag_seconds", [((), host.lag.lags)])
    yield _family("loop_lag_recent_seconds", [((), server.lag_s)])


def _bus(host: Host) -> Iterator["Metric"]:
    connection = host.connection
    port = NO_PORT if connection is None else connection.port
    yield _family("bus_state", [((state.value,), port.state is state) for state in PortState])
    if connection is not None:
        seen = connection.port.statistics
        yield _family("bus_role", [((one.value,), connection.role is one) for one in ConnectionRole])
        yield _family("bus_load_ratio", [((), connection.load_pct / 100)])
        yield _family("bus_frames", [(("rx",), seen.rx_frames), (("tx",), seen.tx_frames)])
        for name, count in (
            ("bus_dropped_frames", seen.rx_dropped), ("bus_ignored_frames", seen.ignored), ("bus_errors", seen.errors),
            ("bus_error_frames", seen.error_frames), ("bus_unacknowledged", seen.unacknowledged),
            ("bus_offs", seen.bus_offs), ("bus_reopened", seen.reopened),
        ):  # fmt: skip
            yield _family(name, [((), count)])
        bad, requested = connection.participant.reassembly_counters, connection.participant.request_counters
        yield _family("bus_bad_frames", [((reason,), getattr(bad, reason)) for reason in _BAD_FRAMES])
        yield _family("bus_request_repeats", [((), requested.retries)])
        yield _family("bus_late_responses", [((), requested.late)])
    requests = host.requests
    yield _spreads("bus_request_seconds", [((kind,), one) for kind, one in requests.response_times.items()])
    yield _family("bus_requests", requests.outcomes.items())
    yield _family("bus_refusals", [((kind,), count) for kind, count in requests.refused.items()])


def _servos(host: Host) -> Iterator["Metric"]:
    now, servos = host.base.now(), host.fleet.all()
    states = [one.state for one in servos]
    online = [one for one in servos if one.online]
    yield _family("servos", [((state.value,), states.count(state)) for state in State])
    yield _family("servo_info", [((*_who(one), *_what(one)), 1) for one in servos])
    yield _family("servo_online", [(_who(one), one.online) for one in servos])
    reported = [(one, one.status) for one in online if one.status is not None]
    yield _family("servo_health", [(_who(one), status.health) for one, status in reported])
    yield _family("servo_uptime_seconds", [(_who(one), status.uptime_sec) for one, status in reported])
    angles = [(one, one.angle_deg, now - one.angle_at) for one in servos if one.angle_at is not None]
    yield _family(
        "servo_angle_degrees",
        [(_who(one), deg) for one, deg, age in angles if deg is not None and one.online and age <= ANGLE_FRESH_S],
    )
    yield _family("servo_angle_age_seconds", [(_who(one), age) for one, _, age in angles])
    for name, key in _READINGS.items():
        yield _family(name, [(_who(one), value) for one in online for value in _fresh(one, key, now)])
    active = [(one, fault) for one in online for fault in host.faults.of(one.uid) if fault.active]
    counts = {(one.uid, level): 0 for one in online if _knows_faults(one, now) for level in LEVELS}
    for one, fault in active:
        counts[one.uid, fault.level] = counts.get((one.uid, fault.level), 0) + 1
    yield _family(
        "servo_faults",
        [((*_who(one), level), counts[one.uid, level]) for one in online for level in LEVELS
         if (one.uid, level) in counts],
    )  # fmt: skip
    yield _family("servo_fault", [((*_who(one), fault.level, fault.key), 1) for one, fault in active])
    yield _family("servo_unacknowledged_faults", [(_who(one), host.faults.unacknowledged(one.uid)) for one in servos])
    streams = [(one, stream) for one in online for stream in host.commanders.of(one.uid)]
    by = [((*_who(one), str(stream.node_id)), stream) for one, stream in streams]
    yield _family("servo_commanded", [(labels, 1) for labels, _ in by])
    yield _family("servo_command_hertz", [(labels, rate) for labels, one in by if (rate := one.rate_hz) is not None])
    yield _family("servo_command_degrees", [(labels, deg) for labels, one in by if (deg := one.degrees) is not None])
    yield _family("servo_command_gaps", [(_who(one), host.commanders.gaps[one.uid]) for one in servos])
    yield _family("servo_unsaved_parameters", [(_who(one), len(one.unsaved())) for one in online])


def _motion(host: Host) -> Iterator["Metric"]:
    latch = host.stop.latch
    yield _family("stop_latched", [((), latch is not None)])
    yield _family("stop_unconfirmed_servos", [((), 0 if latch is None else len(latch.unconfirmed()))])
    yield _family("stops", [((), host.stop.presses)])
    yield _spreads("stop_response_seconds", [((), host.stop.response_times)])
    yield _family("lease_held", [((), host.leases.current(host.base.now()) is not None)])
    yield _family("leases", [((event,), count) for event, count in host.leases.counts.items()])
    yield _family("streams_running", [((), sum(one.ended is None for one in host.streams.all()))])
    yield _family("stream_bursts", [((), host.streams.totals.sent)])
    yield _family("stream_missed_slots", [((), host.streams.totals.misses)])


def _who(one: Servo) -> tuple[str, str]:
    return one.uid, one.label


def _what(one: Servo) -> tuple[str, str, str]:
    return "" if one.model is None else one.model.name, one.firmware_text or "", one.serial or ""


def _fresh(one: Servo, key: str, now: float) -> Iterator[float]:
    """Reading in its unit, unless stale."""
    register = one.registers.get(key)
    if register is not None and register.raw is not None and not is_stale(one, register, now):
        yield register.raw / register.parameter.per_unit


def _knows_faults(one: Servo, now: float) -> bool:
    """Whether all fault registers are fresh. The three registers are read only while the overview (0x18) is not 0."""
    keys = (OVERVIEW, *REGISTERS) if one.raw(OVERVIEW) else (OVERVIEW,)
    words = [one.registers.get(key) for key in keys]
    return all(word is not None and not is_stale(one, word, now) for word in words)


def _family(name: str, samples: _Samples) -> "Metric":
    from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily

    shown = _BY_NAME[f"hornbill_{name}"]
    kind = CounterMetricFamily if shown.kind == "counter" else GaugeMetricFamily
    made = kind(shown.name, shown.help, labels=shown.labels)
    for labels, value in samples:
        made.add_metric(labels, float(value))
    return made


def _spreads(name: str, samples: Iterable[tuple[Sequence[str], Histogram]]) -> "Metric":
    from prometheus_client.core import HistogramMetricFamily

    shown = _BY_NAME[f"hornbill_{name}"]
    made = HistogramMetricFamily(shown.name, shown.help, labels=shown.labels)
    for labels, spread in samples:
        made.add_metric(labels, spread.cumulative(), spread.total_s)
    return made
