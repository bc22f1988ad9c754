"""Findings on bus traffic: none, only errors, no acknowledgement, overload."""

from typing import Final

from hornbill.domain.bus import Finding
from hornbill.domain.fields import Param, known
from hornbill.servo.doctor.finding import count, ok, percent
from hornbill.servo.doctor.record import Record
from hornbill.servo.monitoring.polling import BUDGET, READ_S
from hornbill.wire.port import PortState, SerialLineInfo

QUIET_S: Final = 2.0
"""Minimum silence; longer than the period of a single node's NodeStatus (table 2-2)."""

NO_TRAFFIC_S: Final = 3.0
RESTARTING_S: Final = 10.0
"""The same during a restart requested by hornbill."""

LOAD_OVER_S: Final = 5.0
LINE_FULL: Final = 0.87
"""Load above which a serial line counts as full. Polling stays below it (see line_budget.py)."""
RECENT_S: Final = 10.0
MINUTE_S: Final = 60.0

_RECENT_ERROR_S: Final = 3.0
_ERRORS: Final = 5
_BAD_SECONDS: Final = 3

_RATE: Final = (
    "The baud rate may also be wrong: omit @BAUD in the address to detect it, or specify an unusual one as "
    "slcan:DEVICE@BAUD."
)
_WIRES: Final = "Check the supply, then CAN_H, CAN_L and ground, then the termination (120 Ω at both ends)."


def silence(record: Record) -> list[Finding]:
    """Whether frames are received, and if not, the reason."""
    quiet = record.silence_s
    ours = record.since_last_frame
    for found in (only_errors(record), _unacknowledged(record)):
        if found is not None:
            return [found]
    restarting = any(one.busy is not None for one in record.servos())
    if quiet >= (RESTARTING_S if restarting else NO_TRAFFIC_S) and record.port.state is not PortState.BUS_OFF:
        since = "since connecting" if record.last_frame_at is None else "since the last frame"
        evidence = f"0 frames and {count(ours.errors, 'error')} in {quiet:.0f} s {since}."
        line = record.port.details.serial_line
        if record.last_frame_at is None and line is not None:
            return [_nothing_over(line, evidence, {"errors": ours.errors, "silence_s": round(quiet)})]
        return [
            Finding(
                "no_traffic",
                "failure",
                "No frames received",
                evidence,
                _WIRES,
                advice="check_wires",
                params={
                    "errors": ours.errors,
                    "silence_s": round(quiet),
                    "ever_seen": record.last_frame_at is not None,
                },
            )
        ]
    second = record.counts.over(LOAD_OVER_S)
    per_s = second.rx_frames / second.at if second.at else 0.0
    evidence = f"{per_s:.0f} frames/s, last {quiet:.1f} s ago."
    return [ok("no_traffic", "Frames received", evidence, frames_per_s=round(per_s), silence_s=round(quiet, 1))]


def _nothing_over(line: SerialLineInfo, evidence: str, values: dict[str, Param]) -> Finding:
    """Finding for a serial adapter that has never received a frame. Its baud rate may be wrong."""
    how = "as given" if not line.found else "found" if line.confirmed else "not confirmed"
    where = "USB" if line.native_usb else f"{line.baud} baud, {how}"
    return Finding(
        "nothing_received",
        "failure",
        "The serial adapter has never received a frame",
        f"{evidence} Serial line: {where}.",
        _WIRES if line.native_usb or line.confirmed else f"{_WIRES} {_RATE}",
        advice="check_wires" if line.native_usb or line.confirmed else "check_wires_and_baud",
        params=known(**values, baud=None if line.native_usb else line.baud, found=line.found),
    )


def serial_line(record: Record) -> list[Finding]:
    """Whether the serial line is fast enough for the bus traffic."""
    line = record.port.details.serial_line
    rate = None if line is None else line.bytes_per_s
    if line is None or rate is None:
        return []
    lately = record.counts.over(LOAD_OVER_S)
    load = min(1.0, lately.line_bytes / lately.at / rate) if lately.at else 0.0
    evidence = (
        f"{percent(load)} of {line.baud} baud in {lately.at:.0f} s; the line carries up to {line.budget} full frames/s."
    )
    values = known(load_pct=round(100 * load), baud=line.baud, over_s=round(lately.at), frames_per_s=line.budget)
    if load <= LINE_FULL or lately.at < LOAD_OVER_S - 1:
        return [ok("serial_line_full", "The serial line carries all traffic", evidence, **values)]
    return [
        Finding(
            "serial_line_full",
            "warning",
            "The serial line is full: the adapter may lose frames",
            evidence,
            "Set the adapter to a higher baud rate, remove servos from this bus, or use an adapter without a serial "
            "line.",
            advice="free_serial_line",
            params=values,
        )
    ]


def only_errors(record: Record) -> Finding | None:
    """Finding for error frames only: wrong bit rate or faulty wiring. A bus-off controller sees no further errors."""
    errors = record.since_last_frame.bus_errors
    state = record.port.state
    still = record.was_off or record.counts.over(_RECENT_ERROR_S).bus_errors > 0
    if errors < _ERRORS or not still or record.silence_s < QUIET_S:
        return None
    rate = f"{record.port.bitrate / 1e6:g} Mbit/s"
    return Finding(
        "only_errors",
        "failure",
        "Only error frames on the bus",
        f"{errors} error frames and 0 frames in {record.silence_s:.0f} s at {rate}; the controller is {_word(state)}.",
        "Set all nodes and the adapter to 1 Mbit/s, the bit rate of the servos. If they are, check for CAN_H and CAN_L "
        "swapped or short-circuited, a missing ground, and the termination (120 Ω at both ends).",
        advice="set_bit_rate",
        params={
            "errors": errors,
            "silence_s": round(record.silence_s),
            "bitrate": record.port.bitrate,
            "controller": state.value,
        },
    )


