"""Motion of the horn under a controller, friction and a load, by fixed-step integration."""

from bisect import bisect_right
from collections.abc import Sequence
from enum import IntEnum
from math import exp, inf
from typing import Final, NamedTuple

from hornbill.domain.plant import DEFAULT_PLANT, PlantConstants
from hornbill.sim.mechanics.plant import STEP_S, WEAK_BRAKE, Plant
from hornbill.units import Instant

_SMOOTHING_S: Final = 0.04
_SAME_TORQUE: Final = 1e-4

_INNER_DAMPING: Final = 2.4
"""Speed feedback of the angle loop without 0x25, as a share of back-EMF. It damps that loop."""


class Controller(IntEnum):
    """What moves the horn: nothing, the weak brake, or one of the controllers of 4.18."""

    OFF = 0
    BRAKE = 1
    ANGLE_DIRECT = 2
    ANGLE_CASCADE = 3
    SPEED = 4
    TORQUE = 5


_ARRIVED: Final = {
    Controller.OFF: 0.0,
    Controller.BRAKE: 0.0,
    Controller.ANGLE_DIRECT: 0.01,
    Controller.ANGLE_CASCADE: 0.01,
    Controller.SPEED: 1.0,
    Controller.TORQUE: 0.001,
}
"""Distance at which smoothing has reached a target, in the unit of the target."""


class Orders(NamedTuple):
    """Input of the controller, in the plant's direction (+ clockwise), degrees and °/s.

    `target` is an angle, a speed or a torque share, by `controller`. `angle_p` is °/s per ° in the cascade, torque
    per ° without; `volts` is the supply relative to nominal; torque is a share of stall.
    """

    controller: Controller = Controller.OFF
    target: float = 0.0
    smooth: bool = False
    angle_p: float = 0.0
    angle_d: float = 0.0
    dead_band: float = 0.0
    boost: float = 0.0
    speed_p: float = 0.0
    speed_i: float = 0.0
    speed_dead_band: float = 0.0
    speed_i_limit: float = 0.0
    speed_low: float = 0.0
    speed_high: float = 0.0
    torque_low: float = 0.0
    torque_high: float = 0.0
    current_limit: float = 1.0
    volts: float = 1.0


class _Physics(NamedTuple):
    """Factors of one integration step, from the constants of the horn."""

    slowed: float
    """Speed that remains after a step of viscous friction, as a share."""
    kick: float
    """Speed gained in a step at stall torque, °/s."""
    decay: float
    """Remaining share of the difference between actual and requested torque after a step."""
    mean: float
    """The same, averaged over the step."""
    breakaway: float
    coulomb: float
    gap: float
    load: float
    lean: float
    """Side of the backlash to which the constant load pushes the horn: its offset from the motor, °."""
    shaped: bool
    """Whether the load depends on the angle or there are end stops. Without them a step needs no more than that."""


def _physics(plant: Plant, constants: PlantConstants, friction: float) -> _Physics:
    """Factors of one step with dry and viscous friction multiplied by `friction`."""
    # Viscous friction by the trapezoidal rule: stable, and accurate to less than 0.1 % at this step.
    acceleration = plant.gain / (1.0 + constants.inertia)
    drag = acceleration * constants.viscous * friction / plant.synchronous * STEP_S / 2.0
    decay = exp(-STEP_S / constants.torque_lag_s)
    load, coulomb, gap = constants.load_pct / 100.0, constants.coulomb * friction, constants.backlash_deg / 2.0
    return _Physics(
        slowed=(1.0 - drag) / (1.0 + drag),
        kick=acceleration * STEP_S / (1.0 + drag),
        decay=decay,
        mean=constants.torque_lag_s / STEP_S * (1.0 - decay),
        breakaway=constants.breakaway * friction,
        coulomb=coulomb,
        gap=gap,
        load=load,
        lean=gap if load > coulomb else -gap if load < -coulomb else 0.0,
        shaped=bool(constants.load_by_angle) or constants.stop_cw_deg is not None or constants.stop_ccw_deg is not None,
    )


def load_at(curve: Sequence[tuple[float, float]], angle: float) -> float:
    """Load at an angle from points in order of angle: linear in between, constant beyond the ends."""
    after = bisect_right(curve, angle, key=_angle)
    if not after:
        return curve[0][1]
    if after == len(curve):
        return curve[-1][1]
    (left, low), (right, high) = curve[after - 1], curve[after]
    return low + (high - low) * (angle - left) / (right - left)


def _angle(point: tuple[float, float]) -> float:
    return point[0]


