"""The doctor's findings on what is on the wire: nothing, only errors, nobody to acknowledge, too much."""

from typing import Final

from hornbill.domain.bus import Finding
from hornbill.domain.fields import Param, known
from hornbill.servo.doctor.finding import count, ok, percent
from hornbill.servo.doctor.record import Record
from hornbill.servo.monitoring.polling import BUDGET, READ_S
from hornbill.wire.port import PortState, SerialLineInfo

QUIET_S: Final = 2.0
"""Silence that is told apart from the pause between two NodeStatus of a lonely node (table 2-2)."""

NO_TRAFFIC_S: Final = 3.0
RESTARTING_S: Final = 10.0
"""The same while a servo restarts because we asked it to."""

LOAD_OVER_S: Final = 5.0
LINE_FULL: Final = 0.87
"""Share of a serial line above which it is full: polling leaves it less (see line_budget.py)."""
RECENT_S: Final = 10.0
MINUTE_S: Final = 60.0

_RECENT_ERROR_S: Final = 3.0
_ERRORS: Final = 5
_BAD_SECONDS: Final = 3

_RATE: Final = (
    "The baud rate may also be wrong: leave out what follows @ in the address and it is found; if the adapter has an "
    "unusual one, add it: slcan:DEVICE@BAUD."
)
_WIRES: Final = "Check the supply, then CAN_H, CAN_L and ground, then the termination: 120 Ω at both ends."


def silence(record: Record) -> list[Finding]:
    """Why nothing is heard, if nothing is."""
    quiet = record.silence_s
    ours = record.since_last_frame
    for found in (only_errors(record), _unacknowledged(record)):
        if found is not None:
            return [found]
    restarting = any(one.busy is not None for one in record.servos())
    if quiet >= (RESTARTING_S if restarting else NO_TRAFFIC_S) and record.port.state is not PortState.BUS_OFF:
        since = "since connecting" if record.heard_at is None else "since the last one"
        evidence = f"0 frames and {count(ours.errors, 'error')} in {quiet:.0f} s {since}."
        line = record.port.details.serial_line
        if record.heard_at is None and line is not None:
            return [_nothing_over(line, evidence, {"errors": ours.errors, "silence_s": round(quiet)})]
        return [
            Finding(
                "no_traffic",
                "failure",
                "Nobody is heard on the bus",
                evidence,
                _WIRES,
                advice="check_wires",
                params={"errors": ours.errors, "silence_s": round(quiet), "ever_heard": record.heard_at is not None},
            )
        ]
    second = record.counts.over(LOAD_OVER_S)
    per_s = second.rx_frames / second.at if second.at else 0.0
    evidence = f"{per_s:.0f} a second, the last {quiet:.1f} s ago."
    return [ok("no_traffic", "Frames come in", evidence, frames_per_s=round(per_s), silence_s=round(quiet, 1))]


def _nothing_over(line: SerialLineInfo, evidence: str, values: dict[str, Param]) -> Finding:
    """Nothing was ever received through a serial adapter: its own rate may be the reason."""
    how = "as given" if not line.found else "found" if line.confirmed else "not confirmed"
    where = "USB" if line.native_usb else f"{line.baud} baud, {how}"
    return Finding(
        "nothing_received",
        "failure",
        "Nothing was ever received through the serial adapter",
        f"{evidence} Serial line: {where}.",
        _WIRES if line.native_usb or line.confirmed else f"{_WIRES} {_RATE}",
        advice="check_wires" if line.native_usb or line.confirmed else "check_wires_and_baud",
        params=known(**values, baud=None if line.native_usb else line.baud, found=line.found),
    )


def serial_line(record: Record) -> list[Finding]:
    """Whether a serial line carries all that comes from the bus."""
    line = record.port.details.serial_line
    rate = None if line is None else line.bytes_per_s
    if line is None or rate is None:
        return []
    lately = record.counts.over(LOAD_OVER_S)
    load = min(1.0, lately.line_bytes / lately.at / rate) if lately.at else 0.0
    evidence = (
        f"{percent(load)} of {line.baud} baud in {lately.at:.0f} s; the line carries up to {line.budget} full frames "
        "per second."
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
            "Set the adapter to a higher baud rate, take servos off this bus, or use an adapter without a serial line.",
            advice="free_serial_line",
            params=values,
        )
    ]


def only_errors(record: Record) -> Finding | None:
    """Error frames and nothing else: another bit rate, or no proper bus. A controller that is off sees no more."""
    errors = record.since_last_frame.bus_errors
    state = record.port.state
    still = record.was_off or record.counts.over(_RECENT_ERROR_S).bus_errors > 0
    if errors < _ERRORS or not still or record.silence_s < QUIET_S:
        return None
    rate = f"{record.port.bitrate / 1e6:g} Mbit/s"
    return Finding(
        "only_errors",
        "failure",
        "Only error frames are on the bus",
        f"{errors} error frames and 0 frames in {record.silence_s:.0f} s at {rate}; the controller is {_word(state)}.",
        "Set every node and the adapter to 1 Mbit/s, the servos' bit rate. If they are, look for CAN_H and CAN_L "
        "crossed or shorted, a missing ground, and the termination: 120 Ω at both ends.",
        advice="set_bit_rate",
        params={
            "errors": errors,
            "silence_s": round(record.silence_s),
            "bitrate": record.port.bitrate,
            "controller": state.value,
        },
    )


