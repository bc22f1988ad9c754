"""Owns the doctor's findings on the adapter: not there, lost, off the bus, set to other bit times than the servos."""

from typing import Final

from hornbill.errors import PortError
from hornbill.servo.doctor.finding import Finding, Severity, count, ok, percent
from hornbill.servo.doctor.record import Record
from hornbill.wire.port import PortState

BITRATE: Final = 1_000_000
SAMPLE_POINT: Final = 0.875
"""What the servos are built for (section 2.1)."""

_NEAR: Final = 0.005
_FAR: Final = 0.025
"""Sample points differ in their third digit with an adapter's clock; beyond two points and a half frames get lost."""


def no_connection(failure: tuple[str, PortError] | None) -> Finding:
    """No bus is connected; `failure` is the last attempt that failed: its address, and why."""
    if failure is None:
        return Finding(
            "no_bus",
            Severity.FAILURE,
            "No bus is connected",
            "hornbill runs without an adapter.",
            'Choose one of GET /api/v1/bus/adapters, and connect it: PUT /api/v1/bus {"address": "socketcan:can0"}.',
        )
    address, error = failure
    told = error.facts.get("remedy")
    remedy = str(told) if told else "Do what it says, then connect again."
    code, what = _kind(error.detail) or ("adapter_failed", "cannot be opened")
    return Finding(code, Severity.FAILURE, f"{address} {what}", error.detail, remedy)


def working(record: Record) -> list[Finding]:
    """Whether the adapter is there."""
    port = record.port
    if not record.down:
        told = f"{port.address}, opened again by itself {count(port.statistics.reopened, 'time')}."
        return [ok("adapter", "A recording is played" if record.recorded else "The adapter works", told)]
    seconds = 0.0 if record.down_since is None else record.now - record.down_since
    retry = "" if port.retry_in_s is None else f" Tried again in {port.retry_in_s:.0f} s."
    evidence = f"For {seconds:.0f} s; opened again by itself {count(port.statistics.reopened, 'time')} before.{retry}"
    trouble = port.trouble or "Check the adapter and its cable, then connect again: PUT /api/v1/bus."
    gone = ("adapter_lost", "is lost") if record.opened else ("adapter_failed", "cannot be opened")
    code, what = _kind(trouble) or gone
    return [Finding(code, Severity.FAILURE, f"{port.address} {what}", evidence, trouble)]


def bus_off(record: Record) -> list[Finding]:
    """Whether our controller is, or was a moment ago, off the bus (ISO 11898-1: transmit errors above 255).

    An adapter that is opened again because of it is closed for a while.
    """
    at, port = record.bus_off_at, record.port
    times = count(port.statistics.bus_offs, "time")
    if port.state is PortState.BUS_OFF or (record.was_off and record.down):
        errors = count(record.since_last_frame.disturbances, "error")
        return [
            Finding(
                "bus_off",
                Severity.FAILURE,
                "hornbill's controller is off the bus",
                f"{times} since connecting; {errors} since the last frame came in, {record.silence_s:.0f} s ago.",
                port.trouble or "Check bit rate, wiring and termination, then connect again: PUT /api/v1/bus.",
            )
        ]
    if at is not None and record.was_off:
        return [
            Finding(
                "bus_off",
                Severity.WARNING,
                "hornbill's controller was off the bus",
                f"{times} since connecting, last {record.now - at:.0f} s ago.",
                "Look for a short between CAN_H and CAN_L, and for a node at another bit rate.",
            )
        ]
    return [ok("bus_off", "Never off the bus" if at is None else "On the bus", f"{times} since connecting.")]


def bit_timing(record: Record) -> list[Finding]:
    """Whether bit rate and sample point are the servos' (section 2.1), as far as the adapter tells."""
    port = record.port
    point = port.sample_point
    remedy = _timing_remedy(port.address)
    rate = f"{port.bitrate / 1e6:g} Mbit/s"
    if port.bitrate != BITRATE:
        return [
            Finding(
                "bit_rate",
                Severity.NOTICE if record.heard_at is not None else Severity.FAILURE,
                f"The adapter runs at {rate}, and the servos at 1 Mbit/s",
                f"{record.counts.latest.rx_frames} frames received at {rate} in {record.now - record.since:.0f} s.",
                remedy,
            )
        ]
    if point is None:
        return [ok("bit_rate", "Bit rate", f"{rate}. {port.address} does not tell its sample point.")]
    if abs(point - SAMPLE_POINT) > _NEAR:
        return [
            Finding(
                "sample_point",
                Severity.NOTICE if abs(point - SAMPLE_POINT) <= _FAR else Severity.WARNING,
                f"The sample point is {percent(point, 1)}, and the servos' is {percent(SAMPLE_POINT, 1)}",
                f"Read back from {port.address}. On long cables frames are lost.",
                remedy,
            )
        ]
    return [ok("bit_rate", "Bit rate and sample point", f"{rate}, {percent(point, 1)}, read back from {port.address}.")]


def _timing_remedy(address: str) -> str:
    interface, _, channel = address.partition(":")
    if interface == "socketcan":
        options = f"type can bitrate {BITRATE} sample-point {SAMPLE_POINT}"
        return f"sudo ip link set {channel} down && sudo ip link set {channel} up {options}"
    return f'Connect again at the right one: PUT /api/v1/bus {{"address": "{address}", "bitrate": {BITRATE}}}.'


def _kind(trouble: str) -> tuple[str, str] | None:
    """A code and a few words for troubles with a known cause, by the sentences of `bus/socketcan.py`."""
    if " is down" in trouble:
        return "interface_down", "is down"
    if " bit/s and not at " in trouble:
        return "bit_rate", "runs at another bit rate"
    return None
