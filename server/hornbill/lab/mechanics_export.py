"""Stored mechanics as shown and exported: newest values, twin for the simulator, MuJoCo and URDF. Pure functions."""

from collections.abc import Mapping, Sequence
from math import radians
from typing import Any, Final, cast, get_args
from xml.sax.saxutils import quoteattr

from hornbill.domain.frequency_response import Estimate
from hornbill.domain.mechanics import Mechanics, MechanicsValue, Quantity, TravelPoint, Twin
from hornbill.domain.note import Note
from hornbill.domain.plant import PlantConstants
from hornbill.domain.set_up import SetUp
from hornbill.lab import mechanics
from hornbill.lab.mechanics import Zone
from hornbill.lab.mechanics_job import UNITS
from hornbill.schema.catalog import Catalog
from hornbill.sim.mechanics.plant import Plant, plant_of
from hornbill.store.runs import Run
from hornbill.units import Uid

UNKNOWABLE: Final = (
    Note("Motor angle and backlash while a load pushes the gear to one side.", "unknowable_loaded_backlash"),
    Note("Elasticity between horn and load: the sensor is at the horn.", "unknowable_elasticity"),
    Note("Torque in N·m: the servo reports shares of its own stall torque.", "unknowable_torque"),
    Note("Noise and backlash below the resolution of 0.1°.", "unknowable_resolution"),
)
"""What no measurement through the servo can tell."""

WHY: Final[Mapping[str, Note]] = {
    "backlash_deg": Note(
        "The load keeps the gear on one side. Relieve it, or measure where it is below friction.", "gear_on_one_side"
    ),
    "stop_cw_deg": Note("No end stop within the range.", "no_stop_in_range"),
    "stop_ccw_deg": Note("No end stop within the range.", "no_stop_in_range"),
    "supply_ohm": Note("The torques were too alike. Permit more torque.", "too_little_torque"),
}
"""Why a quantity could not be measured, by its name."""
_TOO_FEW: Final = Note("Too few samples. Check the bus, and repeat the test.", "too_few_samples")


def known(uid: Uid, runs: Sequence[Run]) -> Mechanics:
    """Newest value of each quantity from the runs of one servo, newest first."""
    values: dict[str, MechanicsValue] = {}
    travel: list[TravelPoint] = []
    travel_run: int | None = None
    for run in runs:
        estimates = cast("Mapping[str, Mapping[str, float] | None]", run.document.get("estimates") or {})
        for name, one in estimates.items():
            if name in values or name not in UNITS:
                continue
            values[name] = MechanicsValue(
                name=cast("Quantity", name), unit=UNITS[cast("Quantity", name)],
                estimate=None if one is None else Estimate(**one),
                note=WHY.get(name, _TOO_FEW) if one is None else None, at=run.at, run=run.id,
            )  # fmt: skip
        zones = zones_of(run)
        if zones and travel_run is None:
            bound = mechanics.binding(zones)
            travel_run = run.id
            travel = [
                TravelPoint(
                    angle_deg=one.deg, load_pct=100 * one.load, friction_pct=100 * one.friction, binding=one in bound
                )
                for one in zones
            ]
    order = get_args(Quantity.__value__)
    return Mechanics(
        uid=uid, values=sorted(values.values(), key=lambda one: order.index(one.name)), travel=travel,
        travel_run=travel_run, unknowable=list(UNKNOWABLE),
    )  # fmt: skip


def zones_of(run: Run) -> list[Zone]:
    """Load and friction along the travel of one run."""
    return [Zone(*one) for one in cast("list[list[float]]", run.document.get("zones") or [])]


def twin(found: Mechanics, newest: Run) -> Twin:
    """A servo for the simulator, in the directions of its horn."""
    rows = _rows(newest)
    zones = [Zone(one.angle_deg, one.load_pct / 100, one.friction_pct / 100) for one in found.travel]
    plant = mechanics.plant_constants(
        {one.name: one.estimate for one in found.values},
        sign=-1 if rows.get("reverse") else 1,
        origin_deg=_number(rows, "origin"),
        zones=zones,
    )
    document: Mapping[str, Any] = newest.document
    return Twin(
        format="hornbill-twin/1", uid=found.uid, model=document.get("model"), firmware=document.get("firmware"),
        set_up=SetUp.model_validate(document.get("set_up") or {}), plant=plant, values=found.values,
    )  # fmt: skip


