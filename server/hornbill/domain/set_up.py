"""Set-up of a servo under test: load, mounting and surroundings, which decide what a run measures."""

from typing import ClassVar, Literal, Self

from pydantic import ConfigDict, Field, model_validator
from typing_extensions import TypeAliasType

from hornbill.domain.fields import Model

Mounting = TypeAliasType("Mounting", Literal["bench", "vice", "vehicle", "other"])
"""Where the servo was fixed during a run."""


class SetUp(Model):
    """Set-up of a servo. Null: not stated. Either arm and mass, or their inertia."""

    # one schema for requests and responses
    model_config: ClassVar[ConfigDict] = {**Model.model_config, "json_schema_serialization_defaults_required": False}

    arm_mm: float | None = Field(
        default=None, gt=0, le=1000, description="Distance of the mass from the axis of the horn, mm."
    )
    mass_g: float | None = Field(default=None, gt=0, le=20_000, description="Mass at the end of the arm, g.")
    inertia_gm2: float | None = Field(
        default=None, ge=0, le=1000, description="Moment of inertia on the horn, g·m², instead of arm and mass."
    )
    load_nm: float | None = Field(
        default=None, ge=-50, le=50, description="Constant torque on the horn, N·m. Positive: clockwise."
    )
    mounting: Mounting | None = Field(
        default=None, description="Mounting: loose on a bench, in a vice, in its vehicle, or other."
    )
    supply_v: float | None = Field(default=None, gt=0, le=60, description="Voltage of the power supply, V.")
    ambient_c: float | None = Field(default=None, ge=-60, le=120, description="Ambient temperature, °C.")

    @model_validator(mode="after")
    def _one_inertia(self) -> Self:
        if self.inertia_gm2 is not None and (self.arm_mm is not None or self.mass_g is not None):
            raise ValueError("give either arm_mm and mass_g, or inertia_gm2")
        return self
