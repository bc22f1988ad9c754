"""What the servo layer does, and says, when the bus is lost and when it is back."""

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
"""States in which nothing we send arrives."""

SAMPLE_POINT = 0.875
"""Where in a bit the servos sample (section 2.1)."""

NEAR = 0.005


class BusWatch:
    """Looks at the port of the connected bus. When it is lost every command ends at once, and torque off is owed to
    the servos that were under command; when it is back, that is written first, and nothing else by itself.
    """

    def __init__(self, hub: Hub, base: TimeBase, fleet: Fleet, motion: Motion, on_back: Callable[[], None]) -> None:
        """`on_back` is called when a lost bus works again."""
        self._hub = hub
        self._base = base
        self._fleet = fleet
        self._motion = motion
        self._on_back = on_back
        self._port: CanPort | NoPort = NO_PORT
        self._state = NO_PORT.state
        self._losses = (0, 0)
        self._lost_at: Instant | None = None
        self._told: set[str] = set()

    @property
    def gone(self) -> bool:
        """Whether a bus is connected that cannot be used now."""
        return self._lost_at is not None

    def begin(self, port: CanPort) -> None:
        """This port's bus was joined: it is open, or will be when its adapter can be opened."""
        self._port, self._state, self._losses = port, port.state, _losses(port)
        self._hub.publish(BusChanged())
        if self._state in GONE:
            self._set_lost_at(self._base.now())
            self._tell("warning", "bus_lost", f"{self._trouble()}{self._promise()}", **self._params())
            return
        self._set_lost_at(None)
        text = f"Connected to {port.address} at {port.bitrate / 1e6:g} Mbit/s."
        self._tell("info", "connected", text, address=port.address, mbit_per_s=port.bitrate / 1e6)
        self._check_sample_point()

    def end(self) -> None:
        """The bus was left."""
        self._port, self._state = NO_PORT, NO_PORT.state
        self._set_lost_at(None)

    def look(self) -> None:
        """Notice what the port says of itself; call it at least every 50 ms."""
        port, state, losses = self._port, self._port.state, _losses(self._port)
        if isinstance(port, NoPort):
            return
        if state is not self._state:
            self._state = state
            self._hub.publish(BusChanged())
        if losses != self._losses:  # it may have been lost and back between two looks
            self._losses = losses
            if not self.gone:
                self._lost()
        if state in GONE:
            if not self.gone:
                self._lost()
            elif self._trouble() not in self._told:
                self._tell("warning", "bus_trouble", self._trouble(), **self._params())
        elif self.gone:
            self._back()

    def _lost(self) -> None:
        self._set_lost_at(self._base.now())
        self._fleet.bus_lost()
        servos = self._motion.bus_lost()
        text = f"{self._trouble()}{self._promise()}"
        if servos:
            text += f" Commands have ended. Torque goes off on {_names(servos)} once the bus is back; cut the supply "
            text += "of what can move until then."
        self._tell("failure", "bus_lost", text, **self._params(), servos=[one.title for one in servos])

    def _back(self) -> None:
        assert self._lost_at is not None
        away = self._base.now() - self._lost_at
        self._set_lost_at(None)
        self._motion.torque_off.retry_now()
        self._fleet.bus_restored()
        self._on_back()
        owed = self._motion.torque_off.servos()
        text = f"{self._port.address} is back after {away:.1f} s. Nothing moves by itself."
        if owed:
            text += f" Torque goes off on {_names(owed)}."
        titles = [one.title for one in owed]
        self._tell("notice", "bus_back", text, address=self._port.address, away_s=round(away, 1), servos=titles)
        self._check_sample_point()

    def _set_lost_at(self, at: Instant | None) -> None:
        self._lost_at = at
        self._told.clear()
        self._hub.publish(BusUsable(at is None))

    def _trouble(self) -> str:
        trouble = self._port.trouble
        return f"{self._port.address} is lost. Check the adapter and its cable." if trouble is None else trouble.detail

    def _promise(self) -> str:
        return "" if self._port.retry_in_s is None else " It is opened again by itself."

    def _check_sample_point(self) -> None:
        point = self._port.sample_point
        if point is None or abs(point - SAMPLE_POINT) <= NEAR:
            return
        text = f"{self._port.address} samples a bit at {point:.1%}; the servos do at {SAMPLE_POINT:.1%}."
        self._tell(
            "notice", "sample_point", f"{text} On a short bus that works; on a long one set the adapter alike.",
            address=self._port.address, sample_point_pct=round(100 * point, 1),
            wanted_sample_point_pct=100 * SAMPLE_POINT,
        )  # fmt: skip

    def _params(self) -> dict[str, object]:
        """What is wrong, as values of an event."""
        trouble = self._port.trouble
        told = {} if trouble is None else trouble.note_params
        return {**told, "address": self._port.address, "retry": self._port.retry_in_s is not None}

    def _tell(self, level: str, code: EventCode, text: str, **params: object) -> None:
        self._told.add(self._trouble())
        self._hub.publish(LogEvent(level, code, text, params=params))


def _losses(port: CanPort | NoPort) -> tuple[int, int]:
    """How often it was opened again, and how often its controller was off the bus."""
    return port.statistics.reopened, port.statistics.bus_offs


def _names(servos: list[Servo]) -> str:
    return ", ".join(servo.title for servo in servos)
