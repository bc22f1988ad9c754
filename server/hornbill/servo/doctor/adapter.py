"""Findings of the doctor on the adapter: not there, lost, off the bus, set to other bit times than the servos."""

from collections.abc import Mapping
from typing import Final, cast

from hornbill.domain.bus import Finding, FindingCode
from hornbill.domain.fields import Param, known
from hornbill.errors import PortError
from hornbill.servo.doctor.finding import count, ok, percent
from hornbill.servo.doctor.record import Record
from hornbill.wire.port import PortState

BITRATE: Final = 1_000_000
SAMPLE_POINT: Final = 0.875
"""What the servos are built for (section 2.1)."""

_NEAR: Final = 0.005
_FAR: Final = 0.025
"""Sample points differ in their third digit with an adapter's clock; beyond two points and a half frames get lost."""


CHECK: Final = "Check the adapter and its cable, then connect again."
CHECK_TIMING: Final = "Check bit rate, wiring and termination, then connect again."

_KINDS: Final[Mapping[str, tuple[FindingCode, str]]] = {
    "interface_down": ("interface_down", "is down"),
    "bit_rate_mismatch": ("bit_rate", "runs at another bit rate"),
}
"""A code and a few words for troubles with a known cause."""

_NOTES: Final = {
    "adapter_silent": "The adapter answers no command",
    "bit_rate_fixed": "The CAN bit rate of the adapter is fixed",
    "baud_unknown": "The baud rate of the adapter is not known",
    "adapter_echoes": "The adapter returns what it is sent",
    "line_noise": "Noise on the serial line",
    "latency_timer": "The latency timer of the FTDI chip is long",
}
"""Titles of what is unusual about a serial adapter, by the code of the note."""


def no_connection(failure: tuple[str, PortError] | None) -> Finding:
    """No bus is connected; `failure` is the last attempt that failed: its address, and why."""
    if failure is None:
        return Finding(
            "no_bus",
            "failure",
            "No bus is connected",
            "hornbill runs without an adapter.",
            "Choose an adapter, and connect it.",
            advice="connect_adapter",
        )
    address, error = failure
    told = error.facts.get("remedy")
    remedy = str(told) if told else "Do what it says, then connect again."
    code, what = _KINDS.get(error.facts.get("cause", ""), ("adapter_failed", "cannot be opened"))
    params: dict[str, Param] = {**error.note_params, "address": address}
    return Finding(code, "failure", f"{address} {what}", error.detail, remedy, advice="check_adapter", params=params)


def working(record: Record) -> list[Finding]:
    """Whether the adapter is there."""
    port = record.port
    if not record.down:
        told = f"{port.address}, opened again by itself {count(port.statistics.reopened, 'time')}."
        notes = [
            Finding(
                cast("FindingCode", note.code),
                "notice",
                _NOTES.get(note.code, note.code),
                note.text,
                None,
                params={**note.params},
            )
            for note in port.details.notes
        ]
        works = "The adapter is open" if port.details.nothing_received else "The adapter works"
        found = ok(
            "adapter",
            "A recording is played" if record.recorded else works,
            told,
            address=port.address,
            reopened=port.statistics.reopened,
        )
        return [found, *notes]
    seconds = 0.0 if record.down_since is None else record.now - record.down_since
    retry = "" if port.retry_in_s is None else f" Tried again in {port.retry_in_s:.0f} s."
    evidence = f"For {seconds:.0f} s; opened again by itself {count(port.statistics.reopened, 'time')} before.{retry}"
    trouble = port.trouble
    gone: tuple[FindingCode, str] = (
        ("adapter_lost", "is lost") if record.opened else ("adapter_failed", "cannot be opened")
    )
    code, what = gone if trouble is None else _KINDS.get(trouble.facts.get("cause", ""), gone)
    return [
        Finding(
            code,
            "failure",
            f"{port.address} {what}",
            evidence,
            CHECK if trouble is None else trouble.detail,
            advice="check_adapter" if trouble is None else "as_adapter_says",
            params=({} if trouble is None else trouble.note_params)
            | known(
                address=port.address,
                down_s=round(seconds),
                reopened=port.statistics.reopened,
                retry_in_s=None if port.retry_in_s is None else round(port.retry_in_s),
            ),
        )
    ]


