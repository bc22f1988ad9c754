"""Response of one servo and its horn to angle commands, computed with the simulator's mechanics. Pure.

Angles and directions are those of the servo's registers (0x00, 0x08). The model has no bus: a command takes effect at
once, and angles are exact.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from hornbill.domain.plant import PlantConstants
from hornbill.schema.model import ServoModel
from hornbill.sim.mechanics.motion import Controller, HornMotion, Orders
from hornbill.sim.mechanics.plant import STEP_S, Plant, plant_of
from hornbill.units import Raw

GAINS: Final = ("angle_p_gain", "angle_d_gain", "angle_dead_band", "angle_boost")
"""Rows that Improve may change."""
EXPERT_GAINS: Final = ("speed_p_gain", "speed_i_gain")
"""Rows of the speed loop, only with `expert`: the maker recommends their defaults (4.25, 4.26)."""
SHAPING: Final = (
    *GAINS, *EXPERT_GAINS, "speed_dead_band", "speed_i_limit", "speed_limit_cw", "speed_limit_ccw", "torque_limit_cw",
    "torque_limit_ccw", "overcurrent_limit", "smoothing", "speed_torque_control", "reverse",
)  # fmt: skip
"""Rows on which the response to an angle command depends."""

SAMPLE_S: Final = 0.002
"""Interval of computed angles."""
_STEPS_PER_SAMPLE: Final = round(SAMPLE_S / STEP_S)
_SUPPLY_EVERY: Final = 12
"""Samples between updates of the supply voltage under load."""
_DROOP: Final = 0.06
"""Drop of the supply inside the servo at stall torque, share of the nominal voltage."""
_RPM: Final = 6.0
_LEFTOVER: Final = 1e-6
_INNER_DAMPING: Final = 2.4
_SPEED_DEAD_BAND_RPM: Final = 0.001

Angles = np.ndarray
Gains = Mapping[str, Raw]


class Move(NamedTuple):
    """A command: target angle, °, and how long it is followed, s. `gains`: rows written before it."""

    to_deg: float
    duration_s: float
    gains: Gains


@dataclass(frozen=True)
class Loop:
    """The servo without its horn: plant of its model, raw values of the rows in `SHAPING`, supply at rest, V."""

    plant: Plant
    rows: Mapping[str, Raw]
    supply_v: float
    delay_s: float = 0.0
    """Time from the acknowledgement of a command to its effect in the readings, s."""
    ranges: Mapping[str, tuple[Raw, Raw]] = field(default_factory=dict[str, tuple[Raw, Raw]])
    """Range of each gain that may be changed."""

    @classmethod
    def of(cls, model: ServoModel, rows: Mapping[str, Raw], supply_v: float) -> "Loop":
        """The loop of a servo of this model."""
        ranges = {
            key: (model.parameters[key].minimum or 0, model.parameters[key].maximum or 0)
            for key in (*GAINS, *EXPERT_GAINS)
            if key in rows
        }
        return cls(plant_of(model), {key: rows[key] for key in SHAPING if key in rows}, supply_v, ranges=ranges)

    @cached_property
    def cascade(self) -> bool:
        """Whether the speed loop is active (0x25), so that D gain and limits have an effect."""
        return self.rows.get("speed_torque_control") == 1

    def tuned(self, gains: Gains) -> "Loop":
        """The same loop with these gains."""
        return replace(self, rows={**self.rows, **gains})

    def orders(self, target_deg: float, volts: float) -> Orders:
        """Orders of the controller for a target. `volts`: supply relative to nominal."""
        get, plant = self.rows.get, self.plant
        current = get("overcurrent_limit", 0) / 10.0 / plant.stall_a or 1.0
        return Orders(
            Controller.ANGLE_CASCADE if self.cascade else Controller.ANGLE_DIRECT,
            target_deg,
            smooth=get("smoothing", 0) == 1,
            angle_p=self.angle_p,
            angle_d=get("angle_d_gain", 0) * plant.angle_d,
            dead_band=get("angle_dead_band", 0) / 10.0 + _LEFTOVER,
            boost=get("angle_boost", 0) / 1000.0,
            speed_p=get("speed_p_gain", 0) * plant.speed_p,
            speed_i=get("speed_i_gain", 0) * plant.speed_i,
            speed_dead_band=get("speed_dead_band", 0) * _SPEED_DEAD_BAND_RPM * _RPM,
            speed_i_limit=get("speed_i_limit", 0) * plant.speed_i_limit,
            speed_low=get("speed_limit_ccw", -1000) * _RPM,
            speed_high=get("speed_limit_cw", 1000) * _RPM,
            torque_low=get("torque_limit_ccw", -100) / 100.0,
            torque_high=get("torque_limit_cw", 100) / 100.0,
            current_limit=current,
            volts=volts,
        )

    @property
    def angle_p(self) -> float:
        """P gain: °/s per ° in the cascade, share of stall torque per ° without."""
        factor = self.plant.angle_p if self.cascade else self.plant.angle_p_direct
        return self.rows.get("angle_p_gain", 0) * factor

    @property
    def stiffness(self) -> float:
        """Torque per angle error of a held horn, share of stall torque per °."""
        speed_p = self.rows.get("speed_p_gain", 0) * self.plant.speed_p
        return self.angle_p * speed_p if self.cascade else self.angle_p

    def respond(self, constants: PlantConstants, begin_deg: float, moves: Sequence[Move]) -> list[Angles]:
        """Angles of each move, every SAMPLE_S from its command on, of a horn that rests at `begin_deg` before."""
        plant = self.plant
        horn = HornMotion(plant, begin_deg, 0.0, constants)
        sag = _DROOP * plant.nominal_v + constants.supply_ohm * plant.stall_a
        loop, now, found = self, 0.0, list[Angles]()
        for move in moves:
            loop = loop.tuned(move.gains) if move.gains else loop
            count = round(move.duration_s / SAMPLE_S)
            angles = np.empty(count + 1)
            angles[0] = horn.angle
            for index in range(0, count, _SUPPLY_EVERY):
                if horn.asleep and index:
                    angles[index + 1 :] = horn.angle
                    break
                volts = round((self.supply_v - sag * abs(horn.torque)) / plant.nominal_v, 2)
                horn.obey(loop.orders(move.to_deg, volts))
                end, steps = min(index + _SUPPLY_EVERY, count), list[float]()
                horn.advance(now + end * SAMPLE_S + 1e-9, steps)
                seen = steps[_STEPS_PER_SAMPLE - 1 :: _STEPS_PER_SAMPLE]
                angles[index + 1 : end + 1] = horn.angle
                angles[index + 1 : index + 1 + len(seen)] = seen
            now += count * SAMPLE_S
            horn.advance(now + 1e-9)
            found.append(angles)
        return found

    def phase_margin_deg(self, constants: PlantConstants) -> float:
        """Phase margin of the linear loop without friction and backlash, °. 0 if it is unstable."""
        plant, hertz = self.plant, np.logspace(-1, 2.3, 400)
        s = 2j * np.pi * hertz
        emf, gain = 1.0 / plant.synchronous, plant.gain / (1.0 + constants.inertia)
        drag = gain * constants.viscous * emf
        lag = (1.0 + s * constants.torque_lag_s) * np.exp(s * 0.0015)  # sampling and computing take 1.5 periods
        if self.cascade:
            get = self.rows.get
            control = get("speed_p_gain", 0) * plant.speed_p + get("speed_i_gain", 0) * plant.speed_i / s
            damping = 1.0 + get("angle_d_gain", 0) * plant.angle_d
            open_loop = self.angle_p * control * gain / ((s + drag) * lag + control * gain * damping) / s
        else:
            open_loop = self.angle_p * gain / ((s + drag) * lag + gain * emf * (_INNER_DAMPING + 1.0)) / s
        above = np.flatnonzero(np.abs(open_loop) >= 1.0)
        if not len(above):
            return 90.0
        phase = float(np.unwrap(np.angle(open_loop))[int(above[-1])])
        turns = round((phase + np.pi / 2) / (2 * np.pi))
        return max(0.0, 180.0 + float(np.degrees(phase - 2 * np.pi * turns)))
