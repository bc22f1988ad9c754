"""Simulated servos and autopilot of the server."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, Unpack

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hornbill.client import responses
    from hornbill.client.sync.connection import Connection
    from hornbill.client.sync.servo import Servo


class Sim:
    """Simulated servos of the server, as `hornbill.sim`. Raises Unknown (no_simulator) on a server without them."""

    def __init__(self, connection: Connection) -> None:
        self._request = connection.request

    def servos(self) -> list[responses.SimServo]:
        """Simulated servos and their conditions."""
        return self._request("GET", "/sim/servos")

    def servo(self, servo: Servo | str) -> responses.SimServo:
        """One simulated servo and its conditions, by servo or unique ID."""
        return self._request("GET", _path(servo))

    def set(self, servo: Servo | str, **changes: Unpack[responses.SimChange]) -> responses.SimServo:
        """Change the conditions of a simulated servo, all or nothing: supply, load, temperature, faults, responses,
        `behaviour` and others. Raises InvalidValue with the valid names.
        """
        return self._request("PATCH", _path(servo), changes)

    def add(self, **recipe: Unpack[responses.NewSimServo]) -> responses.SimServo:
        """Add a simulated servo (`model`), and switch it on."""
        return self._request("POST", "/sim/servos", recipe)

    def remove(self, servo: Servo | str) -> None:
        """Remove a simulated servo from the bus, as if it were unplugged."""
        self._request("DELETE", _path(servo))

    def truth(self, servo: Servo | str) -> responses.SimTruth:
        """True constants and state of a simulated servo, to compare measurements with."""
        return self._request("GET", f"{_path(servo)}/truth")

    def clock(self) -> responses.SimClock:
        """Clock of the server: real or virtual time, and its speed."""
        return self._request("GET", "/sim/clock")

    def set_speed(self, speed: float | Literal["max"]) -> responses.SimClock:
        """Set the speed of virtual time relative to real time. Raises Conflict in real time."""
        return self._request("PUT", "/sim/clock", {"speed": speed})

    def chaos(self) -> responses.SimChaos:
        """Faults that are injected at random."""
        return self._request("GET", "/sim/chaos")

    def start_chaos(
        self, seed: int, *, kinds: Sequence[str] | None = None, interval_s: float | None = None
    ) -> responses.SimChaos:
        """Inject faults into the present servos, the same for the same seed. `kinds`: None for all. `interval_s`: mean
        time between two.
        """
        given = {"seed": seed, "kinds": None if kinds is None else list(kinds), "interval_s": interval_s}
        return self._request("PUT", "/sim/chaos", {key: one for key, one in given.items() if one is not None})

    def stop_chaos(self) -> responses.SimChaos:
        """Stop injecting faults, and end those in effect."""
        return self._request("DELETE", "/sim/chaos")

    def injections(self, *, limit: int = 100) -> list[responses.SimInjection]:
        """What was injected when, newest first."""
        return self._request("GET", "/sim/chaos/injections", limit=limit)

    def autopilot(self) -> responses.SimAutopilot:
        """The simulated autopilot. Raises Unknown (no_autopilot) if there is none."""
        return self._request("GET", "/sim/autopilot")

    def add_autopilot(
        self, program: Literal["ardupilot", "px4"], *, output_count: int = 4, rate_hz: float = 50.0
    ) -> responses.SimAutopilot:
        """Add a simulated autopilot to the bus, in place of the present one. It is disarmed."""
        body = {"program": program, "output_count": output_count, "rate_hz": rate_hz}
        return self._request("PUT", "/sim/autopilot", body)

    def set_autopilot(self, **changes: Unpack[responses.SimAutopilotChange]) -> responses.SimAutopilot:
        """Arm or disarm the simulated autopilot, press its safety switch, restart it, or set its outputs."""
        return self._request("PATCH", "/sim/autopilot", changes)

    def remove_autopilot(self) -> None:
        """Remove the simulated autopilot from the bus. Idempotent."""
        self._request("DELETE", "/sim/autopilot")


def _path(servo: Servo | str) -> str:
    return f"/sim/servos/{servo if isinstance(servo, str) else servo.uid}"
