"""Physical constants of one simulated or identified horn: load, friction, backlash, supply, end stops, sensor."""

from collections.abc import Mapping
from dataclasses import fields
from difflib import get_close_matches
from itertools import pairwise
from typing import Annotated, Any, Final, NamedTuple, Self

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError, model_validator
from pydantic.dataclasses import dataclass

from hornbill.errors import InvalidValue

_Point = tuple[Annotated[float, Field(ge=-36_000, le=36_000)], Annotated[float, Field(ge=-1000, le=1000)]]


@dataclass(frozen=True, slots=True, config=ConfigDict(extra="forbid"))  # one schema for requests and responses
class PlantConstants:
    """Constants of one horn. The defaults are those of a servo without load on a stiff supply.

    Torque is relative to stall torque at nominal supply, angles are those of the horn clockwise from its notch (0x08
    without origin and reverse).
    """

    inertia: float = Field(
        default=0.0, ge=0, le=1e7, description="Inertia on the horn, as a multiple of the servo's own inertia there."
    )
    breakaway: float = Field(default=0.03, ge=0, le=1, description="Static friction, share of stall torque.")
    coulomb: float = Field(
        default=0.02, ge=0, le=1, description="Friction of a moving horn, share of stall torque. At most `breakaway`."
    )
    viscous: float = Field(
        default=0.3, ge=0, le=10, description="Viscous friction at no-load speed, share of stall torque."
    )
    backlash_deg: float = Field(default=0.2, ge=0, le=10, description="Backlash between motor and horn, °.")
    torque_lag_s: float = Field(
        default=0.003, ge=0.0005, le=0.1, description="Time constant of torque behind its demand, s."
    )
    load_pct: float = Field(
        default=0.0, ge=-1000, le=1000, description="Constant load, % of stall torque. Positive pushes clockwise."
    )
    load_by_angle: tuple[_Point, ...] = Field(
        default=(),
        description="Additional load at angles: pairs of angle (°, increasing) and load (% of stall torque), linear in "
        "between, constant beyond the ends.",
    )
    supply_ohm: float = Field(
        default=0.0,
        ge=0,
        le=100,
        description="Resistance of the supply and its cable, Ω. Voltage drops by it times the motor current.",
    )
    stop_cw_deg: float | None = Field(
        default=None, ge=-36_000, le=36_000, description="Clockwise end stop of the horn, °. Null for none."
    )
    stop_ccw_deg: float | None = Field(
        default=None, ge=-36_000, le=36_000, description="Counterclockwise end stop of the horn, °. Null for none."
    )
    sensor_noise_deg: float = Field(
        default=0.0, ge=0, le=10, description="Noise of angle readings, RMS, °. The servo's own loop filters it."
    )
    wear_per_hour: float = Field(
        default=0.0, ge=0, le=1e6, description="Growth of all friction per hour of motion, as a share."
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.coulomb > self.breakaway:
            raise ValueError(f"coulomb {self.coulomb:g} is above breakaway, {self.breakaway:g}. Enter at most that.")
        if self.stop_cw_deg is not None and self.stop_ccw_deg is not None and self.stop_ccw_deg >= self.stop_cw_deg:
            raise ValueError(
                f"stop_ccw_deg {self.stop_ccw_deg:g} is not below stop_cw_deg, {self.stop_cw_deg:g}. Exchange them."
            )
        angles = [angle for angle, _ in self.load_by_angle]
        if any(after <= before for before, after in pairwise(angles)):
            raise ValueError("The angles of load_by_angle do not increase. Sort the pairs by angle.")
        return self


DEFAULT_PLANT: Final = PlantConstants()
PLANT_NAMES: Final = tuple(one.name for one in fields(PlantConstants))
_CHECK: Final = TypeAdapter(PlantConstants)


def plant_from(document: Mapping[str, object]) -> PlantConstants:
    """Constants from a file or request; omitted ones have their defaults.

    Raises InvalidValue for an unknown name, with the nearest, and for a value out of range, with its limit.
    """
    for name in document:
        if name not in PLANT_NAMES:
            near = get_close_matches(name, PLANT_NAMES, 1)
            raise InvalidValue(
                f"Unknown plant constant {name!r}. "
                + (f"Did you mean {near[0]}?" if near else f"Known: {', '.join(PLANT_NAMES)}."),
                cause="names_unknown",
                names=[name],
                known=list(PLANT_NAMES),
            )
    try:
        return _CHECK.validate_python(dict(document))
    except ValidationError as error:
        found = [_Refusal(one["loc"], one.get("ctx", {}), one["input"], one["msg"]) for one in error.errors()]
        names = [str(one.where[0]) for one in found if one.where]
        raise InvalidValue("\n".join(map(_sentence, found)), cause="plant_invalid", names=names) from None


class _Refusal(NamedTuple):
    """One error of pydantic: where, its limits by name, the value, and its text."""

    where: tuple[int | str, ...]
    limits: dict[str, Any]
    value: object
    text: str


def _sentence(refusal: _Refusal) -> str:
    """A refusal with value and limit."""
    name, limits, value = ".".join(map(str, refusal.where)), refusal.limits, refusal.value
    if "ge" in limits:
        return f"{name} {value} is below its limit. Enter at least {limits['ge']:g}."
    if "le" in limits:
        return f"{name} {value} is above its limit. Enter at most {limits['le']:g}."
    if "error" in limits:
        return str(limits["error"])
    return f"{name} {value!r} is not valid: {refusal.text}."