def bus_off(record: Record) -> list[Finding]:
    """Whether our controller is, or was a moment ago, off the bus (ISO 11898-1: transmit errors above 255).

    An adapter that is opened again because of it is closed for a while.
    """
    at, port = record.bus_off_at, record.port
    times = count(port.statistics.bus_offs, "time")
    if port.state is PortState.BUS_OFF or (record.was_off and record.down):
        errors = record.since_last_frame.disturbances
        return [
            Finding(
                "bus_off",
                "failure",
                "hornbill's controller is off the bus",
                f"{times} since connecting; {count(errors, 'error')} since the last frame came in, "
                f"{record.silence_s:.0f} s ago.",
                CHECK_TIMING if port.trouble is None else port.trouble.detail,
                advice="check_timing_and_wiring" if port.trouble is None else "as_adapter_says",
                params=({} if port.trouble is None else port.trouble.note_params)
                | {
                    "times": port.statistics.bus_offs,
                    "errors": errors,
                    "silence_s": round(record.silence_s),
                },
            )
        ]
    if at is not None and record.was_off:
        return [
            Finding(
                "bus_off",
                "warning",
                "hornbill's controller was off the bus",
                f"{times} since connecting, last {record.now - at:.0f} s ago.",
                "Look for a short between CAN_H and CAN_L, and for a node at another bit rate.",
                advice="find_short",
                params={"times": port.statistics.bus_offs, "ago_s": round(record.now - at)},
            )
        ]
    text = "Never off the bus" if at is None else "On the bus"
    return [ok("bus_off", text, f"{times} since connecting.", times=port.statistics.bus_offs)]


def bit_timing(record: Record) -> list[Finding]:
    """Whether bit rate and sample point are the servos' (section 2.1), as far as the adapter tells."""
    port = record.port
    point = port.sample_point
    remedy, command = _timing_remedy(port.address)
    rate = f"{port.bitrate / 1e6:g} Mbit/s"
    timing = {"address": port.address, "bitrate": port.bitrate, "wanted_bitrate": BITRATE, "command": command}
    if port.bitrate != BITRATE:
        return [
            Finding(
                "bit_rate",
                "notice" if record.heard_at is not None else "failure",
                f"The adapter runs at {rate}, and the servos at 1 Mbit/s",
                f"{record.counts.latest.rx_frames} frames received at {rate} in {record.now - record.since:.0f} s.",
                remedy,
                advice="set_bit_timing",
                params=known(
                    **timing, frames=record.counts.latest.rx_frames, seconds_s=round(record.now - record.since)
                ),
            )
        ]
    if point is None:
        return [ok("bit_rate", "Bit rate", f"{rate}. {port.address} does not tell its sample point.", **timing)]
    points = {"sample_point_pct": round(100 * point, 1), "wanted_sample_point_pct": 100 * SAMPLE_POINT}
    if abs(point - SAMPLE_POINT) > _NEAR:
        return [
            Finding(
                "sample_point",
                "notice" if abs(point - SAMPLE_POINT) <= _FAR else "warning",
                f"The sample point is {percent(point, 1)}, and the servos' is {percent(SAMPLE_POINT, 1)}",
                f"Read back from {port.address}. On long cables frames are lost.",
                remedy,
                advice="set_bit_timing",
                params=known(**timing, **points),
            )
        ]
    evidence = f"{rate}, {percent(point, 1)}, read back from {port.address}."
    return [ok("bit_rate", "Bit rate and sample point", evidence, **timing, **points)]


def _timing_remedy(address: str) -> tuple[str, str | None]:
    """What to do, and the command in it."""
    interface, _, channel = address.partition(":")
    if interface == "socketcan":
        options = f"type can bitrate {BITRATE} sample-point {SAMPLE_POINT}"
        command = f"sudo ip link set {channel} down && sudo ip link set {channel} up {options}"
        return command, command
    return f"Connect again at {BITRATE} bit/s.", None
