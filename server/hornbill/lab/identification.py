"""Identification: constants of a horn from measured steps, by fitting the model to them. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Final, NamedTuple

import numpy as np

from hornbill.domain.plant import PlantConstants
from hornbill.domain.step_test import StepTrace
from hornbill.lab.model import SAMPLE_S, Angles, Gains, Loop, Move

CHAINS: Final = 2
"""Maximum number of chains in a fit, the newest."""
LONGEST: Final = 4
"""Maximum number of steps of a chain, the last."""
AT_REST_S: Final = 0.1
"""Time at rest at the end of each step that is part of the fit. The rest tells nothing new."""
CHANGE_DEG: Final = 0.15
"""Change of a reading that is more than the resolution of the sensor, °."""

_LOWER: Final = np.array([0.0, -1.6, -1.6, 0.0, -0.6, 0.0, -0.004])
_UPPER: Final = np.array([3.4, 1.6, 1.2, 1.2, 0.6, 0.5, 0.012])
_STEP: Final = np.array([0.02, 0.04, 0.08, 0.03, 0.01, 0.02, 0.0004])
_PRIOR: Final = np.array([np.inf, 2.0, 0.6, 0.5, 0.5, 0.15, 0.01])
_COARSE: Final = [(inertia, friction) for inertia in (0.05, 0.7, 1.4, 2.1, 2.7) for friction in (-0.5, 0.3, 0.9)]
_PULL: Final = 0.3
"""Weight of what is known before, in degrees."""
_CORRELATED: Final = 15.0
"""Samples per independent residual: neighbouring residuals of a model are alike."""


class Interval(NamedTuple):
    """95 % interval of a constant."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Identified:
    """Constants of a horn in the directions of its registers, with 95 % intervals by name.

    `rms_deg`: remaining deviation of the model from the measured angles.
    """

    constants: PlantConstants
    intervals: dict[str, Interval]
    delay_s: float
    rms_deg: float


Chain = Sequence[tuple[Gains, StepTrace]]
"""Consecutive steps, each with the gains under which it was measured."""


@dataclass(frozen=True, slots=True)
class _Chain:
    """A chain prepared for the fit: times and angles of each step, as far as it is used."""

    begin_deg: float
    moves: list[Move]
    seen: list[tuple[Angles, Angles]]

    @classmethod
    def of(cls, chain: Chain) -> "_Chain":
        seen = [_used(np.asarray(one.t), np.asarray(one.angle_deg)) for _, one in chain]
        moves = [Move(one.to_deg, float(t[-1]) + 0.02, gains) for (gains, one), (t, _) in zip(chain, seen, strict=True)]
        return cls(chain[0][1].angle_deg[0], moves, seen)


def _used(t: Angles, angles: Angles) -> tuple[Angles, Angles]:
    changing = np.flatnonzero(np.abs(angles - angles[-1]) > CHANGE_DEG)
    until = t[changing[-1]] + AT_REST_S if len(changing) else AT_REST_S
    count = max(2, int(np.searchsorted(t, until)))
    return t[:count], angles[:count]


def fit(loop: Loop, chains: Sequence[Chain], before: Identified | None = None) -> Identified:
    """Fit the model to measured steps. `before`: an earlier result, from which the fit begins.

    Needs the package scipy.
    """
    least_squares: Any = import_module("scipy.optimize").least_squares
    prepared = [_Chain.of(one[-LONGEST:]) for one in chains[-CHAINS:]]
    start = _start(before)

    def residuals(x: Angles) -> Angles:
        constants, delay = _constants(x)
        parts: list[Angles] = []
        for chain in prepared:
            found = loop.respond(constants, chain.begin_deg, chain.moves)
            parts += [_sampled(one, t - delay) - seen for one, (t, seen) in zip(found, chain.seen, strict=True)]
        return np.concatenate([*parts, (x - start) / _PRIOR * _PULL])

    def cost(x: Angles) -> float:
        return float(np.square(residuals(x)).sum())

    def jacobian(x: Angles) -> Angles:
        return _jacobian(residuals, x)

    x = start
    if before is None:
        guesses = [np.array([inertia, friction, *start[2:]]) for inertia, friction in _COARSE]
        x = min(guesses, key=cost)
    found = least_squares(
        residuals, np.clip(x, _LOWER + 1e-6, _UPPER - 1e-6), jac=jacobian,
        bounds=(_LOWER, _UPPER), x_scale=_STEP * 10, loss="soft_l1", f_scale=0.3,
        max_nfev=12 if before is None else 6, ftol=1e-3, xtol=1e-3,
    )  # fmt: skip
    constants, delay = _constants(found.x)
    rest = residuals(found.x)[: -len(start)]
    spread = _spread(_jacobian(residuals, found.x), float(np.square(rest).mean()))
    return Identified(constants, _intervals(found.x, spread), delay, float(np.sqrt(np.square(rest).mean())))


