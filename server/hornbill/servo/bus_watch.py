"""Reaction to a lost and a restored bus."""

from collections.abc import Callable

from hornbill.domain.event import EventCode
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.hub import BusChanged, BusUsable, Hub, LogEvent
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant
from hornbill.wire.port import NO_PORT, CanPort, NoPort, PortState

GONE = frozenset((PortState.LOST, PortState.CONNECTING, PortState.DISCONNECTED, PortState.BUS_OFF))
"""States in which nothing can be sent."""

SAMPLE_POINT = 0.875
"""Sample point of the servos (section 2.1)."""

NEAR = 0.005


class BusWatch:
    """Monitors the port of the connected bus. When it is lost, all commands end at once, and torque off becomes pending
    for the commanded servos. When it is back, torque off is written first; nothing else is sent automatically.
    """

    def __init__(self, hub: Hub, base: TimeBase, fleet: Fleet, motion: Motion, on_back: Callable[[], None]) -> None:
        """`on_back`: called when a lost bus works again."""
        self._hub = hub
        self._base = base
        self._fleet = fleet
        self._motion = motion
        self._on_back = on_back
        self._port: CanPort | NoPort = NO_PORT
        self._state = NO_PORT.state
        self._losses = (0, 0)
        self._lost_at: Instant | None = None
        self._published: set[str] = set()

    @property
    def gone(self) -> bool:
        """Whether the connected bus cannot be used now."""
        return self._lost_at is not None

    def begin(self, port: CanPort) -> None:
        """Begin monitoring a port, whose adapter may not be open yet."""
        self._port, self._state, self._losses = port, port.state, _losses(port)
        self._hub.publish(BusChanged())
        if self._state in GONE:
            self._set_lost_at(self._base.now())
            self._publish("warning", "bus_lost", f"{self._trouble()}{self._retry_text()}", **self._params())
            return
        self._set_lost_at(None)
        text = f"Connected to {port.address} at {port.bitrate / 1e6:g} Mbit/s."
        self._publish("info", "connected", text, address=port.address, mbit_per_s=port.bitrate / 1e6)
        self._check_sample_point()

    def end(self) -> None:
        """End monitoring."""
        self._port, self._state = NO_PORT, NO_PORT.state
        self._set_lost_at(None)

    def check(self) -> None:
        """Check the state of the port. Call it at least every 50 ms."""
        port, state, losses = self._port, self._port.state, _losses(self._port)
        if isinstance(port, NoPort):
            return
        if state is not self._state:
            self._state = state
            self._hub.publish(BusChanged())
        if losses != self._losses:  # it may have been lost and restored between two checks
            self._losses = losses
            if not self.gone:
                self._lost()
        if state in GONE:
            if not self.gone:
                self._lost()
            elif self._trouble() not in self._published:
                self._publish("warning", "bus_trouble", self._trouble(), **self._params())
        elif self.gone:
            self._back()

    def _lost(self) -> None:
        self._set_lost_at(self._base.now())
        self._fleet.bus_lost()
        servos = self._motion.bus_lost()
        text = f"{self._trouble()}{self._retry_text()}"
        if servos:
            text += f" All commands have ended. Torque of {_names(servos)} is turned off when the bus is back. Until "
            text += "then, turn off the supply of servos that can move."
        self._publish("failure", "bus_lost", text, **self._params(), servos=[one.title for one in servos])

    def _back(self) -> None:
        assert self._lost_at is not None
        away = self._base.now() - self._lost_at
        self._set_lost_at(None)
        self._motion.torque_off.retry_now()
        self._fleet.bus_restored()
        self._on_back()
        pending = self._motion.torque_off.servos()
        text = f"{self._port.address} is back after {away:.1f} s. Nothing moves automatically."
        if pending:
            text += f" Torque of {_names(pending)} is turned off."
        titles = [one.title for one in pending]
        self._publish("notice", "bus_back", text, address=self._port.address, away_s=round(away, 1), servos=titles)
        self._check_sample_point()

    def _set_lost_at(self, at: Instant | None) -> None:
        self._lost_at = at
        self._published.clear()
        self._hub.publish(BusUsable(at is None))

    def _trouble(self) -> str:
        trouble = self._port.trouble
        return f"{self._port.address} is lost. Check the adapter and its cable." if trouble is None else trouble.detail

    def _retry_text(self) -> str:
        return "" if self._port.retry_in_s is None else " It is reopened automatically."

    def _check_sample_point(self) -> None:
        point = self._port.sample_point
        if point is None or abs(point - SAMPLE_POINT) <= NEAR:
            return
        text = f"The sample point of {self._port.address} is {point:.1%}; the servos use {SAMPLE_POINT:.1%}."
        self._publish(
            "notice", "sample_point", f"{text} This works on a short bus; on a long bus, set the adapter to match.",
            address=self._port.address, sample_point_pct=round(100 * point, 1),
            wanted_sample_point_pct=100 * SAMPLE_POINT,
        )  # fmt: skip

    def _params(self) -> dict[str, object]:
        """The problem as parameters of an event."""
        trouble = self._port.trouble
        params = {} if trouble is None else trouble.note_params
        return {**params, "address": self._port.address, "retry": self._port.retry_in_s is not None}

    def _publish(self, level: str, code: EventCode, text: str, **params: object) -> None:
        self._published.add(self._trouble())
        self._hub.publish(LogEvent(level, code, text, params=params))


def _losses(port: CanPort | NoPort) -> tuple[int, int]:
    """Number of reconnects, and number of times the controller went bus-off."""
    return port.statistics.reopened, port.statistics.bus_offs


def _names(servos: list[Servo]) -> str:
    return ", ".join(servo.title for servo in servos)