def _unacknowledged(record: Record) -> Finding | None:
    """Nobody else takes part: what a controller sends alone is never acknowledged, and makes it passive."""
    lately = record.counts.over(QUIET_S).unacknowledged
    passive = record.passive
    if (not lately and not passive) or record.silence_s < QUIET_S:
        return None
    total = record.since_last_frame.unacknowledged
    return Finding(
        "unacknowledged",
        "failure",
        "hornbill is alone on the bus",
        f"{count(total, 'transmission')} of ours without an acknowledgement and 0 frames received in "
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
    """Whether the error counter goes up again and again while frames get through."""
    minute = record.counts.over(MINUTE_S)
    bad = record.counts.disturbed()
    passive = record.passive
    errors = minute.disturbances
    rising = errors >= _ERRORS and len(bad) >= _BAD_SECONDS and record.now - bad[-1] <= RECENT_S
    if not rising and not passive:
        told = f"{count(errors, 'error')} in {minute.at:.0f} s."
        return [ok("errors_rising", "Few errors, or none", told, errors=errors, over_s=round(minute.at))]
    seen = min(minute.bus_errors, errors)
    return [
        Finding(
            "errors_rising",
            "warning",
            "The error counter is rising" if rising else "hornbill's controller is passive after too many errors",
            f"{count(errors, 'error')} in {minute.at:.0f} s, in {len(bad)} of its seconds: {seen} on the wire, "
            f"{errors - seen} frames of ours that could not leave. The controller is {_word(record.port.state)}.",
            "Look at plugs and cables, the termination (120 Ω at both ends) and the length of stubs.",
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
    """Whether others fill the bus beyond the budget that polling keeps within."""
    lately = record.counts.over(LOAD_OVER_S)
    if not lately.at:
        return []
    total = lately.busy_s / lately.at
    ours = min(total, lately.tries * READ_S / lately.at)
    evidence = (
        f"{percent(total)} in {lately.at:.0f} s, limit {percent(BUDGET)}; "
        f"about {percent(ours)} are hornbill's own requests."
    )
    values = {
        "load_pct": round(100 * total), "over_s": round(lately.at), "limit_pct": round(100 * BUDGET),
        "ours_pct": round(100 * ours),
    }  # fmt: skip
    if total - ours <= BUDGET or lately.at < LOAD_OVER_S - 1:
        return [ok("load_over_budget", "The load is within its budget", evidence, **values)]
    return [
        Finding(
            "load_over_budget",
            "warning",
            "The bus is loaded beyond its budget",
            evidence,
            "See in the frame monitor who sends so much, and slow it down or take it off the bus.",
            advice="slow_sender",
            params={**values},
        )
    ]


def dropped(record: Record) -> list[Finding]:
    """Whether frames came faster than they were taken."""
    lately = record.counts.over(RECENT_S)
    if not lately.rx_dropped:
        told = f"0 of {lately.rx_frames} in {lately.at:.0f} s."
        return [ok("frames_dropped", "No frame dropped", told, frames=lately.rx_frames, over_s=round(lately.at))]
    share = lately.rx_dropped / (lately.rx_dropped + lately.rx_frames)
    return [
        Finding(
            "frames_dropped",
            "warning",
            "Frames are lost on the way to hornbill",
            f"{count(lately.rx_dropped, 'frame')} in {lately.at:.0f} s, {percent(share, 1)} of what came.",
            "Close what else keeps this computer busy, or use an adapter with a larger buffer.",
            advice="free_computer",
            params={
                "dropped": lately.rx_dropped,
                "over_s": round(lately.at),
                "dropped_pct": round(100 * share, 1),
            },
        )
    ]


def foreign_frames(record: Record) -> list[Finding]:
    """Whether frames are on the bus that DroneCAN on classic CAN does not know."""
    lately = record.counts.over(RECENT_S)
    if not lately.ignored:
        told = f"0 others in {lately.at:.0f} s."
        return [ok("foreign_frames", "DroneCAN frames alone", told, over_s=round(lately.at))]
    return [
        Finding(
            "foreign_frames",
            "notice",
            "Frames that are no DroneCAN are on the bus",
            f"{count(lately.ignored, 'standard, remote or CAN FD frame')} in {lately.at:.0f} s, passed over.",
            "They do no harm but for the load. CAN FD frames confuse servos that know classic CAN alone.",
            advice="none_needed",
            params={"frames": lately.ignored, "over_s": round(lately.at)},
        )
    ]


def _word(state: PortState) -> str:
    return state.value.replace("_", " ")
