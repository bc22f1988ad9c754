"""Mechanics of a servo with its load: friction, backlash, load, deadband, end stops, each with a 95 % interval."""

from typing import Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from hornbill.domain.fields import Model, UidField
from hornbill.domain.frequency_response import Estimate
from hornbill.domain.note import Note
from hornbill.domain.plant import PlantConstants
from hornbill.domain.set_up import SetUp

MechanicsTest = TypeAliasType(
    "MechanicsTest",
    Literal["deadband", "repeatability", "speed", "friction", "backlash", "travel", "end_stops"],
)
"""friction and backlash are measured by the same motion."""

Quantity = TypeAliasType(
    "Quantity",
    Literal[
        "inertia",
        "breakaway",
        "coulomb",
        "viscous",
        "backlash_deg",
        "torque_lag_s",
        "load_pct",
        "supply_ohm",
        "sensor_noise_deg",
        "deadband_deg",
        "reversal_deg",
        "repeatability_deg",
        "top_speed_rpm",
        "stop_cw_deg",
        "stop_ccw_deg",
    ],
)
"""Measured quantity. The constants of a plant have their names; the unit is at the end of the others, too."""


class MechanicsValue(Model):
    """One measured quantity, from the newest run that contains it."""

    name: Quantity = Field(description="Quantity.")
    unit: str = Field(description="Unit, such as `°`. Empty for a share or multiple.")
    estimate: Estimate | None = Field(description="Value with its 95 % interval. Null if it could not be measured.")
    note: Note | None = Field(description="Why it could not be measured. Null otherwise.")
    at: float = Field(description="Time of the run, seconds since 1970 UTC.")
    run: int = Field(description="ID of the run.")


class TravelPoint(Model):
    """Load and friction at one angle of the travel."""

    angle_deg: float = Field(description="Angle, °.")
    load_pct: float = Field(description="Load, % of stall torque. Positive pushes clockwise.")
    friction_pct: float = Field(description="Friction, % of stall torque.")
    binding: bool = Field(description="Friction here is at least 5 % of stall torque above that of the travel.")


class Mechanics(Model):
    """What is known about the mechanics of one servo, in the directions of its registers."""

    uid: UidField
    values: list[MechanicsValue] = Field(description="Measured quantities.")
    travel: list[TravelPoint] = Field(description="Load and friction along the travel, in order of angle.")
    travel_run: int | None = Field(description="ID of the run of `travel`. Null if not measured.")
    unknowable: list[Note] = Field(description="What a sensor at the horn cannot know.")


class Twin(Model):
    """A servo for the simulator: give it to `hornbill sim --plant FILE` or as `plant` to a simulated servo."""

    format: Literal["hornbill-twin/1"] = Field(description="Format of this document.")
    uid: UidField
    model: str | None = Field(description="Model, such as `BLA21-06U-A0`. Null if unknown.")
    firmware: str | None = Field(description="Firmware version. Null if unknown.")
    set_up: SetUp = Field(description="Set-up of the newest run.")
    plant: PlantConstants = Field(description="Constants of the plant; what was not measured has its default.")
    values: list[MechanicsValue] = Field(description="The measured values with intervals.")