def _start(before: Identified | None) -> Angles:
    if before is None:
        return np.array([0.7, 0.0, 0.0, 0.2, 0.0, 0.02, 0.001])
    one = before.constants
    default = PlantConstants()
    return np.array([
        np.log1p(one.inertia), np.log(max(one.coulomb, 1e-3) / default.coulomb),
        np.log(max(one.viscous, 1e-2) / default.viscous), one.backlash_deg, one.load_pct / 100, one.supply_ohm,
        before.delay_s,
    ])  # fmt: skip


def _constants(x: Angles) -> tuple[PlantConstants, float]:
    inertia, friction, viscous, backlash, load, ohm, delay = (float(one) for one in x)
    default = PlantConstants()
    constants = PlantConstants(
        inertia=float(np.expm1(inertia)), breakaway=default.breakaway * float(np.exp(friction)),
        coulomb=default.coulomb * float(np.exp(friction)), viscous=default.viscous * float(np.exp(viscous)),
        backlash_deg=backlash, load_pct=load * 100, supply_ohm=ohm,
    )  # fmt: skip
    return constants, delay


def _sampled(angles: Angles, t: Angles) -> Angles:
    return np.interp(t, np.arange(len(angles)) * SAMPLE_S, angles)


def _jacobian(residuals: Any, x: Angles) -> Angles:
    """Central differences over steps larger than the jumps that friction makes."""
    columns: list[Angles] = []
    for index, step in enumerate(_STEP):
        low, high = x.copy(), x.copy()
        low[index], high[index] = max(x[index] - step, _LOWER[index]), min(x[index] + step, _UPPER[index])
        columns.append((residuals(high) - residuals(low)) / (high[index] - low[index]))
    return np.stack(columns, axis=1)


def _spread(jacobian: Angles, variance: float) -> Angles:
    """Standard deviation of each coordinate."""
    information = jacobian.T @ jacobian / (max(variance, 0.03**2) * _CORRELATED)
    return np.sqrt(np.clip(np.diag(np.linalg.pinv(information)), 0.0, None))


def _intervals(x: Angles, spread: Angles) -> dict[str, Interval]:
    low, _ = _constants(np.clip(x - 2 * spread, _LOWER, _UPPER))
    high, _ = _constants(np.clip(x + 2 * spread, _LOWER, _UPPER))
    names = ("inertia", "breakaway", "coulomb", "viscous", "backlash_deg", "load_pct", "supply_ohm")
    return {name: Interval(getattr(low, name), getattr(high, name)) for name in names}


def variants(found: Identified) -> list[PlantConstants]:
    """Constants as identified, then others within their uncertainty, for robust predictions."""
    one, intervals = found.constants, found.intervals

    def within(name: str, share: float, least: float) -> tuple[float, float]:
        value, interval = getattr(one, name), intervals[name]
        reach = min(max(interval.high - interval.low, 0.0) / 2, share * value + least)
        return max(value - reach, 0.0), value + reach

    inertia, friction, backlash = (
        within("inertia", 0.15, 0.1),
        within("coulomb", 0.3, 0.003),
        within("backlash_deg", 0.3, 0.05),
    )
    low, high = (f / max(one.coulomb, 1e-6) for f in friction)
    return [
        one,
        replace(
            one,
            inertia=inertia[1] * 1.05,
            coulomb=one.coulomb * low,
            breakaway=one.breakaway * low,
            backlash_deg=backlash[1],
        ),
        replace(
            one,
            inertia=inertia[0] * 0.95,
            coulomb=one.coulomb * high,
            breakaway=one.breakaway * high,
            backlash_deg=backlash[0],
        ),
    ]