def _unacknowledged(record: Record) -> Finding | None:
    """Finding for a bus without another node: frames are not acknowledged, and the controller becomes passive."""
    lately = record.counts.over(QUIET_S).unacknowledged
    passive = record.passive
    if (not lately and not passive) or record.silence_s < QUIET_S:
        return None
    total = record.since_last_frame.unacknowledged
    return Finding(
        "unacknowledged",
        "failure",
        "hornbill is alone on the bus",
        f"{count(total, 'transmission')} without acknowledgement and 0 frames received in "
        f"{record.silence_s:.0f} s; the controller is {_word(record.port.state)}.",
        _WIRES,
        advice="check_wires",
        params={
            "transmissions": total,
            "silence_s": round(record.silence_s),
            "controller": record.port.state.value,
        },
    )


def errors_rising(record: Record) -> list[Finding]:
    """Whether errors keep occurring while frames are received."""
    minute = record.counts.over(MINUTE_S)
    bad = record.counts.disturbed()
    passive = record.passive
    errors = minute.disturbances
    rising = errors >= _ERRORS and len(bad) >= _BAD_SECONDS and record.now - bad[-1] <= RECENT_S
    if not rising and not passive:
        evidence = f"{count(errors, 'error')} in {minute.at:.0f} s."
        return [ok("errors_rising", "Few or no errors", evidence, errors=errors, over_s=round(minute.at))]
    seen = min(minute.bus_errors, errors)
    return [
        Finding(
            "errors_rising",
            "warning",
            "Bus errors keep occurring" if rising else "hornbill's CAN controller is error-passive",
            f"{count(errors, 'error')} in {minute.at:.0f} s, spread over {len(bad)} s: {seen} on the bus, "
            f"{errors - seen} frames that could not be sent. The controller is {_word(record.port.state)}.",
            "Check connectors and cables, the termination (120 Ω at both ends) and the length of stubs.",
            advice="check_plugs",
            params={
                "errors": errors,
                "over_s": round(minute.at),
                "seconds": len(bad),
                "on_wire": seen,
                "not_sent": errors - seen,
                "controller": record.port.state.value,
                "rising": rising,
            },
        )
    ]


def load(record: Record) -> list[Finding]:
    """Whether other nodes load the bus beyond the budget of polling."""
    lately = record.counts.over(LOAD_OVER_S)
    if not lately.at:
        return []
    total = lately.busy_s / lately.at
    ours = min(total, lately.tries * READ_S / lately.at)
    evidence = (
        f"{percent(total)} in {lately.at:.0f} s, limit {percent(BUDGET)}; about {percent(ours)} by hornbill's requests."
    )
    values = {
        "load_pct": round(100 * total), "over_s": round(lately.at), "limit_pct": round(100 * BUDGET),
        "ours_pct": round(100 * ours),
    }  # fmt: skip
    if total - ours <= BUDGET or lately.at < LOAD_OVER_S - 1:
        return [ok("load_over_budget", "The bus load is within its budget", evidence, **values)]
    return [
        Finding(
            "load_over_budget",
            "warning",
            "The bus load exceeds its budget",
            evidence,
            "Find the sender in the frame monitor, and reduce its rate or disconnect it.",
            advice="slow_sender",
            params={**values},
        )
    ]


def dropped(record: Record) -> list[Finding]:
    """Whether received frames were dropped."""
    lately = record.counts.over(RECENT_S)
    if not lately.rx_dropped:
        evidence = f"0 of {lately.rx_frames} in {lately.at:.0f} s."
        return [ok("frames_dropped", "No RX overruns", evidence, frames=lately.rx_frames, over_s=round(lately.at))]
    share = lately.rx_dropped / (lately.rx_dropped + lately.rx_frames)
    return [
        Finding(
            "frames_dropped",
            "warning",
            "RX overruns: received frames are dropped",
            f"{count(lately.rx_dropped, 'frame')} in {lately.at:.0f} s, {percent(share, 1)} of the received frames.",
            "Reduce the load of this computer, or use an adapter with a larger buffer.",
            advice="reduce_computer_load",
            params={
                "dropped": lately.rx_dropped,
                "over_s": round(lately.at),
                "dropped_pct": round(100 * share, 1),
            },
        )
    ]


def foreign_frames(record: Record) -> list[Finding]:
    """Whether frames other than DroneCAN on classic CAN are on the bus."""
    lately = record.counts.over(RECENT_S)
    if not lately.ignored:
        evidence = f"No other frames in {lately.at:.0f} s."
        return [ok("foreign_frames", "Only DroneCAN frames", evidence, over_s=round(lately.at))]
    return [
        Finding(
            "foreign_frames",
            "notice",
            "Frames other than DroneCAN are on the bus",
            f"{count(lately.ignored, 'standard, remote or CAN FD frame')} in {lately.at:.0f} s, ignored.",
            "They only add load. CAN FD frames, however, disturb servos, which support classic CAN only.",
            advice="none_needed",
            params={"frames": lately.ignored, "over_s": round(lately.at)},
        )
    ]


def _word(state: PortState) -> str:
    return state.value.replace("_", " ")
