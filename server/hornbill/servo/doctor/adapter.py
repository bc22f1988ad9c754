"""Findings on the adapter: missing, lost, bus-off, or with another bit timing than the servos."""

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
"""Bit timing of the servos (section 2.1)."""

_NEAR: Final = 0.005
_FAR: Final = 0.025
"""Sample points differ in the third digit between adapter clocks. Beyond 2.5 points frames may be lost."""


CHECK: Final = "Check the adapter and its cable, then connect again."
CHECK_TIMING: Final = "Check bit rate, wiring and termination, then connect again."

_KINDS: Final[Mapping[str, tuple[FindingCode, str]]] = {
    "interface_down": ("interface_down", "is down"),
    "bit_rate_mismatch": ("bit_rate", "runs at another bit rate"),
}
"""Code and title for problems with a known cause."""

_NOTES: Final = {
    "adapter_silent": "The adapter does not respond to commands",
    "bit_rate_fixed": "The CAN bit rate of the adapter is fixed",
    "baud_unknown": "The baud rate of the adapter is unknown",
    "adapter_echoes": "The adapter echoes commands",
    "line_noise": "Noise on the serial line",
    "latency_timer": "The latency timer of the FTDI chip is high",
    "not_listen_only": "The adapter is not in listen-only mode",
}
"""Titles of notes on serial adapters, by code."""


def no_connection(failure: tuple[str, PortError] | None) -> Finding:
    """Finding for no bus. `failure`: address and error of the last failed attempt."""
    if failure is None:
        return Finding(
            "no_bus",
            "failure",
            "No bus is connected",
            "hornbill runs without an adapter.",
            "Choose an adapter and connect.",
            advice="connect_adapter",
        )
    address, error = failure
    given = error.facts.get("remedy")
    remedy = str(given) if given else "Follow the message, then connect again."
    code, what = _KINDS.get(error.facts.get("cause", ""), ("adapter_failed", "cannot be opened"))
    params: dict[str, Param] = {**error.note_params, "address": address}
    return Finding(code, "failure", f"{address} {what}", error.detail, remedy, advice="check_adapter", params=params)


def working(record: Record) -> list[Finding]:
    """Whether the adapter works."""
    port = record.port
    if not record.down:
        evidence = f"{port.address}, reconnects: {port.statistics.reopened}."
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
        title = "The adapter is open" if port.details.nothing_received else "The adapter works"
        found = ok(
            "adapter",
            "A recording is being played" if record.recorded else title,
            evidence,
            address=port.address,
            reopened=port.statistics.reopened,
        )
        return [found, *notes]
    seconds = 0.0 if record.down_since is None else record.now - record.down_since
    retry = "" if port.retry_in_s is None else f" Next attempt in {port.retry_in_s:.0f} s."
    evidence = f"For {seconds:.0f} s; earlier reconnects: {port.statistics.reopened}.{retry}"
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
            advice="check_adapter" if trouble is None else "see_adapter_message",
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
    """Whether our controller is or recently was bus-off (ISO 11898-1: transmit errors above 255).

    An adapter that is reopened after bus-off is closed for a while.
    """
    at, port = record.bus_off_at, record.port
    times = count(port.statistics.bus_offs, "time")
    if port.state is PortState.BUS_OFF or (record.was_off and record.down):
        errors = record.since_last_frame.disturbances
        return [
            Finding(
                "bus_off",
                "failure",
                "hornbill's CAN controller is bus-off",
                f"{times} since connecting; {count(errors, 'error')} since the last received frame "
                f"{record.silence_s:.0f} s ago.",
                CHECK_TIMING if port.trouble is None else port.trouble.detail,
                advice="check_timing_and_wiring" if port.trouble is None else "see_adapter_message",
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
                "hornbill's CAN controller was bus-off",
                f"{times} since connecting, last {record.now - at:.0f} s ago.",
                "Check for a short circuit between CAN_H and CAN_L and for a node with another bit rate.",
                advice="find_short",
                params={"times": port.statistics.bus_offs, "ago_s": round(record.now - at)},
            )
        ]
    text = "Never bus-off" if at is None else "Not bus-off"
    return [ok("bus_off", text, f"{times} since connecting.", times=port.statistics.bus_offs)]


def bit_timing(record: Record) -> list[Finding]:
    """Whether bit rate and sample point match the servos (section 2.1), as far as the adapter reports them."""
    port = record.port
    point = port.sample_point
    remedy, command = _timing_remedy(port.address)
    rate = f"{port.bitrate / 1e6:g} Mbit/s"
    timing = {"address": port.address, "bitrate": port.bitrate, "wanted_bitrate": BITRATE, "command": command}
    if port.bitrate != BITRATE:
        return [
            Finding(
                "bit_rate",
                "notice" if record.last_frame_at is not None else "failure",
                f"The adapter is set to {rate}, but the servos use 1 Mbit/s",
                f"{record.counts.latest.rx_frames} frames received at {rate} in {record.now - record.since:.0f} s.",
                remedy,
                advice="set_bit_timing",
                params=known(
                    **timing, frames=record.counts.latest.rx_frames, seconds_s=round(record.now - record.since)
                ),
            )
        ]
    if point is None:
        return [ok("bit_rate", "Bit rate", f"{rate}. {port.address} does not report its sample point.", **timing)]
    points = {"sample_point_pct": round(100 * point, 1), "wanted_sample_point_pct": 100 * SAMPLE_POINT}
    if abs(point - SAMPLE_POINT) > _NEAR:
        return [
            Finding(
                "sample_point",
                "notice" if abs(point - SAMPLE_POINT) <= _FAR else "warning",
                f"The sample point is {percent(point, 1)}, but the servos use {percent(SAMPLE_POINT, 1)}",
                f"Read back from {port.address}. On long cables frames may be lost.",
                remedy,
                advice="set_bit_timing",
                params=known(**timing, **points),
            )
        ]
    evidence = f"{rate}, {percent(point, 1)}, read back from {port.address}."
    return [ok("bit_rate", "Bit rate and sample point", evidence, **timing, **points)]


def _timing_remedy(address: str) -> tuple[str, str | None]:
    """Remedy, and the command in it if any."""
    interface, _, channel = address.partition(":")
    if interface == "socketcan":
        options = f"type can bitrate {BITRATE} sample-point {SAMPLE_POINT}"
        command = f"sudo ip link set {channel} down && sudo ip link set {channel} up {options}"
        return command, command
    return f"Connect again at {BITRATE} bit/s.", None