class Actuator:
    """Joint and position actuator of a servo in SI units; `stall_nm`: its stall torque, N·m. Without it, 1."""

    def __init__(self, plant: Plant, constants: PlantConstants, rows: Mapping[str, Any], stall_nm: float = 1.0) -> None:
        stall = stall_nm
        self.armature = stall * (1.0 + constants.inertia) / radians(plant.gain)
        self.damping = stall * constants.viscous / radians(plant.synchronous)
        self.friction = stall * constants.coulomb
        self.load = stall * constants.load_pct / 100.0
        self.lag_s = constants.torque_lag_s
        self.speed = radians(plant.synchronous) * (1.0 - constants.coulomb) / (1.0 + constants.viscous)
        self.low, self.high = constants.stop_ccw_deg, constants.stop_cw_deg
        gain, emf = _number(rows, "angle_p_gain"), 1.0 / plant.synchronous
        if rows.get("speed_torque_control"):
            speed_p = _number(rows, "speed_p_gain") * plant.speed_p
            share_per_deg = gain * plant.angle_p * speed_p
            share_per_speed = speed_p * (1.0 + _number(rows, "angle_d_gain") * plant.angle_d)
            self.force = stall * min(_number(rows, "torque_limit_cw", 100.0) / 100.0, 1.0)
        else:
            share_per_deg = gain * plant.angle_p_direct
            share_per_speed = emf * (_INNER_DAMPING + 1.0)
            self.force = stall
        # MuJoCo applies its feedback at once. Torque that lags behind by a small time is, to first order, feedback with
        # less damping on a smaller inertia, which higher gains replace.
        lag = self.lag_s + _PERIOD_S
        inertia = (1.0 + constants.inertia) / plant.gain
        higher = 1.0 / (1.0 - min(share_per_speed * lag / inertia, _MOST_LAG))
        self.kp = stall * higher * share_per_deg / radians(1.0)
        self.kv = stall * higher * max(share_per_speed - share_per_deg * lag, 0.0) / radians(1.0)


_PERIOD_S: Final = 0.001
"""Delay of the servo's loop, which samples and holds for its period."""
_MOST_LAG: Final = 0.6
_INNER_DAMPING: Final = 2.4
"""Speed feedback of the angle loop without 0x25, as a share of back-EMF."""


def actuator(found: Twin, newest: Run, catalog: Catalog, stall_nm: float | None) -> Actuator | None:
    """The actuator of a twin. None if its model is unknown."""
    model = catalog.models.get(found.model or "")
    return None if model is None else Actuator(plant_of(model), found.plant, _rows(newest), stall_nm or 1.0)


def mjcf(name: str, one: Actuator) -> str:
    """MuJoCo model: hinge with armature, damping and friction, and a position servo with the gains of the last run.

    Backlash is not part of it. Angles in rad, clockwise positive.
    """
    limits = ""
    if one.low is not None and one.high is not None:
        limits = f' limited="true" range="{radians(one.low):.6g} {radians(one.high):.6g}"'
    return f"""<mujoco model={quoteattr(name)}>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.0005" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody>
    <body name="horn">
      <joint name="horn" type="hinge" axis="0 0 1" armature="{one.armature:.6g}" damping="{one.damping:.6g}" \
frictionloss="{one.friction:.6g}"{limits}/>
      <inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>
    </body>
  </worldbody>
  <actuator>
    <general name="servo" joint="horn" dyntype="filter" dynprm="{one.lag_s:.6g}" gainprm="{one.kp:.6g}" \
biastype="affine" biasprm="0 {-one.kp:.6g} {-one.kv:.6g}" forcerange="{-one.force:.6g} {one.force:.6g}"/>
    <general name="load" joint="horn" gainprm="0" biastype="affine" biasprm="{one.load:.6g} 0 0"/>
  </actuator>
</mujoco>
"""


def urdf(name: str, one: Actuator) -> str:
    """URDF robot of one revolute (or continuous) joint with limit and dynamics. Clockwise is positive."""
    stops = one.low is not None and one.high is not None
    kind = "revolute" if stops else "continuous"
    ends = f'lower="{radians(one.low or 0.0):.6g}" upper="{radians(one.high or 0.0):.6g}" ' if stops else ""
    return f"""<?xml version="1.0"?>
<robot name={quoteattr(name)}>
  <link name="servo"/>
  <link name="horn">
    <inertial>
      <mass value="1e-6"/>
      <inertia ixx="{one.armature:.6g}" ixy="0" ixz="0" iyy="{one.armature:.6g}" iyz="0" izz="{one.armature:.6g}"/>
    </inertial>
  </link>
  <joint name="horn" type="{kind}">
    <parent link="servo"/>
    <child link="horn"/>
    <axis xyz="0 0 1"/>
    <limit {ends}effort="{one.force:.6g}" velocity="{one.speed:.6g}"/>
    <dynamics damping="{one.damping:.6g}" friction="{one.friction:.6g}"/>
  </joint>
</robot>
"""


def _rows(run: Run) -> Mapping[str, Any]:
    return cast("Mapping[str, Any]", run.document.get("parameters") or {})


def _number(rows: Mapping[str, Any], key: str, otherwise: float = 0.0) -> float:
    value = rows.get(key)
    return float(value) if isinstance(value, int | float) else otherwise