class HornMotion:
    """Angle (°, including turns) of one horn, speed (°/s, at the horn) and torque (share of stall) of its motor.

    The motor has inertia, dry and viscous friction, and torque that lags behind the requested one; the horn follows
    through the gear backlash, or is pushed by a load to one side of it. Time is advanced lazily: `advance(now)`
    integrates the time since the last call in steps of STEP_S, with the controllers once per step.
    A horn at rest sleeps: it needs no computation until its orders or constants change or it is turned manually.
    An end stop stops the horn without rebound, and the motor once it has crossed the backlash.
    """

    __slots__ = (
        "_asleep",
        "_at",
        "_constants",
        "_curve",
        "_heat",
        "_integral",
        "_orders",
        "_physics",
        "_plant",
        "_point",
        "_stops",
        "_wears",
        "angle",
        "limited_speed",
        "limited_torque",
        "motor",
        "moved_s",
        "speed",
        "torque",
    )

    def __init__(
        self, plant: Plant, angle: float, now: Instant = 0.0, constants: PlantConstants = DEFAULT_PLANT
    ) -> None:
        self._plant = plant
        self._orders = Orders()
        self._at: float = now
        self._point: float = 0.0
        self._integral: float = 0.0
        self._heat: float = 0.0
        self._asleep = False
        self.angle: float = angle
        self.motor: float = angle
        """Angle of the motor at the horn, within the backlash of `angle`."""
        self.speed: float = 0.0
        self.torque: float = 0.0
        self.limited_speed = 0
        """+1 or -1 while the speed limit of that side is active (4.32)."""
        self.limited_torque = 0
        """+1 or -1 while the torque limit of that side is active (4.33)."""
        self.moved_s: float = 0.0
        """Time in motion, s. Friction grows with it."""
        self._take(constants)

    @property
    def constants(self) -> PlantConstants:
        """Constants of the horn as delivered, without wear. Set as of the last `advance`."""
        return self._constants

    @constants.setter
    def constants(self, constants: PlantConstants) -> None:
        if constants is not self._constants and constants != self._constants:
            self._take(constants)
            self._asleep = False

    @property
    def orders(self) -> Orders:
        """The present orders."""
        return self._orders

    @property
    def friction(self) -> float:
        """Friction relative to that of `constants`: it grows by `wear_per_hour`."""
        return 1.0 + self._constants.wear_per_hour * self.moved_s / 3600.0

    @property
    def asleep(self) -> bool:
        """Whether the horn is at rest with nothing to integrate."""
        return self._asleep

    def _take(self, constants: PlantConstants) -> None:
        low, high = constants.stop_ccw_deg, constants.stop_cw_deg
        self._constants = constants
        self._curve = tuple((angle, pct / 100.0) for angle, pct in constants.load_by_angle)
        self._stops = (-inf if low is None else low, inf if high is None else high)
        self._wears = constants.wear_per_hour > 0.0
        self._physics = _physics(self._plant, constants, self.friction)

    def obey(self, orders: Orders) -> None:
        """Set the orders as of the last `advance`. A new controller starts at the present state of the horn."""
        before = self._orders
        if orders == before:
            return
        if orders.controller != before.controller:
            self._integral = 0.0
            starts = {
                Controller.ANGLE_DIRECT: self.angle,
                Controller.ANGLE_CASCADE: self.angle,
                Controller.SPEED: self.speed,
            }
            self._point = starts.get(orders.controller, 0.0)
        self._orders = orders
        self._asleep = False

    def turn(self, angle: float) -> None:
        """Set the horn manually to `angle`, at rest. The controller may move it afterwards."""
        self.angle = self.motor = angle
        self.speed = 0.0
        self._asleep = False

    def heat(self) -> float:
        """Integral of the squared torque since the last call, in seconds at stall. It warms the board."""
        heat, self._heat = self._heat, 0.0
        return heat

    def advance(self, now: Instant, trace: list[float] | None = None) -> None:
        """Integrate up to `now`, less than one step short of it.

        `trace` receives the angle after each step, °, until the horn sleeps.
        """
        steps = int((now - self._at) / STEP_S)
        if steps <= 0:
            return
        self._at += steps * STEP_S
        if self._asleep:
            self._heat += self.torque * self.torque * steps * STEP_S
            return
        (
            controller, target, smooth, angle_p, angle_d, dead_band, boost, speed_p, speed_i, speed_dead_band,
            speed_i_limit, speed_low, speed_high, torque_low, torque_high, current_limit, volts,
        ) = self._orders  # fmt: skip
        plant = self._plant
        emf = 1.0 / plant.synchronous
        damping = _INNER_DAMPING * emf
        slowed, kick, decay, mean, breakaway, coulomb, gap, load, lean, shaped = self._physics
        smoothing = 1.0 - exp(-STEP_S / _SMOOTHING_S)
        speed_i *= STEP_S
        half = STEP_S / 2.0
        if shaped:
            constant, curve = load, self._curve
            low, high = self._stops
            lowest, highest = low - gap, high + gap
        else:
            constant, curve, low, high, lowest, highest = load, (), -inf, inf, -inf, inf
        angle, speed, point, integral, torque = self.angle, self.speed, self._point, self._integral, self.torque
        motor = began = self.motor
        heat = 0.0
        limited_speed = limited_torque = 0
        near = _ARRIVED[controller]
        controller = int(controller)  # plain integers compare faster than an enumeration
        in_dead_band, in_speed_dead_band = -dead_band, -speed_dead_band
        if not smooth:
            point = target
        for done in range(1, steps + 1):
            settled = point == target
            if not settled:
                ahead = target - point
                point = target if -near < ahead < near else point + ahead * smoothing
            if controller == 2:
                error = point - angle
                voltage = -damping * speed
                if error > dead_band:
                    voltage += angle_p * error + boost
                elif error < in_dead_band:
                    voltage += angle_p * error - boost
                if voltage > volts:
                    voltage = volts
                elif voltage < -volts:
                    voltage = -volts
                demand = voltage - speed * emf
            elif controller >= 3:
                limited_torque = 0
                growth = 0.0
                braked = False
                if controller == 5 or (controller == 4 and point == 0.0):
                    effort = point
                    if point == 0.0:
                        # 4.2 and 4.3: speed or torque 0 brakes.
                        integral = 0.0
                        braked = True
                else:
                    push = 0.0
                    if controller == 4:
                        wanted = point
                    else:
                        error = point - angle
                        if error > dead_band:
                            wanted = angle_p * error - angle_d * speed
                            push = boost
                        elif error < in_dead_band:
                            wanted = angle_p * error - angle_d * speed
                            push = -boost
                        else:
                            wanted = 0.0
                    limited_speed = 0
                    if wanted > speed_high:
                        wanted, limited_speed = speed_high, 1
                    elif wanted < speed_low:
                        wanted, limited_speed = speed_low, -1
                    deviation = wanted - speed
                    effort = integral + push
                    if deviation > speed_dead_band or deviation < in_speed_dead_band:
                        effort += speed_p * deviation
                        growth = speed_i * deviation
                    elif wanted == 0.0:
                        # Prevent creeping at speeds within the speed deadband.
                        growth = speed_i * deviation
                if effort > torque_high:
                    effort, limited_torque, growth = torque_high, 1, 0.0
                elif effort < torque_low:
                    effort, limited_torque, growth = torque_low, -1, 0.0
                back = speed * emf
                if braked:
                    demand = -back
                else:
                    voltage = effort + back
                    if voltage > volts:
                        voltage, growth = volts, 0.0
                    elif voltage < -volts:
                        voltage, growth = -volts, 0.0
                    demand = voltage - back
                if growth:
                    integral += growth
                    if integral > speed_i_limit:
                        integral = speed_i_limit
                    elif integral < -speed_i_limit:
                        integral = -speed_i_limit
                    settled = False
            elif controller == 1:
                demand = -WEAK_BRAKE * speed * emf
            else:
                demand = 0.0
            if demand > current_limit:
                demand = current_limit
            elif demand < -current_limit:
                demand = -current_limit
            missing = torque - demand
            force = demand + missing * mean
            torque = demand + missing * decay
            heat += force * force
            if shaped:
                if curve:
                    load = constant + load_at(curve, angle)
                    lean = gap if load > coulomb else -gap if load < -coulomb else 0.0
                force += load
                if speed == 0.0 and ((force > 0.0 and motor >= highest) or (force < 0.0 and motor <= lowest)):
                    force = 0.0  # the stop bears it
            else:
                force += load
            before = speed
            if speed > 0.0:
                speed = speed * slowed + kick * (force - coulomb)
                if speed <= 0.0:
                    speed = 0.0
            elif speed < 0.0:
                speed = speed * slowed + kick * (force + coulomb)
                if speed >= 0.0:
                    speed = 0.0
            elif force > breakaway:
                speed = kick * (force - coulomb)
            elif force < -breakaway:
                speed = kick * (force + coulomb)
            elif settled and -_SAME_TORQUE < missing < _SAME_TORQUE:
                self._asleep = True
                heat += torque * torque * (steps - done)
                break
            motor += (before + speed) * half
            if shaped and not lowest < motor < highest:
                motor = highest if motor >= highest else lowest
                speed = 0.0
            if lean:
                angle = motor + lean
            else:
                slack = motor - angle
                if slack > gap:
                    angle = motor - gap
                elif slack < -gap:
                    angle = motor + gap
            if shaped:
                angle = low if angle < low else high if angle > high else angle
            if trace is not None:
                trace.append(angle)
        self.angle, self.speed, self._point, self._integral, self.torque = angle, speed, point, integral, torque
        self.motor = motor
        self._heat += heat * STEP_S
        if motor != began:
            self.moved_s += steps * STEP_S
            if self._wears:
                self._physics = _physics(plant, self._constants, self.friction)
        self.limited_speed, self.limited_torque = limited_speed, limited_torque
