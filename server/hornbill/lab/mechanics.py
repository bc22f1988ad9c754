"""Mechanics of one horn from measured motion: friction, inertia, load, backlash, supply, deadband. Pure functions.

Angles, loads and torques are in the directions of the servo's registers; torque and load are shares of stall torque.
Every estimate has a 95 % interval. What a sensor at the horn cannot know is None with a reason.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from hornbill.domain.frequency_response import Estimate
from hornbill.domain.plant import DEFAULT_PLANT, PlantConstants
from hornbill.sim.mechanics.motion import Controller, HornMotion, Orders
from hornbill.sim.mechanics.plant import STEP_S, Plant

Array = np.ndarray

QUANTUM_DEG: Final = 0.1
"""Resolution of 0x08, °."""
QUANTUM: Final = 0.01
"""Resolution of 0x0A and 0x02, share of stall torque."""
DROOP: Final = 0.06
"""Drop of the supply inside the servo at stall torque, share of the nominal voltage."""

_FINE_S: Final = 0.002
_FINE_FOR_S: Final = 0.024
_COARSE_S: Final = 0.006
_TIME_S: Final = 0.0005
"""Uncertainty of the time of one sample, s."""
_SHIFT_S: Final = 0.001
"""Uncertainty of the time of one command, s: the control period of the servo and the bus."""
_MOVED_DEG: Final = 0.25
"""Motion from which a pulse is used: before, the motor may be anywhere within the backlash."""
_TORQUE_ERROR: Final = 0.004
_ROUNDS: Final = 14
_INFLATION: Final = 3.0
"""Standard deviations per side of an interval: neighbouring residuals are alike, and friction is not smooth."""
_LEAST: Final = np.array([0.015, 0.06, 0.1, 0.05, 0.35, 0.001])
"""Smallest half intervals of the coordinates, for errors that no residual shows, such as those of the servo's clock.
Found with random horns in the bench."""
_LEANING: Final = 0.8
"""Load above which the gear may lean to one side, relative to friction."""
_SEEN_BACKLASH_DEG: Final = 0.3
"""Largest half interval with which a backlash is stated at all, °."""


@dataclass(slots=True)
class Pulse:
    """A resting horn under torque commands: times in s from the first one, torque as a share.

    `commands`: (time, torque) of each; `angle` and `torque`: samples; `before`: torque before the first command.
    """

    commands: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    angle: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    torque: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    before: float = 0.0


@dataclass(slots=True)
class Breakaway:
    """Torque steps on a resting horn: the last one without motion and the first one with it, per direction."""

    cw: tuple[float, float] | None = None
    ccw: tuple[float, float] | None = None


@dataclass(slots=True)
class SupplySample:
    """Supply (V) at a torque that was constant for a while."""

    torque: float
    volts: float


class Fitted(NamedTuple):
    """Constants of a fit, and the standard deviation of its coordinates."""

    constants: PlantConstants
    coordinates: Array
    spread: Array
    rms_deg: float


_NAMES: Final = ("inertia", "coulomb", "viscous", "backlash_deg", "torque_lag_s", "load_pct")
_STEPS: Final = np.array([0.01, 0.03, 0.03, 0.02, 0.05, 0.001])
_LOWER: Final = np.array([0.0, np.log(0.002), np.log(0.01), 0.0, np.log(0.0006), -2.0])
_UPPER: Final = np.array([np.log1p(200.0), np.log(0.6), np.log(5.0), 4.0, np.log(0.03), 2.0])
_PRIOR: Final = np.array([np.inf, 2.0, 1.0, np.inf, 0.7, np.inf])


def constants_of(x: Array, breakaway: float) -> PlantConstants:
    """Constants at coordinates of the fit."""
    coulomb = float(np.exp(x[1]))
    return PlantConstants(
        inertia=float(np.expm1(x[0])), coulomb=coulomb, breakaway=min(max(breakaway, coulomb), 1.0),
        viscous=float(np.exp(x[2])), backlash_deg=float(x[3]), torque_lag_s=float(np.exp(x[4])),
        load_pct=100.0 * float(x[5]),
    )  # fmt: skip


def respond(
    plant: Plant, volts: float, constants: PlantConstants, pulse: Pulse, end_s: float
) -> tuple[Array, Array, Array]:
    """Times, angles from rest at 0°, and torques of the model until `end_s`. `volts`: supply relative to nominal.

    Points are close after a command, where torque rises.
    """
    horn = HornMotion(plant, 0.0, 0.0, constants)
    gap, load = constants.backlash_deg / 2.0, constants.load_pct / 100.0
    forward = pulse.commands[0][1] + load > 0
    lean = gap if load > constants.coulomb else -gap if load < -constants.coulomb else 0.0
    horn.motor = -lean if lean else gap if forward else -gap
    horn.torque = pulse.before
    steps = [(round(since / STEP_S) * STEP_S, torque) for since, torque in pulse.commands]
    commands = [*steps, (end_s + 2 * _COARSE_S, 0.0)]
    times, angles, torques = [0.0], [0.0], [pulse.before]
    for (since, torque), (until, _) in pairwise(commands):
        horn.obey(Orders(Controller.TORQUE, torque, torque_low=-1.0, torque_high=1.0, volts=volts))
        now = since
        while now < until - 1e-6:
            now = min(now + (_FINE_S if now < since + _FINE_FOR_S else _COARSE_S), until)
            horn.advance(now + 1e-9)
            times.append(now)
            angles.append(horn.angle)
            torques.append(horn.torque)
    return np.array(times), np.array(angles), np.array(torques)


class _Prepared(NamedTuple):
    pulse: Pulse
    t: Array
    angle: Array
    torque_t: Array
    torque: Array


def _prepare(pulse: Pulse) -> _Prepared | None:
    """Samples from the first motion on."""
    if len(pulse.angle) < 12 or not pulse.commands:
        return None
    t, angle = (np.array(one) for one in zip(*pulse.angle, strict=True))
    begin = float(np.median(angle[t <= 0.004])) if (t <= 0.004).any() else angle[0]
    moved = np.flatnonzero(np.abs(angle - begin) > _MOVED_DEG)
    if not len(moved) or len(t) - moved[0] < 8:
        return None
    torque_t, torque = (
        (np.array(one) for one in zip(*pulse.torque, strict=True)) if pulse.torque else (np.empty(0),) * 2
    )
    return _Prepared(pulse, t[moved[0] :], angle[moved[0] :] - begin, torque_t, torque)


def fit(
    plant: Plant, volts: float, pulses: Sequence[Pulse], breakaway: float, load: float, noise_deg: float = 0.0
) -> Fitted | None:
    """Fit the model to pulses. `breakaway` and `load`: first guesses, shares. None if nothing moved.

    The start of the horn within the backlash and the time of each command are unknown: both are eliminated per pulse.
    """
    used = [one for one in map(_prepare, pulses) if one is not None]
    if not used:
        return None
    quantum = float(np.hypot(QUANTUM_DEG / np.sqrt(12.0), noise_deg))

    def residuals(x: Array) -> Array:
        constants = constants_of(x, breakaway)
        parts = [_pulse_residuals(plant, volts, constants, one, quantum) for one in used]
        return np.concatenate([*parts, (x - centre) / _PRIOR])

    guess = np.array([0.0, np.log(max(breakaway * 0.7, 0.004)), np.log(0.3), 0.2, np.log(0.003), load])
    centre = guess.copy()
    grid = [np.array([inertia, *guess[1:]]) for inertia in np.log1p([0.0, 0.5, 1.2, 2.5, 5.0, 9.0, 14.0, 20.0])]
    x = min(grid, key=lambda one: float(np.square(residuals(one)).sum()))
    x = _least_squares(residuals, x)
    jacobian = _jacobian(residuals, x)
    rest = residuals(x)
    scale = max(float(np.square(rest).mean()), 0.5)
    covariance = np.linalg.pinv(jacobian.T @ jacobian + np.diag(np.full(len(x), 1e-9))) * scale
    return Fitted(
        constants_of(x, breakaway), x, np.sqrt(np.clip(np.diag(covariance), 0.0, None)), quantum * float(np.sqrt(scale))
    )


def _pulse_residuals(plant: Plant, volts: float, constants: PlantConstants, one: _Prepared, quantum: float) -> Array:
    """Weighted residuals of a pulse, without what its unknown offset and times of commands explain."""
    end = float(max(one.t[-1], one.torque_t[-1] if len(one.torque_t) else 0.0))
    times, angle, torque = respond(plant, volts, constants, one.pulse, end)
    speed, rate = np.gradient(angle, times), np.gradient(torque, times)
    slope, torque_slope = np.interp(one.t, times, speed), np.interp(one.torque_t, times, rate)
    # an earlier later command changes the speed after it, which viscous friction then levels
    (_, first), (since, second) = one.pulse.commands[0], one.pulse.commands[-1]
    gain = plant.gain / (1.0 + constants.inertia)
    decay = gain * constants.viscous / plant.synchronous
    after = np.clip(one.t - since, 0.0, None)
    gained = gain * (first - second) * (1.0 - np.exp(-decay * after)) / decay
    sigma, torque_sigma = np.hypot(quantum, slope * _TIME_S), np.hypot(_TORQUE_ERROR, torque_slope * _TIME_S)
    error = np.concatenate([
        (np.interp(one.t, times, angle) - one.angle) / sigma,
        (np.interp(one.torque_t, times, torque) - one.torque) / torque_sigma,
    ])  # fmt: skip
    nothing = np.zeros(len(one.torque_t))
    columns = np.stack([
        np.concatenate([1.0 / sigma, nothing]),
        np.concatenate([slope / sigma, torque_slope / torque_sigma]),
        np.concatenate([gained / sigma, -torque_slope * (one.torque_t > since) / torque_sigma]),
    ], axis=1) * np.array([2.0, _SHIFT_S, _SHIFT_S])  # fmt: skip
    nuisance = np.linalg.solve(columns.T @ columns + np.eye(3), columns.T @ error)
    return np.concatenate([error - columns @ nuisance, nuisance])


def _least_squares(residuals: Callable[[Array], Array], x: Array) -> Array:
    """Levenberg-Marquardt within the limits of the coordinates."""
    damping, found = 1e-2, residuals(x)
    cost = float(found @ found)
    for _ in range(_ROUNDS):
        jacobian = _jacobian(residuals, x)
        normal, gradient = jacobian.T @ jacobian, jacobian.T @ found
        better, gain = False, 0.0
        for _ in range(5):
            step = np.linalg.solve(normal + np.diag(damping * np.diag(normal) + 1e-9), -gradient)
            trial = np.clip(x + step, _LOWER, _UPPER)
            tried = residuals(trial)
            if (new := float(tried @ tried)) < cost:
                better, gain = True, cost - new
                x, found, cost, damping = trial, tried, new, max(damping / 5, 1e-6)
                break
            damping *= 6
        if not better or gain < 1e-4 * cost:
            break
    return x


def _jacobian(residuals: Callable[[Array], Array], x: Array) -> Array:
    """Central differences over steps larger than the jumps that friction makes."""
    columns: list[Array] = []
    for index, step in enumerate(_STEPS):
        low, high = x.copy(), x.copy()
        low[index], high[index] = max(x[index] - step, _LOWER[index]), min(x[index] + step, _UPPER[index])
        columns.append((residuals(high) - residuals(low)) / (high[index] - low[index]))
    return np.stack(columns, axis=1)


def intervals(found: Fitted) -> dict[str, Estimate | None]:
    """Estimates of a fit. The backlash is None if the load keeps the gear on one side, where no sensor at the horn can
    see it."""
    reach = _INFLATION * found.spread + _LEAST
    low = constants_of(np.clip(found.coordinates - reach, _LOWER, _UPPER), 0.0)
    high = constants_of(np.clip(found.coordinates + reach, _LOWER, _UPPER), 0.0)
    made: dict[str, Estimate | None] = {
        name: Estimate(getattr(found.constants, name), getattr(low, name), getattr(high, name)) for name in _NAMES
    }
    hidden = abs(found.constants.load_pct) / 100.0 > _LEANING * found.constants.coulomb
    if hidden or reach[3] > _SEEN_BACKLASH_DEG:
        made["backlash_deg"] = None
    return made


def breakaway_of(seen: Breakaway, load: Estimate | None) -> Estimate | None:
    """Static friction from the torque steps of both directions, in which the load acts oppositely.

    `load`: share, from a fit; without it the load is that of the two directions.
    """
    if seen.cw is None or seen.ccw is None:
        return None
    up, down = seen.cw, seen.ccw
    if load is None:
        middle, reach = (sum(up) + sum(down)) / 4.0, QUANTUM
        return Estimate(max(middle, 0.0), max(middle - reach, 0.0), middle + reach)
    error = max(load.high - load.value, load.value - load.low)
    low = max(up[0] + load.value, down[0] - load.value) - error
    high = min(up[1] + load.value, down[1] - load.value) + error
    if low > high:
        low, high = min(low, high) - QUANTUM / 2, max(low, high) + QUANTUM / 2
    return Estimate((max(low, 0.0) + high) / 2.0, max(low, 0.0), high)


def load_guess(seen: Breakaway) -> float:
    """Load from the torque steps of both directions, share."""
    if seen.cw is None or seen.ccw is None:
        return 0.0
    return (sum(seen.ccw) - sum(seen.cw)) / 4.0


def noise_of(angles: Sequence[float]) -> Estimate:
    """Noise of readings of a horn at rest, RMS, °. Below the resolution it cannot be told from none.

    From differences of consecutive readings, which slow motion does not change.
    """
    values = np.asarray(angles)
    variance = float(np.square(np.diff(values)).mean()) / 2.0 if len(values) > 1 else 0.0
    noise = float(np.sqrt(max(variance - QUANTUM_DEG**2 / 12.0, 0.0)))
    reach = noise * 2.0 / np.sqrt(2.0 * max(len(values) - 1, 1))
    return Estimate(noise, max(noise - reach - 0.03, 0.0), noise + reach + 0.05)


def supply_of(samples: Sequence[SupplySample], plant: Plant) -> Estimate | None:
    """Resistance of the supply, Ω, from its voltage at different torques. None if they are too alike."""
    torque, volts = np.array([abs(one.torque) for one in samples]), np.array([one.volts for one in samples])
    if len(samples) < 6 or np.ptp(torque) < 0.08:
        return None
    slope, _ = np.polyfit(torque, volts, 1)
    reach = 0.12 / float(np.ptp(torque)) / plant.stall_a
    ohm = (-float(slope) - DROOP * plant.nominal_v) / plant.stall_a
    return Estimate(max(ohm, 0.0), max(ohm - reach, 0.0), max(ohm, 0.0) + reach)


def threshold_of(held: Sequence[float], moved: Sequence[float], *, error_deg: float = QUANTUM_DEG) -> Estimate | None:
    """Deadband from position errors at which the horn rested (`held`) and began to move (`moved`), °."""
    if not held or not moved:
        return None
    low, high = float(np.median(held)), float(np.median(moved))
    low, high = min(low, high), max(low, high)
    return Estimate((low + high) / 2.0, max(low - error_deg / 2.0, 0.0), high + error_deg / 2.0)


class Sides(NamedTuple):
    """Repeatability: spread of end positions from the same side, RMS, and difference between both sides, °."""

    repeatability: Estimate
    reversal: Estimate


def sides_of(from_below: Sequence[float], from_above: Sequence[float]) -> Sides:
    """Repeatability of end positions (°) reached from both sides, at least two each."""
    below, above = np.asarray(from_below), np.asarray(from_above)
    freedom = len(below) + len(above) - 2
    variance = float((below.var() * len(below) + above.var() * len(above)) / max(freedom, 1))
    spread = float(np.sqrt(variance + QUANTUM_DEG**2 / 12.0))
    reach = 2.0 * spread / float(np.sqrt(2.0 * max(freedom, 1)))
    difference = abs(float(above.mean() - below.mean()))
    error = 2.0 * spread * float(np.sqrt(1.0 / len(below) + 1.0 / len(above))) + QUANTUM_DEG / 2.0
    return Sides(
        Estimate(float(np.sqrt(variance)), max(float(np.sqrt(variance)) - reach, 0.0), spread + reach),
        Estimate(difference, max(difference - error, 0.0), difference + error),
    )


def speed_of(samples: Sequence[tuple[float, float]], window_s: float = 0.03) -> Estimate | None:
    """Highest speed, rpm, as the steepest straight line over `window_s`. None with too few samples."""
    t: Array = np.array([one[0] for one in samples])
    angle: Array = np.array([one[1] for one in samples])
    best: Estimate | None = None
    for begin in range(len(samples)):
        until = samples[begin][0] + window_s
        within = slice(begin, int((t < until).sum()))
        if samples[-1][0] < until or len(t[within]) < 5:
            continue
        slope: Array = np.polyfit(t[within], angle[within], 1)
        speed = abs(float(slope[0])) / 6.0
        if best is None or speed > best.value:
            spread = float(np.sqrt(np.square(t[within] - t[within].mean()).sum()))
            reach = 2.0 * (QUANTUM_DEG / np.sqrt(12.0) / spread / 6.0 + speed * _TIME_S / spread)
            best = Estimate(speed, max(speed - reach, 0.0), speed + reach)
    return best


class Zone(NamedTuple):
    """Load and friction, shares of stall torque, at an angle."""

    deg: float
    load: float
    friction: float


BIN_DEG: Final = 5.0


def along(cw: Sequence[tuple[float, float]], ccw: Sequence[tuple[float, float]]) -> list[Zone]:
    """Load and friction along the travel from (angle, torque) samples of slow motion in both directions."""
    bins: dict[int, tuple[list[float], list[float]]] = {}
    for direction, samples in enumerate((cw, ccw)):
        for angle, torque in samples:
            bins.setdefault(int(np.floor(angle / BIN_DEG)), ([], []))[direction].append(torque)
    found: list[Zone] = []
    for number, (up, down) in sorted(bins.items()):
        if len(up) >= 5 and len(down) >= 5:
            mean_up, mean_down = float(np.mean(up)), float(np.mean(down))
            found.append(Zone((number + 0.5) * BIN_DEG, -(mean_up + mean_down) / 2.0, (mean_up - mean_down) / 2.0))
    return found


ZONE_ERROR: Final = 0.006
"""Half of the 95 % interval of the load in a zone: 0x0A reads whole percents."""
BINDING: Final = 0.05
"""Friction above the median of the travel from which a zone binds, share of stall torque."""


def binding(zones: Sequence[Zone]) -> list[Zone]:
    """Zones whose friction is much higher than that of the travel."""
    if not zones:
        return []
    usual = float(np.median([one.friction for one in zones]))
    return [one for one in zones if one.friction > usual + BINDING]


def plant_constants(
    found: dict[str, Estimate | None], *, sign: int, origin_deg: float, zones: Sequence[Zone] = ()
) -> PlantConstants:
    """Constants of the plant, in the horn's directions, from estimates in those of the registers by name.

    `sign`: -1 with reverse (0x23); `origin_deg`: 0x44. What is not known has its default.
    """

    def value(name: str, otherwise: float) -> float:
        one = found.get(name)
        return otherwise if one is None else one.value

    def plant_deg(name: str) -> float | None:
        one = found.get(name)
        return None if one is None else sign * (one.value + origin_deg)

    stops = plant_deg("stop_cw_deg"), plant_deg("stop_ccw_deg")
    high, low = stops if sign > 0 else stops[::-1]
    coulomb = value("coulomb", DEFAULT_PLANT.coulomb)
    made = PlantConstants(
        inertia=value("inertia", 0.0), coulomb=coulomb,
        breakaway=max(value("breakaway", DEFAULT_PLANT.breakaway), coulomb),
        viscous=value("viscous", DEFAULT_PLANT.viscous), backlash_deg=value("backlash_deg", DEFAULT_PLANT.backlash_deg),
        torque_lag_s=value("torque_lag_s", DEFAULT_PLANT.torque_lag_s), load_pct=sign * value("load_pct", 0.0),
        supply_ohm=value("supply_ohm", 0.0), stop_cw_deg=high, stop_ccw_deg=low,
        sensor_noise_deg=value("sensor_noise_deg", 0.0),
    )  # fmt: skip
    loads = [one.load for one in zones]
    if len(zones) < 2 or max(loads) - min(loads) < 4 * ZONE_ERROR:
        return made
    points = sorted((sign * (one.deg + origin_deg), 100.0 * sign * one.load) for one in zones)
    return replace(made, load_pct=0.0, load_by_angle=tuple(points))
