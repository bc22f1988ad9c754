"""Owns the doctor's findings on what is on the wire: nothing, only errors, nobody to acknowledge, too much."""

from typing import Final

from hornbill.servo.doctor.finding import Finding, Severity, count, ok, percent
from hornbill.servo.doctor.record import Record
from hornbill.servo.polling import BUDGET, READ_S
from hornbill.wire.port import PortState

QUIET_S: Final = 2.0
"""Silence that is told apart from the pause between two NodeStatus of a lonely node (table 2-2)."""

NO_TRAFFIC_S: Final = 3.0
RESTARTING_S: Final = 10.0
"""The same while a servo restarts because we asked it to."""

LOAD_OVER_S: Final = 5.0
RECENT_S: Final = 10.0
MINUTE_S: Final = 60.0

_RECENT_ERROR_S: Final = 3.0
_ERRORS: Final = 5
_BAD_SECONDS: Final = 3

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
        return [
            Finding(
                "no_traffic",
                Severity.FAILURE,
                "Nobody is heard on the bus",
                f"0 frames and {count(ours.errors, 'error')} in {quiet:.0f} s {since}.",
                _WIRES,
            )
        ]
    second = record.counts.over(LOAD_OVER_S)
    per_s = second.rx_frames / second.at if second.at else 0.0
    return [ok("no_traffic", "Frames come in", f"{per_s:.0f} a second, the last {quiet:.1f} s ago.")]


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
        Severity.FAILURE,
        "Only error frames are on the bus",
        f"{errors} error frames and 0 frames in {record.silence_s:.0f} s at {rate}; the controller is {_word(state)}.",
        "Set every node and the adapter to 1 Mbit/s, the servos' bit rate. If they are, look for CAN_H and CAN_L "
        "crossed or shorted, a missing ground, and the termination: 120 Ω at both ends.",
    )


def _unacknowledged(record: Record) -> Finding | None:
    """Nobody else takes part: what a controller sends alone is never acknowledged, and makes it passive."""
    lately = record.counts.over(QUIET_S).unacknowledged
    passive = record.port.state is PortState.PASSIVE
    if (not lately and not passive) or record.silence_s < QUIET_S:
        return None
    total = record.since_last_frame.unacknowledged
    return Finding(
        "unacknowledged",
        Severity.FAILURE,
        "hornbill is alone on the bus",
        f"{count(total, 'transmission')} of ours without an acknowledgement and 0 frames received in "
        f"{record.silence_s:.0f} s; the controller is {_word(record.port.state)}.",
        _WIRES,
    )


def errors_rising(record: Record) -> list[Finding]:
    """Whether the error counter goes up again and again while frames get through."""
    minute = record.counts.over(MINUTE_S)
    bad = record.counts.disturbed()
    passive = record.port.state is PortState.PASSIVE
    errors = minute.disturbances
    rising = errors >= _ERRORS and len(bad) >= _BAD_SECONDS and record.now - bad[-1] <= RECENT_S
    if not rising and not passive:
        return [ok("errors_rising", "Few errors, or none", f"{count(errors, 'error')} in {minute.at:.0f} s.")]
    seen = min(minute.bus_errors, errors)
    return [
        Finding(
            "errors_rising",
            Severity.WARNING,
            "The error counter is rising" if rising else "hornbill's controller is passive after too many errors",
            f"{count(errors, 'error')} in {minute.at:.0f} s, in {len(bad)} of its seconds: {seen} on the wire, "
            f"{errors - seen} frames of ours that could not leave. The controller is {_word(record.port.state)}.",
            "Look at plugs and cables, the termination (120 Ω at both ends) and the length of stubs.",
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
    if total - ours <= BUDGET or lately.at < LOAD_OVER_S - 1:
        return [ok("load_over_budget", "The load is within its budget", evidence)]
    return [
        Finding(
            "load_over_budget",
            Severity.WARNING,
            "The bus is loaded beyond its budget",
            evidence,
            "See in the frame monitor who sends so much, and slow it down or take it off the bus.",
        )
    ]


def dropped(record: Record) -> list[Finding]:
    """Whether frames came faster than they were taken."""
    lately = record.counts.over(RECENT_S)
    if not lately.rx_dropped:
        return [ok("frames_dropped", "No frame dropped", f"0 of {lately.rx_frames} in {lately.at:.0f} s.")]
    share = lately.rx_dropped / (lately.rx_dropped + lately.rx_frames)
    return [
        Finding(
            "frames_dropped",
            Severity.WARNING,
            "Frames are lost on the way to hornbill",
            f"{count(lately.rx_dropped, 'frame')} in {lately.at:.0f} s, {percent(share, 1)} of what came.",
            "Close what else keeps this computer busy, or use an adapter with a larger buffer.",
        )
    ]


def foreign_frames(record: Record) -> list[Finding]:
    """Whether frames are on the bus that DroneCAN on classic CAN does not know."""
    lately = record.counts.over(RECENT_S)
    if not lately.ignored:
        return [ok("foreign_frames", "DroneCAN frames alone", f"0 others in {lately.at:.0f} s.")]
    return [
        Finding(
            "foreign_frames",
            Severity.NOTICE,
            "Frames that are no DroneCAN are on the bus",
            f"{count(lately.ignored, 'standard, remote or CAN FD frame')} in {lately.at:.0f} s, passed over.",
            "They do no harm but for the load. CAN FD frames confuse servos that know classic CAN alone.",
        )
    ]


def _word(state: PortState) -> str:
    return state.value.replace("_", " ")
